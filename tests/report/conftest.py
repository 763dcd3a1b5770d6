"""Fixtures of the reports."""

from __future__ import annotations

import numpy as np
import pytest
from made_up import report_of, summary_of

from meshgauge.report import FileReport


@pytest.fixture
def mixed() -> FileReport:
    """Everything at once: all bands, a NaN, a surface, a curved type, another metric, a note."""
    values = {
        "tetra": [0.5, 0.1, -0.25, 0.0, np.nan],
        "quad": [np.nan, np.nan],
        "hexahedron": [1.0, 0.9],
        "lagrange_pyramid": [0.8],
    }
    other = summary_of("aspect_ratio_gamma", tetra=[1.0, 2.0, np.inf], hexahedron=[np.nan])
    one = report_of("dir/mixed.vtu", worst=2, **values)
    return FileReport(one.path, 10, one.n_cells, one.summary, one.worst, (other,), ("a note",))
