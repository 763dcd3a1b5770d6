"""Solutions added to CGNS files in HDF5: arrays on the points and the solid cells of every zone."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....cells import IS_SOLID
from ....mesh.labels import LABEL
from ...plumbing.added import Added, CannotAdd
from .tree import Node
from .zone import Zone, zones

_WIDTHS = {"name": 33, "label": 33, "type": 3}
"""Bytes of the attributes of a node."""
_KINDS = {"f8": "R8", "i8": "I8", "i4": "I4", "i1": "C1"}
_LONGEST = 32
"""Characters of a name."""


def add(old: Path, new: Path, added: Added) -> NDArray[np.bool_]:
    """Arrays stand in the solution of a zone on points, or on cells, that it has; else in one that is made."""
    import h5py

    require_hdf(old)
    longest = max((*added.cells, *added.points), key=len, default="")
    if len(longest) > _LONGEST:
        raise CannotAdd(f"would need the name {longest!r}, of more than {_LONGEST} characters")
    shutil.copyfile(old, new)
    is_held, point, cell = np.zeros(added.mesh.n_cells, bool), 0, 0
    with h5py.File(new, "r+") as file:
        for base in Node(file, new.stat().st_size).children("CGNSBase_t"):
            for node, zone in zip(base.children("Zone_t"), zones(base), strict=True):
                solid, n_points = _solid(zone), len(zone.part.points)
                on_points = {key: values[point : point + n_points] for key, values in added.points_as_reals.items()}
                on_cells = {key: values[cell + solid] for key, values in added.cells_as_reals.items()}
                _put(node, "Vertex", on_points, zone.shape)
                _put(node, "CellCenter", on_cells, tuple(n - 1 for n in zone.shape))
                is_held[cell + solid] = True
                point, cell = point + n_points, cell + len(zone.part.types)
    return is_held


def require_hdf(path: Path) -> None:
    """Raise `CannotAdd` if a file is of the old kind."""
    import h5py

    if not h5py.is_hdf5(path):
        raise CannotAdd("is of the old kind (ADF); cgnsconvert makes HDF5 of it")


def _solid(zone: Zone) -> NDArray[np.int64]:
    """The cells that have values: of the dimension of the base, in the order of the numbers of elements."""
    types, numbers = zone.part.types, zone.part.cell_data.get(LABEL)
    solid = np.flatnonzero(IS_SOLID[types]) if IS_SOLID[types].any() else np.arange(len(types))
    if numbers is not None and (np.diff(numbers[solid]) < 0).any():
        raise CannotAdd("has sections in another order than their elements")
    return solid


def _put(zone: Node, where: str, arrays: dict[str, NDArray[np.float64]], shape: tuple[int, ...]) -> None:
    """Arrays of a zone, in its first solution of that place."""
    solution = next((one for one in zone.children("FlowSolution_t") if _place(one) == where), None)
    if solution is None:
        name = "PointQuality" if where == "Vertex" else "CellQuality"
        if zone.child(name) is not None:
            raise CannotAdd(f"has a node {name!r} already")
        made = make_node(zone.group, name, "FlowSolution_t")
        make_node(made, "GridLocation", "GridLocation_t", np.frombuffer(where.encode(), np.int8))
    else:
        made = solution.group
        if solution.first("Rind_t") is not None:
            raise CannotAdd(f"has a solution with rind, {solution.name!r}")
    for key, values in arrays.items():
        if key in made:
            del made[key]
        make_node(made, key, "DataArray_t", values.reshape(shape[::-1] or -1))


def _place(solution: Node) -> str:
    place = solution.child("GridLocation")
    return place.text() if place is not None else "Vertex"


def make_node(parent: Any, name: str, label: str, values: NDArray[Any] | None = None) -> Any:
    """A node as CGNS's library writes it."""
    made = parent.create_group(name, track_order=True)
    kind = "MT" if values is None else _KINDS[values.dtype.str[1:]]
    for key, text in (("name", name), ("label", label), ("type", kind)):
        made.attrs.create(key, np.bytes_(text), dtype=f"S{_WIDTHS[key]}")
    made.attrs.create("flags", np.array([1], np.int32))
    if values is not None:
        made.create_dataset(" data", data=values)
    return made
