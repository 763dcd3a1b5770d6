"""Where CGNS files in HDF5 hold the coordinates of points."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ....errors import ReadError
from ...plumbing.hdf_places import places_in
from ...plumbing.numerals import Ints, Raw
from ...plumbing.patch import Places
from .tree import Node
from .zone import CARTESIAN


def places(path: Path) -> Places:
    """Of every zone in turn; of Cartesian coordinates without rind.

    Raises
    ------
    ReadError
        If the file is none of HDF5.
    """
    import h5py

    if not h5py.is_hdf5(path):
        raise ReadError(f"{path}: CGNS files of the old kind (ADF) are not patched; cgnsconvert makes HDF5 of them")
    with h5py.File(path, "r") as file:
        root = Node(file, path.stat().st_size)
        zones = [zone for base in root.children("CGNSBase_t") for zone in base.children("Zone_t")]
        return Places.joined([_of_zone(path, zone) for zone in zones])


def _of_zone(path: Path, zone: Node) -> Places:
    grid = zone.first("GridCoordinates_t")
    arrays = {} if grid is None else {child.name: child.group[" data"] for child in grid.children("DataArray_t")}
    own = [arrays[name] for name in CARTESIAN if name in arrays]
    has_rind = grid is not None and grid.first("Rind_t") is not None
    n = max((array.size for array in arrays.values()), default=0)
    if not own or has_rind or len({array.shape for array in own}) > 1:
        none: Ints = np.full((n, 3), -1, np.int64)
        return Places.of(path, Raw("<f8"), none, none)
    return places_in(path, [(array, np.arange(n)) for array in own])
