"""``meshgauge metrics``: every row is listed with what a user needs to choose."""

from __future__ import annotations

import pytest

from meshgauge.cli.main import main
from meshgauge.quality.metrics import METRICS


def test_every_metric_is_listed_with_its_reference(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["metrics"]) == 0
    out = capsys.readouterr().out
    lines = {line.split()[0]: line for line in out.splitlines() if line.strip()}
    for name, row in METRICS.items():
        assert f"{row.range[0]:.4g} to {row.range[1]:.4g}" in lines[name]
        assert row.better in lines[name]
        assert " ".join(row.reference.split()) in " ".join(out.split())


@pytest.mark.parametrize("name", METRICS)
def test_one_metric_is_shown_in_full(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["metrics", name]) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert METRICS[name].text in out
    assert METRICS[name].reference in out


def test_an_unknown_metric_is_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["metrics", "beauty"]) == 2
    assert capsys.readouterr().err.startswith("meshgauge: error: no metric 'beauty'")
