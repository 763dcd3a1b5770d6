"""The numbers of the page of a repair."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np

from meshgauge.repair.page_progress import progress_chart
from meshgauge.repair.page_report import Moment, history
from meshgauge.report.html.charts import WIDTH


def test_phases_that_follow_on_themselves_are_one() -> None:
    seconds = {0.0: "start", 1.0: "untangle", 2.0: "untangle", 3.0: "worst", 4.0: "untangle"}
    moments = [Moment(at, 0.1 * at, float("nan"), phase) for at, phase in seconds.items()]
    chart = progress_chart(moments)
    assert chart is not None
    quarter = WIDTH / 4
    assert chart.phases == [
        (0.0, 2 * quarter, "untangle"),
        (2 * quarter, quarter, "worst"),
        (3 * quarter, quarter, "untangle"),
    ]
    assert chart.mean == ""


def test_moments_are_entries_that_have_a_time_and_a_worst_quality() -> None:
    rows = [
        {"phase": "start", "seconds": 0.0, "worst": -0.5, "mean": 0.5},
        {"seconds": "late", "worst": 0.1},
        {"seconds": 1.0, "worst": None},
        {"seconds": 2.0, "worst": 0.25},
    ]
    first = Moment(0.0, -0.5, 0.5, "start")
    moments = history(rows)
    assert moments[0] == first
    assert [(moment.seconds, moment.worst, moment.phase) for moment in moments[1:]] == [(2.0, 0.25, "")]
    assert math.isnan(moments[1].mean)
    assert history([SimpleNamespace(**rows[0])]) == [first]
    columns = {"phase": ["start", "x"], "seconds": [0.0, 9.0], "worst": np.array([-0.5, 1.0]), "mean": [0.5]}
    assert history(columns) == [first]
    assert history("seconds") == history(None) == []
