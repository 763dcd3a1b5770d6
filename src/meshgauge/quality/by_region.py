"""What a metric says of each region of a mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..mesh.interface import is_interface
from ..mesh.regions import regions
from .measure import Quality
from .summary import Summary, summarise

JENS = "jens"


def by_region(quality: Quality) -> tuple[NDArray[np.int64], tuple[tuple[str, Summary], ...]]:
    """The region of each cell ``(n_cells,)``, and name and J_ENS of each region, in the order of the file."""
    ids, names = regions(quality.mesh)
    types, purpose = quality.mesh.types, quality.mesh.purpose
    if len(names) == 1:
        return ids, ((names[0], quality.summary()),)
    interface = is_interface(quality.mesh)
    order = np.argsort(ids, kind="stable")
    bounds = np.searchsorted(ids[order], np.arange(len(names) + 1))
    by_name = []
    for n, name in enumerate(names):
        cells = order[bounds[n] : bounds[n + 1]]
        cells = cells if interface is None else cells[~interface[cells]]
        summary = summarise(
            quality.values[cells], quality.status[cells], types[cells], quality.rows[JENS], purpose=purpose
        )
        by_name.append((name, summary))
    return ids, tuple(by_name)
