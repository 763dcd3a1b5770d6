"""What a newcomer meets first: help, names that are none, completion, explanations."""

from __future__ import annotations

import json
from pathlib import Path

import command_line
import pytest

from meshgauge.cli.main import main
from meshgauge.quality.metrics import METRICS
from meshgauge.status import STATUSES


def test_alone_it_prints_its_help() -> None:
    done = command_line.run()
    assert (done.returncode, done.stderr) == (0, "")
    assert "Usage: meshgauge" in done.stdout


def test_a_subcommand_alone_prints_its_help_and_no_empty_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["report"]) == 2
    streams = capsys.readouterr()
    assert "Usage: meshgauge report" in streams.out + streams.err
    assert "error" not in streams.err


@pytest.mark.parametrize("command", [[], ["report"], ["metrics"], ["check"], ["improve"], ["view"]])
def test_no_type_of_python_in_a_help(command: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*command, "--help"]) == 0
    text = capsys.readouterr().out
    for word in ("<bool>", "list[str]", "<str>", "BOOLEAN"):
        assert word not in text


@pytest.mark.parametrize(
    ("typed", "expected"),
    [
        ("meshgauge rep", "report"),
        ("meshgauge report --metric scaled_j", "scaled_jacobian"),
        ("meshgauge report --format vt", "vtu\nvtk-xml\nvtp\nvtk\nvtkhdf"),
        ("meshgauge explain edge", "edge_ratio"),
    ],
)
def test_shells_complete(typed: str, expected: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("_MESHGAUGE_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", typed)
    monkeypatch.setenv("COMP_CWORD", str(len(typed.split()) - 1))
    done = command_line.run()
    assert done.stdout.strip() == expected


@pytest.mark.parametrize("name", [row.name for row in STATUSES.values()])
def test_every_status_is_explained(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", name]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert f"{name} a status of cells" in text
    assert "counts as" in text


def test_a_metric_a_purpose_and_rules(capsys: pytest.CaptureFixture[str]) -> None:
    rules = ["jens >= 0.2 @ 1% for tetra", "nothing hanging @ 3 cells in inlet", "no worse than a.json within 0.01"]
    assert main(["explain", "edge_ratio", "fv", *rules]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert METRICS["edge_ratio"].reference.split(",")[0] in text
    assert "fail non_orthogonality <= 70" in text
    assert "warn jens >= 0.2 @ 1%" in text
    assert "a share of at most 1%" in text
    assert "the solid cells for tetra" in text
    assert "at most 3 of the cells" in text
    assert "worse by no more than 0.01" in text


def test_what_has_no_meaning_is_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", "inverted_insid"]) == 2
    assert "nothing is called 'inverted_insid'; did you mean 'inverted_inside'?" in capsys.readouterr().err


def test_metrics_for_programs(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["metrics", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert (listed["schema"], listed["version"]) == ("meshgauge-metrics", 1)
    assert [one["name"] for one in listed["metrics"]] == list(METRICS)
    row = listed["metrics"][0]
    assert row["range"] == [-1.0, 1.0]
    assert row["shapes"]["tetra"] == {"ideal": 1.0, "acceptable": [0.2, 1.0]}
    assert main(["metrics", "skewness", "--json"]) == 0
    (one,) = json.loads(capsys.readouterr().out)["metrics"]
    assert one["where"] == ["cell", "face"]


def test_settings_to_begin_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from meshgauge.check.settings import load

    monkeypatch.chdir(tmp_path)
    assert main(["check", "--init"]) == 0
    settings = load(tmp_path / "meshgauge.toml")
    assert "nothing invalid" in settings.fail
    assert settings.warn == ("jens >= 0.2 @ 1%",)
    text = (tmp_path / "meshgauge.toml").read_text()
    assert main(["check", "--init"]) == 2
    assert "holds settings already" in capsys.readouterr().err
    assert (tmp_path / "meshgauge.toml").read_text() == text


def test_exit_codes_of_what_is_found(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bracket = str(Path(__file__).resolve().parents[2] / "examples" / "meshes" / "bracket.vtu")
    missing = str(tmp_path / "none.vtu")
    for command in ("check", "doctor"):
        assert main([command, bracket, "-q"]) == 1
        assert main([command, bracket, "-q", "--exit-zero"]) == 0
        assert main([command, missing, "-q", "--exit-zero"]) == 2
    assert main(["doctor", bracket.replace("bracket", "bracket_good"), "-q"]) == 0
