"""Cells that are there twice."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..cells import IS_SOLID
from ..kernels.topology import driver
from ..mesh import Mesh
from ..mesh.polyhedra import IndexArray

Ids = NDArray[np.int64]


def duplicates(mesh: Mesh, hashes: Ids) -> Ids:
    """Ids, ascending, of the cells that are of one type with an earlier one and have the same points, in any order.

    ``hashes`` are those of `kernels.scan.cells`; each suspicion is verified.
    """
    ordered = np.sort(hashes)
    twice = np.unique(ordered[1:][ordered[1:] == ordered[:-1]])
    del ordered
    matches = [np.empty(0, np.int64)]
    suspects = np.flatnonzero(np.isin(hashes, twice)) if len(twice) else matches[0]
    firsts = np.asarray(mesh.offsets[suspects], np.int64)
    kinds = mesh.types[suspects].astype(np.int64) << 32 | (mesh.offsets[suspects + 1] - firsts)
    for kind in np.unique(kinds):
        here = kinds == kind
        cells = suspects[here]
        nodes = np.sort(mesh.connectivity[firsts[here][:, None] + np.arange(kind & 0xFFFFFFFF)], axis=1)
        order = np.argsort(hashes[cells], kind="stable")
        same_hash, same = _same(hashes[cells[order]]), _same(nodes[order])
        if (same_hash & ~same).any():  # different cells of one hash, by chance
            order = np.lexsort((cells, *nodes.T))
            same = _same(nodes[order])
        matches.append(cells[order[1:]][same])
    return np.sort(np.concatenate(matches))


def covering(mesh: Mesh, representative: IndexArray) -> Ids:
    """Ids, ascending, of the solid cells whose points all coincide with those of an earlier one of their type.

    ``representative`` is the point that stands for each, see `points.representatives`. Cells of which two points
    coincide with each other are left out: cohesive cells and others that are flat by design.
    """
    nodes = representative.astype(mesh.connectivity.dtype)[mesh.connectivity]
    welded = mesh.replace(connectivity=nodes, polyhedra=None, blocks=())
    _, repeats, hashes = driver.signatures(welded.types, welded.offsets, welded.connectivity, IS_SOLID, welded.n_points)
    matches = duplicates(welded, hashes)
    return matches[IS_SOLID[mesh.types[matches]] & ~repeats[matches]]


def _same(rows: Ids) -> NDArray[np.bool_]:
    """Whether each row but the first is as the one before it."""
    return np.asarray((rows[1:] == rows[:-1]).reshape(len(rows) - 1, -1).all(axis=1))
