"""Summaries: any split merges to the whole, and every number agrees with plain NumPy and exact fractions."""

from __future__ import annotations

import itertools
import math
import pickle
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from meshgauge.cells import BY_NAME, CELL_TYPES
from meshgauge.errors import MetricError
from meshgauge.quality.metrics import METRICS
from meshgauge.quality.summary import EXACT, QUANTILES, Scale, Summary, Tally, summarise
from meshgauge.quality.summary.builder import tallies
from meshgauge.status import Status

TETRA, HEXAHEDRON, QUAD, TETRA10, POLYHEDRON = (
    BY_NAME[name].vtk_id for name in ("tetra", "hexahedron", "quad", "hexa_prism", "polyhedron")
)


def statuses(values: np.ndarray, types: np.ndarray) -> np.ndarray:
    """The status that measuring gives a cell of such a value and type."""
    solid = np.array([CELL_TYPES[t].dimension == 3 for t in types.tolist()], bool)
    known = np.array([CELL_TYPES[t].shape is not None for t in types.tolist()], bool)
    status = np.select([values < 0, values == 0, np.isnan(values)], [1, 2, 3], 0)
    return np.select([~solid, ~known], [Status.NOT_SOLID, Status.UNSUPPORTED], status).astype(np.uint8)


def cells(n: int, seed: int, types: tuple[int, ...] = (TETRA, HEXAHEDRON)) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(seed)
    values = np.clip(rng.normal(0.5, 0.4, n), -1, 1)
    values[rng.random(n) < 0.05] = np.nan
    special = rng.random(n) < 0.1
    values[special] = rng.choice([0.0, -0.0, 1.0, -1.0, 0.2, 0.5, 5e-324, -1e-300, 0.3], special.sum())
    kinds = rng.choice(np.array(types, np.uint8), n)
    return values, statuses(values, kinds), kinds


def merged(arrays: tuple[np.ndarray, ...], cuts: list[int], order: list[int], metric: str = "jens") -> Summary:
    parts = [
        summarise(*(a[i:j] for a in arrays), metric, threads=1)
        for i, j in itertools.pairwise([0, *cuts, len(arrays[0])])
    ]
    whole = summarise(*(a[:0] for a in arrays), metric)
    for i in order:
        whole = parts[i].merge(whole) if i % 2 else whole.merge(parts[i])
    return whole


@settings(max_examples=60, deadline=None)
@given(
    values=hnp.arrays(
        np.float64,
        st.integers(0, 60),
        elements=st.one_of(st.floats(-1, 1), st.sampled_from([np.nan, 0.0, -0.0, 1.0, -1.0, 0.2, 5e-324, 0.1 + 0.2])),
    ),
    data=st.data(),
)
def test_any_split_in_any_order_gives_the_whole(values: np.ndarray, data: st.DataObject) -> None:
    n = len(values)
    types = data.draw(hnp.arrays(np.uint8, n, elements=st.sampled_from([TETRA, HEXAHEDRON, TETRA10, QUAD])))
    cuts = sorted(data.draw(st.lists(st.integers(0, n), max_size=6)))
    order = data.draw(st.permutations(range(len(cuts) + 1)))
    arrays = (values, statuses(values, types), types)
    whole = summarise(*arrays)
    split = merged(arrays, cuts, order)
    assert split == whole
    assert bits(split) == bits(whole)


@pytest.mark.parametrize("metric", ["jens", "aspect_ratio_gamma", "verdict_skew"])
def test_splits_give_the_whole_when_there_are_too_many_to_keep(metric: str) -> None:
    values, status, types = cells(3 * EXACT, 1)
    if metric != "jens":
        values = np.abs(np.tan(values * 1.5)) if METRICS[metric].range[1] > 1 else np.abs(values)
    arrays = (values, status, types)
    whole = summarise(*arrays, metric, threads=2)
    assert whole.all.counts is not None
    for cuts, order in (([5, EXACT, EXACT + 1], [3, 1, 0, 2]), ([2 * EXACT], [1, 0]), ([1, 2, 3], [0, 3, 2, 1])):
        assert bits(merged(arrays, cuts, order, metric)) == bits(whole)
    for chunk in (10_007, 1 << 17):
        assert bits(summarise(*arrays, metric, chunk=chunk, threads=2)) == bits(whole)
    shuffle = np.random.default_rng(0).permutation(len(values))
    assert bits(summarise(*(a[shuffle] for a in arrays), metric)) == bits(whole)


