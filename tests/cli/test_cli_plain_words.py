"""Wrong usage is answered in one line of our own words, with what may be meant, and nothing is written."""

from __future__ import annotations

from pathlib import Path

import pytest

from meshgauge.cli.command import in_plain_words
from meshgauge.cli.main import main

GOOD = str(Path(__file__).resolve().parents[2] / "examples" / "meshes" / "bracket_good.vtu")
MESH = str(Path(GOOD).with_name("bracket_small.msh"))
Captured = pytest.CaptureFixture[str]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["report", MESH, "--by", "regoin"], "there is no 'regoin'; did you mean 'region'?"),
        (["report", MESH, "--dimension", "4"], "there is no '4'; there are auto, 2, 3"),
        (["report", MESH, "--for", "explict"], "there is no 'explict'; did you mean 'explicit'?"),
        (["report", MESH, "--worst", "x"], "expected a whole number ("),
        (["report", MESH, "--worst", "-1"], "expected 0 or more"),
        (["improve", MESH, "-o", "a.vtu", "--target", "x"], "expected a number ("),
        (["view", MESH, GOOD, MESH], "is given twice"),
        (["report", MESH, "--partial", "a.txt"], "a partial report is a .mgp file"),
        (["paraview-plugin", "--preset", "a.txt"], "from .json files"),
    ],
    ids=lambda one: " ".join(one[2:])[-24:] if isinstance(one, list) else "",
)
def test_wrong_usage(
    words: list[str], message: str, capsys: Captured, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(words) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert message in err
    for word in ("Value error", "Input should", "parse"):
        assert word not in err
    assert list(tmp_path.iterdir()) == []


def test_other_words_stay() -> None:
    assert in_plain_words("No such option: --wurst") == "No such option: --wurst"


def test_a_mesh_of_no_bad_cells_is_not_written(capsys: Captured, tmp_path: Path) -> None:
    for name, is_written in (("bad.vtu", False), ("bad.txt", True)):
        target = tmp_path / name
        assert main(["report", GOOD, "--bad", str(target), "--no-diagnosis"]) == 0
        out, err = capsys.readouterr()
        assert target.exists() is is_written
        assert out.splitlines()[-1].endswith("0 bad cells") is is_written
        assert (f"note: {target}: there are no bad cells: nothing is written\n" in err) is not is_written
    for quiet in ("-q", "--json"):  # what was asked for and is not there is said in any case
        assert main(["report", GOOD, "--bad", str(tmp_path / "bad.vtu"), "--no-diagnosis", quiet]) == 0
        assert "there are no bad cells: nothing is written" in capsys.readouterr().err
