"""Meshes in which everything occurs that a slice could get wrong, and files of them."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import h5py
import numpy as np

from meshgauge import Mesh
from meshgauge.cells import CELL_TYPES
from meshgauge.io.formats.vtk import hdf
from meshgauge.mesh.polyhedra import Polyhedra

PLAIN = tuple(
    row
    for row in CELL_TYPES.values()
    if row.shape is not None and row.n_nodes is not None and row.n_nodes == row.shape.n_nodes + row.n_middles
)
"""Types whose nodes are their corners, and the middles of edges."""

COPIES = {"hexahedron": 400, "tetra": 200, "wedge": 60, "quadratic_tetra": 60}
"""Cells of a type; a few of the others."""


@cache
def garden(*, shuffled: bool = False, seed: int = 0, single: bool = False) -> Mesh:
    """Cells of all plain types, moved at random, some flat, inverted, collapsed or not finite; and surface cells."""
    rng = np.random.default_rng(seed)
    points: list[np.ndarray] = []
    cells: list[tuple[int, np.ndarray]] = []
    total = 0
    for row in PLAIN:
        assert row.shape is not None
        for copy in range(COPIES.get(row.name, 5)):
            corners = np.empty((row.shape.n_nodes, 3))
            corners[list(row.corners[: row.shape.n_nodes])] = np.array(row.shape.points)
            corners += rng.normal(size=corners.shape) * 0.12 + rng.integers(0, 50, 3)
            middles = [(corners[a] + corners[b]) / 2 for a, b, *_ in row.edges[: row.n_middles]]
            own = np.vstack([corners, *middles]) if middles else corners
            ids = total + np.arange(len(own))
            if row.name == "hexahedron" and copy % 29 == 1:
                own[[3, 7]], ids[[3, 7]] = own[[2, 6]], ids[[2, 6]]  # a wedge, as programs without wedges write it
            if copy % 31 == 2:
                own[1] = own[0]
            if copy % 37 == 3:
                own[:, 2] = own[0, 2]
            if copy == 44:
                own[0, 0] = np.nan
            points.append(own)
            cells.append((row.vtk_id, ids))
            total += len(own)
    cells += [(5, np.array([0, 1, 2]) + 3 * at) for at in range(40)]
    order = rng.permutation(len(cells)) if shuffled else np.arange(len(cells))
    cells = [cells[at] for at in order]
    xyz = np.vstack(points)
    if shuffled:
        places = rng.permutation(total)
        moved = np.empty_like(xyz)
        moved[places] = xyz
        xyz, cells = moved, [(vtk_id, places[ids]) for vtk_id, ids in cells]
    n = len(cells)
    marks = np.zeros(n, np.uint8)
    marks[rng.choice(n, 25, replace=False)] = 1
    return Mesh(
        points=xyz.astype(np.float32 if single else np.float64),
        types=np.array([vtk_id for vtk_id, _ in cells], np.uint8),
        offsets=np.concatenate([[0], np.cumsum([len(ids) for _, ids in cells])]),
        connectivity=np.concatenate([ids for _, ids in cells]),
        cell_data={
            "material": rng.integers(1, 5, n).astype(np.int32),
            "GlobalElementId": rng.permutation(n).astype(np.int64) + 7,
            "vtkGhostType": marks,
            "interface": (rng.random(n) < 0.02).astype(np.uint8),
        },
        point_data={"GlobalNodeId": rng.permutation(len(xyz)).astype(np.int64) + 100},
    )


def without_bricks(seed: int = 0) -> Mesh:
    """A garden without collapsed bricks, which are read whole where values of points are asked for."""
    mesh = garden(seed=seed, shuffled=True)
    return mesh[[cell for cell in range(mesh.n_cells) if len(set(mesh.nodes(cell))) == len(mesh.nodes(cell))]]


def boxes(n: int = 7) -> Mesh:
    """n³ boxes as polyhedra, between them hexahedra."""
    i = np.arange((n + 1) ** 3).reshape(n + 1, n + 1, n + 1)
    bottom = [i[:-1, :-1, :-1], i[1:, :-1, :-1], i[1:, 1:, :-1], i[:-1, 1:, :-1]]
    top = [i[:-1, :-1, 1:], i[1:, :-1, 1:], i[1:, 1:, 1:], i[:-1, 1:, 1:]]
    cubes = np.stack(bottom + top, -1).reshape(-1, 8)
    points = np.stack(np.meshgrid(*[np.arange(n + 1.0)] * 3, indexing="ij"), -1).reshape(-1, 3)
    points += np.random.default_rng(2).normal(size=points.shape) * 0.15
    sides = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    types = np.where(np.arange(len(cubes)) % 3 == 1, 12, 42).astype(np.uint8)
    counts = np.where(types == 42, 6, 0)
    faces = np.concatenate([cubes[types == 42][:, side] for side in sides], axis=1).reshape(-1)
    n_faces = int(counts.sum())
    return Mesh(
        points=points,
        types=types,
        offsets=8 * np.arange(len(cubes) + 1),
        connectivity=cubes.reshape(-1),
        polyhedra=Polyhedra(
            np.concatenate([[0], np.cumsum(counts)]), np.arange(n_faces), 4 * np.arange(n_faces + 1), faces
        ),
    )


def spoiled(mesh: Mesh) -> Mesh:
    """`boxes` of which some are missing, others there twice, some hexahedra numbered in reverse, some faces inward,
    some cells with a point of their own where others have one in common; and a surface cell inside."""
    assert mesh.polyhedra is not None
    n, rng = mesh.n_cells, np.random.default_rng(5)
    mesh = mesh[np.delete(np.arange(n), rng.choice(n, n // 30, replace=False))]
    nodes, poly = mesh.connectivity.reshape(-1, 8).copy(), mesh.polyhedra
    assert poly is not None
    rings = poly.face_points.reshape(-1, 4).copy()
    for vtk_id in (12, 42):
        of_type = np.flatnonzero(mesh.types == vtk_id)
        copy, of = rng.choice(of_type, (2, 4), replace=False)
        nodes[copy] = nodes[of]
        if vtk_id == 42:
            faces = [poly.cell_offsets[cells][:, None] + np.arange(6) for cells in (copy, of)]
            rings[poly.cell_faces[faces[0]]] = rings[poly.cell_faces[faces[1]]]
    is_reversed = (mesh.types == 12) & (rng.random(mesh.n_cells) < 0.1)
    nodes[is_reversed] = nodes[is_reversed][:, [4, 5, 6, 7, 0, 1, 2, 3]]
    is_turned = rng.random(len(rings)) < 0.01
    rings[is_turned] = rings[is_turned][:, ::-1]
    points = mesh.points
    for cell in rng.choice(np.flatnonzero(mesh.types == 42), 5, replace=False).tolist():
        own = rings[poly.cell_faces[poly.cell_offsets[cell] : poly.cell_offsets[cell + 1]]]
        own[own == nodes[cell, 0]] = len(points)
        rings[poly.cell_faces[poly.cell_offsets[cell] : poly.cell_offsets[cell + 1]]] = own
        points, nodes[cell, 0] = np.vstack([points, points[nodes[cell, 0]]]), len(points)
    quad = nodes[n // 2, [0, 2, 4, 6]]
    return Mesh(
        points=np.vstack([points, [[99.0, 99.0, 99.0]]]),
        types=np.append(mesh.types, 9).astype(np.uint8),
        offsets=np.append(8 * np.arange(mesh.n_cells + 1), 8 * mesh.n_cells + 4),
        connectivity=np.concatenate([nodes.reshape(-1), quad]),
        polyhedra=Polyhedra(
            np.append(poly.cell_offsets, poly.cell_offsets[-1]), poly.cell_faces, poly.face_offsets, rings.reshape(-1)
        ),
    )


def write_raw_vtu(path: Path, mesh: Mesh) -> None:
    """A VTU with raw appended data that are not packed, by VTK."""
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    writer = vtkXMLUnstructuredGridWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(mesh.to_pyvista())
    writer.SetDataModeToAppended()
    writer.EncodeAppendedDataOff()
    writer.SetCompressorTypeToNone()
    writer.SetHeaderTypeToUInt64()
    assert writer.Write() == 1


def write_packed_hdf(path: Path, mesh: Mesh) -> None:
    """A VTKHDF file in small chunks, packed by gzip."""
    hdf.write(path.with_suffix(".plain"), mesh)
    with h5py.File(path.with_suffix(".plain"), "r") as plain, h5py.File(path, "w") as packed:
        plain.copy("VTKHDF", packed)
        root = packed["VTKHDF"]
        for name in ("Points", "Types", "Offsets", "Connectivity", "CellData/material"):
            values = root[name][...]
            del root[name]
            root.create_dataset(name, data=values, chunks=(97, *values.shape[1:]), compression="gzip")


def write_parts(path: Path, meshes: list[Mesh]) -> None:
    """A VTKHDF file with a partition of each mesh."""
    with h5py.File(path, "w") as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = np.array([2, 0], np.int64)
        root.attrs.create("Type", np.bytes_("UnstructuredGrid"))
        for name, sizes in (
            ("NumberOfPoints", [m.n_points for m in meshes]),
            ("NumberOfCells", [m.n_cells for m in meshes]),
            ("NumberOfConnectivityIds", [len(m.connectivity) for m in meshes]),
        ):
            root[name] = np.array(sizes, np.int64)
        root["Points"] = np.vstack([m.points for m in meshes])
        for name, attribute in (("Types", "types"), ("Offsets", "offsets"), ("Connectivity", "connectivity")):
            root[name] = np.concatenate([getattr(m, attribute) for m in meshes])
        for group, attribute in (("CellData", "cell_data"), ("PointData", "point_data")):
            for key in getattr(meshes[0], attribute):
                root[f"{group}/{key}"] = np.concatenate([getattr(m, attribute)[key] for m in meshes])


def write_parallel(path: Path, meshes: list[Mesh]) -> None:
    """A PVTU with a VTU for each mesh."""
    items = ""
    for number, mesh in enumerate(meshes):
        name = f"{path.stem}_{number}.vtu"
        write_raw_vtu(path.parent / name, mesh)
        items += f'<Piece Source="{name}"/>'
    path.write_text(
        f'<VTKFile type="PUnstructuredGrid" version="1.0" byte_order="LittleEndian"><PUnstructuredGrid GhostLevel="0">'
        f"{items}</PUnstructuredGrid></VTKFile>"
    )
