"""The histogram beside the scene: how many of the cells that pass the other filters have which quality."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..quality.summary.unlike import NOT_VALID
from ..status import Category, category
from .model import Model

PER_UNIT = 20
EDGES = np.arange(-PER_UNIT, PER_UNIT + 1) / PER_UNIT
"""Edges of the bins: decimals correctly rounded, so that 0 and the end of what is poor are edges exactly."""


LEAST = 0.04
"""Height of a bar of one cell, of 1."""


def histogram(values: NDArray[np.float64]) -> NDArray[np.int64]:
    """``(40,)`` how many values are in each bin; one on an edge is in the bin above, 1 in the last; NaN in none."""
    nearest = np.rint(values * PER_UNIT)
    with np.errstate(invalid="ignore"):
        nearest -= values < nearest / PER_UNIT
    bins = nearest[~np.isnan(nearest)] + PER_UNIT
    counted = np.bincount(np.clip(bins, 0, 2 * PER_UNIT - 1).astype(np.intp), minlength=2 * PER_UNIT)
    return counted.astype(np.int64)


def by_status(model: Model, chosen: NDArray[np.bool_]) -> dict[str, NDArray[np.int64]]:
    """`histogram` of some cells by what they count as: ``invalid``, ``degenerate``, ``undecided`` and ``valid``."""
    categories, values = category(model.status_ids, model.mesh.purpose), model.values
    return {one.name.lower(): histogram(values[chosen & (categories == one)]) for one in (*NOT_VALID, Category.VALID)}


def bars(counts: NDArray[np.int64]) -> list[float]:
    """Heights, 0 to 1, that grow as the square root: one bad cell among a million good ones must not vanish."""
    top = max(int(counts.max(initial=0)), 1)
    return [max(float(np.sqrt(n / top)), LEAST) if n else 0.0 for n in counts]