@pytest.mark.parametrize("n", [EXACT - 1, EXACT, EXACT + 1])
def test_collapse_depends_only_on_how_many_there_are(n: int) -> None:
    values = np.random.default_rng(n).random(n)
    arrays = (values, np.zeros(n, np.uint8), np.full(n, TETRA, np.uint8))
    whole = summarise(*arrays)
    assert (whole.all.counts is None) == (n <= EXACT)
    assert bits(merged(arrays, [n // 3, n // 2], [2, 0, 1])) == bits(whole)


def bits(one: Summary) -> bytes:
    """Everything in a summary, so that equal means equal to the last bit (0.0 and -0.0 differ)."""
    return pickle.dumps(
        [
            (t, *(v.tobytes() if isinstance(v, np.ndarray) else repr(v) for v in (getattr(tally, f) for f in FIELDS)))
            for t, tally in sorted(one.tallies.items())
        ]
    )


FIELDS = Tally.__dataclass_fields__


def test_counts_are_those_of_plain_comparisons() -> None:
    values, status, types = cells(5000, 2)
    for name, tally in summarise(values, status, types).types.items():
        v = values[types == BY_NAME[name].vtk_id]
        assert tally.n_cells == len(v)
        assert tally.n_measured == np.count_nonzero(~np.isnan(v))
        assert tally.n_invalid == np.count_nonzero(v < 0)
        assert tally.n_degenerate == np.count_nonzero(v == 0)
        assert tally.n_poor == np.count_nonzero((v > 0) & (v < 0.2))
        assert tally.n_good == np.count_nonzero(v >= 0.2)
        assert (tally.min, tally.max) == (np.nanmin(v), np.nanmax(v))
        assert sum(tally.statuses.values()) == len(v)


@pytest.mark.parametrize("metric", METRICS)
def test_every_measured_cell_is_counted_in_one_band(metric: str) -> None:
    row = METRICS[metric]
    rng = np.random.default_rng(3)
    special = [*row.range, *row.acceptable, row.ideal, 0.0, np.nan]
    values = np.concatenate([np.clip(rng.normal(0, 3, 500), *row.range), np.clip(special, *row.range)])
    types = rng.choice(np.array([TETRA, HEXAHEDRON], np.uint8), len(values))
    one = summarise(values, np.zeros(len(values), np.uint8), types, metric)
    tally = one.all
    assert tally.n_poor + tally.n_good == tally.n_measured == len(values) - 1
    assert (tally.n_invalid, tally.n_degenerate, tally.n_undecided, tally.n_unmeasured) == (0, 0, 0, 1)
    for bins in (1, 17):
        edges, counts = tally.histogram(bins)
        assert len(counts) == bins
        assert counts.sum() == tally.n_measured
        assert (np.diff(edges) > 0).all()
    low, high = row.standard("tetra").acceptable if row.is_defined_for("tetra") else row.acceptable
    kept = values[types == TETRA]
    assert one.types["tetra"].n_good == np.count_nonzero((kept >= low) & (kept <= high))


@settings(max_examples=100, deadline=None)
@given(hnp.arrays(np.float64, st.integers(1, 40), elements=st.floats(allow_nan=False, allow_infinity=False)))
def test_the_mean_is_the_exact_one_rounded(values: np.ndarray) -> None:
    n = len(values)
    one = summarise(values, np.zeros(n, np.uint8), np.full(n, TETRA, np.uint8), "aspect_ratio_gamma")
    exact = sum(map(Fraction, values.tolist())) / n
    assert one.all.mean == float(exact)


def test_the_mean_of_many_is_exact() -> None:
    rng = np.random.default_rng(4)
    n = 1 << 17  # a power of two, so that the division of the oracle does not round
    values = rng.random(n) * 10.0 ** rng.integers(-30, 1, n) * rng.choice([-1, 1], n)
    one = summarise(values, np.zeros(len(values), np.uint8), np.full(len(values), TETRA, np.uint8))
    assert one.all.mean == math.fsum(values) / len(values)
    ordinary = rng.random(n)
    two = summarise(ordinary, np.zeros(len(values), np.uint8), np.full(len(values), TETRA, np.uint8))
    assert two.all.mean == math.fsum(ordinary) / len(values)


def test_infinite_values_are_values() -> None:
    values = np.array([np.inf, 1.0, 2.0, np.inf, 3.0])
    status = np.array([2, 0, 0, 2, 0], np.uint8)
    one = summarise(values, status, np.full(5, TETRA, np.uint8), "aspect_ratio_gamma").all
    assert one.max == np.inf
    assert one.mean == np.inf
    assert one.n_degenerate == 2  # a flat tetrahedron has an infinite aspect ratio
    assert one.quantiles([0.0, 0.25, 0.5, 1.0]) == {0.0: 1.0, 0.25: 2.0, 0.5: 3.0, 1.0: np.inf}
    both = summarise(np.array([-np.inf, np.inf]), np.zeros(2, np.uint8), np.full(2, TETRA, np.uint8), "verdict_volume")
    assert np.isnan(both.all.mean)


def test_quantiles_are_exact_while_values_are_kept() -> None:
    values = np.random.default_rng(5).random(EXACT)
    one = summarise(values, np.zeros(EXACT, np.uint8), np.full(EXACT, TETRA, np.uint8)).all
    assert list(one.quantiles().values()) == np.quantile(values, QUANTILES).tolist()
    assert one.quantile_resolution == 0


@pytest.mark.parametrize("metric", ["jens", "verdict_aspect_ratio"])
def test_quantiles_are_within_the_resolution_beyond(metric: str) -> None:
    rng = np.random.default_rng(6)
    n = 3 * EXACT
    values = rng.beta(5, 2, n) if metric == "jens" else 1 + rng.exponential(2, n)
    one = summarise(values, np.zeros(n, np.uint8), np.full(n, TETRA, np.uint8), metric).all
    exact = np.quantile(values, QUANTILES)
    assert 0 < one.quantile_resolution < 0.02
    np.testing.assert_allclose(list(one.quantiles().values()), exact, rtol=0, atol=one.quantile_resolution)
    assert one.quantiles([0, 1]) == {0: values.min(), 1: values.max()}


def test_equal_values_have_equal_quantiles() -> None:
    n = EXACT + 1
    one = summarise(np.full(n, 0.37), np.zeros(n, np.uint8), np.full(n, HEXAHEDRON, np.uint8)).all
    assert set(one.quantiles().values()) == {0.37}
    assert one.mean == 0.37


def test_histograms_agree_whether_values_are_kept_or_binned() -> None:
    values, _, _ = cells(EXACT + 500, 7)
    values = values[~np.isnan(values)][: EXACT // 2]
    few = summarise(values, np.zeros(len(values), np.uint8), np.full(len(values), TETRA, np.uint8)).all
    thrice = few.merge(few).merge(few)
    assert thrice.counts is not None
    for bins in (1, 7, 20, 64, 20_000):
        edges, counts = few.histogram(bins)
        assert len(edges) == bins + 1
        assert (thrice.histogram(bins)[1] == 3 * counts).all()
        assert (thrice.histogram(bins)[0] == edges).all()
        # As NumPy counts them with the same edges.
        assert (np.histogram(values, edges)[0] == counts).all()


def test_values_on_an_edge_belong_to_the_bin_above() -> None:
    edges = np.arange(-10_000, 10_001) / 10_000
    for shift, expected in ((edges[:-1], 1), (np.nextafter(edges[1:], -2), 1)):
        types = np.full(len(shift), TETRA, np.uint8)
        counts = summarise(shift, np.zeros(len(shift), np.uint8), types).all.histogram(20_000)[1]
        assert (counts == expected).all()


def test_edges_of_the_display_are_listed_decimals() -> None:
    one = Tally.empty(Scale.of("jens"))
    assert one.histogram(20)[0].tolist() == [i / 10 for i in range(-10, 11)]
    assert one.histogram(3)[0].tolist() == [-1.0, -0.3334, 0.3333, 1.0]
    with pytest.raises(ValueError, match="bins is 0"):
        one.histogram(0)


def test_cells_without_a_value_are_counted_and_named() -> None:
    types = np.array([TETRA, TETRA, HEXAHEDRON, QUAD, QUAD, POLYHEDRON, TETRA10, 99], np.uint8)
    values = np.array([0.5, np.nan, 0.1, np.nan, np.nan, np.nan, 0.9, np.nan])
    status = np.array([0, 3, 0, 5, 5, 4, 0, 4], np.uint8)
    one = summarise(values, status, types)
    assert one.n_cells == 8
    assert list(one.types) == ["tetra", "hexahedron", "hexa_prism", "polyhedron", "vtk_99"]
    assert (one.all.n_cells, one.all.n_measured) == (6, 3)
    assert one.not_measured == {
        "quad": {"not_solid": 2},
        "tetra": {"non_finite": 1},
        "polyhedron": {"unsupported": 1},
        "vtk_99": {"unsupported": 1},
    }
    assert one.corners_only == {}


def test_a_metric_that_is_not_defined_for_a_type_says_so() -> None:
    types = np.array([TETRA, HEXAHEDRON], np.uint8)
    one = summarise(np.array([1.5, np.nan]), np.zeros(2, np.uint8), types, "aspect_ratio_gamma")
    assert one.not_measured == {"hexahedron": {"undefined": 1}}


def test_acceptable_ranges_are_those_of_the_type() -> None:
    # J_S of 0.15 is J_ENS of 0.21 in a tetrahedron, of 0.15 in a hexahedron.
    types = np.array([TETRA, HEXAHEDRON], np.uint8)
    one = summarise(np.array([0.15, 0.15]), np.zeros(2, np.uint8), types, "scaled_jacobian")
    assert (one.types["tetra"].n_good, one.types["hexahedron"].n_good) == (1, 0)


def test_no_cells_is_a_summary_of_none() -> None:
    none = summarise(np.empty(0), np.empty(0, np.uint8), np.empty(0, np.uint8))
    assert none.all.n_cells == 0
    assert np.isnan([none.all.min, none.all.max, none.all.mean, *none.all.quantiles().values()]).all()
    assert none.all.histogram(4)[1].tolist() == [0, 0, 0, 0]


def test_summaries_travel_between_processes() -> None:
    one = summarise(*cells(1000, 8))
    assert pickle.loads(pickle.dumps(one)) == one
    assert one != summarise(*cells(1000, 9))


def test_wrong_input_is_refused() -> None:
    with pytest.raises(ValueError, match="2 values, 1 statuses and 2 types"):
        summarise(np.zeros(2), np.zeros(1, np.uint8), np.zeros(2, np.uint8))
    with pytest.raises(MetricError, match="no metric 'beauty'"):
        summarise(np.zeros(1), np.zeros(1, np.uint8), np.zeros(1, np.uint8), "beauty")
    jens, other = (
        summarise(np.empty(0), np.empty(0, np.uint8), np.empty(0, np.uint8), m) for m in ("jens", "verdict_skew")
    )
    with pytest.raises(ValueError, match="jens and verdict_skew"):
        jens.merge(other)
    with pytest.raises(ValueError, match="jens and verdict_skew"):
        jens.all.merge(other.all)


def test_to_dict_has_plain_numbers() -> None:
    one = summarise(*cells(100, 10)).to_dict(bins=4)
    flat = [one]
    while flat:
        item = flat.pop()
        if isinstance(item, dict):
            flat += [*item.keys(), *item.values()]
        elif isinstance(item, list):
            flat += item
        else:
            assert type(item) in (str, int, float)
    assert len(one["all"]["histogram"]["counts"]) == 4


def test_plus_is_merge_of_summaries_and_of_tallies() -> None:
    values, status, types = cells(1000, 11)
    whole = summarise(values, status, types)
    one, other = (summarise(values[at], status[at], types[at]) for at in (slice(0, 400), slice(400, None)))
    assert one + other == other + one == whole
    assert one.all + other.all == whole.all
    with pytest.raises(TypeError):
        one + 1  # type: ignore[operator]
    with pytest.raises(TypeError):
        one.all + one  # type: ignore[operator]
    of_other_metric = summarise(values, status, types, "scaled_jacobian")
    with pytest.raises(ValueError, match="cannot merge summaries of jens and scaled_jacobian"):
        one + of_other_metric


def test_a_histogram_has_20_bins_unless_asked_otherwise() -> None:
    tally = summarise(*cells(1000, 12)).all
    edges, counts = tally.histogram()
    np.testing.assert_allclose(edges, np.linspace(-1, 1, 21), atol=1e-15)
    assert counts.sum() == tally.n_measured
    for default, asked in zip((edges, counts), tally.histogram(20), strict=True):
        np.testing.assert_array_equal(default, asked)


def test_only_types_that_cannot_be_told_inside_are_known_at_their_corners_only() -> None:
    names = ["lagrange_pyramid", "lagrange_pyramid", "tetra10", "hexahedron"]
    types = np.array([BY_NAME[name].vtk_id for name in names], np.uint8)
    status = np.array([Status.UNDECIDED, Status.OK, Status.UNDECIDED, Status.UNDECIDED], np.uint8)
    assert summarise(np.ones(4), status, types).corners_only == {"lagrange_pyramid": 1}


EDGES = np.arange(-10_000, 10_001) / 10_000


@pytest.mark.parametrize("metric", ["jens", "warpage"])  # with bounds, and without
@pytest.mark.parametrize(
    "values",
    [
        np.tile(np.concatenate([EDGES, np.nextafter(EDGES, 2), np.nextafter(EDGES, -2)]), 2),
        np.random.default_rng(0).normal(size=EXACT + 9) * 10 ** np.random.default_rng(1).uniform(-300, 300, EXACT + 9),
        np.random.default_rng(2).uniform(-1, 1, EXACT + 9) ** 31,
        np.concatenate([np.full(EXACT, -0.0), [np.inf, np.nan, -np.inf, 5e-324]]),
        np.zeros(EXACT + 9),
        np.concatenate([np.linspace(-1, 1, 2 * EXACT), [np.nan, 3.0], np.linspace(-1, 1, 2 * EXACT)]),
        np.concatenate([np.linspace(-1, 1, EXACT - 600), np.full(EXACT, np.nan), [0.5, -0.25]]),
    ],
    ids=["edges", "any-size", "small", "special", "zero", "gap", "few with gaps"],
)
def test_the_kernel_counts_what_numpy_counts(values: np.ndarray, metric: str) -> None:
    status = statuses(values, np.full(len(values), HEXAHEDRON, np.uint8))
    status[::7][status[::7] == Status.OK] = Status.UNDECIDED
    types = np.full(len(values), HEXAHEDRON, np.uint8)
    by_numpy, by_kernel = (
        tallies(values, status, types, METRICS[metric], "fem", compiled=compiled) for compiled in (False, True)
    )
    assert by_numpy == by_kernel
    assert by_kernel[HEXAHEDRON].total == sum(map(Fraction, values[np.isfinite(values)].tolist())) * 2**1074
