"""The verdict: what it says, and that it never says all is good when it is not known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_up import summary_of

from meshgauge.quality.summary import summarise
from meshgauge.report.verdict import verdict
from meshgauge.status import Purpose, Status

NAN = np.nan


@pytest.mark.parametrize(
    ("cells", "level", "text"),
    [
        (
            {"hexahedron": [-0.1] * 9 + [0.5] * 399},
            "bad",
            "9 of 408 cells are inverted: the mesh is not usable as it is",
        ),
        ({"tetra": [-0.1, 0.5]}, "bad", "1 of 2 cells is inverted: the mesh is not usable as it is"),
        ({"tetra": [-0.1]}, "bad", "the one cell is inverted: the mesh is not usable as it is"),
        ({"tetra": [0.0, 0.5]}, "bad", "1 of 2 cells is degenerate: the mesh is not usable as it is"),
        (
            {"tetra": [-0.1, -0.2, 0.0, 0.5]},
            "bad",
            "2 of 4 cells are inverted and 1 is degenerate: the mesh is not usable as it is",
        ),
        ({"tetra": [0.1, 0.19] + [0.5] * 1620}, "poor", "all 1,622 measured cells are valid; 2 are poor (< 0.2)"),
        ({"tetra": [0.2, 0.5]}, "good", "all 2 measured cells are valid; none is poor (< 0.2)"),
        ({"tetra": [0.7]}, "good", "the one cell is valid; none is poor (< 0.2)"),
        ({"tetra10": [0.7, 0.8]}, "good", "all 2 measured cells are valid; none is poor (< 0.2)"),
        ({"hexa_prism": [0.7, 0.8]}, "good", "all 2 measured cells are valid; none is poor (< 0.2)"),
        (
            {"tetra": [0.5, NAN]},
            "unknown",
            "1 cell could not be measured (1 tetra: a coordinate is NaN or infinite); "
            "the 1 measured cell is valid; none is poor (< 0.2)",
        ),
        ({}, "nothing", "nothing measured: the mesh has no solid cells"),
        ({"quad": [NAN]}, "nothing", "nothing measured: the mesh has no solid cells"),
        (
            {"tetra": [NAN]},
            "nothing",
            "nothing measured: 1 cell could not be measured (1 tetra: a coordinate is NaN or infinite)",
        ),
    ],
)
def test_sentences(cells: dict[str, list[float]], level: str, text: str) -> None:
    assert verdict(summary_of(**cells)) == (level, text)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.one_of(st.floats(-1, 1), st.just(NAN), st.just(0.0)), min_size=1, max_size=8))
def test_good_means_measured_and_good(values: list[float]) -> None:
    level, text = verdict(summary_of(tetra=values))
    assert (level == "good") == all(v >= 0.2 for v in values)
    assert ("could not be measured" in text) == any(np.isnan(values))


def test_surfaces_do_not_spoil_a_good_mesh() -> None:
    assert verdict(summary_of(tetra=[0.5], quad=[NAN])).level == "good"


@pytest.mark.parametrize(
    ("purpose", "statuses", "level", "text"),
    [
        ("fem", [Status.CONCAVE, Status.CONCAVE, Status.OK], "bad", "2 of 3 cells are concave but star-shaped: usable"),
        ("fv", [Status.CONCAVE, Status.CONCAVE, Status.OK], "poor", "2 of 3 cells are concave but star-shaped: usable"),
        (
            "fem",
            [Status.CONCAVE, Status.INVERTED, Status.OK],
            "bad",
            "1 of 3 cells is inverted and 1 is concave but star-shaped: the mesh is not usable as it is",
        ),
        (
            "fem",
            [Status.INVERTED_INSIDE, Status.INVERTED, Status.OK],
            "bad",
            "2 of 3 cells are inverted (1 of them inside, between good corners): the mesh is not usable as it is",
        ),
    ],
)
def test_concave_cells_are_not_called_inverted(purpose: Purpose, statuses: list[Status], level: str, text: str) -> None:
    values = np.where(np.isin(statuses, [Status.OK, Status.INVERTED_INSIDE]), 0.5, -0.5)
    summary = summarise(values, np.array(statuses, np.uint8), np.full(3, 42, np.uint8), purpose=purpose)
    found = verdict(summary)
    assert found.level == level
    assert found.text.startswith(text)
