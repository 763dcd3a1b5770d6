"""What other tools answer, what is true, and what meshgauge answers, on the files of `examples/wrong_answers`."""

from __future__ import annotations

import importlib.util
import sys
from fractions import Fraction
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import optional
import pytest

import meshgauge
from meshgauge.status import STATUSES, Status

ROOT = Path(__file__).resolve().parent.parent


def load() -> ModuleType:
    """The example as a module; its dataclass asks `sys.modules` for it."""
    spec = importlib.util.spec_from_file_location("wrong_answers", ROOT / "examples" / "wrong_answers.py")
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


EXAMPLE = load()
# The program asks all that the tests have asked already.
EXAMPLE.answer, EXAMPLE.measured = cache(EXAMPLE.answer), cache(EXAMPLE.measured)
cases = pytest.mark.parametrize(
    "case", EXAMPLE.CASES, ids=[f"{c.tool}-{c.asked}-{c.file}-{c.cell}" for c in EXAMPLE.CASES]
)


@cases
def test_the_tool_answers_as_the_page_says(case: Any) -> None:
    found = EXAMPLE.installed(case.tool)
    if found is None:
        pytest.skip(f"{case.tool} is not installed")
    says = EXAMPLE.answer(case)
    tested = EXAMPLE.TESTED[case.tool]
    if found != tested and not EXAMPLE.agrees(says, case.says):
        pytest.skip(f"{case.tool} {found} now says {says!r}; {tested} said {case.says!r}")
    assert EXAMPLE.agrees(says, case.says), f"{case.tool} {found} says {says!r}"


@cases
def test_meshgauge_answers_as_the_page_says(case: Any) -> None:
    status, value = EXAMPLE.measured(case)
    if case.status == "unsupported":
        assert not STATUSES[Status[status.upper()]].is_valid
        assert not value >= 0
    else:
        assert status == case.status
        assert EXAMPLE.agrees(value, case.quality)


@cases
def test_the_page_has_the_case(case: Any) -> None:
    page = (ROOT / "docs" / "wrong-answers.md").read_text(encoding="utf-8")
    cells = [f"`{case.file}`", f"`{case.asked}`", f"`{EXAMPLE.written(case.says)}`", f"`{case.status}`"]
    assert any(all(cell in line for cell in cells) for line in page.splitlines()), cells


def test_every_file_is_a_case() -> None:
    assert {path.name for path in EXAMPLE.FILES.iterdir()} == {case.file for case in EXAMPLE.CASES}


def test_the_page_names_the_versions() -> None:
    page = (ROOT / "docs" / "wrong-answers.md").read_text(encoding="utf-8")
    assert all(version in page for version in EXAMPLE.TESTED.values())


def test_the_program_prints_a_row_a_case(capsys: pytest.CaptureFixture[str]) -> None:
    EXAMPLE.main()
    lines = capsys.readouterr().out.splitlines()
    asked = [case for case in EXAMPLE.CASES if EXAMPLE.installed(case.tool)]
    assert len(lines) == 2 + len(asked)
    for case, line in zip(asked, lines[2:], strict=True):
        assert line.startswith(case.file)
        assert all(text in line for text in (case.tool, case.asked, EXAMPLE.written(case.says), case.status))


# The truth, in whole and rational numbers.


def points(name: str) -> list[list[Fraction]]:
    """The coordinates of a file, exactly."""
    return [[Fraction(x) for x in row] for row in meshgauge.read(EXAMPLE.FILES / name).points.tolist()]


def determinant(rows: list[list[Fraction]]) -> Fraction:
    (a, b, c), (d, e, f), (g, h, i) = rows
    return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)


def corner(x: list[list[Fraction]], a: int, *neighbours: int) -> Fraction:
    return determinant([[p - q for p, q in zip(x[n], x[a], strict=True)] for n in neighbours])


def combined(weights: list[Fraction], x: list[list[Fraction]]) -> list[Fraction]:
    return [sum((w * p[axis] for w, p in zip(weights, x, strict=True)), Fraction(0)) for axis in range(3)]


def swept(x: list[list[Fraction]], t: Fraction) -> Fraction:
    """Determinant at height t of 0 to 1, at node 0's upright edge of a wedge or hexahedron."""
    n = len(x) // 2
    level = [combined([1 - t, t], [x[i], x[i + n]]) for i in (0, 1, n - 1)]
    sides = [[p - q for p, q in zip(level[i], level[0], strict=True)] for i in (1, 2)]
    return determinant([*sides, [p - q for p, q in zip(x[n], x[0], strict=True)]])


def test_corners_that_are_negative() -> None:
    hexahedron = points("hexahedron_corner_inverted.vtk")
    assert corner(hexahedron, 6, 5, 7, 2) == Fraction(-5, 4)
    assert points("polyhedron_corner_inverted.vtu") == hexahedron
    pyramid = points("pyramid_tangled.vtk")
    corners = [corner(pyramid, i, (i + 1) % 4, (i - 1) % 4, 4) for i in range(4)]
    assert corners == [8, Fraction(7, 8), Fraction(-5, 4), Fraction(7, 8)]


