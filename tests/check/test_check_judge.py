"""What keeps a rule and what breaks it."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from check_meshes import measured, mesh

import meshgauge
from meshgauge.check import Check, State, check, default_rules, metrics_of, rule
from meshgauge.errors import MetricError

STATES = tuple[State, int, int]


def one(quality: meshgauge.Quality, text: str, **options: int) -> STATES:
    """State of a single rule, cells that break it, cells it is about."""
    (outcome,) = check(quality, [text], **options).outcomes  # type: ignore[arg-type]
    return outcome.state, outcome.n_failing, outcome.n_cells


@pytest.mark.parametrize("text", ["jens >= -1", "jens > -2", "jens <= 1", "jens < 2", "jens <= 1 @ 1%"])
def test_nan_never_passes(text: str) -> None:
    assert one(measured("good", "nan"), text) == (State.FAIL, 1, 2)
    assert one(measured("good", "cube"), text)[0] is State.PASS


def test_what_is_inverted_inside_has_no_good_value() -> None:
    quality = measured("cube", "twisted")
    assert quality.values.min() > 0.9
    for text in ("jens >= 0.2", "jens > 0", "jens >= 0", "nothing invalid", "nothing invalid inside"):
        assert one(quality, text) == (State.FAIL, 1, 2), text
    assert one(quality, "jens >= -0.5")[0] is State.PASS
    (outcome,) = check(quality, ["jens >= 0.2"]).outcomes
    assert outcome.text == "1 of 2 cells is below 0.2 (1 invalid); none is allowed"


def test_an_inverted_cell_has_no_low_aspect_ratio() -> None:
    quality = measured("good", "inverted", "flat", metrics=["aspect_ratio_gamma"])
    assert quality.metrics["aspect_ratio_gamma"][1] < 0
    assert one(quality, "aspect_ratio_gamma <= 3") == (State.FAIL, 2, 3)
    assert one(quality, "aspect_ratio_gamma >= 1 @ 1") == (State.PASS, 1, 3)


def test_words_mean_statuses() -> None:
    quality = measured("good", "low", "flat", "inverted", "nan", "cube", "twisted", "triangle")
    counts = {
        "invalid": 2,
        "invalid inside": 1,
        "degenerate": 1,
        "unmeasured": 1,
        "inverted": 1,
        "inverted_inside": 1,
        "non_finite": 1,
        "undecided": 0,
        "unsupported": 0,
    }
    for word, n in counts.items():
        assert one(quality, f"nothing {word}") == (State.FAIL if n else State.PASS, n, 7), word


def test_a_threshold_counts_as_the_report_does() -> None:
    rng = np.random.default_rng(5)
    n = 400
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]) + rng.uniform(-0.7, 0.7, (n, 4, 3))
    made = meshgauge.Mesh.from_arrays(points.reshape(-1, 3), [("tetra", np.arange(4 * n).reshape(n, 4))])
    quality = meshgauge.measure(made, metrics=["scaled_jacobian", "aspect_ratio_gamma", "verdict_shape"])
    for name, standard in (("jens", 0.2), ("verdict_shape", 0.3)):
        tally = quality.summary(name).all
        assert one(quality, f"{name} >= {standard}") == (State.FAIL, n - tally.n_good, n)
    tally = quality.summary("aspect_ratio_gamma").all
    assert one(quality, "aspect_ratio_gamma <= 3") == (State.FAIL, n - tally.n_good, n)
    bad = int(np.count_nonzero(~(quality.values >= 0.2)))
    assert one(quality, f"jens >= 0.2 @ {bad}")[0] is State.PASS
    assert one(quality, f"jens >= 0.2 @ {bad - 1}")[0] is State.FAIL
    assert one(quality, f"jens >= 0.2 @ {100 * bad / n}%")[0] is State.PASS


def test_types_are_those_of_a_shape_or_one() -> None:
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, 0, 1), (0, 1, 1), (1, 1, 1)]
    voxel = [[0, 1, 2, 4, 3, 5, 6, 7]]
    made = meshgauge.Mesh.from_arrays(
        points, [("voxel", voxel), ("hexahedron", [[0, 1, 4, 2, 3, 5, 7, 6]]), ("tetra", [[0, 1, 2, 3]])]
    )
    quality = meshgauge.measure(made)
    assert one(quality, "jens >= 0.9 for hexahedron") == (State.PASS, 0, 2)
    assert one(quality, "jens >= 0.9 for voxel") == (State.PASS, 0, 1)
    assert one(quality, "jens >= 0.9 for tetra, voxel") == (State.FAIL, 1, 2)
    assert one(quality, "jens >= 0.9 for pyramid") == (State.EMPTY, 0, 0)
    assert check(quality, ["jens >= 0.9 for pyramid"]).state is State.PASS


def test_regions_are_named_or_matched() -> None:
    quality = measured("good", "low", "cube", "inverted", regions=[1, 1, 2, 30])
    assert one(quality, "jens >= 0.2 in 'region 1'") == (State.FAIL, 1, 2)
    assert one(quality, "jens >= 0.2 in 'region 2'") == (State.PASS, 0, 1)
    assert one(quality, "nothing invalid in 'region [12]'") == (State.PASS, 0, 3)
    assert one(quality, "nothing invalid in 'region *' for tetra") == (State.FAIL, 1, 3)
    (outcome,) = check(quality, ["jens >= 0.2 in inlet"]).outcomes
    assert outcome.state is State.UNCHECKED
    assert outcome.text == "the mesh has no region 'inlet'; it has 'region 1', 'region 2', 'region 30'"


def test_a_region_whose_name_looks_like_a_pattern() -> None:
    made = mesh("good", "low")
    zones = (meshgauge.CellBlock("zone [1]", 0, 1), meshgauge.CellBlock("zone 1", 1, 2))
    quality = meshgauge.measure(made.replace(blocks=zones))
    assert one(quality, "jens >= 0.2 in 'zone [1]'") == (State.FAIL, 1, 2)  # the name, and what the pattern matches
    assert one(quality, "jens >= 0.2 in 'zone [[]1]'") == (State.PASS, 0, 1)


def test_a_mesh_without_solid_cells_is_not_checked() -> None:
    found = check(meshgauge.measure(measured("triangle").mesh, dimension=3))
    assert found.state is State.UNCHECKED
    assert not found.is_passed


def test_levels_and_the_rules_where_none_are_given() -> None:
    assert check(measured("good", "cube")).state is State.PASS
    assert check(measured("good", "low")).state is State.WARN
    assert check(measured("good", "low")).is_passed
    for kind in ("inverted", "flat", "nan", "twisted"):
        assert check(measured("good", kind)).state is State.FAIL, kind
    assert [str(r) for r in default_rules()][-1] == "jens >= 0.2 @ 1%"
    both = check(measured("inverted"), [rule("nothing invalid"), rule("jens > 0", level="warn")])
    assert [o.state for o in both.outcomes] == [State.FAIL, State.WARN]


def test_failing_cells_have_their_place_worst_first() -> None:
    quality = measured("cube", "low", "inverted", "nan", "inverted", regions=[4, 5, 6, 7, 8])
    (outcome,) = check(quality, ["jens >= 0.5"], listed=3).outcomes
    assert [cell.cell for cell in outcome.cells] == [3, 2, 4]  # without a value, then equal ones in file order
    assert (outcome.n_failing, outcome.n_more) == (4, 1)
    lost, worst, _ = outcome.cells
    assert (lost.status, lost.node, lost.region) == ("non_finite", 3, "region 7")
    assert math.isnan(lost.value)
    assert lost.point == int(quality.mesh.nodes(3)[3])
    assert worst.value == pytest.approx(-(0.5**0.5))
    assert worst.point is not None
    assert worst.coordinates == tuple(quality.mesh.points[worst.point])
    assert worst.text.startswith("tetra cell 2 (inverted, jens -0.7071) in region 6 at node ")
    (outcome,) = check(quality, ["jens >= 0.5"], listed=0).outcomes
    assert outcome.cells == ()


def test_of_one_region_no_cell_names_it() -> None:
    (outcome,) = check(measured("good", "inverted"), ["jens >= 0.5"]).outcomes
    assert [cell.region for cell in outcome.cells] == [None]
    assert " in region" not in outcome.cells[0].text


def test_the_worst_of_an_upper_bound_are_the_greatest() -> None:
    quality = measured("good", "low", "cube", "low", metrics=["aspect_ratio_gamma"])
    (outcome,) = check(quality, ["aspect_ratio_gamma <= 1.1"], listed=2).outcomes
    assert [cell.cell for cell in outcome.cells] == [1, 3]
    assert (outcome.n_cells, outcome.n_failing) == (3, 3)  # the cube is none of its business


def test_a_metric_that_was_not_measured_is_an_error() -> None:
    with pytest.raises(MetricError, match="was not measured"):
        check(measured("good"), ["aspect_ratio_gamma <= 3"])
    assert metrics_of([rule("nothing invalid"), rule("verdict_shape > 0.1")]) == ("jens", "verdict_shape")


def test_a_check_is_plain_data() -> None:
    found = check(measured("good", "nan"), path="a.vtu")
    assert isinstance(found, Check)
    plain = found.to_dict()
    assert json.loads(json.dumps(plain))["path"] == "a.vtu"
    assert plain["outcomes"][3]["cells"][0]["status"] == "non_finite"


def test_many_cells_are_listed_as_a_full_sort_would() -> None:
    rng = np.random.default_rng(2)
    kinds = rng.choice(["good", "low", "inverted", "flat"], 200).tolist()
    quality = meshgauge.measure(mesh(*kinds))
    (outcome,) = check(quality, ["jens >= 1"], listed=50).outcomes
    expected = np.argsort(quality.values, kind="stable")[:50].tolist()
    assert [cell.cell for cell in outcome.cells] == expected
