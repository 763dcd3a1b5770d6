"""Are surface cells in a plane of constant z, and which way do they run about?"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import path
from ..threads import run

Ids = NDArray[np.int64]
Look = tuple[float, float, float]
"""Least and greatest z of cells, infinite where none is finite, and twice their area as seen from +z."""


def side(
    points: NDArray[np.floating], parts: Iterable[Callable[[], Ids]], n_cells: int, known: Side | None = None
) -> int:
    """1, -1 if all corners that are finite have one z: the side from which the area is positive together; else 0.

    Parameters
    ----------
    points
        ``(n_points, 3)``, C-contiguous.
    parts
        Each gives the corners ``(n, n_corners)`` of some cells, C-contiguous, all of one type.
    n_cells
        Cells together, which decides whether kernels are taken.
    known
        What is known of other cells of the mesh; these are added.
    """
    look: Callable[..., Look] = _look
    if path.is_compiled(n_cells):
        from .plane_kernel import look
    group = 1  # the first part alone: of a mesh in space it says enough
    known = Side() if known is None else known
    rest = list(parts)
    while rest and not known.is_in_space:
        now, rest, group = rest[:group], rest[group:], 64
        for seen in run(lambda part: look(points.reshape(-1), part()), now):
            known.take(*seen)
    return known.side


class Side:
    """What is known of cells that were looked at."""

    def __init__(self) -> None:
        self.z, self.twice, self.is_in_space = np.nan, 0.0, False

    def take(self, low: float, high: float, area: float) -> None:
        """Look at more of them."""
        if low > high:
            return
        self.z = low if np.isnan(self.z) else self.z
        self.is_in_space = self.is_in_space or low != self.z or high != self.z
        self.twice += area

    @property
    def side(self) -> int:
        """See `side`."""
        return 0 if self.is_in_space or np.isnan(self.z) else -1 if self.twice < 0.0 else 1


def _look(points: NDArray[np.floating], ids: Ids) -> Look:
    x: Any = np.asarray(points.reshape(-1, 3)[ids], np.float64)
    z = x[:, :, 2][np.isfinite(x[:, :, 2])]
    with np.errstate(all="ignore"):
        edges = x[:, 1:, :2] - x[:, :1, :2]
        areas = edges[:, :-1, 0] * edges[:, 1:, 1] - edges[:, :-1, 1] * edges[:, 1:, 0]
    return float(z.min(initial=np.inf)), float(z.max(initial=-np.inf)), float(areas[np.isfinite(areas)].sum())
