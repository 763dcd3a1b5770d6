"""``meshgauge check`` as a user, a pipeline and pre-commit see it."""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
import xml.etree.ElementTree as ET
from pathlib import Path

import command_line
import pytest
from check_meshes import mesh

import meshgauge
from meshgauge.check.settings import SettingsError, load, nearest
from meshgauge.cli.main import main

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "check.md").read_text(encoding="utf-8")

Captured = pytest.CaptureFixture[str]


@pytest.fixture(autouse=True)
def nowhere(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """An empty working folder, outside GitHub Actions."""
    for name in ("GITHUB_ACTIONS", "GITHUB_STEP_SUMMARY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write(path: str, *kinds: str) -> str:
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    meshgauge.write(target, mesh(*kinds), overwrite=True)
    return path


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE)


def test_exit_codes(capsys: Captured) -> None:
    good, bad, surface = write("good.msh", "good", "cube"), write("bad.msh", "inverted"), write("s.msh", "triangle")
    assert main(["check", good]) == 0
    assert main(["check", good, "--warn", "jens > 0.9"]) == 0
    assert main(["check", good, bad]) == 1
    assert main(["check", bad, "missing.msh"]) == 2
    assert main(["check", surface]) == 0
    assert main(["check", surface, "--dimension", "3"]) == 2
    assert main(["check", good, "--fail", "jens > 0 in inlet"]) == 2
    capsys.readouterr()
    assert main(["check", good, "--fail", "no worse than none.json"]) == 2
    assert main(["check", good, "--fail", "jens > 0", "--junit", good]) == 2
    assert main(["check"]) == 2
    errors = capsys.readouterr().err.splitlines()
    assert errors == [
        "meshgauge: error: none.json: No such file or directory",
        "meshgauge: error: good.msh: is an input; it is not overwritten",
        "meshgauge: error: no mesh is given, and no settings name any (check.meshes)",
    ]


def test_what_is_said(capsys: Captured) -> None:
    bad = write("bad.msh", "good", "inverted", "nan")
    assert main(["check", bad]) == 1
    out, err = capsys.readouterr()
    assert err == ""
    assert "bad.msh  3 cells, 12 points\n✗ 2 of 5 rules fail, 1 warns\n" in out
    assert "1 of 3 cells is invalid; none is allowed" in out
    assert re.search(r"^ element 2 \(cell 1\) +tetra +-0\.707 +inverted +0 +node 5 \(point 4\) +10 ", out, re.MULTILINE)
    assert all(line == line.rstrip() for line in out.splitlines())
    assert main(["check", bad, "-q", "--fail", "nothing invalid", "--fail", "jens <= 2"]) == 1
    assert capsys.readouterr().out == "bad.msh: 2 of 2 rules fail: nothing invalid; jens <= 2\n"


def test_an_error_in_a_rule_is_pointed_at(capsys: Captured) -> None:
    good = write("good.msh", "good")
    assert main(["check", good, "--fail", "jens => 0.2"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert f"```text\n{err}```" in PAGE


def test_json_is_alone_on_standard_output(capsys: Captured, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    bad = write("bad.msh", "inverted", "cube")
    assert (
        main(["check", bad, "--json", "--worst", "1", "--fail", "verdict_shape > 0", "--fail", "nothing invalid"]) == 1
    )
    out, err = capsys.readouterr()
    document = json.loads(out)
    assert [outcome["n_failing"] for outcome in document["files"][0]["outcomes"]] == [1, 1]
    assert err.startswith("::error file=bad.msh,title=verdict_shape > 0::")
    assert [len(outcome["cells"]) for outcome in document["files"][0]["outcomes"]] == [1, 1]
    assert main(["check", bad, "--json", "-q"]) == 1
    json.loads(capsys.readouterr().out)


def test_every_output_at_once(capsys: Captured, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", "summary.md")
    Path("summary.md").write_text("before\n")
    write("a/good.msh", "good"), write("a/bad.msh", "inverted")
    outputs = ["--junit", "j.xml", "--sarif", "s.json", "--gitlab", "g.json", "--markdown", "m.md", "--github"]
    assert main(["check", "a/*.msh", *outputs]) == 1
    out, err = capsys.readouterr()
    assert "1 of 2 meshes passes" in out
    assert err.count("::error file=a/bad.msh,") == 1
    root = ET.parse("j.xml").getroot()
    assert (root.get("tests"), root.get("failures")) == ("10", "1")
    assert len(json.loads(Path("s.json").read_text())["runs"][0]["results"]) == 2  # one of them a warning
    assert {issue["location"]["path"] for issue in json.loads(Path("g.json").read_text())} == {"a/bad.msh"}
    assert Path("summary.md").read_text(encoding="utf-8") == "before\n" + Path("m.md").read_text(encoding="utf-8")


def test_a_baseline_is_stored_and_kept_to(capsys: Captured) -> None:
    write("a.msh", "good", "good"), write("b.msh", "good", "low")
    assert main(["check", "a.msh", "b.msh", "--write-baseline", "base.json"]) == 0
    assert main(["check", "a.msh", "b.msh", "--fail", "no worse than base.json"]) == 0
    write("a.msh", "good", "low")
    assert main(["check", "a.msh", "b.msh", "--fail", "no worse than base.json"]) == 1
    capsys.readouterr()
    assert main(["report", "b.msh", "--json"]) == 0
    Path("report.json").write_text(capsys.readouterr().out)
    assert main(["check", "b.msh", "--fail", "no worse than report.json"]) == 0
    before = Path("base.json").read_bytes()
    assert main(["check", "a.msh", "none.msh", "--write-baseline", "base.json"]) == 2
    assert Path("base.json").read_bytes() == before
    assert main(["check", "a.msh", "--write-baseline", "a.msh"]) == 2


def test_the_nearest_settings_count(capsys: Captured) -> None:
    write("meshes/good.msh", "good", "low")
    Path(".git").mkdir()
    Path("meshgauge.toml").write_text('[check]\nmeshes = ["meshes/*.msh"]\nfail = ["jens > 0.5"]\n')
    below = Path("deep/below")
    below.mkdir(parents=True)
    os.chdir(below)
    assert main(["check", "-q"]) == 1
    assert capsys.readouterr().out == "../../meshes/good.msh: 1 of 1 rule fails: jens > 0.5\n"
    Path("../pyproject.toml").write_text("[tool.other]\nx = 1\n")
    assert main(["check", "-q"]) == 1
    Path("../pyproject.toml").write_text('[tool.meshgauge.check]\nfail = ["no worse than base.json"]\n')
    assert main(["check", "../../meshes/good.msh", "--write-baseline", "../base.json"]) == 0
    assert main(["check", "../../meshes/good.msh"]) == 0
    assert main(["check", "../../meshes/good.msh", "--fail", "jens > 0.5"]) == 1
    capsys.readouterr()
    assert main(["check", "--config", "../../meshgauge.toml"]) == 1
    assert capsys.readouterr().out.startswith("settings: ../../meshgauge.toml\n../../meshes/good.msh ")
    assert main(["check", "--config", "../../meshgauge.toml", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["settings"] == "../../meshgauge.toml"
    # Of which nothing is used, it is not named.
    assert (
        main(["check", "--json", "--config", "../../meshgauge.toml", "--fail", "jens > 0", "../../meshes/good.msh"])
        == 0
    )
    assert json.loads(capsys.readouterr().out)["settings"] is None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[check]\nfail = 1", "check.fail is 1, expected a list of strings"),
        ("[check]\nfial = []", "no setting check.fial; did you mean 'check.fail'?"),
        ("[chekc]", "no setting chekc; did you mean 'check'?"),
        ("check = 1", "check is 1, expected a table"),
        ("[check", "Expected ']'"),
        ("[check]\nfail = ['jens > 0', 'jens > x']", "check.fail[1]: expected a number"),
    ],
)
def test_wrong_settings_are_named(text: str, message: str, capsys: Captured) -> None:
    write("good.msh", "good")
    Path("meshgauge.toml").write_text(text)
    assert main(["check", "good.msh"]) == 2
    err = capsys.readouterr().err
    assert err.startswith("meshgauge: error: ")
    assert "meshgauge.toml: " in err
    assert message in err


def test_settings_that_are_not_there(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="No such file"):
        load(tmp_path / "meshgauge.toml")
    (tmp_path / "pyproject.toml").write_text("[project]\n")
    with pytest.raises(SettingsError, match=r"has no \[tool.meshgauge\]"):
        load(tmp_path / "pyproject.toml")
    assert nearest(tmp_path) is None or nearest(tmp_path) != tmp_path / "pyproject.toml"


def test_the_commands_and_settings_of_the_page(capsys: Captured, tmp_path: Path) -> None:
    (tmp_path / "examples").symlink_to(ROOT / "examples", target_is_directory=True)
    lines = [line for block in blocks("sh") for line in block.splitlines()]
    assert len(lines) == 4
    for line in lines:
        words = shlex.split(line)
        assert words.pop(0) == "meshgauge"
        assert main(words) == 0, line
    (settings,) = blocks("toml")
    Path("meshgauge.toml").write_text(settings)
    write("meshes/a.vtu", *["good"] * 9)
    assert main(["check", "meshes/a.vtu", "--write-baseline", "meshes/baseline.json"]) == 0
    assert main(["check"]) == 0
    capsys.readouterr()


# --- a scripted repository ------------------------------------------------------------------------------------------


def run(*command: str, **environment: str) -> subprocess.CompletedProcess[str]:
    environment = {
        **os.environ,
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        "GIT_CONFIG_GLOBAL": os.devnull,
        "GIT_CONFIG_NOSYSTEM": "1",
        **environment,
    }
    return subprocess.run(command, capture_output=True, encoding="utf-8", timeout=100, check=False, env=environment)


SETTINGS = '[check]\nmeshes = ["meshes/*.msh"]\nfail = ["nothing invalid", "nothing unmeasured", "jens >= 0.2 @ 25%"]\n'


@pytest.fixture
def repository(nowhere: Path) -> Path:
    """A repository with settings, a good mesh and a file that is no mesh, committed."""
    if shutil.which("git") is None:
        pytest.skip("git is not installed")
    Path("meshgauge.toml").write_text(SETTINGS)
    Path("notes.txt").write_text("no mesh\n")
    write("meshes/wing.msh", "good", "good", "good", "low")
    for command in ("init -q", "config user.name t", "config user.email t@t", "add .", "commit -q -m start"):
        done = run("git", *command.split())
        assert done.returncode == 0, done.stderr
    return nowhere


def hook() -> dict[str, str]:
    """The one hook of .pre-commit-hooks.yaml; its few plain lines need no parser of YAML."""
    text = (ROOT / ".pre-commit-hooks.yaml").read_text(encoding="utf-8")
    return dict(re.findall(r"^(?:- |  )(\w+): (.+)$", text, re.MULTILINE))


def test_the_hook_is_described() -> None:
    found = hook()
    assert (found["id"], found["language"], found["entry"]) == ("meshgauge-check", "python", "meshgauge check")
    assert f"id: {found['id']}" in PAGE
    pattern = re.compile(found["files"])
    assert all(pattern.search(name) for name in ("a.msh", "b/c.msh", "d.vtk.gz"))
    assert not any(pattern.search(name) for name in ("notes.txt", "vtu", "mesh.py"))
    assert "require_serial" in found
    scripts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["scripts"]
    assert found["entry"].split()[0] in scripts


def test_the_gate_in_a_pipeline_of_a_repository(repository: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What the action of the page's workflow runs, as a runner would run it: passing, failing, passing again."""
    (workflow,) = [block for block in blocks("yaml") if "actions/checkout" in block]
    ((action, sarif),) = re.findall(r"- uses: OWNER/(\w+)@.*\n *with:\n *sarif: (\S+)", workflow)
    assert action == "meshgauge"
    script = (ROOT / "action.yml").read_text(encoding="utf-8")
    assert 'arguments+=(--sarif "$SARIF")' in script
    assert 'meshgauge check "${arguments[@]}"' in script
    words = ["check", "--sarif", sarif, "--"]
    monkeypatch.setenv("GITHUB_ACTIONS", "true")

    def pipeline() -> subprocess.CompletedProcess[str]:
        Path("summary.md").write_text("")
        with monkeypatch.context() as patch:
            patch.setenv("GITHUB_STEP_SUMMARY", "summary.md")
            return command_line.run(*words)

    done = pipeline()
    assert (done.returncode, done.stderr) == (0, "")
    assert "✅ Mesh quality: 1 of 1 passes" in Path("summary.md").read_text(encoding="utf-8")
    write("meshes/wing.msh", "good", "good", "inverted", "low")
    done = pipeline()
    assert done.returncode == 1
    assert [line.split("::")[1] for line in done.stderr.splitlines()] == [
        "error file=meshes/wing.msh,title=nothing invalid",
        "error file=meshes/wing.msh,title=jens >= 0.2 @ 25%25",
    ]
    assert re.search(r"tetra element 3 \(cell 2\)[^%]*jens -0\.7071[^%]* at node 9 \(point 8\)", done.stderr)
    assert "❌ Mesh quality: 0 of 1 pass" in Path("summary.md").read_text(encoding="utf-8")
    results = json.loads(Path("meshes.sarif").read_text())["runs"][0]["results"]
    assert {result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] for result in results} == {
        "meshes/wing.msh"
    }
    os.chdir("meshes")
    below = command_line.run(*words)
    assert below.stderr == done.stderr  # paths are those of the repository, wherever it runs
    os.chdir("..")
    run("git", "checkout", "-q", "meshes/wing.msh")
    assert pipeline().returncode == 0


@pytest.mark.long
def test_the_hook_in_a_repository(repository: Path) -> None:
    """pre-commit runs the entry of the hook on what a commit touches: the commit is refused, then let through."""
    pytest.importorskip("pre_commit")
    found = hook()
    entry = f"{sys.executable} -m {found['entry']}"
    Path(".pre-commit-config.yaml").write_text(
        "repos:\n- repo: local\n  hooks:\n  - id: meshgauge-check\n    name: meshgauge check\n"
        f"    entry: {entry}\n    language: system\n    files: '{found['files']}'\n    require_serial: true\n"
    )
    cache = {"PRE_COMMIT_HOME": str(repository / "cache")}
    installed = run(sys.executable, "-m", "pre_commit", "install", **cache)
    assert installed.returncode == 0, installed.stderr + installed.stdout
    Path(".gitignore").write_text("cache\n")
    run("git", "add", ".")
    nothing = run("git", "commit", "-m", "no mesh touched", **cache)
    assert nothing.returncode == 0, nothing.stdout + nothing.stderr
    assert "Skipped" in nothing.stdout + nothing.stderr
    write("meshes/wing.msh", "good", "inverted")
    run("git", "add", ".")
    refused = run("git", "commit", "-m", "worse", **cache)
    assert refused.returncode == 1
    assert "meshes/wing.msh" in refused.stdout + refused.stderr
    assert "cells is invalid; none is allowed" in refused.stdout + refused.stderr
    write("meshes/wing.msh", "good", "good")
    run("git", "add", ".")
    passed = run("git", "commit", "-m", "better", **cache)
    assert passed.returncode == 0, passed.stdout + passed.stderr
    assert "Passed" in passed.stdout + passed.stderr
