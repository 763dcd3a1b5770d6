"""Where arrays of HDF5 files hold coordinates: as bytes where an array is in one piece, else by their place in it."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .numerals import Form, Ints, Raw, Reals
from .patch import Places


@dataclass(frozen=True, slots=True)
class Stored:
    """Numbers in arrays that are packed or in chunks.

    A place ``start`` is that of ``start // 3`` in the array ``names[start % 3]``, its items in a row.
    """

    names: tuple[str, str, str]
    kind: str

    def values(self, data: bytes, starts: Ints, ends: Ints) -> Reals:
        import h5py

        values = np.empty(len(starts))
        with h5py.File(io.BytesIO(data), "r") as file:
            for name in set(self.names):
                own = np.flatnonzero(np.array(self.names)[starts % 3] == name)
                values[own] = np.asarray(file[name][...]).ravel()[starts[own] // 3]
        return values

    def rounded(self, values: Reals) -> Reals:
        return values.astype(self.kind).astype(np.float64)

    def put(self, path: Path, starts: Ints, values: Reals) -> None:
        """Change numbers in the arrays of a file, packed and in chunks as they were."""
        import h5py

        with h5py.File(path, "r+") as file:
            for name in set(self.names):
                own = np.flatnonzero(np.array(self.names)[starts % 3] == name)
                array = np.asarray(file[name][...])
                array.reshape(-1)[starts[own] // 3] = values[own]
                file[name][...] = array


def places_in(path: Path, axes: Sequence[tuple[Any, Ints]]) -> Places:
    """The places of points in data sets of h5py.

    Parameters
    ----------
    path
        The file.
    axes
        For x, y and z the array, and which of its items, in a row, each point has; fewer if the mesh has fewer axes.
    """
    n = len(axes[0][1])
    starts, ends = np.full((n, 3), -1, np.int64), np.full((n, 3), -1, np.int64)
    offsets = [None if array.chunks else array.id.get_offset() for array, _ in axes]
    kind = axes[0][0].dtype.str
    if any(array.dtype.str != kind for array, _ in axes):
        return Places.of(path, Raw(kind), starts, ends)
    form: Form
    whole = [offset for offset in offsets if offset is not None]
    if len(whole) == len(axes):
        size = np.dtype(kind).itemsize
        for axis, ((_, at), offset) in enumerate(zip(axes, whole, strict=True)):
            starts[:, axis] = offset + size * at
            ends[:, axis] = starts[:, axis] + size
        form = Raw(kind)
    else:
        for axis, (_, at) in enumerate(axes):
            starts[:, axis] = 3 * at + axis
            ends[:, axis] = starts[:, axis] + 1
        names = [str(array.name) for array, _ in axes]
        x, y, z = (*names, *[names[0]] * 3)[:3]
        form = Stored((x, y, z), kind)
    return Places.of(path, form, starts, ends)
