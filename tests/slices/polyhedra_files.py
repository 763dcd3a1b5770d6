"""Files of polyhedra, as programs write them."""

from __future__ import annotations

import zlib
from pathlib import Path

import numpy as np

from meshgauge import Mesh

Arrays = list[tuple[str, str, np.ndarray]]
"""Name, type and numbers."""


def stream_of(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Faces of polyhedra as VTK had them before 9.4: of each cell their number, of each its number of points and these;
    and where the part of each cell ends, -1 where it is none."""
    assert mesh.polyhedra is not None
    poly = mesh.polyhedra.with_own_faces()
    stream: list[int] = []
    ends = []
    for first, last in zip(poly.cell_offsets[:-1].tolist(), poly.cell_offsets[1:].tolist(), strict=True):
        if first < last:
            stream.append(last - first)
        for face in poly.cell_faces[first:last].tolist():
            ring = poly.face_points[poly.face_offsets[face] : poly.face_offsets[face + 1]].tolist()
            stream += [len(ring), *ring]
        ends.append(len(stream) if first < last else -1)
    return np.array(stream, np.int64), np.array(ends, np.int64)


def write_vtu(path: Path, mesh: Mesh, *, is_old: bool, packed: bool = False, faces: Arrays | None = None) -> None:
    """A VTU with appended data, raw or packed by zlib in small blocks; ``is_old``: as before VTK 9.4."""
    poly = mesh.polyhedra
    if faces is None and is_old:
        stream, ends = stream_of(mesh)
        faces = [("faces", "Int64", stream), ("faceoffsets", "Int64", ends)]
    elif faces is None:
        assert poly is not None
        faces = [
            ("face_connectivity", "Int64", poly.face_points),
            ("face_offsets", "Int64", poly.face_offsets[1:]),
            ("polyhedron_to_faces", "Int64", poly.cell_faces),
            ("polyhedron_offsets", "Int64", poly.cell_offsets[1:]),
        ]
    arrays: Arrays = [
        ("Points", "Float64", mesh.points),
        ("connectivity", "Int64", mesh.connectivity),
        ("offsets", "Int64", mesh.offsets[1:]),
        ("types", "UInt8", mesh.types),
        *faces,
        *((name, "Int64", values) for name, values in mesh.cell_data.items()),
    ]
    items, data = [], b""
    for name, kind, values in arrays:
        width = ' NumberOfComponents="3"' if name == "Points" else ""
        items.append(f'<DataArray type="{kind}" Name="{name}"{width} format="appended" offset="{len(data)}"/>')
        dtype = {"Float64": "<f8", "Int64": "<i8", "UInt8": "u1"}[kind]
        data += _packed(values.astype(dtype).tobytes()) if packed else _raw(values.astype(dtype).tobytes())
    n = 4 + len(faces)
    compressor = ' compressor="vtkZLibDataCompressor"' if packed else ""
    head = (
        f'<VTKFile type="UnstructuredGrid" version="{"1.0" if is_old else "2.3"}" byte_order="LittleEndian" '
        f'header_type="UInt64"{compressor}><UnstructuredGrid>'
        f'<Piece NumberOfPoints="{mesh.n_points}" NumberOfCells="{mesh.n_cells}"><Points>{items[0]}</Points>'
        f"<Cells>{''.join(items[1:n])}</Cells><CellData>{''.join(items[n:])}</CellData></Piece></UnstructuredGrid>"
        f'<AppendedData encoding="raw">_'
    )
    path.write_bytes(head.encode() + data + b"</AppendedData></VTKFile>")


def _raw(content: bytes) -> bytes:
    return np.uint64(len(content)).tobytes() + content


def _packed(content: bytes, block: int = 1000) -> bytes:
    parts = [zlib.compress(content[at : at + block]) for at in range(0, len(content), block)]
    head = [len(parts), block, len(content) % block, *map(len, parts)]
    return np.array(head, np.uint64).tobytes() + b"".join(parts)
