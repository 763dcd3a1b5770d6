"""Where MED files hold the coordinates of points."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...plumbing.hdf_places import places_in
from ...plumbing.patch import Places


def places(path: Path) -> Places:
    """Of every mesh in turn, at its first step: one axis after the other."""
    import h5py

    parts = []
    with h5py.File(path, "r") as file:
        for group in file["ENS_MAA"].values():
            step = group if "NOE" in group else group[next(iter(group))]
            array = step["NOE"]["COO"]
            dimension = int(group.attrs.get("ESP", group.attrs.get("DIM", 3)))
            n = array.size // dimension
            parts.append(places_in(path, [(array, axis * n + np.arange(n)) for axis in range(dimension)]))
    return Places.joined(parts)
