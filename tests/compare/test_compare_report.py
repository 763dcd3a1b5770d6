"""``meshgauge compare`` as a user sees it, and the wording that does not oversell."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest
from compare_meshes import measured, mixed, tetra
from rich.console import Console

import meshgauge
from meshgauge import Quality
from meshgauge.cli.main import main
from meshgauge.compare import comparison
from meshgauge.compare.plot import comparison_chart
from meshgauge.compare.sentences import at_random, of_the_worst, sentences, which_is_better
from meshgauge.compare.text import ComparisonText

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "compare.md").read_text(encoding="utf-8")

Captured = pytest.CaptureFixture[str]


def write(path: Path, heights: Sequence[float]) -> str:
    meshgauge.write(path, tetra(heights))
    return str(path)


def said(a: Quality, b: Quality) -> tuple[str, str]:
    found = comparison({"a.vtu": a, "b.vtu": b})
    return at_random(found, found.against[0]), of_the_worst(found, found.against[0])


def test_the_better_one_is_named_first_with_how_often() -> None:
    low, high = measured([0.4, 0.5, 0.6, 0.7]), measured([0.65, 0.8, 0.9, 1.0])
    text, but = said(low, high)
    assert text == (
        "A random cell of b.vtu is better than a random cell of a.vtu in 94 % of all draws, worse in 6 %, "
        "equal in 0 %: a large difference."
    )
    assert but == ""
    assert said(high, low)[0] == text.replace("b.vtu", "x").replace("a.vtu", "b.vtu").replace("x", "a.vtu")


def test_the_worst_cells_have_a_say() -> None:
    steady, mostly = measured([0.4] * 10), measured([0.8] * 9 + [-1.0])
    text, but = said(steady, mostly)
    assert "b.vtu is better than a random cell of a.vtu in 90 %" in text
    assert but == "But a.vtu is better in invalid cells, min and 1 %: its worst cells are the better ones."
    alike, one_bad = mixed(4, 0.05, 0), mixed(4, 0.05, 0)
    points = one_bad.mesh.points.copy()
    points[0] += 0.3
    _, apart = said(alike, meshgauge.measure(one_bad.mesh.replace(points=points)))
    assert apart == "The worst cells tell them apart: a.vtu is better in min and 1 %."


def test_equal_meshes_and_least_values_below_0() -> None:
    cube = measured([0.5])
    assert said(cube, cube) == ("Every cell of b.vtu is as good as every cell of a.vtu.", "")
    found = comparison({"a.vtu": measured([-0.1, 1.0]), "b.vtu": measured([-1.0, 1.0])})
    assert "min" not in which_is_better(found)
    assert "significan" not in " ".join(sentences(found)).lower()


@pytest.mark.parametrize("width", [80, 100, 160])
@pytest.mark.parametrize("encoding", ["utf-8", "ascii"])
def test_text_fits_its_width(width: int, encoding: str, tmp_path: Path) -> None:
    found = comparison({f"dir/{n}.vtu": mixed(4, 0.3, n) for n in range(3)})
    with (tmp_path / "out").open("w", encoding=encoding) as file:
        Console(file=file, width=width, highlight=False, markup=False).print(ComparisonText(found))
    text = (tmp_path / "out").read_text(encoding=encoding)
    assert max(map(len, text.splitlines())) <= width
    for word in (
        "hexahedron",
        "degenerate",
        "not good",
        "2.vtu against 0.vtu",
        "largest losses",
        "How often, not how",
    ):
        assert word in text
    assert text.count("hexahedron  A") >= 1


def test_two_meshes(tmp_path: Path, capsys: Captured) -> None:
    a, b = write(tmp_path / "a.msh", [1.0, 0.1, -1.0]), write(tmp_path / "b.msh", [0.9, 0.6, 0.6])
    assert main(["compare", a, b]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert "Of 3 corresponding cells 2 are better, 1 worse and 0 equal; 1 became valid. 3 points moved" in out
    assert "b.msh is better in invalid cells (0 against 1), min" in out
    assert re.search(r"^ element 1 \(cell 0\) +tetra +0\.707 +0\.\d{3} +ok", out, re.MULTILINE)
    assert main(["compare", a, b, "-q"]) == 0
    assert capsys.readouterr().out.count("\n") == 3


def test_json_is_as_described(tmp_path: Path, capsys: Captured) -> None:
    a, b = write(tmp_path / "a.msh", [1.0, 0.1]), write(tmp_path / "b.msh", [0.5, 0.6])
    assert main(["compare", a, b, str(tmp_path / "none.msh"), "--json"]) == 2
    out, err = capsys.readouterr()
    assert "none.msh: no such file" in err
    document = json.loads(out)
    assert (document["schema"], document["version"]) == ("meshgauge-compare", 3)
    assert document["errors"][0]["path"].endswith("none.msh")
    found = document["comparison"]
    (one,) = found["against"]
    assert one["mesh"] == b
    described = PAGE[PAGE.index("## JSON") :]
    items = [document, found, one, one["superiority"]["all"], one["paired"], one["paired"]["all"]]
    for item in (*items, one["paired"]["losses"][0], found["criteria"]["all"]["min"]):
        assert {key for key in item if f"`{key}`" not in described} == set()


def test_what_cannot_be_compared_is_one_line(tmp_path: Path, capsys: Captured) -> None:
    a, b = write(tmp_path / "a.msh", [1.0]), write(tmp_path / "b.msh", [1.0])
    before = Path(a).read_bytes()
    for words, message in (
        ([a], "is one mesh; give two or more"),
        ([a, a], "is one mesh; give two or more"),
        ([a, b, "--plot", a], "is an input; it is not overwritten"),
        ([a, b, "--plot", "x.gif"], "pictures are written as png, svg, pdf"),
        ([a, str(tmp_path / "none.msh")], "none.msh: no such file"),
    ):
        assert main(["compare", *words]) == 2
        err = capsys.readouterr().err
        assert err.startswith("meshgauge: error: ")
        assert err.count("\n") == 1
        assert message in err
    assert Path(a).read_bytes() == before


def test_a_picture(tmp_path: Path, capsys: Captured) -> None:
    pytest.importorskip("matplotlib")
    a, b = write(tmp_path / "a.msh", [1.0, 0.1]), write(tmp_path / "b.msh", [0.5, 0.6])
    assert main(["compare", a, b, "-q", "--plot", str(tmp_path / "c.svg")]) == 0
    assert main(["compare", a, b, "-q", "--plot", str(tmp_path / "c.png")]) == 0
    text = (tmp_path / "c.svg").read_text(encoding="utf-8")
    assert text.count("<path") > 20
    assert (tmp_path / "c.png").read_bytes().startswith(b"\x89PNG")
    capsys.readouterr()


def test_the_picture_holds_what_was_compared() -> None:
    pytest.importorskip("matplotlib")

    found = comparison({"a": mixed(3, 0.3, 0), "b": mixed(3, 0.1, 0)})
    figure = comparison_chart(found, names=["before", "after"])
    assert len(figure.axes) == 2 * len(found.rows)
    texts = {text.get_text() for text in figure.texts}
    assert {"before", "after"} <= texts
    least = [line.get_xdata()[0] for line in figure.axes[-1].lines if len(line.get_xdata()) == 1]
    assert least == pytest.approx([side.summary.all.min for side in found.sides])


def test_the_commands_of_the_page(tmp_path: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib")
    (tmp_path / "examples").symlink_to(ROOT / "examples", target_is_directory=True)
    monkeypatch.chdir(tmp_path)
    lines = [line for block in re.findall(r"^```sh\n(.*?)^```$", PAGE, re.S | re.M) for line in block.splitlines()]
    assert len(lines) == 4
    for line in lines:
        assert main(shlex.split(line)[1:]) == 0, line
        assert capsys.readouterr().out


def test_in_a_process_with_a_closed_pipe(tmp_path: Path) -> None:
    a, b = write(tmp_path / "a.msh", [1.0]), write(tmp_path / "b.msh", [0.5])
    command = [sys.executable, "-m", "meshgauge", "compare", a, b]
    done = subprocess.run(
        command, capture_output=True, encoding="ascii", env={**os.environ, "PYTHONIOENCODING": "ascii"}
    )
    assert (done.returncode, done.stderr) == (0, "")
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        assert process.stderr.read() == ""
    assert process.returncode == 0
