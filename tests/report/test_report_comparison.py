"""Which mesh is better, and in what."""

from __future__ import annotations

import numpy as np
from made_up import report_of

from meshgauge.report.comparison import comparison_dict, sentence
from meshgauge.report.record import short_names


def test_one_is_better_in_some_the_other_in_the_rest() -> None:
    a = report_of("a.vtu", tetra=[0.1, 0.9, 0.9, 0.9])
    b = report_of("b.vtu", tetra=[0.3, 0.4, 0.4, 0.4])
    assert sentence([a, b]) == (
        "b.vtu is better in min (0.300 against 0.100), 1 % (0.303 against 0.124) and share of cells not good "
        "(0 % against 25 %); a.vtu is better in mean (0.700 against 0.375)."
    )


def test_equal_meshes_are_equal() -> None:
    a, b = (report_of(name, tetra=[0.5]) for name in ("a.vtu", "b.vtu"))
    assert sentence([a, b]) == (
        "both are equal in min (0.500), 1 % (0.500), mean (0.500) and share of cells not good (0 %)."
    )


def test_of_three_the_best_are_named() -> None:
    reports = [report_of(f"{n}.vtu", tetra=[q, 0.9]) for n, q in (("a", 0.1), ("b", 0.5), ("c", 0.5))]
    assert sentence(reports).startswith("b.vtu and c.vtu are best in min (0.500)")
    best = comparison_dict(reports)
    assert best is not None
    assert best["best"]["min"] == ["b.vtu", "c.vtu"]


def test_many_that_are_equal_are_counted() -> None:
    reports = [report_of(f"{n}.vtu", tetra=[0.5]) for n in range(9)] + [report_of("z.vtu", tetra=[0.1])]
    assert sentence(reports).startswith("9 of the 10 files share the best min (0.500)")


def test_a_mesh_in_which_nothing_was_measured_is_not_compared() -> None:
    a, none = report_of("a.vtu", tetra=[0.5]), report_of("b.vtu", quad=[np.nan])
    assert comparison_dict([a, none]) is None
    assert sentence([a, none]) == ""


def test_short_names_tell_paths_apart() -> None:
    assert short_names(["x/a.vtu", "x/b.vtu"]) == ["a.vtu", "b.vtu"]
    assert short_names(["x/1/a.vtu", "x/2/a.vtu"]) == ["1/a.vtu", "2/a.vtu"]
    assert short_names(["/a.vtu", "a.vtu"]) == ["/a.vtu", "a.vtu"]
    assert short_names([]) == []
