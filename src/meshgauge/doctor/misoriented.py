"""Cells that a solver would take the wrong way round: a face points inward, or the numbering is reversed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..mesh.ghosts import without_ghosts
from ..quality.measure import Quality
from ..status import Status
from .inward import inward
from .orientation import orientation


def misoriented(quality: Quality) -> NDArray[np.bool_]:
    """``(n_cells,)`` True for a polyhedron of which a face points inward, and for a cell that is numbered in reverse.

    Parameters
    ----------
    quality
        Of the mesh; a cell that is numbered in reverse is inverted, so that faces are matched only if one is.
    """
    mesh = without_ghosts(quality.mesh)
    wrong = np.zeros(mesh.n_cells, np.bool_)
    cells = inward(mesh).cells
    wrong[cells[cells >= 0]] = True
    if (quality.status == Status.INVERTED).any():
        wrong[orientation(replace(quality, mesh=mesh)).reversed_cells] = True
    return wrong
