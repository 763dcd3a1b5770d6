"""Many meshes: statistics, rules by name, mending into new files, watching; and rules for explicit time steps."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from check_meshes import mesh

import meshgauge
from meshgauge.check import State
from meshgauge.check import check as judge
from meshgauge.check.judge import PROFILES, default_rules
from meshgauge.check.settings import SettingsError, load
from meshgauge.cli import watch
from meshgauge.cli.main import main
from meshgauge.look.bands import PoorBelow

Captured = pytest.CaptureFixture[str]
KINDS = {"good": ["good"] * 3, "low": ["good", "low"], "bad": ["inverted", "good", "inverted"]}


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for folder in ("fine", "coarse"):
        (tmp_path / folder).mkdir()
        for name, kinds in KINDS.items():
            meshgauge.write(f"{folder}/{name}.vtu", mesh(*kinds))
    return tmp_path


def test_statistics_are_sums_over_the_meshes(here: Path, capsys: Captured) -> None:
    rules = ["--fail", "nothing invalid", "--warn", "jens >= 0.2", "--fail", "nothing inverted in nowhere"]
    assert main(["check", "fine", "--json", "--statistics", *rules]) == 2
    document = json.loads(capsys.readouterr().out)
    outcomes = [one for file in document["files"] for one in file["outcomes"]]
    for row in document["statistics"]:
        own = [one for one in outcomes if one["rule"] == row["rule"]]
        broken = [one for one in own if one["state"] in ("fail", "warn")]
        assert (row["n_meshes"], row["n_broken"]) == (len(own), len(broken)) == (3, len(broken))
        assert row["n_cells"] == sum(one["n_failing"] for one in broken)
        assert row["n_unchecked"] == sum(one["state"] == "unchecked" for one in own)
    by_rule = {row["rule"]: row for row in document["statistics"]}
    assert (by_rule["nothing invalid"]["n_broken"], by_rule["nothing invalid"]["worst"]) == (1, "fine/bad.vtu")
    assert (by_rule["jens >= 0.2"]["n_broken"], by_rule["jens >= 0.2"]["n_cells"]) == (2, 3)
    assert document["statistics"][0]["n_unchecked"] == 3
    assert main(["check", "fine", "--statistics", *rules[:4]]) == 1
    text = capsys.readouterr().out
    assert text.startswith("2 of 3 meshes pass")
    assert "worst" not in text
    assert "fine/bad.vtu" in text


def test_rules_by_name_take_the_place_of_those_of_all(here: Path, capsys: Captured) -> None:
    Path("meshgauge.toml").write_text(
        "[check]\nfail = ['jens >= 0.9']\n[check.files.'fine/*.vtu']\nfail = ['nothing invalid']\n"
        "[check.files.'bad.*']\nwarn = ['nothing invalid']\n"
    )

    def rules(*words: str) -> dict[str, tuple[str, ...]]:
        main(["check", "fine", "coarse", "--json", *words])
        files = json.loads(capsys.readouterr().out)["files"]
        return {file["path"]: tuple(f"{one['level']} {one['rule']}" for one in file["outcomes"]) for file in files}

    assert rules() == {
        **{f"fine/{name}.vtu": ("fail nothing invalid",) for name in KINDS},
        **{f"coarse/{name}.vtu": ("fail jens >= 0.9",) for name in KINDS},
        "coarse/bad.vtu": ("warn nothing invalid",),
    }
    assert set(rules("--fail", "nothing poor").values()) == {("fail nothing poor",)}
    Path("meshgauge.toml").write_text("[check.files.'nowhere/*']\nfail = ['jens => 0.9']\n")
    assert main(["check", "fine"]) == 2
    assert "check.files.'nowhere/*'.fail[0]" in capsys.readouterr().err


WRONG = (
    "files = 3",
    "[check.files]\n'a' = ['x']",
    "[check.files.'a']\nmeshes = ['b']",
    "[check.files.a]\nfail = 'x'",
)


@pytest.mark.parametrize("wrong", WRONG)
def test_wrong_tables_of_names_are_refused(wrong: str, tmp_path: Path) -> None:
    path = tmp_path / "meshgauge.toml"
    path.write_text(f"[check]\n{wrong}\n")
    with pytest.raises(SettingsError, match=r"check\.files"):
        load(path)


def test_fix_writes_new_files_and_leaves_the_inputs(here: Path, capsys: Captured) -> None:
    before = {path: path.read_bytes() for path in here.rglob("*.vtu")}
    assert main(["check", "fine", "--fix", "out", "-q"]) == 1
    text = capsys.readouterr().out
    assert "fixed: out/bad.vtu: 2 cells renumbered, now: " in text
    assert [path.name for path in Path("out").iterdir()] == ["bad.vtu"], "nothing is left between, what passes stays"
    assert {path: path.read_bytes() for path in before} == before
    fixed = meshgauge.measure(meshgauge.read("out/bad.vtu"))
    assert not meshgauge.status.is_invalid(fixed.status).any()
    np.testing.assert_array_equal(fixed.mesh.points, meshgauge.read("fine/bad.vtu").points)
    for words, message in (
        (["fine", "--fix", "out"], "is there already"),
        (["fine", "coarse", "--fix", "new"], "both have one"),
        (["fine", "--fix", "fine/bad.vtu"], "is no folder"),
    ):
        assert main(["check", *words]) == 2
        errors = capsys.readouterr()
        assert message in errors.err
        assert errors.out == ""
    assert not Path("new").exists()


def test_fix_says_why_a_folder_cannot_be_made(here: Path, capsys: Captured) -> None:
    assert main(["check", "fine", "--fix", "fine/good.vtu/new", "-q"]) == 2
    out, err = capsys.readouterr()
    assert (out, err) == ("", f"meshgauge: error: fine/good.vtu/new: {here / 'fine' / 'good.vtu'} is no folder\n")


def test_watching_checks_again_when_a_file_changes(
    here: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    Path("meshgauge.toml").write_text("[check]\nfail = ['nothing invalid']\n")
    steps: list[Any] = [
        lambda: None,
        lambda: Path("fine/bad.vtu").write_bytes(Path("fine/good.vtu").read_bytes()),
        lambda: None,
        lambda: Path("meshgauge.toml").write_text("[check]\nfail = ['nothing inv"),
        lambda: None,
        lambda: Path("meshgauge.toml").write_text("[check]\nfail = ['jens >= 0.9']\n"),
        lambda: None,
    ]

    def sleep(_: float) -> None:
        if not steps:
            raise KeyboardInterrupt
        steps.pop(0)()

    monkeypatch.setattr(watch, "sleep", sleep)
    assert main(["check", "fine/bad.vtu", "-q"]) == 1
    capsys.readouterr()
    assert main(["check", "fine/bad.vtu", "-q", "--watch"]) == 130
    out, err = capsys.readouterr()
    verdicts = [line.partition(": ")[2] for line in out.splitlines()]
    assert verdicts == ["1 of 1 rule fails: nothing invalid", "the rule holds", "1 of 1 rule fails: jens >= 0.9"]
    assert err.count("meshgauge: watching: ") == 4
    assert "meshgauge.toml" in err


def test_explicit_time_steps_ask_for_no_poor_cell(here: Path, capsys: Captured) -> None:
    texts = {profile: [f"{one.level} {one}" for one in default_rules(profile)] for profile in PROFILES}
    assert texts["explicit"] == [*texts["fem"][:-1], "warn jens >= 0.2", "warn edge_ratio >= 0.1"]
    assert str(default_rules("explicit", PoorBelow(0.3))[-2]) == "nothing poor"
    quality = meshgauge.measure(mesh(*["good"] * 150, "low"), metrics="edge_ratio")
    states = {
        profile: [one.state for one in judge(quality, default_rules(profile)).outcomes]
        for profile in ("fem", "explicit")
    }
    assert State.WARN not in states["fem"]
    assert State.WARN in states["explicit"]
    assert main(["check", "fine/low.vtu", "--for", "explicit", "--json"]) == 0
    (file,) = json.loads(capsys.readouterr().out)["files"]
    assert [one["rule"] for one in file["outcomes"]][-2:] == ["jens >= 0.2", "edge_ratio >= 0.1"]
    assert main(["report", "fine/low.vtu", "--for", "explicit", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["files"][0]["purpose"] == "fem"
