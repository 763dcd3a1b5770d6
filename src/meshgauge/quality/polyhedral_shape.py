"""`shape` of polyhedra: the mean ratio of their corners against those of the ideal cell."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..kernels.arrays import read_only
from ..kernels.polyhedra import codes, driver
from ..kernels.polyhedra.driver import Links
from .metrics.inputs import PolyhedralCells
from .polyhedra import solids_table
from .polyhedral_corners import links_left
from .reference import corner_cosines

Values = NDArray[np.float64]

_TINY = float(np.finfo(np.float64).smallest_subnormal)


def shape_of_polyhedra(cells: PolyhedralCells) -> Values:
    """``(n_cells,)`` the fold of the mean ratios of a polyhedron's corners, hanging nodes left out. [-1, 1]

    A corner of three edges has one triple, one of more has those that follow one another, as for J_ENS. The ideal
    corner is that of the solid or the model that gave the corner's constant. Of edges D and ideal unit edges W:
    M = D W⁻¹, sign(det M) 3 \\|det M\\|^(2/3) / \\|M\\|². The sign is the exact one of the corner.
    """
    quality = cells.quality
    out = np.full(cells.n_cells, np.nan)
    some = np.flatnonzero(~np.isnan(quality.values))
    if len(some) == 0:
        return out
    of_nodes = np.repeat(~np.isnan(quality.values), np.diff(quality.node_offsets))
    hangs, signs = np.asarray(quality.node_is_hanging)[of_nodes], quality.node_scaled_jacobian[of_nodes]
    points = read_only(np.asarray(cells.points, np.float64))
    n_nodes = np.diff(quality.node_offsets)[some]
    links = links_left(points, cells.polyhedra, quality.cells[some], hangs, n_nodes, cells.beyond)
    nodes = np.flatnonzero(~hangs)
    ratios = np.zeros(len(nodes))
    is_corner = links.valences[nodes] >= 3
    ratios[is_corner] = _of_corners(links, nodes[is_corner])
    signed = np.copysign(np.maximum(np.abs(ratios), _TINY), signs[nodes])
    signed[signs[nodes] == 0.0] = 0.0
    starts = np.searchsorted(links.cells[nodes], np.arange(len(some)))
    out[some] = driver.fold(signed, starts) + 0.0
    return out


def _of_corners(links: Links, nodes: NDArray[np.int64]) -> Values:
    """``(n,)`` the fold of the mean ratios of the triples of nodes of three and more edges."""
    sides, diagonals = _ideal_cosines(links)
    corners, first = driver.triples(links, nodes)
    sizes = np.diff(first, append=len(corners))
    of_node = np.repeat(nodes, sizes)
    start, valence = links.starts[of_node], links.valences[of_node]
    turn = np.arange(len(corners)) - np.repeat(first, sizes)
    dart = start + turn
    a, b, c = sides[dart], diagonals[dart], sides[start + (turn + 1) % valence]
    x = 0.25 * links.points[corners]  # differences of the largest doubles stay finite
    edges = x[:, 1:] - x[:, :1]
    with np.errstate(all="ignore"):
        largest = np.abs(edges).max(axis=(1, 2))
        d = (edges / np.where(largest > 0.0, largest, 1.0)[:, None, None]).transpose(1, 0, 2)
        dot = {(i, j): (d[i] * d[j]).sum(axis=1) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))}
        det = (d[0] * np.cross(d[1], d[2])).sum(axis=1)
        # |D W⁻¹|² by the inverse of WᵀW = [[1, a, b], [a, 1, c], [b, c, 1]].
        gram = 1.0 + 2.0 * a * b * c - a * a - b * b - c * c
        square = (1.0 - c * c) * dot[0, 0] + (1.0 - b * b) * dot[1, 1] + (1.0 - a * a) * dot[2, 2]
        square += 2.0 * ((b * c - a) * dot[0, 1] + (a * c - b) * dot[0, 2] + (a * b - c) * dot[1, 2])
        ratio = np.minimum(3.0 * np.cbrt(det * det / gram) * gram / square, 1.0)
    is_zero = (edges == 0.0).all(axis=2).any(axis=1)
    return driver.fold(np.where(is_zero, 0.0, np.copysign(ratio, det)), first)


def _ideal_cosines(links: Links) -> tuple[Values, Values]:
    """For each dart the cosines of the ideal angles to the next dart around its node, and to the next but one."""
    diagonals = np.full(len(links.nodes), np.nan)
    which = driver.match(links, solids_table(), np.empty(len(links.node_ids)), diagonals)[links.cells]
    angles = np.pi * (links.sizes - 2.0) / links.sizes
    sides = np.cos(angles)
    known = (links.is_hanging == 0) & (links.valences >= 3)
    cell_sizes = np.bincount(
        links.cells[(links.is_hanging == 0) & (links.valences > 0)], minlength=len(links.node_counts)
    )
    for valence in np.unique(links.valences[known]).tolist():
        at = np.flatnonzero(known & (links.valences == valence))
        modelled, regular = at[which[at] == codes.NO_SOLID], at[which[at] != codes.NO_SOLID]
        darts = links.starts[modelled][:, None] + np.arange(valence)
        forms, inverse = np.unique(
            np.column_stack([links.sizes[darts], cell_sizes[links.cells[modelled]]]), axis=0, return_inverse=True
        )
        found = corner_cosines(forms[:, :-1], forms[:, -1])
        sides[darts], diagonals[darts] = (of_forms[inverse.reshape(-1)] for of_forms in found)
        darts = links.starts[regular][:, None] + np.arange(valence)
        if valence == 3:
            diagonals[darts] = np.roll(sides[darts], -2, axis=1)
        elif valence == 4:
            darts = darts[which[regular] == codes.ANTIPRISM]
            diagonals[darts] = _antiprism_diagonal(links.sizes[darts].max(axis=1))[:, None]
    return sides, diagonals


def _antiprism_diagonal(n: NDArray[np.int64]) -> Values:
    """Cosine of the angle between an edge at a corner of an antiprism over n-gons and the next but one: by the length
    of the line that closes them, from ring to ring over three half sides."""
    half = np.pi / np.maximum(n, 3)
    height = np.sqrt(0.75 - (0.5 * np.tan(0.5 * half)) ** 2)
    across = np.sin(1.5 * half) / np.sin(half)
    return np.asarray(1.0 - 0.5 * (across * across + height * height))
