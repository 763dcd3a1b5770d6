"""Where VTK's legacy files hold the coordinates of points, and rows of other files do."""

from __future__ import annotations

import os
import re
from pathlib import Path

import numpy as np

from ...plumbing.hdf_places import Stored
from ...plumbing.numerals import Ints, Raw, Text
from ...plumbing.patch import Places
from ...plumbing.pieces import FileRows, HdfRows, Rows
from ...plumbing.spans import words
from . import legacy_own

_POINTS = re.compile(rb"\n[ \t]*POINTS[ \t]+(\d+)[ \t]+(float|double)[ \t\r]*\n", re.IGNORECASE)

NONE = Places.joined([])
"""Of a file that is not patched."""


def legacy(path: Path) -> Places:
    """Behind the line POINTS, ascii or binary."""
    data = path.read_bytes()
    head = legacy_own.HEAD.match(data)
    found = _POINTS.search(data, head.end() - 1) if head is not None else None
    if head is None or found is None:
        return NONE
    n, is_single = int(found[1]), found[2].lower() == b"float"
    if head[3].upper() == b"BINARY":
        form = Raw(">f4" if is_single else ">f8")
        return row_places(path, form, found.end(), n)
    following = legacy_own.NEXT.search(data, found.end() - 1)
    return text_places(path, data, found.end(), following.start() if following else len(data), n, is_single=is_single)


def row_places(path: Path, form: Raw, begin: int, n: int) -> Places:
    """Of coordinates one after another in memory."""
    size = np.dtype(form.dtype).itemsize
    starts = begin + size * np.arange(3 * n, dtype=np.int64).reshape(n, 3)
    return Places.of(path, form, starts, starts + size)


def text_places(path: Path, data: bytes, begin: int, end: int, n: int, *, is_single: bool) -> Places:
    """Of coordinates one after another as words."""
    starts, ends = (found[: 3 * n] for found in words(data, begin, end))
    if len(starts) < 3 * n:
        return NONE
    return Places.of(path, Text(is_single=is_single), starts.reshape(n, 3), ends.reshape(n, 3))


def places_of_rows(path: Path, rows: Rows) -> Places:
    """Of rows that a piece tells, where they stand in the file itself."""
    if not isinstance(rows, FileRows | HdfRows) or os.path.realpath(rows.path) != os.path.realpath(path):
        return NONE
    n = rows.shape[0]
    if isinstance(rows, FileRows):
        return row_places(path, Raw(rows.dtype.str), rows.offset, n)
    import h5py

    with h5py.File(path, "r") as file:
        if file[rows.name].is_virtual:  # parts of other files
            return NONE
    flat: Ints = 3 * rows.first + np.arange(3 * n, dtype=np.int64).reshape(n, 3)
    starts = 3 * flat + np.arange(3)
    return Places.of(path, Stored((rows.name, rows.name, rows.name), rows.dtype.str), starts, starts + 1)
