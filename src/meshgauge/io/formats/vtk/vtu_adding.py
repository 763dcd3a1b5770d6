"""Arrays added to .vtu files: encoded as the others are, in front of the ends of their elements."""

from __future__ import annotations

import html
from pathlib import Path

import numpy as np

from ...plumbing.added import Added, Array, CannotAdd
from .vtu_layout import NOT_WHOLE, Layout, Piece
from .vtu_raw import DTYPES

_NAMES = {kind: name for name, kind in DTYPES.items()}


def add(old: Path, new: Path, added: Added) -> None:
    """Put the arrays of each piece behind those that it has; what is appended of them stands behind all else."""
    data = old.read_bytes()
    try:
        layout = Layout(data)
        n_points, n_cells = (
            [int(piece.attributes[f"NumberOf{what}"]) for piece in layout.pieces] for what in ("Points", "Cells")
        )
    except NOT_WHOLE as error:
        raise CannotAdd("is not as VTK writes such files") from error
    if layout.has_steps:
        raise CannotAdd("holds time steps, of which each would need the arrays")
    if (sum(n_points), sum(n_cells)) != (added.mesh.n_points, added.mesh.n_cells):
        raise CannotAdd("is not as VTK writes such files")
    end = data.rfind(b"</AppendedData>") if layout.appended >= 0 else -1
    is_text = not (end >= 0 and layout.encoding == "raw")
    puts: list[tuple[int, int, bytes]] = []
    blobs: list[bytes] = []
    for kind, arrays, counts in (("PointData", added.points, n_points), ("CellData", added.cells, n_cells)):
        at = 0
        for piece, n in zip(layout.pieces, counts, strict=True):
            added.require_new(kind[:-4].lower(), piece.groups[kind].names if kind in piece.groups else ())
            elements = []
            for name, values in arrays.items():
                content = np.asarray(values[at : at + n]).astype(f"{layout.order}{values.dtype.str[1:]}").tobytes()
                encoded = layout.encoded(content, is_text=is_text)
                place = end - layout.appended + sum(map(len, blobs)) if end >= 0 else -1
                elements.append(_element(name, values, encoded, place))
                blobs += [encoded] if end >= 0 else []
            puts.append(_put(layout, piece, kind, b"".join(elements)))
            at += n
    if end >= 0:
        puts.append((end, end, b"".join(blobs)))
    puts.sort()
    pieces, at = [], 0
    for start, stop, text in puts:
        pieces += [data[at:start], text]
        at = stop
    new.write_bytes(b"".join([*pieces, data[at:]]))


def _element(name: str, values: Array, encoded: bytes, offset: int) -> bytes:
    """A DataArray, appended unless the offset is -1."""
    head = f'        <DataArray type="{_NAMES[values.dtype.str[1:]]}" Name="{html.escape(name)}"'
    if offset >= 0:
        return f'{head} format="appended" offset="{offset}"/>\n'.encode()
    return f'{head} format="binary">\n          '.encode() + encoded + b"\n        </DataArray>\n"


def _put(layout: Layout, piece: Piece, kind: str, elements: bytes) -> tuple[int, int, bytes]:
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
