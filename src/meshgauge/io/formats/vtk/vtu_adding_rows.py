"""Arrays that are not in memory added to .vtu files that append theirs as bytes: the file is copied around them."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO

import numpy as np

from ...plumbing.added import CannotAdd
from ...plumbing.pieces import Rows
from .vtu_adding import element, is_alone, line_start, put
from .vtu_layout import BLOCK, NOT_WHOLE, Layout

_ROWS = 1 << 16
"""That are encoded at a time: whole blocks of every type of number."""

_HEAD, _TAIL = 64 << 20, 1 << 16
"""Bytes within which the appended arrays begin, and behind which they end."""


def add_rows(
    old: Path, new: Path, cells: Mapping[str, Rows], points: Mapping[str, Rows], sizes: tuple[int, int]
) -> None:
    """`vtu_adding.add`, some rows at a time. What is appended of an array of the same name is written over if it is as
    many bytes and not packed; else it stays, without a name."""
    try:
        head, end = _ends(old)
        layout = Layout(head)
        (piece,) = layout.pieces
        held_sizes = int(piece.attributes["NumberOfPoints"]), int(piece.attributes["NumberOfCells"])
    except NOT_WHOLE as error:
        raise CannotAdd("is not as VTK appends arrays") from error
    if layout.moves:
        raise CannotAdd("holds time steps of which each has points or cells of its own")
    if layout.encoding != "raw" or held_sizes != sizes:
        raise CannotAdd("is not as VTK appends arrays")
    puts: list[tuple[int, int, bytes]] = []
    over: list[tuple[int, Rows]] = []
    with TemporaryFile(dir=new.parent) as blobs:
        for kind, arrays in (("PointData", points), ("CellData", cells)):
            elements = []
            old_arrays = piece.groups[kind].arrays if kind in piece.groups else []
            for name, rows in arrays.items():
                held = [(one, stop) for one, stop in old_arrays if one.attributes.get("Name") == name]
                if len(held) == 1 and layout.is_plain(held[0][0]) and is_alone(layout, held[0][0], rows.dtype):
                    over.append((layout.at(held[0][0]) + layout.header.itemsize, rows))
                    continue
                puts += [(line_start(head, one.tag), stop, b"") for one, stop in held]
                elements.append(element(name, rows.dtype, b"", end - layout.appended + blobs.tell()))
                _append(blobs, layout, rows)
            if elements:
                puts.append(put(layout, piece, kind, b"".join(elements)))
        made = _with(head, puts)
        with old.open("rb") as source, new.open("wb") as target:
            target.write(made)
            source.seek(len(head))
            _copy(source, target, end - len(head))
            blobs.seek(0)
            shutil.copyfileobj(blobs, target, 1 << 20)
            shutil.copyfileobj(source, target, 1 << 20)
    with new.open("r+b") as target:
        for at, rows in over:
            target.seek(at + len(made) - len(head))
            for content in _contents(layout, rows):
                target.write(content)


def _ends(path: Path) -> tuple[bytes, int]:
    """What stands before the appended arrays, and where these end. Raises one of `NOT_WHOLE` if there are none."""
    with path.open("rb") as file:
        head = file.read(1 << 16)
        while (opening := re.search(rb"<AppendedData\b[^>]*>\s*_", head)) is None:
            more = file.read(len(head))
            if not more or len(head) > _HEAD:
                raise ValueError
            head += more
        size = file.seek(0, 2)
        file.seek(max(size - _TAIL, 0))
        tail = file.read()
    at = tail.rindex(b"</AppendedData>")
    return head[: opening.end()], size - len(tail) + at


def _with(head: bytes, puts: list[tuple[int, int, bytes]]) -> bytes:
    parts, at = [], 0
    for start, stop, text in sorted(puts):
        parts += [head[at:start], text]
        at = stop
    return b"".join([*parts, head[at:]])


def _contents(layout: Layout, rows: Rows) -> Iterator[bytes]:
    """The bytes of an array as the file orders them."""
    n = rows.shape[0]
    for at in range(0, n, _ROWS):
        yield rows.read(at, min(at + _ROWS, n)).astype(f"{layout.order}{rows.dtype.str[1:]}", copy=False).tobytes()


def _append(file: IO[bytes], layout: Layout, rows: Rows) -> None:
    """Write an array behind others, with what tells its length, packed if all are."""
    n_bytes = rows.shape[0] * rows.dtype.itemsize
    if n_bytes > np.iinfo(layout.header).max:
        raise CannotAdd("counts bytes in numbers that are too small for more arrays")
    if not layout.compressor:
        file.write(np.array([n_bytes], layout.header).tobytes())
        for content in _contents(layout, rows):
            file.write(content)
        return
    start, n_blocks = file.tell(), -(-n_bytes // BLOCK)
    file.seek(start + (3 + n_blocks) * layout.header.itemsize)
    lengths = []
    for content in _contents(layout, rows):
        for block in layout.packed_blocks(content):
            lengths.append(len(block))
            file.write(block)
    stop = file.tell()
    file.seek(start)
    file.write(np.array([n_blocks, BLOCK, n_bytes % BLOCK, *lengths], layout.header).tobytes())
    file.seek(stop)


def _copy(source: IO[bytes], target: IO[bytes], n: int) -> None:
    while n > 0:
        part = source.read(min(n, 1 << 20))
        if not part:
            raise CannotAdd("was changed while it was read")
        target.write(part)
        n -= len(part)
