"""Files of OpenVolumeMesh, ascii and binary, made of meshes of linear cells."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from meshgauge.cells import CELL_TYPES
from meshgauge.mesh import Mesh

Rows = list[list[int]]


def halves(mesh: Mesh, is_inside_out: bool = False, seed: int = 0) -> tuple[list[tuple[int, int]], Rows, Rows]:
    """Edges, faces by half-edges, cells by half-faces; edges and faces run one way or the other at random."""
    rng = np.random.default_rng(seed)
    edges: list[tuple[int, int]] = []
    faces, cells = [], []
    for cell in range(mesh.n_cells):
        shape = CELL_TYPES[int(mesh.types[cell])].shape
        assert shape is not None
        own = []
        for face in shape.faces:
            ring, is_turned = mesh.nodes(cell)[list(face)].tolist(), bool(rng.integers(2))
            ring = ring[::-1] if is_turned else ring
            row = []
            for a, b in zip(ring, [*ring[1:], ring[0]], strict=True):
                if (a, b) not in edges and (b, a) not in edges:
                    edges.append((a, b) if rng.integers(2) else (b, a))
                row.append(2 * edges.index((a, b)) if (a, b) in edges else 2 * edges.index((b, a)) + 1)
            own.append(2 * len(faces) + (is_turned != is_inside_out))
            faces.append(row)
        cells.append(own)
    return edges, faces, cells


def ovm(path: Path, mesh: Mesh, is_inside_out: bool = False) -> Path:
    edges, faces, cells = halves(mesh, is_inside_out)
    lines = ["OVM ASCII", "Vertices", str(mesh.n_points), *(" ".join(map(repr, x)) for x in mesh.points.tolist())]
    lines += ["Edges", str(len(edges)), *(f"{a} {b}" for a, b in edges)]
    for name, rows in (("Faces", faces), ("Polyhedra", cells)):
        lines += [name, str(len(rows)), *(" ".join(map(str, (len(row), *row))) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


def chunk(mark: bytes, body: bytes = b"", *, flags: int = 1, version: int = 0, compression: int = 0) -> bytes:
    """Filled up to a multiple of 8 bytes."""
    fill = -len(body) % 8
    return struct.pack("<4s4BQ", mark, version, fill, compression, flags, len(body) + fill) + body + b"\0" * fill


def topology(entity: int, rows: Rows, first: int = 0, shift: int = 0) -> bytes:
    """Rows of one length without their lengths; items in as few bytes as hold them."""
    sizes, flat = {len(row) for row in rows}, np.concatenate(rows) - shift
    code = next(width for width in (1, 2, 4) if flat.max() < 256**width)
    valence, lengths = (sizes.pop(), b"") if len(sizes) == 1 else (0, bytes(len(row) for row in rows))
    head = struct.pack("<QI4BQ", first, len(rows), entity, valence, 0 if valence else 1, code, shift)
    return chunk(b"TOPO", head + lengths + flat.astype(f"<u{code}").tobytes())


def text4(text: bytes) -> bytes:
    return struct.pack("<I", len(text)) + text


def ovmb(path: Path, mesh: Mesh, is_inside_out: bool = False, parts: int = 1, real: str = "<f8") -> Path:
    """As OpenVolumeMesh writes it; with more ``parts`` each kind of items in as many chunks."""
    edges, faces, cells = halves(mesh, is_inside_out)
    data = b"OVMB\n\r\n\xff" + struct.pack("<4B4x4Q", 1, 1, 3, 0, mesh.n_points, len(edges), len(faces), len(cells))
    names = [(3, b"region", b"i32", struct.pack("<i", 7)), (0, b"force", b"3d", bytes(24)), (3, b"odd", b"b", b"\0")]
    names.append((1, b"of edges", b"f", bytes(4)))
    names.append((3, b"label", b"s32", text4(b"")))
    data += chunk(b"DIRP", b"".join(bytes([e]) + text4(n) + text4(t) + text4(d) for e, n, t, d in names))
    for ids in np.array_split(np.arange(mesh.n_points), parts):
        head = struct.pack("<QIB3x", ids[0], len(ids), 1 if real == "<f4" else 2)
        data += chunk(b"VERT", head + mesh.points[ids].astype(real).tobytes())
    data += chunk(b"TOPO", topology(1, [list(edge) for edge in edges])[16:])
    for entity, rows in ((2, faces), (3, cells)):
        for ids in np.array_split(np.arange(len(rows)), parts):
            own = [rows[i] for i in ids]
            data += topology(entity, own, int(ids[0]), min(min(row) for row in own) if parts > 1 else 0)
    data += chunk(b"NEW ", b"a chunk of a later version", flags=0)
    n = mesh.n_cells
    data += chunk(b"PROP", struct.pack("<QII", 1, n - 1, 0) + np.arange(1, n, dtype="<i4").tobytes())
    data += chunk(b"PROP", struct.pack("<QII", 0, mesh.n_points, 1) + mesh.points.astype("<f8").tobytes())
    odd = np.packbits(np.arange(n) % 2 == 1, bitorder="little").tobytes()
    data += chunk(b"PROP", struct.pack("<QII", 0, n, 2) + odd)
    data += chunk(b"PROP", struct.pack("<QII", 0, len(edges), 3) + bytes(4 * len(edges)))
    path.write_bytes(data + chunk(b"EOF "))
    return path
