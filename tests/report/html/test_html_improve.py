"""The page of an improvement: what changed, and a report shown whatever it holds."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from html_pages import BRACKET, EVIL, ROOT, grid, unpacked

import meshgauge
from meshgauge.repair.page import change, improve_page, improve_section
from meshgauge.repair.page_report import history, tree
from meshgauge.repair.page_words import WORDS
from meshgauge.repair.report import CellChanges, LimitedCell, WorsenedCell
from meshgauge.report import html

HISTORY = [
    {
        "seconds": 0.1 * n,
        "worst": -0.06 + 0.005 * n,
        "mean": 0.6 + 0.001 * n,
        "phase": "untangle" if n < 20 else "smooth",
    }
    for n in range(60)
]
REPORT = {
    "stopped": "",
    "strict": False,
    "verdict": "Three cells were repaired.",
    "claims": [{"name": "valid", "holds": True, "text": "no cell is invalid"}, {"name": "strict", "holds": False}],
    "history": HISTORY,
    "before": {"all": "not shown twice"},
    "displacement": {"max": 0.0012345, "cells": np.arange(100)},
    "remaining": [{"cell": 390, "why": "all points of a corner are fixed"}, {"cell": 7, "why": EVIL}],
}


@pytest.fixture(scope="module")
def states() -> tuple[meshgauge.Quality, meshgauge.Quality]:
    """The bracket with its three inverted cells, and as it was before they were made."""
    good = BRACKET.replace("bracket", "bracket_good")
    before, after = (meshgauge.measure(meshgauge.read(ROOT / name)) for name in (BRACKET, good))
    return before, after


@pytest.fixture(scope="module")
def text(states: tuple[meshgauge.Quality, meshgauge.Quality]) -> str:
    return improve_page(REPORT, *states)


def test_numbers_before_and_after_are_shown(text: str, states: tuple[meshgauge.Quality, meshgauge.Quality]) -> None:
    was, now = (state.summary() for state in states)
    plain = re.sub(r"\s+", " ", unescape(re.sub("<[^>]*>", " ", text)))
    for name, tally in now.types.items():
        assert f"{was.types[name].min:.3f} → {tally.min:.3f}" in plain
    assert "Before: 3 of 6,192 cells are inverted" in plain
    assert "poor, below 0.2" in plain
    assert "poor_below" not in text
    counted = change(*states)
    assert counted.n_better + counted.n_same + counted.n_worse == 6192
    assert f"{counted.n_better:,} cells better" in plain
    assert counted.n_moved == int((states[0].mesh.points != states[1].mesh.points).any(axis=1).sum())
    assert f"{counted.n_moved} of 2,754 points moved" in plain


def test_the_report_is_shown_whatever_it_holds(text: str) -> None:
    plain = unescape(text)
    for part in ("all points of a corner are fixed", "0.0012345", "… (100 in all)", "<dt>strict</dt><dd>no"):
        assert part in plain
    assert "not shown twice" not in plain
    assert '<p class="lead">Three cells were repaired.</p>' in plain
    checks = re.findall(r"<li><span class=\"level (\w+)\">.*?</span></span>(.*?)</li>", plain)
    assert [(level, text.strip()) for level, text in checks] == [("good", "no cell is invalid"), ("bad", "strict")]
    assert 'data-locate="390"' in text
    assert "<script>alert" not in text
    assert text.count("<polyline") == 2


@pytest.mark.parametrize("report", [{}, None, {"history": "none"}, {"history": [{"seconds": 1}]}, {"a": {1: {2: ()}}}])
def test_a_report_may_say_nothing(report: Any) -> None:
    quality = meshgauge.measure(grid(2))
    text = improve_page(report, quality, quality)
    assert "<polyline" not in text
    assert "0 cells better" in text


@dataclass
class Step:
    """An entry of a history that is no mapping."""

    seconds: float
    worst: float
    phase: str = "start"


def test_a_history_may_have_any_of_three_forms() -> None:
    rows = history(HISTORY)
    columns = history({key: [entry[key] for entry in HISTORY] for key in HISTORY[0]})
    assert rows == columns
    assert len(rows) == 60
    (one,) = history([Step(1, 0.5), Step(math.nan, 0.5)])
    assert one[:2] == (1, 0.5)
    assert math.isnan(one.mean)


def test_a_record_is_shown_like_a_mapping() -> None:
    assert tree(Step(1.5, 0.25)) == tree({"seconds": 1.5, "worst": 0.25, "phase": "start"})


def test_entries_have_words_for_people() -> None:
    result = meshgauge.improve(grid(2).replace(points=grid(2).points + 0.3 * (np.arange(81).reshape(27, 3) % 2 == 0)))
    facts = result.report.to_dict()
    known = {f"{key}.{name}" for key, value in facts.items() if isinstance(value, dict) for name in value} | set(facts)
    cells = {name for kind in (LimitedCell, WorsenedCell) for name in kind.__dataclass_fields__}
    changes = {f"reconnection.{name}" for name in CellChanges.__dataclass_fields__}
    assert set(WORDS) <= known | cells | changes, "of no entry"
    names = [name for name, _ in tree(facts).parts]
    assert not [name for name in names if name.startswith("n ") or "_" in name]


def test_both_states_are_in_the_page(states: tuple[meshgauge.Quality, meshgauge.Quality]) -> None:
    before, after = states
    arrays = unpacked(improve_section(REPORT, before, after))
    np.testing.assert_array_equal(arrays["valueBefore"], before.values)
    np.testing.assert_array_equal(arrays["value"], after.values)
    moved = (arrays["xyz"] != arrays["xyzBefore"]).reshape(-1, 3).any(axis=1)
    np.testing.assert_array_equal(
        arrays["point"][moved], np.flatnonzero((before.mesh.points != after.mesh.points).any(1))
    )


def test_other_cells_are_refused(states: tuple[meshgauge.Quality, meshgauge.Quality]) -> None:
    with pytest.raises(ValueError, match="different cells"):
        improve_page({}, states[0], meshgauge.measure(grid(2)))


def test_the_picture_shows_either_state(opened: Callable[..., Any], tmp_path: Path, text: str) -> None:
    path = tmp_path / "improved.html"
    html.write(path, text)
    one = opened(path)
    page = one.ready()
    said = "[data-shown]"
    # Nothing is left below the target: about the worst hundredth is shown, not an empty mesh.
    worst = page.inner_text(said)
    assert 20 <= int(worst.split()[1]) <= 200
    size = page.viewport_size
    page.set_viewport_size({"width": 360, "height": 740})
    assert page.evaluate("document.documentElement.scrollWidth") == 360
    page.set_viewport_size(size)
    page.click("[data-state=before]")
    assert page.inner_text(said) == "Shows 39 of 6,192 cells."
    page.click("[data-state=after]")
    assert page.inner_text(said) == worst
    page.locator("[data-of=before] .bar").first.click()
    assert page.inner_text("[data-chip-text]") == "Selected -0.1 to 0: 3 cells: 521, 584, 1743"
    assert page.locator("[data-state=before]").get_attribute("aria-pressed") == "true"
    assert one.complaints == []
