"""What shells are given to complete: subcommands, files of known formats, metrics, formats, rules."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import command_line
import pytest

from meshgauge.cli import completion


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in ("bracket.vtu", "bracket.txt", "brick.msh.gz", ".hidden.vtu", "a b.inp"):
        (tmp_path / name).touch()
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / "first.case").touch()
    monkeypatch.chdir(tmp_path)
    return tmp_path


def completed(words: list[str], monkeypatch: pytest.MonkeyPatch, shell: str = "bash") -> list[str]:
    """As the script of the shell asks."""
    monkeypatch.setenv("_MESHGAUGE_COMPLETE", f"complete_{shell}")
    monkeypatch.setenv("COMP_WORDS", "\n".join(["meshgauge", *words]))
    monkeypatch.setenv("COMP_CWORD", str(len(words)))
    monkeypatch.setenv("_TYPER_COMPLETE_ARGS", " ".join(["meshgauge", *words]))
    monkeypatch.setenv("_TYPER_COMPLETE_FISH_ACTION", "get-args")
    return [line.split("\t")[0] for line in command_line.run().stdout.splitlines() if line]


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["impr"], ["improve"]),
        (["report", "--metric", "scaled_j"], ["scaled_jacobian"]),
        (["report", "--format", "aba"], ["abaqus"]),
        (["report", "--for", ""], ["fem", "fv", "explicit"]),
        (["report", "--compare-m"], ["--compare-metric"]),
        (["report", "br"], ["bracket.vtu", "brick.msh.gz"]),
        (["improve", "br"], ["bracket.vtu", "brick.msh.gz"]),
        (["compare", "bracket.vtu", "bri"], ["brick.msh.gz"]),
        (["report", ""], [r"a\ b.inp", "bracket.vtu", "brick.msh.gz", "runs/"]),
        (["report", "runs/"], ["runs/first.case"]),
        (["report", "ru"], []),  # a folder alone: the shell does that better
        (["report", "none/"], []),
        (["check", "--fail", "'nothing inverted_"], ["nothing inverted_inside"]),
        (["check", "--warn", "warp"], [r"warpage\ \<=\ "]),
        (["explain", "inverted_"], ["inverted_inside"]),
        (["explain", "expl"], ["explicit"]),
        (["metrics", "skew"], ["skewness"]),
        (["schema", "improve-"], ["improve-several"]),
    ],
)
def test_bash(words: list[str], expected: list[str], here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = completed(words, monkeypatch)
    assert found == expected


def test_fish_marks_blanks_itself(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert "nothing invalid" in completed(["check", "--fail", "noth"], monkeypatch, "fish")


def test_rules_are_understood() -> None:
    from meshgauge.check import rule

    for text in completion.rules(""):
        if not text.endswith(" "):
            rule(text)
    assert {"nothing invalid", "nothing poor", "no worse than "} <= set(completion.rules("no"))


@pytest.mark.long
def test_in_a_real_bash(here: Path) -> None:
    if shutil.which("bash") is None:
        pytest.skip("there is no bash")
    program = here / "meshgauge"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m meshgauge "$@"\n')
    program.chmod(0o755)
    script = (
        'PATH=".:$PATH"; source <(meshgauge --show-completion bash); '
        "COMP_WORDS=(meshgauge report bri); COMP_CWORD=2; _meshgauge_completion meshgauge; echo ${COMPREPLY[*]}"
    )
    done = subprocess.run(["bash", "-c", script], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.strip() == "brick.msh.gz"
