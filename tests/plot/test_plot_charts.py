"""Charts show the numbers of the summary, of any size and metric, and leave matplotlib's global state alone."""

from __future__ import annotations

import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

import meshgauge
from meshgauge import MeshgaugeError, plot
from meshgauge.look.colours import INVALID, POOR, RAMP, SERIES, WORDS, colours, rgb
from meshgauge.plot import chart_style
from meshgauge.plot.distributions import counts_in, edges_of, steps_of
from meshgauge.quality.summary import Summary, summarise

TETRA, HEXAHEDRON = 10, 12
SMALL = Path(__file__).resolve().parents[2] / "examples" / "meshes" / "bracket_small.msh"


def made(values: list[float] | np.ndarray, vtk_id: int = TETRA, metric: str = "jens") -> Summary:
    values = np.asarray(values, float)
    status = np.select([np.isnan(values), values < 0, values == 0], [3, 1, 2], 0).astype(np.uint8)
    return summarise(values, status, np.full(len(values), vtk_id, np.uint8), metric)


def texts(figure: Figure) -> list[str]:
    return [t.get_text() for axes in figure.axes for t in axes.texts] + [t.get_text() for t in figure.texts]


def test_bars_are_as_high_as_there_are_cells() -> None:
    values = [-0.5, -0.01, 0.0, 0.05, 0.2, 0.3, 0.3, 0.999, 1.0, np.nan]
    figure = plot.histogram(made(values), bins=20)
    bars = figure.axes[0].containers[0]
    heights = {round(bar.get_x() + bar.get_width() / 2, 2): bar.get_height() for bar in bars if bar.get_height() >= 1}
    assert heights == {-0.45: 1, -0.05: 1, 0.05: 2, 0.25: 1, 0.35: 2, 0.95: 2}
    found = texts(figure)
    for n, band in (("2", "invalid"), ("1", "degenerate"), ("1", "poor"), ("5", "good")):
        assert (n, band) in pairwise(found)
    assert any("1 not measured" in text for text in found)


def test_a_bad_cell_among_millions_is_seen() -> None:
    figure = plot.histogram(made(np.r_[-0.9, np.full(2_000_000, 0.5)]))
    heights = np.array([bar.get_height() for bar in figure.axes[0].containers[0]])
    assert np.count_nonzero(heights) == 2
    assert heights[heights > 0].min() > 0.004 * heights.max()


def test_many_cells_are_drawn_like_few() -> None:
    values = np.random.default_rng(1).uniform(-0.3, 1.0, 100_000)
    many = made(values).all
    assert many.values is None
    few = [made(part).all for part in np.array_split(values, 4)]
    edges = edges_of([many], 80)
    np.testing.assert_array_equal(counts_in(many, edges), sum(counts_in(part, edges) for part in few))
    np.testing.assert_array_equal(counts_in(many, edges), np.histogram(values, edges)[0])
    x, below = steps_of(many)
    assert below[-1] == len(values)
    np.testing.assert_allclose(np.interp(0.4, x, below), np.count_nonzero(values <= 0.4), atol=20)


def test_every_type_has_a_row() -> None:
    both = made([0.5, 0.6]).merge(made([-0.2, 0.1, 0.9], HEXAHEDRON))
    figure = plot.types(both)
    assert len(figure.axes) == 2
    assert [t for t in texts(figure) if "\n" in t] == ["tetra\n2", "hexahedron\n3"]
    assert "1 invalid" in texts(figure)


@pytest.mark.parametrize("draw", [plot.histogram, plot.types, plot.cumulative])
def test_several_meshes_are_shares_of_their_own(draw: object) -> None:
    figure = draw({"a": made([0.1] * 3 + [0.9]), "b": made([0.1] * 300 + [0.9] * 700)})  # type: ignore[operator]
    assert {"a", "b"} <= set(texts(figure))
    axes = figure.axes[0]
    if draw is plot.cumulative:
        a, b = (line.get_ydata() for line in axes.lines if len(line.get_ydata()) > 1)
        assert (a[0], b[0], a[-1], b[-1]) == (0.75, 0.3, 1.0, 1.0)
    else:
        a, b = (patch.get_data().values for patch in axes.patches if hasattr(patch, "get_data") and not patch.fill)
        np.testing.assert_allclose([a.max(), b.max(), a.sum(), b.sum()], [75, 70, 100, 100])


