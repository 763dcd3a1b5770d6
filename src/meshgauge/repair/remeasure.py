"""Measuring anew only what has changed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..kernels.arrays import read_only
from ..kernels.repair.corners import at_marked
from ..mesh import Mesh
from ..mesh.polyhedra import ragged_positions
from ..quality.measure import JENS, Quality, measure
from .constraints import Mask
from .problem import Ids, Points

LARGE = 0.5
"""Share of all cells from which on all are taken."""


def remeasured(quality: Quality, points: Points, *, threads: int | None) -> Quality:
    """The quality of the mesh with its points elsewhere, from that of the mesh as it is.

    Collapsed bricks are taken for what they were measured as already.
    """
    mesh = quality.mesh
    moved = mesh.replace(points=points)
    if mesh.polyhedra is None:
        changed = np.zeros(mesh.n_points, bool)
        changed[np.flatnonzero((points != mesh.points).reshape(-1)) // 3] = True
        cells = cells_at(mesh, changed)
        if len(cells) <= LARGE * mesh.n_cells:
            if not len(cells):
                return replace(quality, mesh=moved, collapsed_from=None)
            return merged(quality, moved, cells, measured_alike(quality, moved[cells], threads=threads))
    return measured_alike(quality, moved, threads=threads)


def measured_alike(quality: Quality, mesh: Mesh, *, threads: int | None, keep_bricks: bool = True) -> Quality:
    """Another mesh measured as one was: by the same metrics, and what is poor below the same limits."""
    rows = [quality.rows[name] for name in quality.metrics if name != JENS]
    return measure(mesh, metrics=rows, threads=threads, keep_bricks=keep_bricks, poor_below=quality.poor_below)


def merged(whole: Quality, mesh: Mesh, cells: Ids, part: Quality) -> Quality:
    """The quality of a mesh of which some cells were measured anew, beside what was measured of all."""
    status = whole.status.copy()
    status[cells] = part.status
    metrics = {name: values.copy() for name, values in whole.metrics.items()}
    for name, values in metrics.items():
        values[cells] = part.metrics[name]
    metrics = {name: read_only(values) for name, values in metrics.items()}
    return replace(
        whole, mesh=mesh, values=metrics[JENS], status=read_only(status), metrics=metrics, collapsed_from=None
    )


def nodes_of(mesh: Mesh, cells: Ids) -> Ids:
    """Points of some cells, as often as they are named."""
    starts = np.asarray(mesh.offsets[cells], np.int64)
    nodes: Ids = mesh.connectivity[ragged_positions(starts, np.asarray(mesh.offsets[cells + 1], np.int64) - starts)]
    return nodes


def cells_at(mesh: Mesh, points: Mask) -> Ids:
    """Cells that have one of some points."""
    is_at = np.zeros(mesh.n_cells, bool)
    at_marked(read_only(mesh.offsets), read_only(mesh.connectivity), points, is_at)
    return np.flatnonzero(is_at)
