"""Arrays added to .vtu files: encoded as the others are, in front of the ends of their elements."""

from __future__ import annotations

import html
import re
from pathlib import Path
from typing import Any

import numpy as np

from ...plumbing.added import Added, Array, CannotAdd
from .vtu_layout import NOT_WHOLE, Layout, Piece
from .vtu_layout import Array as LayoutArray
from .vtu_raw import DTYPES

NAMES = {kind: name for name, kind in DTYPES.items()}


def add(old: Path, new: Path, added: Added) -> None:
    """Put the arrays of each piece behind those that it has; what is appended of them stands behind all else.

    One of the same name is taken out. Its appended bytes are written over if the new ones are as many; else they stay.
    """
    data = old.read_bytes()
    try:
        layout = Layout(data)
        n_points, n_cells = (
            [int(piece.attributes[f"NumberOf{what}"]) for piece in layout.pieces] for what in ("Points", "Cells")
        )
    except NOT_WHOLE as error:
        raise CannotAdd("is not as VTK writes such files") from error
    if layout.moves:
        raise CannotAdd("holds time steps of which each has points or cells of its own")
    if (sum(n_points), sum(n_cells)) != (added.mesh.n_points, added.mesh.n_cells):
        raise CannotAdd("is not as VTK writes such files")
    end = data.rfind(b"</AppendedData>") if layout.appended >= 0 else -1
    is_text = not (end >= 0 and layout.encoding == "raw")
    puts: list[tuple[int, int, bytes]] = []
    blobs: list[bytes] = []
    for kind, arrays, counts in (("PointData", added.points, n_points), ("CellData", added.cells, n_cells)):
        at = 0
        for piece, n in zip(layout.pieces, counts, strict=True):
            elements = []
            old_arrays = piece.groups[kind].arrays if kind in piece.groups else []
            for name, values in arrays.items():
                content = np.asarray(values[at : at + n]).astype(f"{layout.order}{values.dtype.str[1:]}").tobytes()
                encoded = layout.encoded(content, is_text=is_text)
                held = [(one, stop) for one, stop in old_arrays if one.attributes.get("Name") == name]
                if (extent := _same_extent(layout, held, values, encoded)) is not None:
                    puts.append((*extent, encoded))
                    continue
                puts += [(line_start(data, one.tag), stop, b"") for one, stop in held]
                place = end - layout.appended + sum(map(len, blobs)) if end >= 0 else -1
                elements.append(element(name, values.dtype, encoded, place))
                blobs += [encoded] if end >= 0 else []
            if elements:
                puts.append(put(layout, piece, kind, b"".join(elements)))
            at += n
    if end >= 0:
        puts.append((end, end, b"".join(blobs)))
    puts.sort()
    pieces, at = [], 0
    for start, stop, text in puts:
        pieces += [data[at:start], text]
        at = stop
    new.write_bytes(b"".join([*pieces, data[at:]]))


def _same_extent(
    layout: Layout, held: list[tuple[LayoutArray, int]], values: Array, encoded: bytes
) -> tuple[int, int] | None:
    """Where the appended bytes of an array stand that are to be written over; None if these are not as many."""
    if len(held) != 1 or not held[0][0].is_appended:
        return None
    array = held[0][0]
    try:
        extent = layout.extent(array) if is_alone(layout, array, values.dtype) else (0, -1)
    except NOT_WHOLE:
        return None
    return extent if extent[1] - extent[0] == len(encoded) else None


def is_alone(layout: Layout, array: LayoutArray, kind: np.dtype[Any]) -> bool:
    """Whether what is appended of an array is of such numbers, and of no other array or time step."""
    is_alike = array.attributes.get("type") == NAMES[kind.str[1:]] and array.width == 1
    is_shared = _offsets(layout).count(int(array.attributes["offset"])) > 1
    return is_alike and "TimeStep" not in array.attributes and not is_shared


def _offsets(layout: Layout) -> list[int]:
    """Those of all arrays that are appended."""
    return [int(offset) for offset in re.findall(rb"\boffset\s*=\s*[\"'](\d+)[\"']", layout.data[: layout.appended])]


def line_start(data: bytes, tag: int) -> int:
    """Where the line of an element begins, if there are blanks only in front of it."""
    line = data.rfind(b"\n", 0, tag) + 1
    return tag if data[line:tag].strip() else max(line - 1, 0)


def element(name: str, kind: np.dtype[Any], encoded: bytes, offset: int) -> bytes:
    """A DataArray, appended unless the offset is -1."""
    head = f'        <DataArray type="{NAMES[kind.str[1:]]}" Name="{html.escape(name)}"'
    if offset >= 0:
        return f'{head} format="appended" offset="{offset}"/>\n'.encode()
    return f'{head} format="binary">\n          '.encode() + encoded + b"\n        </DataArray>\n"


def put(layout: Layout, piece: Piece, kind: str, elements: bytes) -> tuple[int, int, bytes]:
    """First byte, end and text of what changes to have elements in a group of a piece, which may not be there."""
    data, group = layout.data, piece.groups.get(kind)
    if group is None:
        at = data.index(b">", piece.tag) + 1
        return at, at, b"\n      <" + kind.encode() + b">\n" + elements + b"      </" + kind.encode() + b">"
    tag_end = data.index(b">", group.tag) + 1
    if data[tag_end - 2 : tag_end] == b"/>":
        return tag_end - 2, tag_end, b">\n" + elements + b"      </" + kind.encode() + b">"
    line = data.rfind(b"\n", 0, group.end) + 1
    is_alone = line >= tag_end and not data[line : group.end].strip()  # else the tag stands behind others
    return (line, line, elements) if is_alone else (group.end, group.end, b"\n" + elements + b"      ")
