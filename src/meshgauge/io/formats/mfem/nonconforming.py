"""MFEM's non-conforming meshes (``MFEM NC mesh``): trees of elements, of which the leaves are the mesh.

A vertex that hangs stands between two others, halfway unless the file says where.
"""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from ....errors import ReadError
from ....mesh import Mesh
from ....mesh.mesh import GHOST_TYPE
from ...plumbing.build import Ints, check_codes, gather, runs
from ...plumbing.face_based import spans
from ...plumbing.ghosts import DUPLICATE
from ...plumbing.ids import Index
from ...plumbing.text import Ragged, Text
from .kinds import KINDS

VERSION = re.compile(rb"MFEM NC[ -]mesh v1\.[01]\b", re.IGNORECASE)
_UNUSED = -1  # the geometry of an element that was removed
_MOST_ROUNDS = 1000
"""Vertices between others between others ...: a file of MFEM has two a level."""


def read(text: Text) -> Mesh:
    """The leaves, then boundary elements, whose attributes are cell data ``mfem:attribute``; those of other processes
    are ghosts.

    Raises
    ------
    ReadError
        If the mesh is curved, or a vertex has no place.
    """
    rank = 0
    elements: _Table | None = None
    boundary: _Table | None = None
    parents: Ragged | None = None
    points = np.empty((0, 0))
    while key := text.line():
        if key == b"dimension":
            text.integers("the dimension")
        elif key == b"rank":
            rank = text.integers("the rank")[0]
        elif key == b"elements":
            elements = _rows(text, "elements", 3)
        elif key == b"boundary":
            boundary = _rows(text, "boundary elements", 2)
        elif key == b"vertex_parents":
            n = text.count("vertices")
            parents = text.ragged(n, "parents of vertices", np.float64)
        elif key == b"coordinates":
            n, width = text.count("vertices"), text.integers("the number of coordinates")[0]
            if not 1 <= width <= 3:
                raise text.fail(f"vertices of {width} coordinates, expected 1 to 3")
            points = text.reals(n, width, "vertices")
        elif key == b"root_state":
            text.lines(text.count("orientations of elements"), "orientations of elements")
        elif key == b"nodes":
            raise text.fail("a non-conforming mesh that is curved cannot be read; save it as VTU")
        elif key == b"mfem_mesh_end":
            break
        else:
            raise text.fail(f"section {key[:40].decode('utf-8', 'replace')!r} is not known")
    if elements is None or not points.size:
        raise ReadError(f"{text.path}: has no elements or no coordinates; the file is not whole")
    leaf = elements.column(3) == 0
    leaf &= elements.column(2) != _UNUSED
    leaves = elements.chosen(leaf, 2, 4)
    sides = boundary.chosen(np.ones(len(boundary.starts), bool), 1, 2) if boundary is not None else None
    codes, attributes = [leaves.codes], [elements.column(1)[leaf]]
    nodes, sizes = [leaves.nodes], [leaves.sizes]
    if boundary is not None and sides is not None:
        codes.append(sides.codes)
        attributes.append(boundary.column(0))
        nodes.append(sides.nodes)
        sizes.append(sides.sizes)
    places, ids = _points(text, points, parents, np.concatenate(nodes))
    n_nodes = np.concatenate(sizes)
    cells = gather(ids, np.cumsum(n_nodes) - n_nodes, np.concatenate(codes), KINDS)
    data = {"mfem:attribute": np.concatenate(attributes)}
    is_ghost = elements.column(0)[leaf] != rank
    if is_ghost.any() and rank in elements.column(0)[leaf]:
        data[GHOST_TYPE] = np.concatenate([is_ghost, np.zeros(len(cells.types) - len(is_ghost), bool)]) * DUPLICATE
    return Mesh(
        places,
        cells.types,
        cells.offsets,
        cells.connectivity,
        blocks=runs(np.repeat(np.arange(len(codes)), list(map(len, codes))), {0: "elements", 1: "boundary"}),
        cell_data=data,
        path=str(text.path),
        copy=False,
    )


class _Leaves:
    """Types of elements, and their nodes one after another."""

    def __init__(self, codes: Ints, nodes: Ints, sizes: Ints) -> None:
        self.codes, self.nodes, self.sizes = codes, nodes, sizes


class _Table:
    """Rows of integers, of different lengths."""

    def __init__(self, text: Text, values: Ints, starts: Ints, first: int) -> None:
        self.text, self.values, self.starts, self.sizes, self.first = text, values, starts[:-1], np.diff(starts), first

    def column(self, k: int) -> Ints:
        """Of rows that are shorter 0."""
        out = np.zeros(len(self.starts), np.int64)
        longer = self.sizes > k
        out[longer] = self.values[self.starts[longer] + k]
        return out

    def chosen(self, rows: NDArray[np.bool_], code: int, node: int) -> _Leaves:
        """Some rows, whose types stand at ``code`` and whose nodes from ``node`` on."""
        at = np.flatnonzero(rows)
        codes, sizes = self.column(code)[at], self.sizes[at] - node
        check_codes(codes, sizes, KINDS, lambda what, row: self.text.fail(what, self.first + int(at[row])))
        return _Leaves(codes, self.values[spans(self.starts[at] + node, sizes)], sizes)


def _rows(text: Text, what: str, least: int) -> _Table:
    n = text.count(what)
    first = text.row
    rows = text.ragged(n, what)
    if n and int(rows.sizes.min()) < least:
        raise text.fail(f"{what} of less than {least} numbers", first + int(np.argmin(rows.sizes)))
    return _Table(text, rows.values, rows.starts, first)


def _points(
    text: Text, given: NDArray[np.float64], parents: Ragged | None, nodes: Ints
) -> tuple[NDArray[np.float64], Ints]:
    """The vertices that elements refer to, and their places among them."""
    rows = np.empty((0, 4))
    if parents is not None and len(parents.sizes):
        if int(parents.sizes.min()) < 3:
            raise text.fail("a vertex without a number and two parents")
        begin = parents.starts[:-1]
        share = np.full(len(begin), 0.5)
        has_share = parents.sizes > 3
        share[has_share] = parents.values[begin[has_share] + 3]
        rows = np.column_stack([parents.values[begin[:, None] + np.arange(3)], share])
    if not (np.abs(rows[:, :3]) < 2**53).all():
        raise text.fail("the number of a vertex is none")
    own = rows[:, :3].astype(np.int64)
    index = Index(np.concatenate([np.arange(len(given)), own[:, 0]]))
    ends = index.of(own[:, 1:].ravel()).reshape(-1, 2)
    used, which = np.unique(index.of(nodes), return_inverse=True)
    if (len(used) and used[0] < 0) or (len(ends) and int(ends.min()) < 0):
        wrong = np.concatenate([nodes[index.of(nodes) < 0], own[:, 1:][ends < 0]])
        raise ReadError(f"{text.path}: vertex {int(wrong[0])} has no place")
    points = np.zeros((index.n, 3))
    points[: len(given), : given.shape[1]] = given
    is_known = np.arange(index.n) < len(given)
    left = np.arange(len(rows))
    for _ in range(_MOST_ROUNDS):
        ready = is_known[ends[left]].all(axis=1)
        at = left[ready]
        t = rows[at, 3:4]
        points[len(given) + at] = (1 - t) * points[ends[at, 0]] + t * points[ends[at, 1]]
        is_known[len(given) + at] = True
        left = left[~ready]
        if not len(left) or not len(at):
            break
    if len(left):
        raise ReadError(f"{text.path}: vertex {int(own[left[0], 0])} hangs on itself, or on too many others")
    return points[used], which.reshape(-1)
