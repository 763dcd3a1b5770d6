"""Files of CGNS, made node by node: mixed sections, and polyhedra by their faces."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from meshgauge.cells import CELL_TYPES
from meshgauge.mesh import Mesh

TYPES = {"tetra": 10, "pyramid": 12, "wedge": 14, "hexahedron": 17}


def put(group: Any, name: str, label: str, data: Any = None) -> Any:
    """A node; texts as bytes in int8, arrays with their axes in the opposite order."""
    made = group.create_group(name)
    values = (
        np.frombuffer(data.encode(), np.int8) if isinstance(data, str) else None if data is None else np.asarray(data)
    )
    kinds = {"int8": "C1", "int32": "I4", "int64": "I8", "float32": "R4", "float64": "R8"}
    kind = "MT" if values is None else kinds[str(values.dtype)]
    for key, value in (("name", name), ("label", label), ("type", kind)):
        made.attrs[key] = np.bytes_(value)
    if values is not None:
        made[" data"] = values
    return made


def base(file: Any, cell: int = 3) -> Any:
    for name, text in (("name", "HDF5 MotherNode"), ("label", "Root Node of HDF5 File"), ("type", "MT")):
        file.attrs[name] = np.bytes_(text)
    put(file, "CGNSLibraryVersion", "CGNSLibraryVersion_t", np.array([4.2], np.float32))
    return put(file, "Base", "CGNSBase_t", np.array([cell, 3], np.int32))


def zone(base: Any, name: str, points: np.ndarray, n_cells: int, sizes: Any = None, kind: str = "Unstructured") -> Any:
    made = put(base, name, "Zone_t", np.array([[len(points)], [n_cells], [0]]) if sizes is None else sizes)
    put(made, "ZoneType", "ZoneType_t", kind)
    grid = put(made, "GridCoordinates", "GridCoordinates_t")
    for axis, letter in enumerate("XYZ"):
        put(grid, f"Coordinate{letter}", "DataArray_t", points[..., axis])
    return made


def section(zone: Any, name: str, code: int, first: int, n: int, ids: Any, offsets: Any = None) -> Any:
    made = put(zone, name, "Elements_t", np.array([code, 0], np.int32))
    put(made, "ElementRange", "IndexRange_t", np.array([first, first + n - 1]))
    put(made, "ElementConnectivity", "DataArray_t", np.asarray(ids, np.int64))
    if offsets is not None:
        put(made, "ElementStartOffset", "DataArray_t", np.asarray(offsets, np.int64))
    return made


def faces_of(mesh: Mesh) -> tuple[list[list[int]], list[list[int]]]:
    """Faces by points, each once, and signed faces of each cell, all from 1; some faces run the other way."""
    found: dict[frozenset[int], int] = {}
    faces: list[list[int]] = []
    cells = []
    for cell in range(mesh.n_cells):
        shape = CELL_TYPES[int(mesh.types[cell])].shape
        assert shape is not None
        row = []
        for face in shape.faces:
            ring = (mesh.nodes(cell)[list(face)] + 1).tolist()
            key = frozenset(ring)
            if key not in found:
                turned = len(faces) % 3 == 0
                faces.append(ring[::-1] if turned else ring)
                found[key] = -len(faces) if turned else len(faces)
                row.append(found[key])
            else:
                row.append(-found[key])
        cells.append(row)
    return faces, cells


def flat(rows: list[list[int]], *, has_sizes: bool = False) -> tuple[list[int], list[int] | None]:
    if has_sizes:
        return [x for row in rows for x in (len(row), *row)], None
    return [x for row in rows for x in row], [0, *np.cumsum([len(row) for row in rows]).tolist()]


def mixed(path: Path, mesh: Mesh, *, has_offsets: bool = True) -> Path:
    """All cells in one section, with a solution on them and one on the points."""
    import h5py

    rows = [[TYPES[CELL_TYPES[int(t)].name], *(mesh.nodes(c) + 1).tolist()] for c, t in enumerate(mesh.types)]
    ids, offsets = flat(rows)
    with h5py.File(path, "w") as file:
        made = zone(base(file), "Zone", mesh.points, mesh.n_cells)
        section(made, "All", 20, 1, mesh.n_cells, ids, offsets if has_offsets else None)
        solution = put(made, "Solution", "FlowSolution_t")
        put(solution, "GridLocation", "GridLocation_t", "CellCenter")
        put(solution, "Pressure", "DataArray_t", np.arange(float(mesh.n_cells)))
        put(put(made, "Nodal", "FlowSolution_t"), "Density", "DataArray_t", mesh.points[:, 0].astype(np.float32))
    return path


def polyhedral(path: Path, mesh: Mesh, form: str = "offsets") -> Path:
    """All cells by their faces, two of which are a wall; the old form has sizes, the shortest only parents."""
    import h5py

    faces, cells = faces_of(mesh)
    n = len(faces)
    with h5py.File(path, "w") as file:
        made = zone(base(file), "Zone", mesh.points, mesh.n_cells)
        ngon = section(made, "Faces", 22, 1, n, *flat(faces, has_sizes=form == "sizes"))
        if form == "parents":
            parents = np.zeros((2, n), np.int64)
            for cell, row in enumerate(cells, 1):
                for face in row:
                    parents[int(face < 0), abs(face) - 1] = cell
            put(ngon, "ParentElements", "DataArray_t", parents)
        else:
            section(made, "Cells", 23, n + 1, mesh.n_cells, *flat(cells, has_sizes=form == "sizes"))
        boundary = put(put(made, "ZoneBC", "ZoneBC_t"), "Wall", "BC_t", "BCWall")
        put(boundary, "GridLocation", "GridLocation_t", "FaceCenter")
        put(boundary, "PointList", "IndexArray_t", np.array([[2], [4], [n + 999]]))
    return path


Faces = tuple[np.ndarray, list[tuple[int, ...]], list[list[int]]]
"""Points, the points of each face from 1 on, and the faces of each cell: negative where their normal points into it."""


def split_boxes(n: int = 5, seed: int = 0) -> Faces:
    """n³ boxes, moved at random, of which some have a face of two triangles: those stay polyhedra."""
    rng = np.random.default_rng(seed)
    index = np.arange((n + 1) ** 3).reshape((n + 1,) * 3)
    points = np.stack(np.meshgrid(*[np.arange(n + 1.0)] * 3, indexing="ij"), -1).reshape(-1, 3)
    points = points + rng.normal(size=points.shape) * 0.15
    cells: list[list[int]] = [[] for _ in range(n**3)]
    inside, outside = [], []  # faces, as files have them: those inside first
    for axis in range(3):
        a, b = (axis + 1) % 3, (axis + 2) % 3
        for at in np.ndindex(*[n + (k == axis) for k in range(3)]):
            corners = []
            for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)):
                corner = list(at)
                corner[a], corner[b] = corner[a] + x, corner[b] + y
                corners.append(int(index[tuple(corner)]) + 1)
            beside = [at[axis] - 1, at[axis]]  # the normal points from the first to the second
            cubes = [(*at[:axis], k, *at[axis + 1 :]) for k in beside]
            own = [int(np.ravel_multi_index(one, (n,) * 3)) if 0 <= one[axis] < n else -1 for one in cubes]
            rings = [corners] if rng.random() < 0.9 else [corners[:3], [corners[0], *corners[2:]]]
            (inside if min(own) >= 0 else outside).append((rings, own))
    faces: list[tuple[int, ...]] = []
    for rings, own in [*inside, *outside]:
        for ring in rings:
            faces.append(tuple(ring))
            for cell, sign in zip(own, (1, -1), strict=True):
                if cell >= 0:
                    cells[cell].append(sign * len(faces))
    return points, faces, cells


def by_faces(path: Path, zones: list[Faces], *, n_tetra: int = 0) -> None:
    """Zones of polyhedra by faces, of which some are a wall, and data of cells; behind them some tetrahedra."""
    import h5py

    with h5py.File(path, "w") as file:
        root = base(file)
        for number, (points, faces, cells) in enumerate(zones):
            n = len(faces)
            made = zone(root, f"Zone {number}", points, len(cells) + n_tetra)
            section(made, "Faces", 22, 1, n, *flat([list(face) for face in faces]))
            section(made, "Cells", 23, n + 1, len(cells), *flat(cells))
            if n_tetra:
                tetra = np.arange(4 * n_tetra) % len(points) + 1
                section(made, "More", 10, n + len(cells) + 1, n_tetra, tetra)
            boundary = put(put(made, "ZoneBC", "ZoneBC_t"), "Wall", "BC_t", "BCWall")
            put(boundary, "GridLocation", "GridLocation_t", "FaceCenter")
            put(boundary, "PointList", "IndexArray_t", np.arange(n - 30, n - 3, 2)[:, None])
            solution = put(made, "Solution", "FlowSolution_t")
            put(solution, "GridLocation", "GridLocation_t", "CellCenter")
            put(solution, "Pressure", "DataArray_t", np.arange(float(len(cells) + n_tetra)))
