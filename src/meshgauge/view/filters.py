"""Which cells are shown: a set of conditions, and the mask that they make of a mesh's arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..cells import BY_NAME
from ..errors import MeshgaugeError
from ..look.bands import POOR
from ..look.names import meant_or_known
from ..status import STATUSES, Purpose, is_invalid, is_usable

Mask = NDArray[np.bool_]

MOST_PLANES = 3
"""Slices at once: as many as make an octant."""

AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


class ViewError(MeshgaugeError, ValueError):
    """A view that cannot be: a link that is not understood, a range upside down, no such cell."""


@dataclass(frozen=True, slots=True)
class Plane:
    """A slicing plane; cells whose centre is not beyond it are kept, and each is kept whole."""

    normal: tuple[float, float, float]  #: points to what is cut away; of any length but 0
    at: float  #: where along the normal: 0 at one end of the mesh, 1 at the other

    def __post_init__(self) -> None:
        if not (np.isfinite(self.normal).all() and any(self.normal)):
            raise ViewError(f"the normal of a plane is {self.normal}, expected three numbers, not all 0")
        if not 0.0 <= self.at <= 1.0:
            raise ViewError(f"a plane is at {self.at}, expected 0 to 1")


@dataclass(frozen=True, slots=True)
class Filters:
    """What a cell must be to be shown. None means that all pass.

    ``low <= quality < high``, so that ranges side by side share no cell; at ``high = 1`` the best cells are in as well.
    """

    low: float = -1.0
    high: float = 1.0
    undefined: bool = True  #: whether cells without a value pass
    types: frozenset[str] | None = None
    statuses: frozenset[str] | None = None
    regions: frozenset[str] | None = None
    planes: tuple[Plane, ...] = ()  #: what is beyond any of them is cut away
    peel: int = 0  #: number of layers of cells taken off the surface

    def __post_init__(self) -> None:
        if not -1.0 <= self.low <= self.high <= 1.0:
            raise ViewError(f"the range of quality is {self.low} to {self.high}, expected -1 <= low <= high <= 1")
        if self.peel < 0:
            raise ViewError(f"{self.peel} layers to peel, expected 0 or more")
        if len(self.planes) > MOST_PLANES:
            raise ViewError(f"{len(self.planes)} slices, expected at most {MOST_PLANES}")


def presets(purpose: Purpose, poor: float = POOR) -> dict[str, tuple[float, float, tuple[str, ...]]]:
    """Filters by name: range of quality, and the names of the statuses. Status goes before value."""
    codes = np.array(sorted(STATUSES), np.uint8)

    def named(mask: Mask) -> tuple[str, ...]:
        return tuple(
            STATUSES[status].name for status, wanted in zip(sorted(STATUSES), mask.tolist(), strict=True) if wanted
        )

    return {
        "invalid": (-1.0, 1.0, named(is_invalid(codes, purpose))),
        "poor": (-1.0, poor, named(is_usable(codes, purpose))),
        "all": (-1.0, 1.0, named(np.ones(len(codes), np.bool_))),
    }


class Cells(Protocol):
    """What the filters read; every array has one entry a cell of the mesh."""

    @property
    def values(self) -> NDArray[np.float64]: ...
    @property
    def is_solid(self) -> Mask: ...
    @property
    def type_ids(self) -> NDArray[np.integer]: ...
    @property
    def type_names(self) -> tuple[str, ...]: ...
    @property
    def status_ids(self) -> NDArray[np.integer]: ...
    @property
    def status_names(self) -> tuple[str, ...]: ...
    @property
    def region_ids(self) -> NDArray[np.integer]: ...
    @property
    def region_names(self) -> tuple[str, ...]: ...
    @property
    def layers(self) -> NDArray[np.int32]: ...
    @property
    def centres(self) -> NDArray[np.float32]:
        """``(n_cells, 3)``, in the frame of the scene."""
        ...


def require_known(filters: Filters, meshes: Sequence[Cells]) -> None:
    """Raise `ViewError` if a filter names a type or status that there is not, or a region that no mesh has.

    A type or status that only these meshes lack passes: a view may be meant for another mesh.
    """
    for what, chosen, have, known in (
        ("cell type", filters.types, [_present(cells) for cells in meshes], BY_NAME),
        ("status", filters.statuses, [[row.name for row in STATUSES.values()]], ()),
        ("region", filters.regions, [cells.region_names for cells in meshes], ()),
    ):
        names = dict.fromkeys(name for one in have for name in one)
        for name in sorted(chosen or ()):
            if name not in names and name not in known:
                raise ViewError(f"no {what} {name!r}{meant_or_known(name, names)}")


def _present(cells: Cells) -> list[str]:
    """Names of the types that a mesh has."""
    return [cells.type_names[at] for at in np.unique(cells.type_ids).tolist()]


def in_range(values: NDArray[np.float64], filters: Filters) -> Mask:
    """The cells whose quality passes; NaN passes if undefined cells do."""
    inside = (values >= filters.low) & ((values < filters.high) | (filters.high >= 1.0))
    if filters.undefined:
        inside |= np.isnan(values)
    return np.asarray(inside)


def others(cells: Cells, filters: Filters) -> Mask:
    """The solid cells that pass everything but the range of quality: what the histogram counts."""
    mask = cells.is_solid.copy()
    for names, ids, chosen in (
        (cells.type_names, cells.type_ids, filters.types),
        (cells.status_names, cells.status_ids, filters.statuses),
        (cells.region_names, cells.region_ids, filters.regions),
    ):
        if chosen is not None:
            mask &= np.array([name in chosen for name in names], np.bool_)[ids]
    if filters.peel:
        mask &= cells.layers >= filters.peel
    for plane in filters.planes:
        mask &= behind(cells.centres, plane)
    return mask


def behind(centres: NDArray[np.floating], plane: Plane) -> Mask:
    """The cells that a plane keeps. It is placed between the least and the greatest centre along its normal."""
    normal = np.array(plane.normal, np.float64)
    along = centres @ (normal / np.linalg.norm(normal)).astype(np.float32)
    finite = along[np.isfinite(along)]
    if not len(finite):
        return np.ones(len(along), np.bool_)
    low, high = float(finite.min()), float(finite.max())
    return np.asarray(along <= low + plane.at * (high - low))


def shown(cells: Cells, filters: Filters) -> Mask:
    """The cells that pass every filter."""
    return others(cells, filters) & in_range(cells.values, filters)
