"""SU2 files, written: solid cells by zones that share no points, surface cells by markers."""

from __future__ import annotations

from pathlib import Path
from typing import TextIO

import numpy as np
from numpy.typing import NDArray

from ....cells import CELL_TYPES, IS_SOLID
from ....errors import WriteError
from ....mesh import Mesh
from ....mesh.regions import named_regions
from ...plumbing import writing

_KNOWN = ("triangle", "quad", "tetra", "hexahedron", "wedge", "pyramid")
_FLAT_KNOWN = ("line", "triangle", "quad")
_NAMES = ("su2:zone", "su2:marker")


def write(path: Path, mesh: Mesh) -> tuple[str, ...]:
    """Surface cells are markers of their region's name; surfaces alone, in the plane z = 0, are of two dimensions."""
    mesh = writing.plain(mesh)
    dimension = np.array([CELL_TYPES[t].dimension if t in CELL_TYPES else -1 for t in range(256)])[mesh.types]
    inside = 3 if (dimension == 3).any() else 2
    writing.check_types(mesh, _KNOWN if inside == 3 else _FLAT_KNOWN)
    if inside == 2 and mesh.points[:, 2].any():
        raise WriteError("the format holds solid cells, or surfaces in the plane z = 0")
    ids, names = named_regions(mesh) or (np.zeros(mesh.n_cells, np.int64), ("marker",))
    solid = dimension == inside
    zones, notes = _zones(mesh, ids, names, solid)
    with path.open("w", encoding="utf-8") as file:
        if len(zones) > 1:
            file.write(f"NZONE= {len(zones)}\n")
        for number, cells in enumerate(zones, 1):
            if len(zones) > 1:
                file.write(f"IZONE= {number}\n")
            _zone(file, mesh, cells, solid, ids, names, inside)
    order = np.concatenate([part for cells in zones for part in (cells[solid[cells]], *_by_marker(cells, solid, ids))])
    if np.any(np.diff(order) < 0):
        notes.append("The format keeps solid cells before the markers: the order of the cells changed.")
    kept = {name for name in mesh.cell_data if name in _NAMES} | ({writing.REGION} if len(zones) > 1 else set())
    return (*notes, *writing.loss_notes(mesh, cell=kept))


def reduce(mesh: Mesh) -> tuple[Mesh, tuple[str, ...]]:
    """Markers are surfaces of a mesh of solid cells, lines of one in a plane."""
    return writing.without_lesser(mesh, _KNOWN if IS_SOLID[mesh.types].any() else _FLAT_KNOWN)


def _zones(
    mesh: Mesh, ids: NDArray[np.int64], names: tuple[str, ...], solid: NDArray[np.bool_]
) -> tuple[list[NDArray[np.int64]], list[str]]:
    """The cells of each zone: of the regions of solid cells if no two share points, else all in one; what is lost."""
    solid_ids = np.unique(ids[solid])
    sizes = np.diff(mesh.offsets)
    if len(solid_ids) < 2:
        return [np.arange(mesh.n_cells)], []
    zone_of_point = np.full(mesh.n_points, -1, np.int64)
    of_node = np.repeat(ids, sizes)[np.repeat(solid, sizes)]
    nodes = mesh.connectivity[np.repeat(solid, sizes)]
    zone_of_point[nodes] = of_node
    listed = ", ".join(repr(names[k]) for k in solid_ids[:8])
    if (zone_of_point[nodes] != of_node).any():
        return [np.arange(mesh.n_cells)], [f"SU2 knows no regions of cells that share points: {listed} are not kept."]
    first = zone_of_point[mesh.connectivity[np.minimum(mesh.offsets[:-1], len(mesh.connectivity) - 1)]]
    zone = np.where(solid, ids, np.where(first < 0, solid_ids[0], first))
    notes = [] if all(names[k] == f"zone {n}" for n, k in enumerate(solid_ids, 1)) else [
        f"SU2's zones have no names: {listed} became zones 1 to {len(solid_ids)}."
    ]  # fmt: skip
    return [np.flatnonzero(zone == k) for k in solid_ids], notes


def _zone(
    file: TextIO,
    mesh: Mesh,
    cells: NDArray[np.int64],
    solid: NDArray[np.bool_],
    ids: NDArray[np.int64],
    names: tuple[str, ...],
    dimension: int,
) -> None:
    """One zone: its cells, its points (all, if it is the only one), its markers."""
    sizes = np.diff(mesh.offsets)
    used = np.zeros(mesh.n_points, bool)
    used[mesh.connectivity[np.repeat(np.isin(np.arange(mesh.n_cells), cells), sizes)]] = True
    points = np.arange(mesh.n_points) if len(cells) == mesh.n_cells else np.flatnonzero(used)
    place = np.full(mesh.n_points, -1, np.int64)
    place[points] = np.arange(len(points))
    inner = cells[solid[cells]]
    file.write(f"NDIME= {dimension}\nNELEM= {len(inner)}\n")
    _cells(file, mesh, inner, place)
    file.write(f"NPOIN= {len(points)}\n" + writing.rows(mesh.points[points, :dimension]))
    markers = _by_marker(cells, solid, ids)
    file.write(f"NMARK= {len(markers)}\n")
    for own in markers:
        name = "_".join(names[ids[own[0]]].split()) or "marker"
        file.write(f"MARKER_TAG= {name}\nMARKER_ELEMS= {len(own)}\n")
        _cells(file, mesh, own, place)


def _by_marker(cells: NDArray[np.int64], solid: NDArray[np.bool_], ids: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """The surface cells of each region."""
    outer = cells[~solid[cells]]
    return [outer[ids[outer] == marker] for marker in np.unique(ids[outer])]


def _cells(file: TextIO, mesh: Mesh, cells: NDArray[np.int64], place: NDArray[np.int64]) -> None:
    for cell in cells.tolist():
        nodes = place[mesh.connectivity[mesh.offsets[cell] : mesh.offsets[cell + 1]]]
        file.write(f"{mesh.types[cell]} {' '.join(map(str, nodes.tolist()))}\n")
