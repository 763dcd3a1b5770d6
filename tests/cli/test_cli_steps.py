"""Files of several time steps on the command line: the gate holds every one, a change needs one that is named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from meshgauge import io
from meshgauge.cli.main import main
from meshgauge.mesh import Mesh

pytestmark = pytest.mark.usefixtures("readers_here")

Captured = pytest.CaptureFixture[str]


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """Three steps of a tetrahedron; the second is inverted."""
    sets = []
    for n, height in enumerate((1.0, -1.0, 0.5)):
        points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, height)])
        moved = np.zeros((4, 3))
        moved[3, 2] = -3 * height
        mesh = Mesh.from_arrays(points, [("tetra", [(0, 1, 2, 3)])], point_data={"u": moved})
        io.write(tmp_path / f"s{n}.vtu", mesh)
        sets.append(f'<DataSet timestep="{n}" file="s{n}.vtu"/>')
    path = tmp_path / "run.pvd"
    path.write_text(f'<VTKFile type="Collection"><Collection>{"".join(sets)}</Collection></VTKFile>')
    return path


def test_the_gate_holds_every_step_and_names_the_one_that_fails(run: Path, capsys: Captured) -> None:
    assert main(["check", str(run), "-q"]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert [line.removeprefix(f"{run}, ").split(":")[0] for line in lines] == [
        "step 1 (time 0)",
        "step 2 (time 1)",
        "step 3 (time 2)",
    ]
    assert ["fails" in line for line in lines] == [False, True, False]
    for step, code in (("first", 0), ("1", 0), ("2", 1), ("last", 0), ("all", 1)):
        assert main(["check", str(run), "-q", "--step", step]) == code
    assert main(["check", str(run), "-q", "--step", "first", "--displacement", "u"]) == 1
    capsys.readouterr()


def test_a_report_reads_the_first_and_says_so(run: Path, capsys: Captured) -> None:
    assert main(["report", str(run)]) == 0
    assert "holds 3 time steps; the first (time 0) was read" in capsys.readouterr().out
    assert main(["report", str(run), "--step", "all"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 4
    assert lines[3] == f"worst over time: {run}, step 2 (time 1), 1 invalid, minimum -0.707"
    for step in ("4", "0", "middle"):
        assert main(["report", str(run), "-q", "--step", step]) == 2
        assert "step" in capsys.readouterr().err


def test_a_change_needs_a_step_that_is_named(run: Path, tmp_path: Path, capsys: Captured) -> None:
    out = tmp_path / "out.vtu"
    for command in (["orient"], ["improve", "-q"]):
        assert main([*command, str(run), "-o", str(out)]) == 2
        assert "holds 3 time steps; --step says which one" in capsys.readouterr().err
        assert main([*command, str(run), "-o", str(out), "--step", "all"]) == 2
        assert main([*command, str(run), "-o", str(out), "--step", "1", "--displacement", "u"]) == 2
        assert not out.exists()
    assert main(["orient", str(run), "-o", str(out), "--step", "3"]) == 0
    assert io.read(out).points[3, 2] == 0.5
    capsys.readouterr()


def test_other_commands_take_a_step(run: Path, tmp_path: Path, capsys: Captured) -> None:
    assert main(["doctor", str(run), "-q", "--step", "all"]) == 0
    assert "step 3 (time 2)" in capsys.readouterr().out
    assert main(["compare", str(run), "-q", "--step", "all"]) == 0
    assert main(["plot", str(run), "-o", str(tmp_path / "a.svg"), "-q", "--step", "last"]) == 0
    capsys.readouterr()