def test_vtk_gives_a_pyramid_a_shape_for_each_of_its_numberings() -> None:
    import pyvista

    x = meshgauge.read(EXAMPLE.FILES / "pyramid_tangled.vtk").points
    nodes = [[5, *((i + turn) % 4 for i in range(4)), 4] for turn in range(4)]
    shape = pyvista.UnstructuredGrid(np.ravel(nodes), [14] * 4, x).cell_quality("shape")["shape"]
    if EXAMPLE.installed("vtk") != EXAMPLE.TESTED["vtk"] and np.ptp(shape) < 1e-6:
        pytest.skip("this VTK has one shape for all numberings")
    np.testing.assert_allclose(shape, [0.541966, 0.083845, 0, 0.083845], atol=1e-6)
    ours = meshgauge.jens(x, np.array(nodes)[:, 1:], "pyramid")
    np.testing.assert_allclose(ours, ours[0], atol=1e-14)


def test_crossed_cells_are_negative_inside() -> None:
    """The parallel section is (1 - t) + a t wide one way, (1 - t) + b t the other; one is negative before the other."""
    quarter = Fraction(1, 4)
    assert swept(points("hexahedron_crossed.vtk"), quarter) == -5
    assert points("hexahedron_crossed.msh") == points("hexahedron_crossed.vtk")
    assert swept(points("hexahedron_crossed_middle.vtk"), Fraction(5, 12)) < 0
    assert swept(points("wedge_crossed.vtk"), quarter) < 0
    for t in (Fraction(0), Fraction(1)):
        assert swept(points("hexahedron_crossed.vtk"), t) > 0
        assert swept(points("hexahedron_crossed_middle.vtk"), t) > 0
        assert swept(points("wedge_crossed.vtk"), t) > 0


def test_the_wedge_that_gmsh_fails_is_valid() -> None:
    """The determinant is a quadratic on each upright edge, and these three hold its minimum."""
    x = points("wedge_valid.msh")
    least = []
    for turn in range(3):
        order = [(turn + i) % 3 + up for up in (0, 3) for i in range(3)]
        y = [x[i] for i in order]
        at = [swept(y, Fraction(i, 2)) for i in range(3)]
        curvature, slope = 2 * at[0] - 4 * at[1] + 2 * at[2], -3 * at[0] + 4 * at[1] - at[2]
        least += [at[0], at[2]]
        if curvature > 0 and 0 < (t := -slope / (2 * curvature)) < 1:
            least.append(swept(y, t))
    assert min(least) == Fraction(7, 16)


def test_the_tetra_with_a_middle_node_aside_is_negative_at_node_1() -> None:
    """Derivatives of its ten shape functions at node 1, where r = 1 and s = t = 0."""
    x = points("tetra10_folded.vtk")
    along_r = combined([Fraction(n) for n in (1, 3, 0, 0, -4, 0, 0, 0, 0, 0)], x)
    along_s = combined([Fraction(n) for n in (1, 0, -1, 0, -4, 4, 0, 0, 0, 0)], x)
    along_t = combined([Fraction(n) for n in (1, 0, 0, -1, -4, 0, 0, 0, 4, 0)], x)
    assert determinant([along_r, along_s, along_t]) == -32


def test_gmsh_contradicts_its_own_determinants_of_the_pyramid_of_13_nodes() -> None:
    gmsh = optional.gmsh()
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(EXAMPLE.FILES / "pyramid13_apex_low.msh"))
        heights = np.array([0.0, 0.25, 0.5, 0.75, 0.875, 0.96875])
        local = np.stack([0 * heights, 0 * heights, heights], axis=1)
        _, determinants, _ = gmsh.model.mesh.getJacobians(19, local.ravel())
    finally:
        gmsh.finalize()
    np.testing.assert_allclose(determinants, 4 * (3 - 4 * heights), atol=1e-12)


@pytest.mark.parametrize("writer", ["meshio", "meshioplusplus"])
@pytest.mark.parametrize("suffix", [".vtu", ".vtk"])
def test_wedges_are_written_in_the_old_order(writer: str, suffix: str, tmp_path: Path) -> None:
    """So that VTK, as it is now, finds a perfect wedge inside out; our reader turns it and says so."""
    library = pytest.importorskip(writer)
    x = [[0, 0, 0], [1, 0, 0], [0.5, 0.75**0.5, 0], [0, 0, 1], [1, 0, 1], [0.5, 0.75**0.5, 1]]
    path = tmp_path / f"wedge{suffix}"
    library.write(path, library.Mesh(np.array(x), [("wedge", np.arange(6)[None])]))
    asked = EXAMPLE.ask_pyvista(path, "scaled_jacobian", 0)
    if EXAMPLE.installed("vtk") == EXAMPLE.TESTED["vtk"]:
        assert asked == pytest.approx(-1)
    mesh = meshgauge.read(path)
    assert mesh.connectivity.tolist() in ([3, 5, 4, 0, 2, 1], [0, 1, 2, 3, 4, 5])
    assert "turned" in " ".join(mesh.notes)
    assert meshgauge.measure(mesh).values[0] == pytest.approx(1)
