"""Reports made by hand: no file is read, nothing is measured."""

from __future__ import annotations

import numpy as np

from meshgauge.cells import BY_NAME
from meshgauge.quality.summary import Summary, summarise
from meshgauge.quality.worst import WorstCell
from meshgauge.report import FileReport


def summary_of(metric: str = "jens", **values: list[float]) -> Summary:
    """A summary of cells of these types and values; NaN is a cell with a NaN coordinate, or not solid.
    Of lagrange_pyramid only the corners are known."""
    v = np.concatenate([np.asarray(x, float) for x in values.values()]) if values else np.empty(0)
    types = np.repeat(np.array([BY_NAME[t].vtk_id for t in values], np.uint8), [len(x) for x in values.values()])
    flat = np.isin(types, [BY_NAME["quad"].vtk_id])
    curved = np.isin(types, [BY_NAME["lagrange_pyramid"].vtk_id])
    status = np.select([flat, np.isnan(v), v < 0, v == 0, curved], [5, 3, 1, 2, 8], 0).astype(np.uint8)
    return summarise(v, status, types, metric)


def report_of(path: str = "a.vtu", *, worst: int = 0, **values: list[float]) -> FileReport:
    """A report on such cells."""
    summary = summary_of(**values)
    cells = tuple(WorstCell(c, "tetra", -0.5, "inverted", 2, -0.625, 7, (1.5, -2e-7, 3e8)) for c in range(worst))
    return FileReport(path, 10, summary.n_cells, summary, cells)
