"""The two energies that are descended, as calls on a part of a problem."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..kernels.repair import quality, shape
from .problem import Part, Points, Problem


@dataclass(eq=False)
class ShapeEnergy:
    """How far corners are from ideal ones; see `kernels.repair.shape`.

    Attributes
    ----------
    lengths
        ``(n_corners, 3)`` float32 reference lengths of the edges at each corner.
    epsilon2
        ε², in units of the determinant of the ideal corner; 0 makes the energy infinite at inverted corners.
    """

    problem: Problem
    lengths: NDArray[np.float32]
    epsilon2: float = 0.0

    def __call__(self, points: Points, part: Part, gradient: Points) -> tuple[float, float]:
        p = self.problem
        first, last = int(p.cells[part.first]), int(p.cells[part.last])
        return shape.shape(
            points,
            p.corners,
            p.kinds,
            p.bends,
            self.lengths,
            p.ideals,
            p.counts,
            self.epsilon2,
            first,
            last,
            gradient,
            part.low,
        )


@dataclass(eq=False)
class QualityEnergy:
    """A barrier under the quality of every corner, and the qualities of cells; see `kernels.repair.quality`.

    Attributes
    ----------
    lengths
        As for `ShapeEnergy`.
    thresholds
        ``(n_cells,)`` the value of J_S/k that no corner of the cell may fall to.
    barrier, mean, sharpness, stretch, flat
        The weights β, α, the sharpness of the least corner, γ of the lengths, and ω of faces of polyhedra.
    """

    problem: Problem
    lengths: NDArray[np.float32]
    thresholds: Points
    barrier: float = 1.0
    mean: float = 0.0
    sharpness: float = 20.0
    stretch: float = 1e-3
    flat: float = 1e4

    def __call__(self, points: Points, part: Part, gradient: Points) -> tuple[float, float]:
        p = self.problem
        weights = np.array([self.barrier, self.mean, self.sharpness, self.stretch, self.flat])
        return quality.quality(
            points,
            p.corners,
            p.kinds,
            p.bends,
            self.lengths,
            p.constants,
            p.cells,
            self.thresholds,
            weights,
            p.most_corners,
            part.first,
            part.last,
            gradient,
            part.low,
        )