def test_other_metrics() -> None:
    mesh = meshgauge.read(SMALL)
    quality = meshgauge.measure(mesh, metrics=["aspect_ratio_gamma", "scaled_jacobian", "verdict_volume"])
    for name in quality.metrics:
        every = quality.summary(name).all
        figure = plot.histogram(quality, metric=name)
        assert name == "jens" or any(name in axes.get_xlabel() for axes in figure.axes)
        assert counts_in(every, edges_of([every], 80)).sum() == every.n_measured
        plot.cumulative(quality, metric=name).canvas.draw()
        plot.types(quality, metric=name).canvas.draw()
    with pytest.raises(meshgauge.MetricError, match="not measured"):
        plot.histogram(quality, metric="verdict_shape")


def test_nothing_to_draw_is_an_error() -> None:
    with pytest.raises(MeshgaugeError, match="nothing to draw"):
        plot.histogram(made([np.nan]))
    with pytest.raises(MeshgaugeError, match="different metrics"):
        plot.histogram({"a": made([0.5]), "b": made([0.5], metric="scaled_jacobian")})
    assert plot.histogram({"a": made([0.5]), "empty": made([np.nan])}).axes


def test_files_are_whole_or_not_there(tmp_path: Path) -> None:
    folder = tmp_path
    figure = plot.histogram(made([0.5]))
    for name, magic in (("a.png", b"\x89PNG"), ("a.SVG", b"<?xml"), ("a.pdf", b"%PDF")):
        plot.save(figure, folder / name)
        assert (folder / name).read_bytes().startswith(magic)
    for name in ("a.jpg", "a", "no/a.png"):
        with pytest.raises(meshgauge.WriteError, match="a"):
            plot.save(figure, folder / name)
    assert sorted(path.name for path in folder.iterdir()) == ["a.SVG", "a.pdf", "a.png"]


def test_pyplot_and_global_settings_are_left_alone() -> None:
    code = f"""
import sys, meshgauge, numpy as np
from meshgauge import plot
assert "matplotlib" not in sys.modules
import matplotlib
before = matplotlib.rcParams.copy()
q = meshgauge.measure(meshgauge.read({str(SMALL)!r}))
for f in (plot.histogram, plot.types, plot.cumulative):
    f(q).canvas.draw()
assert matplotlib.rcParams.copy() == before
assert "matplotlib.pyplot" not in sys.modules
"""
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def luminance(colour: str) -> float:
    c = rgb(colour)
    linear = np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def test_colours_can_be_told_apart() -> None:
    assert all((1.05) / (luminance(colour) + 0.05) >= 4.5 for colour in WORDS.values())
    ramp = [luminance(colour) for colour in RAMP]
    assert ramp == sorted(ramp)
    assert len(set(SERIES)) == len(SERIES)
    found = colours(np.array([-1.0, 0.0, 0.1, 0.2, 1.0, np.nan]))
    np.testing.assert_allclose(found[:2], [rgb(INVALID)] * 2)
    np.testing.assert_allclose(found[2:5], [rgb(POOR), rgb(RAMP[0]), rgb(RAMP[-1])], atol=1e-12)
    assert len(np.unique(found.round(6), axis=0)) == 5


def test_names_of_any_kind_and_many_meshes(tmp_path: Path) -> None:
    names = ["$\\frac{$.vtu", "a_" * 80 + "end.vtu", "\u7f51\u683c.vtu", *(f"mesh {n}" for n in range(16))]
    summaries = {name: made([0.1 + n / 40, 0.9]) for n, name in enumerate(names)}
    for draw in (plot.histogram, plot.cumulative, plot.types):
        figure = draw(summaries)
        plot.save(figure, tmp_path / "many.png")
        assert any(text.endswith("end.vtu") and "…" in text for text in texts(figure))
    looks = [chart_style.stroke(n) for n in range(len(names))]
    assert len(set(looks)) == len(names)
    for name in names[:3]:
        plot.save(plot.histogram({name: made([0.5])}), tmp_path / "one.svg")
    assert [chart_style.short("abcdefg", n) for n in (7, 6, 3)] == ["abcdefg", "ab…efg", "a…g"]
