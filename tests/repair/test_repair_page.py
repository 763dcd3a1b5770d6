"""The numbers of the page of a repair."""

from __future__ import annotations

from meshgauge.repair.page_progress import progress_chart
from meshgauge.repair.page_report import Moment
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
