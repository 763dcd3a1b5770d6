"""Where Fluent's files hold the coordinates of points: as text, as bytes or in HDF5."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...plumbing.hdf_places import places_in
from ...plumbing.numerals import Raw, Text
from ...plumbing.patch import Places
from ...plumbing.spans import words
from .cursor import Cursor

_HDF = b"\x89HDF"


def places(path: Path) -> Places:
    """Of every zone of points, in the order of their numbers."""
    data = path.read_bytes()
    if data.startswith(_HDF):
        return _in_hdf(path)
    cursor, parts = Cursor(path, data), []
    while (number := cursor.section()) is not None:
        is_binary, kind, has_body = number >= 2000, number % 1000, True
        if kind in (10, 12, 13):
            zone, first, last, *_ = cursor.head()
            has_body = zone > 0 and data[cursor.at : cursor.at + 1] == b"("
            if kind == 10 and has_body:
                parts.append((first, _of_zone(cursor, last - first + 1, number)))
        cursor.close(is_binary and has_body)
    return Places.joined([part for _, part in sorted(parts, key=lambda one: one[0])])


def _of_zone(cursor: Cursor, n: int, number: int) -> Places:
    """Of the points of a section, whose number tells how they are held."""
    begin = cursor.at + 1
    if number < 2000:
        end = cursor.data.index(b")", begin)
        starts, ends = (one[: 3 * n].reshape(-1, 3) for one in words(cursor.data, begin, end))
        return Places.of(cursor.path, Text(), starts, ends)
    kind = "<f8" if number >= 3000 else "<f4"
    size = np.dtype(kind).itemsize
    starts = begin + size * np.arange(3 * n).reshape(n, 3)
    return Places.of(cursor.path, Raw(kind), starts, starts + size)


def _in_hdf(path: Path) -> Places:
    """Of the first mesh."""
    import h5py

    with h5py.File(path, "r") as file:
        meshes = file["meshes"]
        coords = meshes[sorted(meshes, key=lambda key: (len(key), key))[0]]["nodes"]["coords"]
        keys = [key for key in coords if key.isdigit()]
        keys.sort(key=lambda key: (int(np.ravel(coords[key].attrs.get("minId", 1))[0]), int(key)))
        return Places.joined(
            [
                places_in(path, [(coords[key], 3 * np.arange(coords[key].size // 3) + axis) for axis in range(3)])
                for key in keys
            ]
        )
