"""Files of several time steps on the command line: the gate holds every one, a change needs one that is named."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from thinned import quick

from meshgauge import io
from meshgauge.cli import batch
from meshgauge.cli.main import main
from meshgauge.mesh import Mesh
from meshgauge.report.over_time_text import sparkline
from meshgauge.report.record import StepOf
from meshgauge.report.states import StateJob, StateReader, measuring

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
    assert len(lines) == 8
    assert lines[3] == f"worst over time: {run}, step 2 (time 1), 1 invalid, minimum -0.707"
    assert lines[4:] == [
        f"3 steps of {run}",
        "  minimum  █▁▇  0.707 first, -0.707 least, 0.447 last",
        "  1 %      █▁▇  0.707 first, -0.707 least, 0.447 last",
        "  invalid  ▁█▁  0 first, 1 most, 0 last",
    ]
    for step in ("4", "0", "middle"):
        assert main(["report", str(run), "-q", "--step", step]) == 2
        assert "step" in capsys.readouterr().err


def test_steps_with_the_same_points_are_said_to_be_one(tmp_path: Path, capsys: Captured) -> None:
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
    io.write(tmp_path / "a.vtu", Mesh.from_arrays(points, [("tetra", [(0, 1, 2, 3)])], point_data={"u": -2 * points}))
    path = tmp_path / "a.pvd"
    sets = "".join(f'<DataSet timestep="{n}" file="a.vtu"/>' for n in range(3))
    path.write_text(f'<VTKFile type="Collection"><Collection>{sets}</Collection></VTKFile>')
    assert main(["report", str(path), "--step", "all"]) == 0
    out, err = capsys.readouterr()
    assert f"note: {path}: its 3 time steps have the same points, and are one; --displacement" in err
    assert len(out.splitlines()) == 1
    for more in (["--step", "all", "--displacement", "u"], ["--step", "all", "-q"], []):
        assert main(["report", str(path), *more]) == 0
        assert "are one" not in capsys.readouterr().err


def test_json_has_the_steps_and_how_they_go(run: Path, capsys: Captured) -> None:
    assert main(["report", str(run), "--step", "all", "--json"]) == 0
    made = json.loads(capsys.readouterr().out)
    assert [one["step"] for one in made["files"]] == [
        {"file": str(run), "number": number, "time": number - 1.0} for number in (1, 2, 3)
    ]
    (trend,) = made["over_time"]
    assert (trend["file"], trend["steps"], trend["times"]) == (str(run), [1, 2, 3], [0.0, 1.0, 2.0])
    assert (trend["n_invalid"], trend["worst_step"]) == ([0, 1, 0], 2)
    assert trend["min"] == [one["all"]["min"] for one in made["files"]]
    assert trend["one_percent"] == [one["all"]["quantiles"]["0.01"] for one in made["files"]]
    assert main(["report", str(run), "--json"]) == 0
    alone = json.loads(capsys.readouterr().out)
    assert (alone["over_time"], alone["files"][0]["step"]) == ([], None)


@pytest.mark.parametrize(("most", "n"), [(5_000_000, 2), (0, 1)], ids=["whole", "in slices"])
def test_processes_give_the_same(
    run: Path, most: int, n: int, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    monkeypatch.setattr(batch, "DIAGNOSED", most)
    (run.parent / "s2.vtu").write_text("no mesh")
    arguments = ["report", str(run), "--step", "all", "--json"]
    assert main(arguments) == 2
    expected, said = capsys.readouterr()
    assert main([*arguments, "--scheduler", str(n)]) == 2
    made, also_said = capsys.readouterr()
    assert json.loads(made) == json.loads(expected)
    assert also_said == said
    assert len(json.loads(made)["files"]) == 2


def test_what_a_killed_process_left_is_measured_here(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    reader = StateReader(None, False, None, "auto", None, io.Limits(), 10, None)
    job = StateJob(reader, ("jens",), 3, False, True)
    steps = [(str(number), StepOf(str(run), number), job) for number in (1, 2)]

    class Killed(ThreadPoolExecutor):
        def submit(self, *arguments: Any) -> Any:  # type: ignore[override]
            future: Future[Any] = Future()
            future.set_exception(BrokenProcessPool("killed"))
            return future

    with Killed() as pool, measuring(pool, steps) as states:
        made = [states.result(name) for name, _, _ in steps]
    assert [one.summary.all.n_invalid for one in made] == [0, 1]
    assert [one.step for one in made] == [step for _, step, _ in steps]


@pytest.mark.parametrize(
    ("most", "n", "rules"),
    quick(
        [(most, n, rules) for most, n in ((5_000_000, 2), (0, 1)) for rules in ("jens >= 0.5", "")],
        (5_000_000, 2, ""),
        (0, 1, "jens >= 0.5"),
    ),
)
def test_processes_check_the_same(
    run: Path, most: int, n: int, rules: str, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    monkeypatch.setattr(batch, "DIAGNOSED", most)
    (run.parent / "s2.vtu").write_text("no mesh")
    arguments = ["check", str(run), *(["--fail", rules] if rules else []), "--json"]
    code = main(arguments)
    expected, said = capsys.readouterr()
    with monkeypatch.context() as patch:
        patch.setattr(batch.Batch, "measure", None)  # nothing is measured here
        patch.setattr(batch.Batch, "in_slices", None)
        assert main([*arguments, "--scheduler", str(n)]) == code == 2
    made, also_said = capsys.readouterr()
    assert json.loads(made) == json.loads(expected)
    assert also_said == said
    assert [len(one["outcomes"]) for one in json.loads(made)["files"]] == [1 if rules else 5] * 2


def test_the_gate_shows_how_the_steps_go(run: Path, capsys: Captured) -> None:
    assert main(["check", str(run)]) == 1
    assert "  invalid  ▁█▁  0 first, 1 most, 0 last" in capsys.readouterr().out.splitlines()
    assert main(["check", str(run), "--json"]) == 1
    (trend,) = json.loads(capsys.readouterr().out)["over_time"]
    assert (trend["n_invalid"], trend["worst_step"]) == ([0, 1, 0], 2)


def test_a_page_shows_how_the_steps_go(run: Path, capsys: Captured) -> None:
    page = run.parent / "a.html"
    assert main(["report", str(run), "--step", "all", "--html", str(page)]) == 0
    text = page.read_text()
    assert "Over time: <bdi>" in text
    first = (
        "The first of 3 steps with invalid cells is step 2 (time 1); the worst is step 2 (time 1), with 1 invalid cell."
    )
    assert first in text
    assert 'aria-label="minimum, step by step, from -0.707 to 0.707"' in text
    assert "<title>step 3 (time 2): 0.447</title>" in text
    assert main(["report", str(run), "--html", str(page)]) == 0
    assert "Over time" not in page.read_text()
    capsys.readouterr()


def test_a_chart_shows_how_the_steps_go(run: Path, capsys: Captured) -> None:
    out = run.parent / "a.svg"
    assert main(["plot", str(run), "--kind", "steps", "-o", str(out)]) == 0
    text = out.read_text()
    for word in ("minimum", "1 %", "invalid", "first invalid at time 1", "3 steps"):
        assert word in text, word
    out.unlink()
    for given, said in (
        ([str(run.parent / "s0.vtu")], "several time steps"),
        ([str(run), str(run.parent / "s0.vtu")], "one file"),
        ([str(run), "--metric", "edge_ratio"], "one file"),
        ([str(run), "--log"], "--log is of"),
    ):
        assert main(["plot", *given, "--kind", "steps", "-o", str(out)]) == 2
        assert said in capsys.readouterr().err.replace("\n", " ")
        assert not out.exists()


def test_the_first_step_that_breaks_a_rule_is_named(run: Path, capsys: Captured) -> None:
    assert main(["check", str(run), "--fail", "nothing invalid"]) == 1
    out = capsys.readouterr().out
    assert f"first step that breaks a rule: {run}, step 2 (time 1): nothing invalid" in out.replace("\n", " ")
    assert main(["check", str(run), "--fail", "jens >= 0.5", "--json"]) == 1
    made = json.loads(capsys.readouterr().out)
    assert made["first_failing_step"] == f"{run}, step 2 (time 1)"
    assert made["files"][1]["step"]["time"] == 1.0
    assert main(["check", str(run), "--fail", "jens >= -1", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["first_failing_step"] is None


@pytest.mark.parametrize(
    ("values", "extreme", "line"),
    [
        ([1.0, 2.0, 3.0], min, "▁▅█"),
        ([0.5, 0.5], min, "▄▄"),
        ([math.nan, 1.0, 0.0], min, " █▁"),
        ([0] * 119 + [7], max, "▁" * 59 + "█"),
        ([9] * 60 + [1] + [9] * 59, min, "█" * 30 + "▁" + "█" * 29),
    ],
)
def test_sparklines(values: list[float], extreme: Callable[[Sequence[float]], float], line: str) -> None:
    assert sparkline(values, extreme) == line


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
    assert main(["doctor", str(run), "-q", "--step", "all"]) == 1
    assert "step 3 (time 2)" in capsys.readouterr().out
    assert main(["compare", str(run), "-q", "--step", "all"]) == 0
    assert main(["plot", str(run), "-o", str(tmp_path / "a.svg"), "-q", "--step", "last"]) == 0
    capsys.readouterr()


def test_steps_of_one_file_keep_their_order(run: Path, capsys: Captured) -> None:
    """The third is the first again, and left out; the trend goes on in time."""
    run.write_text(run.read_text().replace("s2.vtu", "s0.vtu"))
    assert main(["report", str(run), "--step", "all"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.removeprefix(f"{run}, ")[:6] for line in lines[:2]] == ["step 1", "step 2"]
    assert any("0.707 first, -0.707 least, -0.707 last" in line for line in lines)


@pytest.mark.parametrize("large", [0, 10**9])
def test_a_step_that_is_missing_costs_no_other(
    run: Path, large: int, capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(batch, "LARGE", large)
    run.with_name("s1.vtu").unlink()
    assert main(["report", str(run), "--step", "all", "-q"]) == 2
    said = capsys.readouterr()
    assert "step 1 (time 0)" in said.out
    assert "step 3 (time 2)" in said.out
    assert said.err.splitlines() == [f"meshgauge: error: {run}, step 2 (time 1): refers to s1.vtu, which is missing"]
