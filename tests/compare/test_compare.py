"""Comparisons: laws of the statement on random cells, and what becomes of cells that correspond."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from compare_meshes import measured, mixed, tetra
from hypothesis import given
from hypothesis import strategies as st

import meshgauge
from meshgauge import Mesh
from meshgauge.compare import Comparison, comparison, correspond, pair_cells, superiority
from meshgauge.compare.scores import scores
from meshgauge.errors import MeshgaugeError
from meshgauge.quality.summary import KeyFigures, ranking, rankings
from meshgauge.status import Status

SAMPLE = st.lists(st.integers(-3, 3), min_size=1, max_size=12).map(lambda xs: np.sort(np.array(xs, float)))


@given(SAMPLE, SAMPLE)
def test_superiority_is_the_share_of_pairs(a: np.ndarray, b: np.ndarray) -> None:
    found = superiority(a, b)
    assert found.better == pytest.approx((a[:, None] > b).mean())
    assert found.worse == pytest.approx((a[:, None] < b).mean())
    assert found.equal == pytest.approx((a[:, None] == b).mean())
    other = superiority(b, a)
    assert (other.better, other.worse) == (found.worse, found.better)
    assert found.probability + other.probability == pytest.approx(1)
    assert found.words == other.words
    assert superiority(a, a).probability == pytest.approx(0.5)


def test_superiority_is_that_of_scipy() -> None:
    stats = pytest.importorskip("scipy.stats")
    rng = np.random.default_rng(3)
    a, b = np.sort(rng.normal(0.4, 1, 500)), np.sort(rng.normal(0, 1, 300))
    u = stats.mannwhitneyu(a, b).statistic
    assert superiority(a, b).probability == pytest.approx(u / (500 * 300), abs=1e-12)


@pytest.mark.parametrize(("shift", "words"), [(0.0, "hardly"), (0.35, "small"), (0.65, "medium"), (2.0, "large")])
def test_words_grow_with_the_difference(shift: float, words: str) -> None:
    a = np.linspace(-3, 3, 2001)
    weights = np.exp(-a * a / 2)
    sample = np.sort(np.repeat(a, (weights * 20).astype(int)))
    assert words in superiority(sample + shift, sample).words


def test_scores_lump_what_is_invalid() -> None:
    quality = measured([1.0, 0.001, 0.0, -0.2, -1.0, math.nan])
    assert scores(quality)[2:5].tolist() == [0, -1, -1]
    assert scores(quality)[0] == pytest.approx(0.5**0.5, abs=1e-9)
    assert np.isnan(scores(quality)[5])


def test_scores_follow_the_status_not_the_value() -> None:
    """Cells inverted inside and concave ones have good values; only a mesh for finite volumes may keep the latter."""
    kinds = (Status.OK, Status.INVERTED_INSIDE, Status.CONCAVE, Status.DEGENERATE, Status.INVERTED)
    made = measured([1.0] * len(kinds))
    quality = meshgauge.Quality(made.mesh, made.values, np.array(kinds, np.uint8), made.metrics)
    good = pytest.approx(0.5**0.5, abs=1e-9)
    assert scores(quality).tolist() == [good, -1, -1, 0, -1]
    volumes = meshgauge.Quality(made.mesh.replace(purpose="fv"), made.values, quality.status, made.metrics)
    assert scores(volumes).tolist() == [good, -1, good, 0, -1]
    low = np.full(len(kinds), -0.5)
    concave = scores(meshgauge.Quality(volumes.mesh, low, quality.status, {"jens": low}))[2]
    assert 0 < concave < 1e-6, "below all valid cells, above the degenerate ones"


def test_cells_inverted_inside_lose_against_valid_ones() -> None:
    good = measured([1.0] * 8)
    inside = np.full(8, Status.INVERTED_INSIDE, np.uint8)
    broken = meshgauge.Quality(good.mesh, good.values, inside, good.metrics)
    (one,) = comparison({"broken": broken, "good": good}).against
    assert one.superiority["all"].probability in (0.0, 1.0)


def test_a_mesh_against_itself() -> None:
    quality = mixed(3, 0.2, 0)
    found = comparison({"a": quality, "b": quality})
    (one,) = found.against
    assert one.paired is not None
    counts = one.paired.all
    assert (counts.n_better, counts.n_worse, counts.n_equal) == (0, 0, 81)
    assert (one.paired.n_moved, one.paired.largest_move, one.paired.losses) == (0, 0.0, ())
    assert all(s.probability == pytest.approx(0.5) for s in one.superiority.values())
    assert all(row.best == (0, 1) for rows in found.rows.values() for row in rows)
    assert found.notes == ()
    assert list(found.rows) == ["tetra", "hexahedron", "all"]


def test_before_and_after_are_mirror_images() -> None:
    a, b = mixed(4, 0.3, 1), mixed(4, 0.3, 2)
    there, back = pair_cells(a, b).all, pair_cells(b, a).all
    assert (there.n_better, there.n_worse, there.n_equal) == (back.n_worse, back.n_better, back.n_equal)
    assert (there.n_repaired, there.n_broken) == (back.n_broken, back.n_repaired)
    assert there.changes == pytest.approx([-x for x in reversed(back.changes)])


def test_what_became_of_each_cell() -> None:
    nan = math.nan
    before = measured([1.0, 1.0, 0.3, -0.5, -0.5, 0.0, 1.0, nan, 0.2, 1.0])
    after = measured([1.0, 0.5, 0.6, -0.9, 0.5, 0.5, -0.5, 1.0, 0.0, nan])
    found = pair_cells(before, after, losses=3)
    counts = found.all
    assert (counts.n_better, counts.n_worse, counts.n_equal, counts.n_unmeasured) == (3, 3, 2, 2)
    assert (counts.n_repaired, counts.n_broken, counts.n_still_invalid) == (2, 2, 1)
    assert [loss.cell for loss in found.losses] == [6, 1, 8]
    first = found.losses[0]
    assert (first.status_before, first.status_after) == ("ok", "inverted")
    assert first.before == before.values[6]
    assert first.after == after.values[6]
    assert first.coordinates == tuple(after.mesh.points[first.point])
    assert first.point == after.mesh.nodes(6)[first.node]
    assert found.n_moved == 9
    assert found.largest_move == pytest.approx(1.5)


def test_the_changes_are_those_of_numpy() -> None:
    a, b = mixed(4, 0.1, 1), mixed(4, 0.1, 2)
    assert (a.status == Status.OK).all()
    expected = np.quantile(b.values - a.values, (0.05, 0.5, 0.95))
    assert pair_cells(a, b).all.changes == pytest.approx(expected, abs=2e-9)
    change = b.values - a.values
    losses = pair_cells(a, b, losses=7).losses
    assert [loss.cell for loss in losses] == np.argsort(change, kind="stable")[:7].tolist()


def test_when_cells_correspond() -> None:
    a = tetra([1.0, 1.0])
    assert correspond(a, tetra([0.5, 0.2])) == ""
    assert correspond(a, tetra([1.0, 1.0], reverse=[1])) == ""  # as after meshgauge orient
    assert correspond(a, tetra([1.0])) == "they have 2 and 1 cells"
    assert correspond(a, Mesh.from_arrays(a.points[:7], [("tetra", [(0, 1, 2, 3), (3, 4, 5, 6)])])) == (
        "they have 8 and 7 points"
    )
    swapped = Mesh.from_arrays(a.points, [("tetra", [(0, 1, 2, 3), (4, 5, 6, 3)])])
    assert correspond(a, swapped) == "cell 1 has other points"
    other = Mesh.from_arrays(a.points, [("tetra", [(0, 1, 2, 3)]), ("quad", [(4, 5, 6, 7)])])
    assert correspond(a, other) == "cell 1 is of type tetra in one, quad in the other"
    turned = pair_cells(measured([1.0, 1.0], reverse=[1]), measured([1.0, 1.0]))
    assert (turned.all.n_repaired, turned.all.n_better) == (1, 1)


def test_rows_say_who_is_best() -> None:
    found = comparison({"a": measured([1.0, 0.05]), "b": measured([0.8, 0.8]), "c": measured([-1.0, -0.5])})
    rows = {row.criterion: row for row in found.rows["all"]}
    assert rows["min"].best == (1,)
    assert rows["n_invalid"].best == (0, 1)
    assert rows["n_invalid"].values == (0, 0, 2)
    assert rows["share_not_good"].values == (0.5, 0, 1)


def test_below_0_nobody_is_better() -> None:
    found = comparison({"a": measured([-0.1, 1.0]), "b": measured([-1.0, 1.0])})
    rows = {row.criterion: row for row in found.rows["all"]}
    assert rows["min"].best == ()
    assert rows["n_invalid"].best == (0, 1)
    (one,) = found.against
    assert one.superiority["all"].probability == pytest.approx(0.5)


def test_types_that_one_mesh_lacks() -> None:
    both, only = mixed(2, 0.1, 0), measured([1.0, 0.7])
    found = comparison({"both": both, "tetra": only})
    rows = {row.criterion: row for row in found.rows["hexahedron"]}
    assert rows["min"].values[1] is None
    assert rows["min"].best == (0,)
    assert set(found.against[0].superiority) == {"tetra", "all"}
    assert found.against[0].paired is None
    assert any("type by type" in note for note in found.notes)
    assert any("same domain" in note for note in found.notes)


def test_regions_of_one_name_are_compared() -> None:
    def zoned(heights: list[float], first: str, second: str) -> meshgauge.Quality:
        zones = (meshgauge.CellBlock(first, 0, 1), meshgauge.CellBlock(second, 1, len(heights)))
        return meshgauge.measure(tetra(heights).replace(blocks=zones))

    meshes = {"a": zoned([1.0, 0.1, -1.0], "inlet", "wing"), "b": zoned([0.5, 1.0, 1.0], "inlet", "tail")}
    found = comparison(meshes, by_regions=True)
    assert list(found.regions) == ["inlet", "wing", "tail"]
    rows = {name: {row.criterion: row for row in rows} for name, rows in found.regions.items()}
    assert rows["inlet"]["min"].best == (0,)
    assert rows["wing"]["n_invalid"].values == (1, None)
    assert rows["tail"]["n_invalid"].values == (None, 0)
    assert comparison(meshes).regions == {}


def test_meshes_in_which_nothing_is_measured() -> None:
    nothing = meshgauge.measure(Mesh.from_arrays([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [("line", [(0, 1)])]))
    found = comparison({"a": nothing, "b": measured([1.0])})
    assert found.against[0].superiority == {}
    assert found.sides[0].tally("all") is None
    neither = comparison({"a": nothing, "b": nothing})
    assert neither.rows["all"] == ()
    json.dumps(neither.to_dict())


def test_fewer_than_two_are_an_error() -> None:
    with pytest.raises(MeshgaugeError, match="cannot compare 1 meshes"):
        comparison({"a": measured([1.0])})


def test_a_comparison_is_plain_data() -> None:
    found = comparison({"a": measured([1.0, 0.2]), "b": measured([0.1, 0.2])})
    assert isinstance(found, Comparison)
    plain = json.loads(json.dumps(found.to_dict()))
    assert plain["meshes"][1]["all"]["n_poor"] == 2
    assert plain["against"][0]["paired"]["losses"][0]["cell"] == 0
    assert plain["criteria"]["all"]["min"]["best"] == [0]


@pytest.mark.parametrize(("key", "resolution", "margin"), [("min", 0.25, 1.0), ("quantile_0.01", 1.0, 2.0)])
def test_what_differs_by_the_margin_is_as_good(
    key: str, resolution: float, margin: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The last bits, and of quantiles their resolution."""
    monkeypatch.setattr(ranking, "ROUNDING", 1.0)

    def mesh(value: float) -> KeyFigures:
        return KeyFigures(1, 1, 0, 0, 0, 1, 0, value, value, value, value, resolution)

    (ranked,) = rankings([mesh(4.0), mesh(4.0 - margin), mesh(3.9 - margin)], [key])
    assert ranked.best == [0, 1]
