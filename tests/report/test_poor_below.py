"""Limits of one's own below which cells are poor: counted, coloured, said and recorded alike, on every path."""

from __future__ import annotations

import json
from pathlib import Path

import command_line
import numpy as np
import pytest

import meshgauge
from meshgauge import Mesh, OptionError, Quality
from meshgauge.check import check
from meshgauge.cli.groups.improve import Goal
from meshgauge.look.bands import POOR, USUAL, PoorBelow
from meshgauge.look.colours import POOR as POOR_COLOUR
from meshgauge.look.colours import cell_colours, rgb, shade
from meshgauge.plot.pyvista_cells import drawable
from meshgauge.report import html
from meshgauge.report.bad_cells import is_bad
from meshgauge.report.stream import report_on
from meshgauge.report.verdict import verdict
from meshgauge.view.filters import presets
from meshgauge.view.model import Model

CUBE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
TETRA = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
OWN = PoorBelow(0.5, (("tetra", 0.3),))


def mesh(n: int = 40) -> Mesh:
    """Hexahedra and tetrahedra of many values, none of which is invalid."""
    shears = np.linspace(0.0, 6.0, n)
    boxes = [CUBE + np.outer(CUBE[:, 2], (s, 0, 0)) + np.array((20.0 * k, 0, 0)) for k, s in enumerate(shears)]
    tetras = [TETRA + np.outer(TETRA[:, 2], (s, 0, 0)) + np.array((20.0 * k, 50, 0)) for k, s in enumerate(shears)]
    points, own = np.concatenate(boxes + tetras), np.arange(n)
    cells = {"hexahedron": 8 * own[:, None] + np.arange(8), "tetra": 8 * n + 4 * own[:, None] + np.arange(4)}
    return Mesh.from_arrays(points, cells)


@pytest.fixture(scope="module")
def quality() -> Quality:
    return meshgauge.measure(mesh(), poor_below={"tetra": 0.3, "all": 0.5})


def expected(quality: Quality) -> np.ndarray:
    limits = np.where(quality.mesh.types == 10, 0.3, 0.5)
    return np.asarray(quality.values < limits)


def test_they_are_counted_on_every_path(quality: Quality, tmp_path: Path) -> None:
    poor, usual = expected(quality), meshgauge.measure(mesh())
    assert quality.poor_below == OWN
    summary = quality.summary()
    assert summary.poor_below == OWN
    assert usual.summary().all.n_poor < summary.all.n_poor == np.count_nonzero(poor)
    assert summary.types["tetra"].n_poor == np.count_nonzero(poor[quality.mesh.types == 10])
    np.testing.assert_array_equal(is_bad(quality), poor)
    path = tmp_path / "a.vtkhdf"
    meshgauge.write(path, mesh())
    listed = meshgauge.io.pieces(path)
    assert listed is not None
    assert report_on(listed, size=7, poor_below=OWN, by_region=True).summary == summary
    assert meshgauge.stream(path, poor_below=0.5, by_region=True).regions[0][1].poor_below == PoorBelow(0.5)
    assert meshgauge.partial(path, poor_below=OWN).summary.all.n_poor == summary.all.n_poor
    parts = [meshgauge.partial(path, share=(k, 2), poor_below=limit) for k, limit in ((1, 0.5), (2, 0.4))]
    with pytest.raises(meshgauge.MeshgaugeError, match="other limits"):
        meshgauge.merge(parts)


def test_they_are_said(quality: Quality) -> None:
    n = np.count_nonzero(expected(quality))
    assert verdict(quality.summary()).text.endswith(f"{n} are poor (< 0.5 (tetra 0.3))")
    assert "below 0.5 (tetra 0.3) poor" in quality.report()
    section = html.section(quality)
    page = html.page([section])
    assert "<dt>poor, below 0.5 (tetra 0.3)</dt>" in page
    assert section.model is not None
    assert {kind["type"]: kind["poorBelow"] for kind in section.model["kinds"]} == {"tetra": 0.3, "hexahedron": 0.5}
    assert section.model["start"] == 0.5
    (rule,) = [outcome for outcome in check(quality).outcomes if outcome.rule.level == "warn"]
    assert str(rule.rule) == "nothing poor @ 1%"
    assert rule.n_failing == n
    assert presets("fem", 0.5)["poor"][:2] == (-1.0, 0.5)


