"""The language of rules: what it means, and that its errors point at the place."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from meshgauge import METRICS, Mesh, measure
from meshgauge.check import Level, Nothing, NoWorse, Threshold, rule
from meshgauge.check.words import WORDS
from meshgauge.errors import RuleError
from meshgauge.status import STATUSES


@pytest.mark.parametrize(
    ("text", "canonical"),
    [
        ("jens>=0.2@1%", "jens >= 0.2 @ 1%"),
        ("jens ≥ .2 @ 0.5 %", "jens >= .2 @ 0.5%"),
        ("  jens > 0 @ 1 for tetra,wedge ", "jens > 0 @ 1 cell for tetra, wedge"),
        ("aspect_ratio_gamma <= 3 @ 5 cells", "aspect_ratio_gamma <= 3 @ 5 cells"),
        ("jens >= 0.1 in 'boundary layer*', inlet for hexahedron @ 2%", None),
        ("jens > 0 for element 7000", "jens > 0 for element 7000"),
        ("jens > 0 for cells 3 @ 5 cells", "jens > 0 @ 5 cells for cell 3"),
        ("nothing invalid in a for elements 7-9,12 for tetra", "nothing invalid for tetra for elements 7-9, 12 in a"),
        ("nothing invalid", "nothing invalid"),
        ("nothing invalid inside @ 1%", "nothing invalid inside @ 1%"),
        ("nothing non_finite in 3", "nothing non_finite in 3"),
        ("no worse than 2026/base-line.json", "no worse than 2026/base-line.json"),
        ("no worse than 'my base.json' within 1e-3", 'no worse than "my base.json" within 1e-3'),
        ("no worse than C:\\runs\\base.json", "no worse than C:\\runs\\base.json"),
    ],
)
def test_a_rule_says_what_it_was_made_of(text: str, canonical: str | None) -> None:
    said = str(rule(text))
    assert said == (canonical or 'jens >= 0.1 @ 2% for hexahedron in "boundary layer*", inlet')
    assert str(rule(said)) == said
    assert rule(said) == rule(text)


def test_what_is_in_a_rule() -> None:
    found = rule("jens > -0.5 @ 12.5% for tetra in inlet", level="warn")
    assert isinstance(found, Threshold)
    assert (found.metric, found.comparison, found.bound, found.level) == ("jens", ">", -0.5, Level.WARN)
    assert (found.allowance.amount, found.allowance.is_share) == (Fraction(1, 8), True)
    assert (found.scope.types, found.scope.regions) == (("tetra",), ("inlet",))
    nothing = rule("nothing degenerate")
    assert isinstance(nothing, Nothing)
    assert nothing.word is WORDS["degenerate"]
    stored = rule("no worse than base.json within 0.01", folder=Path("up"))
    assert isinstance(stored, NoWorse)
    assert (stored.path, stored.margin) == (Path("up/base.json"), 0.01)


@pytest.mark.parametrize(
    ("text", "at", "reason"),
    [
        ("", "", "a rule is missing"),
        ("jen >= 2", "jen", "did you mean 'jens'?"),
        ("JENS >= 2", "JENS", "did you mean 'jens'?"),
        ("condition > 2", "condition", "did you mean 'verdict_condition'?"),
        ("jens => 2", "=>", "did you mean '>='?"),
        ("jens == 2", "==", "expected >=, >, <= or <"),
        ("jens", "", "expected >=, >, <= or <"),
        ("jens >= x", "x", "expected a number"),
        ("jens >= nan", "nan", "expected a number"),
        ("jens >= 1e999", "1e999", "too large"),
        ("jens >= 0.2 1%", "1", "expected '@ 1%'"),
        ("jens >= 0,2", ",", "expected '@ 1%'"),
        ("jens >= 0.2 @ 0.01", "0.01", "for a share write 1%"),
        ("jens >= 0.2 @ 101%", "101", "at most 100%"),
        ("jens >= 0.2 @ -1%", "-1", "0 or more"),
        ("jens >= 0.2 @ 1% @ 2%", "@", "there twice"),
        ("jens > 0 for elements", "", "expected a number or a range"),
        ("jens > 0 for elements x", "x", "expected a number or a range"),
        ("jens > 0 for elements 9-7", "9-7", "expected a number or a range"),
        ("jens > 0 for cells 1.5", "1.5", "expected a number or a range"),
        ("jens > 0 for cells 1 for elements 2", "for", "there twice"),
        ("jens >= 1 for tetr", "tetr", "did you mean 'tetra'?"),
        ("jens >= 1 for line", "line", "expected the name of a cell type"),
        ("jens >= 1 for tetra,", "", "expected the name of a cell type"),
        ("aspect_ratio_gamma <= 3 for wedge", "wedge", "it is for tetra"),
        ("nothing invald", "invald", "did you mean 'invalid'?"),
        ("nothing", "", "is followed by one of invalid"),
        ("no invalid", "invalid", "write 'nothing invalid'"),
        ("no worse than", "", "expected the file"),
        ("no worse than a.json within -1", "-1", "0 or more"),
        ("no worse than a.json @ 1%", "@", "expected 'within NUMBER'"),
        ("jens >= 0.2 in 'a", "'a", "a quotation mark without its other"),
    ],
)
def test_an_error_points_at_the_place(text: str, at: str, reason: str) -> None:
    with pytest.raises(RuleError, match="rule ") as raised:
        rule(text)
    error = raised.value
    assert reason in error.reason
    assert text[error.start : error.stop] == at
    line, carets = error.pointed.split("\n")
    assert line == text
    assert carets == " " * error.start + "^" * max(len(at), 1)


@given(st.text(alphabet=" jens>=<0.2%@,'\"fornothigvald≥", max_size=30))
def test_any_text_is_a_rule_or_an_error_with_a_place(text: str) -> None:
    try:
        found = rule(text)
    except RuleError as error:
        place = error.start, error.stop
    else:
        assert rule(str(found)) == found
        return
    assert 0 <= place[0] <= place[1] <= len(text)


@given(st.integers(0, 10**9), st.integers(0, 10_000))
def test_a_share_is_exact(n_cells: int, basis_points: int) -> None:
    found = rule(f"jens > 0 @ {basis_points / 100:.2f}%")
    assert isinstance(found, Threshold)
    assert found.allowance.cells(n_cells) == n_cells * basis_points // 10_000


def test_every_metric_and_every_bad_status_can_be_asked_for() -> None:
    for name in METRICS:
        assert str(rule(f"{name} > 0.5")) == f"{name} > 0.5"
    codes = np.array(sorted(STATUSES), np.uint8)
    mesh = Mesh.from_arrays(np.zeros((1, 3)), [("vertex", np.zeros((len(codes), 1), int))])
    quality = replace(measure(mesh), status=codes)
    asked = np.logical_or.reduce([word.mask(quality) for name, word in WORDS.items() if name != "poor"])
    assert {STATUSES[status].name for status in codes[~asked].tolist()} == {"ok", "not_solid", "not_surface", "ghost"}
    for row in STATUSES.values():
        if row.name in WORDS and row.name != "degenerate":
            assert codes[WORDS[row.name].mask(quality)].tolist() == [row.status]
