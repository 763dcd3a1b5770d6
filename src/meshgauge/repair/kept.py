"""Between which cells faces are kept: regions, and cell data that the user names."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..cells import IS_SOLID
from ..errors import MeshError
from ..look.style import printable
from ..mesh import Mesh
from ..mesh.interface import INTERFACE
from ..mesh.labels import LABEL
from ..mesh.mesh import GHOST_TYPE
from ..mesh.regions import regions
from ..status import Status

Ids = NDArray[np.int64]

FEW, MANY = 2, 64
"""How many values integer cell data have that could be regions: with more they are likely to number cells."""

OWN = "meshgauge:"
"""How the names of our own data begin."""


def kept_regions(mesh: Mesh, keep: Sequence[str]) -> tuple[Ids, tuple[str, ...]]:
    """The regions of a mesh, parted further by cell data: ids ``(n_cells,)`` and names, as `mesh.regions.regions`.

    Raises `MeshError` if there is no such cell data.
    """
    ids, names = regions(mesh)
    is_one = len(names) == 1
    for name in keep:
        if name not in mesh.cell_data:
            there = ", ".join(repr(one) for one in mesh.cell_data if not one.startswith(OWN)) or "none"
            raise MeshError(f"{mesh.path or 'the mesh'}: there is no cell data {name!r} to keep; there is {there}")
        values, of_value = _values(mesh.cell_data[name])
        pairs, ids = np.unique(np.stack([ids, of_value], axis=1), axis=0, return_inverse=True)
        ids = ids.reshape(-1).astype(np.int64)
        texts = [f"{printable(name)} {_text(value)}" for value in values]
        names = tuple(texts[v] if is_one else f"{names[n]}, {texts[v]}" for n, v in pairs.tolist())
        is_one = False
    return ids, names


def unkept(mesh: Mesh, region_ids: Ids) -> tuple[str, ...]:
    """Names of integer cell data of `FEW` to `MANY` values that part the solid cells of some region further.

    Parameters
    ----------
    mesh
        Any mesh.
    region_ids
        ``(n_cells,)`` the regions that are kept.
    """
    solid = IS_SOLID[mesh.types]
    names = []
    for name, data in mesh.cell_data.items():
        if data.dtype.kind not in "iub" or data.size != len(data) or _is_own(name, data) or not solid.any():
            continue
        column = data.reshape(-1)[solid]
        low, high = int(column.min()), int(column.max())
        if low == high:
            continue
        values, of_value = np.unique(column, return_inverse=True)
        if FEW <= len(values) <= MANY:
            regions_here = region_ids[solid]
            first = np.zeros(int(regions_here.max()) + 1, np.int64)
            first[regions_here] = of_value.reshape(-1)
            if (first[regions_here] != of_value.reshape(-1)).any():
                names.append(name)
    return tuple(names)


def _is_own(name: str, data: NDArray[Any]) -> bool:
    """True for data that this program, or one of its readers, has made."""
    if name == "status":  # as a report writes it beside the qualities
        return data.dtype == np.uint8 and int(data.max(initial=0)) <= max(Status)
    return name.startswith(OWN) or name in (LABEL, GHOST_TYPE, INTERFACE)


def _values(data: NDArray[Any]) -> tuple[NDArray[Any], Ids]:
    """The different values (rows, of data with components), and which of them each cell has."""
    rows = data.reshape(len(data), -1)
    if rows.shape[1] == 1:
        values, inverse = np.unique(rows[:, 0], return_inverse=True)
    else:
        values, inverse = np.unique(rows, axis=0, return_inverse=True)
    return values, inverse.reshape(-1).astype(np.int64)


def _text(value: Any) -> str:
    """A value as a part of a name."""
    if isinstance(value, np.ndarray):
        return "(" + " ".join(_text(one) for one in value) + ")"
    return f"{value:.12g}" if isinstance(value, np.floating) else printable(str(value))
