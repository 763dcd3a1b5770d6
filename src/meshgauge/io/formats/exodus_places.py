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
    """Of a file alone.

    Raises
    ------
    ReadError
        If the mesh is spread over several files.
    """
    if len(spread.all_pieces(path)) > 1:
        raise ReadError(f"{path}: a mesh that is spread over several files is not patched; join them first (epu)")
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
