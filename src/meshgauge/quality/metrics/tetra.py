"""Aspect ratio gamma of tetrahedra, signed, and its inverse: formula and rows."""

from __future__ import annotations

from functools import reduce

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .inputs import Cells
from .jacobian import REPORT
from .row import Metric

_REFERENCE = (
    f"{REPORT}, section 3; V. N. Parthasarathy, C. M. Graichen, A. F. Hathaway, Finite Elem. Anal. Des. 15 (1994) "
    "255-261, https://doi.org/10.1016/0168-874X(94)90033-7"
)

CHUNK = 1 << 14
"""Cells at a time: the temporaries then stay in the processor's cache."""

_TINY = float(np.finfo(np.float64).smallest_subnormal)
_EDGES = ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3))


def scaled_aspect_ratio_gamma(
    points: NDArray[np.floating], connectivity: NDArray[np.signedinteger], signs: ArrayLike | None = None
) -> NDArray[np.float64]:
    """ARG_S = 12 V / (√2 R³), R² the mean squared edge, V the signed volume.

    Parameters
    ----------
    points
        ``(n_points, 3)``; any unit, from 1e-200 to 1e300.
    connectivity
        ``(n_cells, 4)``, ids in range.
    signs
        ``(n_cells,)`` exact signs of the volumes, -1, 0 or 1, if they are known. Without them the sign of a cell that
        is flat to rounding (\\|ARG_S\\| < 1e-15) is that of the rounded volume.

    Returns
    -------
    NDArray[np.float64]
        ``(n_cells,)`` in [-1, 1], higher is better; 0 if the cell is flat, also if all its points are one; NaN if a
        coordinate is NaN or infinite.
    """
    cells = np.asarray(connectivity)
    known = None if signs is None else np.asarray(signs, np.int8)
    values = np.empty(len(cells), np.float64)
    for start in range(0, len(cells), CHUNK):
        here = slice(start, start + CHUNK)
        values[here] = _chunk(np.asarray(points[cells[here]], np.float64), None if known is None else known[here])
    return values


def aspect_ratio_gamma(
    points: NDArray[np.floating], connectivity: NDArray[np.signedinteger], signs: ArrayLike | None = None
) -> NDArray[np.float64]:
    """ARG = √2 R³ / (12 V): the inverse of `scaled_aspect_ratio_gamma`, which see; lower is better.

    Returns
    -------
    NDArray[np.float64]
        ``(n_cells,)``, \\|ARG\\| >= 1, negative if inverted; +inf if the cell is flat; NaN if a coordinate is NaN or
        infinite.
    """
    with np.errstate(divide="ignore", over="ignore"):
        return 1.0 / scaled_aspect_ratio_gamma(points, connectivity, signs)


def _chunk(x: NDArray[np.float64], signs: NDArray[np.integer] | None) -> NDArray[np.float64]:
    finite = np.asarray(np.isfinite(x).all(axis=(1, 2)))
    x = np.where(finite[:, None, None], x, 0.0)
    # First the coordinates, so that no difference overflows, then the edges, so that no product under- or overflows.
    # Powers of two: neither step rounds.
    x = np.moveaxis(_scale_to_unit(x), 0, -1)
    edges = np.stack([x[b] - x[a] for a, b in _EDGES])
    edges = np.moveaxis(_scale_to_unit(np.moveaxis(edges, -1, 0)), 0, -1)
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = edges[:3]
    volume = (ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)) / 6.0
    # One after another: `sum` adds the squares of a cell that is alone in another order.
    cube = (reduce(np.add, (edges * edges).reshape(18, -1)) / 6.0) ** 1.5
    cube[cube == 0.0] = 1.0
    values: NDArray[np.float64] = np.clip(12.0 / np.sqrt(2.0) * volume / cube, -1.0, 1.0)
    if signs is not None:
        values = np.asarray(signs * np.maximum(np.abs(values), _TINY), np.float64)
    values += 0.0  # no -0.0
    values[~finite] = np.nan
    return values


def _scale_to_unit(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Each cell ``x[c]`` times the power of two that brings its largest component into [1/2, 1)."""
    _, exponent = np.frexp(np.abs(x).max(axis=(1, 2)))
    scaled: NDArray[np.float64] = np.ldexp(x, -exponent[:, None, None])
    return scaled


def _scaled_aspect_ratio_gamma(cells: Cells) -> NDArray[np.float64]:
    return scaled_aspect_ratio_gamma(cells.points, cells.corners, cells.signs())


def _aspect_ratio_gamma(cells: Cells) -> NDArray[np.float64]:
    return aspect_ratio_gamma(cells.points, cells.corners, cells.signs())


ASPECT_RATIO_GAMMA = Metric(
    name="aspect_ratio_gamma",
    values=_aspect_ratio_gamma,
    is_signed=True,
    title="ARG, aspect ratio gamma",
    text="Cube of the root mean square edge over the signed volume, 1 for the regular tetrahedron; "
    "below -1 if inverted, infinite if flat.",
    range=(-np.inf, np.inf),
    acceptable=(1.0, 3.0),
    ideal=1.0,
    better="lower",
    source="meshgauge",
    reference=_REFERENCE,
    shapes=("tetra",),
)
SCALED_ASPECT_RATIO_GAMMA = Metric(
    name="scaled_aspect_ratio_gamma",
    values=_scaled_aspect_ratio_gamma,
    is_signed=True,
    title="ARG_S, scaled aspect ratio gamma",
    text="1/ARG: 1 for the regular tetrahedron, 0 if flat, negative if inverted.",
    range=(-1.0, 1.0),
    acceptable=(1.0 / 3.0, 1.0),
    ideal=1.0,
    better="higher",
    source="meshgauge",
    reference=_REFERENCE,
    shapes=("tetra",),
)

ROWS = (ASPECT_RATIO_GAMMA, SCALED_ASPECT_RATIO_GAMMA)
