"""Where Exodus files hold the coordinates of nodes: netCDF, classic or in HDF5."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...errors import ReadError
from ..plumbing.hdf_places import places_in
from ..plumbing.netcdf import variables
from ..plumbing.numerals import Raw
from ..plumbing.patch import Places
from . import spread


def places(path: Path) -> Places:
    """Of a file, or of all pieces of a mesh that is spread over files: a node of several stands in each.

    Raises
    ------
    ReadError
        If the nodes of pieces have no numbers.
    """
    files = spread.all_pieces(path)
    if len(files) < 2:
        return _of_file(path)
    numbers = []
    for file in files:
        with variables(file) as arrays:
            if "node_num_map" not in arrays:
                raise ReadError(
                    f"{file}: the nodes have no numbers to join the pieces of the mesh by; it is not patched"
                )
            numbers.append(np.asarray(arrays["node_num_map"].values(), np.int64).ravel())
    _, of_node = spread.joined(np.concatenate(numbers))
    return Places.joined([_of_file(file) for file in files]).each_once(of_node)


def _of_file(path: Path) -> Places:
    with variables(path) as arrays:
        is_one = "coord" in arrays
        own = [arrays["coord"]] if is_one else [arrays[k] for k in ("coordx", "coordy", "coordz") if k in arrays]
        n = own[0].shape[-1]
        axes = [(own[0], axis * n + np.arange(n)) for axis in range(own[0].shape[0])] if is_one else None
        axes = axes or [(variable, np.arange(n)) for variable in own]
        if own[0].dataset is not None:
            return places_in(path, [(variable.dataset, at) for variable, at in axes])
        size = np.dtype(own[0].kind).itemsize
        starts = np.full((n, 3), -1, np.int64)
        for axis, (variable, at) in enumerate(axes):
            if variable.start is not None:
                starts[:, axis] = variable.start + size * at
        return Places.of(path, Raw(own[0].kind), starts, starts + size)
