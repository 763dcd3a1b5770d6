"""Cells that are there twice."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..mesh import Mesh

Groups = list[NDArray[np.int64]]


def duplicates(mesh: Mesh, hashes: NDArray[np.int64]) -> Groups:
    """Cells of one type with the same points, whatever their order: ids of each such group, ascending.

    ``hashes`` are those of `kernels.scan.cells`; each suspicion is verified.
    """
    ordered = np.sort(hashes)
    twice = np.unique(ordered[1:][ordered[1:] == ordered[:-1]])
    del ordered
    if len(twice) == 0:
        return []
    suspects = np.flatnonzero(np.isin(hashes, twice))
    suspects = suspects[np.argsort(hashes[suspects], kind="stable")]
    bounds = np.flatnonzero(np.diff(hashes[suspects])) + 1
    groups: Groups = []
    for group in np.split(suspects, bounds):
        by_points: dict[tuple[int, bytes], list[int]] = {}
        for cell in group.tolist():
            key = (int(mesh.types[cell]), np.sort(mesh.nodes(cell)).tobytes())
            by_points.setdefault(key, []).append(cell)
        groups.extend(np.array(ids) for ids in by_points.values() if len(ids) > 1)
    return sorted(groups, key=lambda ids: int(ids[0]))
