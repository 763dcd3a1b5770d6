"""PLOT3D's grids (.xyz, .p3d, .x, .g): text, Fortran's records or bare bytes, blocks in space or in a plane.

Own: no file says which of these it is, and VTK tells them apart for binary ones only. Here the one layout counts that
takes all numbers of the file.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import ReadError
from ...mesh import Mesh
from ...mesh.mesh import GHOST_TYPE
from ..plumbing import budget
from ..plumbing.build import Ints
from ..plumbing.format import HEAD, Format
from ..plumbing.merge import Part, merge_parts
from ..plumbing.text import NotNumbers, numbers, write_out_repeated
from .structured import structured_part

IBLANK = "iblank"
_HIDDEN = np.uint8(32)
_MOST_BLOCKS = 100_000
_TEXT = re.compile(rb"[\s\d+\-.*,eEdD]+")
_WHOLE = re.compile(rb"\s*((?:\d{1,9}(?:\s*,\s*|\s+))+)")

_Block = tuple[tuple[int, ...], NDArray[Any], Ints | None]
"""Shape, coordinates ``(dimension, n)`` and ``iblank`` of a block."""


@dataclass(frozen=True, slots=True)
class _Layout:
    """How the numbers of a file stand: ``shapes`` of the blocks, and where the coordinates of the first begin."""

    shapes: tuple[tuple[int, ...], ...]
    start: int  #: bytes, or numbers of a text
    has_iblank: bool
    order: str = ""  #: of bytes; empty for a text
    size: int = 8  #: bytes of a coordinate
    has_records: bool = False


def sniff(head: bytes, path: Path) -> bool:
    try:
        if _TEXT.fullmatch(head):
            first = _leading(head)
            is_cut = len(head) == HEAD and 0 < len(first) <= 3 * min(int(first[0]), _MOST_BLOCKS)
            return is_cut or next(_of_integers(first), None) is not None
        return _binary(_raw(path)) is not None
    except (OSError, ValueError):
        return False


def read(path: Path) -> Mesh:
    """Hexahedra, quads or lines of each block; cells with a blanked corner (``iblank`` of 0) are hidden.

    Raises
    ------
    ReadError
        If no layout takes all numbers of the file.
    """
    with path.open("rb") as file:
        is_text = _TEXT.fullmatch(file.read(HEAD)) is not None
    blocks = _text_blocks(path) if is_text else _binary_blocks(path)
    parts = [_part(f"block {n}", *block) for n, block in enumerate(blocks, 1)]
    if not any(len(part.types) for part in parts):
        raise ReadError(f"{path}: no cells were found in it")
    if any(IBLANK in part.point_data for part in parts):
        for part in parts:
            part.cell_data.setdefault(GHOST_TYPE, np.zeros(len(part.types), np.uint8))
    mesh = merge_parts(parts, path=path)
    return mesh.replace(stored="single" if mesh.points.dtype == np.float32 else "double")


def _leading(text: bytes) -> Ints:
    """The integers with which a text begins, up to the first number with a point."""
    match = _WHOLE.match(text)
    words = match[1].replace(b",", b" ").split() if match is not None else []
    return np.array([int(word) for word in words], np.int64)


def _of_integers(values: Ints) -> Iterator[tuple[tuple[tuple[int, ...], ...], int]]:
    """The shapes of blocks that the first integers may state, and how many integers that takes: several blocks in
    space, one, several in a plane, one."""
    n = int(values[0]) if len(values) else 0
    for dimension in (3, 2):
        for n_blocks, first in ((n, 1), (1, 0)):
            end = first + n_blocks * dimension
            if 1 <= n_blocks <= _MOST_BLOCKS and end <= len(values) and (values[first:end] > 0).all():
                rows = values[first:end].reshape(n_blocks, dimension).tolist()
                if any(max(row) > 1 for row in rows):
                    yield tuple(map(tuple, rows)), end


def _n_points(shapes: tuple[tuple[int, ...], ...]) -> int:
    return sum(int(np.prod(shape, dtype=object)) for shape in shapes)


def _text_blocks(path: Path) -> Iterator[_Block]:
    data = path.read_bytes()
    budget.draw("text", len(data), path.name)

    def fail(what: str) -> ReadError:
        return ReadError(f"{path}: {what}")

    try:
        values = numbers(write_out_repeated(data.replace(b",", b" "), fail), np.float64)
    except NotNumbers as error:
        raise fail(f"holds something else than numbers: {error}") from None
    heads = values[: np.argmin(np.append(values == np.trunc(values), False))]
    heads = np.minimum(heads[: 1 + 3 * _MOST_BLOCKS], 2.0**40).astype(np.int64)
    for shapes, start in _of_integers(heads):
        for has_iblank in (False, True):
            width = len(shapes[0]) + has_iblank
            if len(values) == start + width * _n_points(shapes):
                return _split_text(values, _Layout(shapes, start, has_iblank))
    raise fail(f"holds {len(values)} numbers, which are those of no grid of PLOT3D")


def _split_text(values: NDArray[np.float64], layout: _Layout) -> Iterator[_Block]:
    at = layout.start
    for shape in layout.shapes:
        n, dimension = int(np.prod(shape)), len(shape)
        points = values[at : at + n * dimension].reshape(dimension, n)
        at += n * dimension
        iblank = values[at : at + n].astype(np.int64) if layout.has_iblank else None
        at += n * layout.has_iblank
        yield shape, points, iblank


def _raw(path: Path) -> NDArray[np.uint8]:
    return np.memmap(path, np.uint8, "r")


def _integers(raw: NDArray[np.uint8], order: str, at: int, n: int) -> list[int]:
    """``n`` integers from a byte on; none if the file ends before."""
    if not 0 <= at <= at + 4 * n <= len(raw):
        return []
    values: list[int] = np.frombuffer(raw[at : at + 4 * n].tobytes(), f"{order}i4").tolist()
    return values


def _binary(raw: NDArray[np.uint8]) -> _Layout | None:
    """The layout of a binary file, None if it has none."""
    for order, has_records, is_single in itertools.product("<>", (True, False), (False, True)):
        mark = 4 * has_records
        start, n_blocks = 0, 1
        if not is_single:
            head = _integers(raw, order, 0, 3 if has_records else 1)
            if not head or (has_records and (head[0], head[-1]) != (4, 4)):
                continue
            start, n_blocks = 4 * len(head), head[mark // 4]
        if not 1 <= n_blocks <= _MOST_BLOCKS:
            continue
        for dimension in (3, 2):
            size = 4 * n_blocks * dimension
            if has_records and _integers(raw, order, start, 1) != [size]:
                continue
            sizes = np.array(_integers(raw, order, start + mark, n_blocks * dimension)).reshape(-1, dimension)
            if len(sizes) == n_blocks and (sizes > 0).all() and (sizes > 1).any():
                shapes = tuple(map(tuple, sizes.tolist()))
                layout = _of_size(raw, shapes, start + size + 2 * mark, order, has_records)
                if layout is not None:
                    return layout
    return None


def _of_size(
    raw: NDArray[np.uint8], shapes: tuple[tuple[int, ...], ...], start: int, order: str, has_records: bool
) -> _Layout | None:
    """Single or double coordinates, with or without ``iblank``: what fills the file to its end."""
    n, dimension = _n_points(shapes), len(shapes[0])
    for size, has_iblank in itertools.product((4, 8), (False, True)):
        width = dimension * size + 4 * has_iblank
        if start + n * width + 8 * has_records * len(shapes) == len(raw) and (
            not has_records or _integers(raw, order, start, 1) == [_n_points(shapes[:1]) * width]
        ):
            return _Layout(shapes, start, has_iblank, order, size, has_records)
    return None


def _binary_blocks(path: Path) -> Iterator[_Block]:
    raw = _raw(path)
    layout = _binary(raw)
    if layout is None:
        raise ReadError(f"{path}: its {len(raw)} bytes are those of no grid of PLOT3D")
    budget.draw("stored", len(raw), path.name)
    at, real, whole = layout.start, f"{layout.order}f{layout.size}", f"{layout.order}i4"
    for shape in layout.shapes:
        n, dimension = int(np.prod(shape)), len(shape)
        at += 4 * layout.has_records
        points = np.frombuffer(raw, real, n * dimension, at).reshape(dimension, n)
        at += n * dimension * layout.size
        iblank = np.frombuffer(raw, whole, n, at).astype(np.int64) if layout.has_iblank else None
        at += 4 * (n * layout.has_iblank + layout.has_records)
        yield shape, points.astype(f"f{layout.size}"), iblank


def _part(name: str, shape: tuple[int, ...], coordinates: NDArray[Any], iblank: Ints | None) -> Part:
    n = coordinates.shape[1]
    budget.draw("made", n * (24 + 64 + 16), name)  # points, nodes of cells
    points = np.zeros((n, 3), coordinates.dtype)
    points[:, : len(coordinates)] = coordinates.T
    part = structured_part(name, tuple(k for k in shape if k > 1) or (1,), points)
    if iblank is not None:
        part.point_data[IBLANK] = iblank
        is_hidden = (iblank[part.connectivity] == 0).reshape(len(part.types), -1).any(axis=1)
        part.cell_data[GHOST_TYPE] = is_hidden * _HIDDEN
    return part


PLOT3D = Format("plot3d", "PLOT3D", (".xyz", ".p3d", ".x", ".g"), sniff, read, by_content=False)
