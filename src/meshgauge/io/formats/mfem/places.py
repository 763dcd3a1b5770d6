"""Where MFEM's meshes hold the coordinates of points: as vertices, or as nodes of order 1 or 2."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ....errors import ReadError
from ...plumbing.numerals import Ints, Text
from ...plumbing.patch import Places
from ...plumbing.spans import after_lines, columns, in_place, words
from .space import space_of

_VERTICES = re.compile(rb"^[ \t]*vertices\s+(\d+)(?:\s+(\d+)[ \t]*\n)?", re.MULTILINE)
_NODES = re.compile(
    rb"^[ \t]*nodes\s+FiniteElementSpace\s+FiniteElementCollection:[ \t]*(\S+)"
    rb"\s+VDim:[ \t]*(\d+)\s+Ordering:[ \t]*(\d)",
    re.MULTILINE,
)
_MOST = 2
"""Order of nodes that are all in place."""


def places(path: Path) -> Places:
    """Of the vertices of a straight mesh; of nodes in H1, or in L2, where elements have a node each in one place.

    Raises
    ------
    ReadError
        If elements are of a higher order: of these the corners alone are read.
    """
    data = in_place(path.read_bytes(), b"#")
    vertices, nodes = _VERTICES.search(data), _NODES.search(data)
    none: Ints = np.empty((0, 3), np.int64)
    if vertices is None:
        return Places.of(path, Text(), none, none)
    n = int(vertices[1])
    if nodes is None:
        own = 2 if vertices[2] == b"2" else 3
        return Places.of(path, Text(), *columns(data, vertices.end(), after_lines(data, vertices.end(), n), 0, own))
    space, width = space_of(nodes[1]), int(nodes[2])
    if space is None or space.order > _MOST:
        raise ReadError(f"{path}: elements above order {_MOST} are not patched: of these the corners alone are read")
    mark = data.find(b"mfem_mesh_end", nodes.end())
    spans = words(data, nodes.end(), mark if mark >= 0 else len(data))
    shape = (-1, width) if nodes[3] == b"1" else (width, -1)
    tables = [one.reshape(shape) if nodes[3] == b"1" else one.reshape(shape).T for one in spans]
    missing = 0 if width == 2 else 3 - width
    starts, ends = (np.pad(table, ((0, 0), (0, missing)), constant_values=-1) for table in tables)
    whole = Places.of(path, Text(), starts, ends)
    if space.is_continuous:
        return whole.rows(np.arange(n)) if space.order == 1 else whole
    return whole.each_once(_points_of(path, whole))


def _points_of(path: Path, whole: Places) -> Ints:
    """The point of each node of elements that have nodes of their own: the one that is where it is.

    Points of which several are in one place have none then.
    """
    from .read import read

    points = np.asarray(read(path).points)
    known, first, counts = np.unique(points, axis=0, return_index=True, return_counts=True)
    table = whole.values()
    every = np.concatenate([known, table])
    _, which = np.unique(every, axis=0, return_inverse=True)
    which = which.reshape(-1)
    of_known = np.full(int(which.max(initial=-1)) + 1, -1, np.int64)
    of_known[which[: len(known)]] = np.where(counts == 1, first, -1)
    return of_known[which[len(known) :]]
