"""Writing Gmsh's .msh, version 4.1, also with a set of cells as a physical group beside those they are in.

In version 2.2 an element has one physical group. In 4.1 it has all of its entity: cells of the set get entities of
their own, with the groups of the old one and then the set, so that who asks for one group is given the old one. Where
some cells are in groups, others are in one that says that they are in none: meshio takes groups of all, or of no cells.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ....cells import CELL_TYPES, type_name
from ....errors import WriteError
from ....mesh import Mesh
from ....mesh.labels import LABEL
from ...plumbing import writing
from ...plumbing.cell_set import CellSet
from . import write as whole
from .cells import BY_CELL, NO_GROUP

_LARGEST = 2**31 - 1


def write_set(path: Path, chosen: CellSet) -> tuple[str, ...]:
    """Write a mesh with a set; sentences that say what the format could not hold."""
    assert chosen.mesh is not None  # no file is copied
    return write_version_4(path, chosen.mesh, chosen)


def write_version_4(path: Path, mesh: Mesh, chosen: CellSet | None = None) -> tuple[str, ...]:
    """Write a mesh, with a set if there is one; as `write_set`."""
    mesh = writing.plain(mesh)
    lost: list[str] = []
    groups = whole.groups_of(mesh)
    dimensions = np.array([CELL_TYPES[t].dimension if t in CELL_TYPES else 0 for t in range(256)])[mesh.types]
    is_chosen = np.zeros(mesh.n_cells, np.int64)
    cells_of_set = np.empty(0, np.int64) if chosen is None else chosen.cells
    is_chosen[cells_of_set] = 1
    known = [tag for _, tag in groups.names] + [
        int(v[0]) for v in mesh.field_data.values() if v.shape == (2,) and v.dtype.kind in "iu"
    ]
    tag = max([int(groups.tags.max(initial=0)), *known, 0]) + 1
    names: dict[tuple[int, int], str] = {}
    if chosen is not None:
        names = {(int(d), tag): chosen.name for d in np.unique(dimensions[cells_of_set])}
    tags = groups.tags.astype(np.int64)
    if len(cells_of_set) or tags.any():
        is_none = (tags == 0) & (is_chosen == 0)
        names |= {(int(d), tag + 1): NO_GROUP for d in np.unique(dimensions[is_none])}
        tags[is_none] = tag + 1
    given = mesh.cell_data.get(whole.TAGS[1], np.zeros(mesh.n_cells, np.int64))
    entities = given.astype(np.int64) if whole.is_tag(whole.TAGS[1], given) else np.zeros(mesh.n_cells, np.int64)
    keys = np.stack([dimensions, entities, tags, is_chosen], axis=1)
    rows, entity = np.unique(keys, axis=0, return_inverse=True)
    entity = entity.ravel()
    numbers = _numbers(rows)
    points = writing.numbers(mesh.point_data, mesh.n_points, _LARGEST)
    cells = writing.numbers(mesh.cell_data, mesh.n_cells, _LARGEST)
    with path.open("wb") as file:
        file.write(b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n")
        whole.write_names(file, mesh, replace(groups, names={**groups.names, **names}), lost)
        file.write(_entities(rows, numbers, tag).encode())
        at = (int(rows[-1, 0]), int(numbers[-1]))
        file.write(
            f"$Nodes\n1 {mesh.n_points} {points.min()} {points.max()}\n{at[0]} {at[1]} 0 {mesh.n_points}\n".encode()
        )
        file.write(writing.rows(points[:, None]).encode())
        file.write(writing.rows(np.asarray(mesh.points, np.float64)).encode() + b"$EndNodes\n")
        breaks = (np.diff(entity) != 0) | (np.diff(mesh.types) != 0) | (np.diff(np.diff(mesh.offsets)) != 0)
        starts = [0, *(np.flatnonzero(breaks) + 1).tolist()]
        file.write(f"$Elements\n{len(starts)} {mesh.n_cells} {cells.min()} {cells.max()}\n".encode())
        for start, stop in zip(starts, [*starts[1:], mesh.n_cells], strict=True):
            n_nodes = int(mesh.offsets[start + 1] - mesh.offsets[start])
            kind = BY_CELL.get((type_name(mesh.types[start]), n_nodes))
            if kind is None:
                what = f"cells of type {type_name(mesh.types[start])} with {n_nodes} nodes"
                raise WriteError(f"{path}: {what} cannot be written in Gmsh's format")
            nodes = mesh.connectivity[mesh.offsets[start] : mesh.offsets[stop]].reshape(stop - start, n_nodes)
            turned = np.argsort(kind.order) if kind.order else slice(None)
            one = entity[start]
            file.write(f"{rows[one, 0]} {numbers[one]} {kind.gmsh_id} {stop - start}\n".encode())
            file.write(writing.rows(np.column_stack([cells[start:stop], points[nodes[:, turned]]])).encode())
        file.write(b"$EndElements\n")
        for name, values in mesh.point_data.items():
            if name != LABEL:
                whole.write_view(file, "NodeData", name, values, points, lost, True)
        for name, values in mesh.cell_data.items():
            if name != LABEL and not whole.is_tag(name, values):
                whole.write_view(file, "ElementData", name, values, cells, lost, True)
    return tuple(lost)


def _numbers(rows: NDArray[np.int64]) -> NDArray[np.int64]:
    """A number for each entity, its own where no other row of its dimension has it before."""
    made = rows[:, 1].copy()
    for dimension in np.unique(rows[:, 0]):
        here = np.flatnonzero(rows[:, 0] == dimension)
        _, first = np.unique(made[here], return_index=True)
        own = np.zeros(len(here), bool)
        own[first] = True
        own &= made[here] > 0
        free = int(made[here].max()) + 1
        made[here[~own]] = np.arange(free, free + np.count_nonzero(~own))
    return made


def _entities(rows: NDArray[np.int64], numbers: NDArray[np.int64], tag: int) -> str:
    """Entities without bounds: a box of no size, no entities around them."""
    counts = [int(np.count_nonzero(rows[:, 0] == dimension)) for dimension in range(4)]
    lines = ["$Entities", " ".join(map(str, counts))]
    for (dimension, _, physical, is_chosen), number in zip(rows.tolist(), numbers.tolist(), strict=True):
        groups = ([physical] if physical else []) + ([tag] if is_chosen else [])
        place = "0 0 0" if dimension == 0 else "0 0 0 0 0 0"
        listed = " ".join(map(str, [len(groups), *groups]))
        lines.append(f"{number} {place} {listed}" + ("" if dimension == 0 else " 0"))
    return "\n".join([*lines, "$EndEntities", ""])
