"""The example of Voronoi cells runs, and says what the page says."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "polyhedra.py"


def test_voronoi_cells_improve_under_relaxation(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("scipy")
    pytest.importorskip("matplotlib")
    pytest.importorskip("pyvista")
    runpy.run_path(str(EXAMPLE))["main"](tmp_path, n=40, steps=5)
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    means = [float(line[3]) for line in lines[1:5]]
    assert means == sorted(means)
    scores = [float(line[-1]) for line in lines[5:]]
    assert scores[:3] == [1.0, 1.0, 1.0]
    assert scores[-1] == 1.0
    assert scores[3] < scores[4] < 1.0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["lloyd.png", "polyhedra.png"]
