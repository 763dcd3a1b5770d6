"""VTU files of meshes that are not in memory: arrays appended as bytes, packed by zlib, as VTK writes them."""

from __future__ import annotations

import html
import shutil
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from ...plumbing.made_rows import CutRows
from ...plumbing.mesh_rows import AT_ONCE, MeshRows, OfType
from ...plumbing.pieces import ArrayRows, Rows, row_bytes
from .vtu_adding import NAMES
from .vtu_layout import BLOCK

_LEVEL = 5
"""Of zlib, as VTK's writer packs."""

_HEAD = (
    '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64" '
    'compressor="vtkZLibDataCompressor">\n  <UnstructuredGrid>\n'
)
_TAIL = b"\n  </AppendedData>\n</VTKFile>\n"


def write_rows(path: Path, rows: MeshRows) -> None:
    """As `xml.write`, some rows at a time."""
    mesh, lines = rows.mesh, [_HEAD]
    integer = np.dtype(np.int64)
    cells = {
        "connectivity": OfType(mesh.connectivity, integer),
        "offsets": OfType(CutRows(mesh.offsets, 1, mesh.n_cells), integer),
        "types": mesh.types,
    }
    with TemporaryFile(dir=path.parent) as blobs:
        if rows.field_data:
            lines += [
                "    <FieldData>\n",
                *(_field(blobs, *one) for one in rows.field_data.items()),
                "    </FieldData>\n",
            ]
        lines.append(f'    <Piece NumberOfPoints="{mesh.n_points}" NumberOfCells="{mesh.n_cells}">\n')
        groups: tuple[tuple[str, Mapping[str, Rows]], ...] = (
            ("PointData", mesh.point_data),
            ("CellData", mesh.cell_data),
            ("Points", {"Points": mesh.points}),
            ("Cells", cells),
        )
        for group, arrays in groups:
            made = [_element(blobs, name, values) for name, values in arrays.items()]
            lines += [f"      <{group}>\n", *made, f"      </{group}>\n"]
        lines.append('    </Piece>\n  </UnstructuredGrid>\n  <AppendedData encoding="raw">\n   _')
        blobs.seek(0)
        with path.open("wb") as file:
            file.write("".join(lines).encode())
            shutil.copyfileobj(blobs, file, 1 << 20)
            file.write(_TAIL)


def _field(blobs: IO[bytes], name: str, values: NDArray[Any]) -> str:
    if values.dtype.kind != "U":
        flat = np.atleast_1d(values)
        return _element(blobs, name, ArrayRows(flat), f' NumberOfTuples="{len(flat)}"')
    text = b"".join(str(one).encode() + b"\0" for one in values.ravel())
    at = blobs.tell()
    _append(blobs, ArrayRows(np.frombuffer(text, np.uint8)))
    return _line("String", name, f' NumberOfTuples="{values.size}"', at)


def _element(blobs: IO[bytes], name: str, rows: Rows, more: str = "") -> str:
    at, width = blobs.tell(), int(np.prod(rows.shape[1:], dtype=np.int64))
    _append(blobs, rows)
    of_several = f' NumberOfComponents="{width}"' if len(rows.shape) > 1 else ""
    return _line(NAMES[rows.dtype.str[1:]], name, of_several + more, at)


def _line(kind: str, name: str, more: str, at: int) -> str:
    head = f'        <DataArray type="{kind}" Name="{html.escape(name)}"{more}'
    return f'{head} format="appended" offset="{at}"/>\n'


def _append(file: IO[bytes], rows: Rows) -> None:
    """Write an array behind others, in packed blocks behind their number and lengths."""
    n_bytes = rows.shape[0] * row_bytes(rows)
    start, n_blocks = file.tell(), -(-n_bytes // BLOCK)
    file.seek(start + (3 + n_blocks) * 8)
    lengths = []
    for block in _blocks(rows):
        packed = zlib.compress(block, _LEVEL)
        lengths.append(len(packed))
        file.write(packed)
    stop = file.tell()
    file.seek(start)
    file.write(np.array([n_blocks, BLOCK, n_bytes % BLOCK, *lengths], "<u8").tobytes())
    file.seek(stop)


def _blocks(rows: Rows) -> Iterator[bytes]:
    """The bytes of an array, so many at a time as are packed together."""
    held = b""
    for start in range(0, rows.shape[0], AT_ONCE):
        values = rows.read(start, min(start + AT_ONCE, rows.shape[0]))
        held += values.astype(values.dtype.newbyteorder("<"), copy=False).tobytes()
        whole = len(held) // BLOCK * BLOCK
        yield from (held[at : at + BLOCK] for at in range(0, whole, BLOCK))
        held = held[whole:]
    if held:
        yield held