def test_they_colour(quality: Quality) -> None:
    poor = expected(quality)
    for shown in (Model.of(quality, "a").colours(np.arange(quality.n_cells)), drawable(quality).grid["colour"]):
        is_poor = np.all(shown == (255 * rgb(POOR_COLOUR)).round().astype(np.uint8), axis=1)
        np.testing.assert_array_equal(is_poor, poor)
    usual = meshgauge.measure(mesh())
    none = np.zeros(usual.n_cells, np.bool_)
    np.testing.assert_array_equal(shade(usual.values, usual.poor_limits()), usual.values)
    np.testing.assert_array_equal(cell_colours(shade(usual.values, 0.2), none, none),
                                  cell_colours(usual.values, none, none))  # fmt: skip


@pytest.mark.parametrize("limit", [0.01, 0.2, 0.5, 0.99])
def test_shades_are_monotone_and_end_poor_where_the_colours_do(limit: float) -> None:
    values = np.linspace(-1.0, 1.0, 2001)
    shades = shade(values, limit)
    assert (np.diff(shades) >= 0).all()
    assert shade(np.array([-1.0, 0.0, limit, 1.0]), limit) == pytest.approx([-1.0, 0.0, POOR, 1.0], abs=1e-12)
    assert ((shades < POOR - 1e-9) <= (values < limit)).all()
    assert np.isnan(shade(np.array([np.nan]), limit)).all()


@pytest.mark.parametrize("wrong", [0.0, 1.0, -0.1, float("nan"), {"tetra": 2.0}, {"tetrahedron": 0.3}, {"foo": 0.2}])
def test_wrong_limits_are_refused(wrong: float) -> None:
    with pytest.raises(OptionError, match="poor_below"):
        meshgauge.measure(mesh(2), poor_below=wrong)


def test_settings_say_them(tmp_path: Path) -> None:
    settings, path = tmp_path / "meshgauge.toml", tmp_path / "a.vtu"
    meshgauge.write(path, mesh())
    before = command_line.run("check", path, "--write-baseline", "base.json", cwd=tmp_path)
    assert before.returncode == 0
    settings.write_text("[quality]\npoor = { tetra = 0.3, all = 0.5 }\n")
    (file,) = json.loads(command_line.run("report", path, "--json", cwd=tmp_path).stdout)["files"]
    assert file["poor_below"] == {"all": 0.5, "tetra": 0.3}
    assert "(< 0.5 (tetra 0.3))" in file["verdict"]["text"]
    done = command_line.run("check", path, "--fail", "no worse than base.json", cwd=tmp_path)
    assert "poor ends at 0.2 there and at 0.5 (tetra 0.3) here: shares are not compared" in " ".join(
        done.stdout.split()
    )
    assert done.returncode == 0
    assert Goal().arguments(OWN)["target"] == 0.5
    assert Goal(target=0.1).arguments(OWN)["target"] == 0.1
    assert Goal().arguments(USUAL)["target"] == 0.2
    for text, message in (("poor = 'a'", "expected a number"), ("poor = 3", "expected more than 0"),
                          ("poor = {tetre = 0.3}", "did you mean 'tetra'"), ("por = 1", "did you mean 'quality.poor'"),
                          ("poor = true", "expected a number")):  # fmt: skip
        settings.write_text(f"[quality]\n{text}\n")
        wrong = command_line.run("report", path, cwd=tmp_path)
        assert (wrong.returncode, wrong.stdout) == (2, ""), text
        assert message in wrong.stderr
        assert wrong.stderr.count("\n") == 1
