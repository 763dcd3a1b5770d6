"""What goes out with a release and what hosts run: it parses, and names commands, options, files, extras that exist.

None of it can be run here: workflows, the action, the image and the recipe run elsewhere.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

import meshgauge
from meshgauge.cli.main import program

yaml = pytest.importorskip("yaml")

ROOT = Path(__file__).resolve().parents[2]
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
FORMS = sorted(p for p in (ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.yml") if p.name != "config.yml")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
COMMANDS = get_command(program()).commands  # type: ignore[attr-defined]


def load(path: Path | str) -> Any:
    return yaml.safe_load((ROOT / path).read_text(encoding="utf-8"))


def steps(file: Any) -> Iterator[dict[str, Any]]:
    """Of all jobs of a workflow, or of an action."""
    if "runs" in file:
        yield from file["runs"]["steps"]
    for job in file["jobs"].values() if isinstance(file.get("jobs"), dict) else ():
        yield from job["steps"]


def lines(path: Path) -> list[str]:
    """Lines of shell that a workflow or an action runs."""
    return [line.strip() for step in steps(load(path)) for line in step.get("run", "").splitlines() if line.strip()]


RUN_BY_HOSTS = [*WORKFLOWS, ROOT / "action.yml"]
by_name = {"ids": lambda path: path.name}


def wrong_words(line: str) -> list[str]:
    """Subcommands and options of meshgauge in a line of shell that there are not."""
    found = []
    for call in re.findall(r"(?:^|&& |; )meshgauge ([^;&]*)", line):
        words = shlex.split(call)
        if words[0] == "--version":
            continue
        command = COMMANDS.get(words[0])
        if command is None:
            found.append(words[0])
            continue
        options = {name for parameter in command.params for name in (*parameter.opts, *parameter.secondary_opts)}
        found += [word for word in words[1:] if word.startswith("--") and word not in options | {"--", "--help"}]
    return found


def test_wrong_words_are_seen() -> None:
    assert wrong_words("meshgauge chek a.vtu") == ["chek"]
    assert wrong_words("pip install . && meshgauge check --fial x") == ["--fial"]
    assert wrong_words("meshgauge check --fail 'jens >= 0.2'") == []


@pytest.mark.parametrize("path", RUN_BY_HOSTS, **by_name)
def test_commands_exist(path: Path) -> None:
    assert lines(path)
    for line in lines(path):
        assert wrong_words(line) == []
        for word in re.findall(r"(?<![\w/.-])(?:docs|examples|benchmarks|\.ci)/[\w./-]+", line):
            made = word.startswith("docs/_build")
            assert made or (ROOT / word).exists(), f"{path.name}: {word}"
        for extra in re.findall(r"\.\[([\w,]+)\]", line):
            assert set(extra.split(",")) <= set(PROJECT["optional-dependencies"]), line


@pytest.mark.parametrize("path", RUN_BY_HOSTS, **by_name)
def test_no_text_of_others_is_run(path: Path) -> None:
    """Expressions stand in variables, never within a script: what an input holds would be run as shell."""
    assert not [line for line in lines(path) if "${{" in line]


@pytest.mark.parametrize("path", WORKFLOWS, **by_name)
def test_workflows_may_write_nothing_unless_they_say_so(path: Path) -> None:
    workflow = load(path)
    assert workflow["permissions"] == {"contents": "read"}
    assert True in workflow  # "on", which YAML takes for a truth
    for job in workflow["jobs"].values():
        assert "runs-on" in job
        assert not set(job.get("permissions", {})) - {"pages", "id-token"}
        assert set(job.get("needs", "").split()) <= set(workflow["jobs"])
    assert all(("uses" in step) != ("run" in step) for step in steps(workflow))


def test_every_python_is_tested() -> None:
    (matrix,) = [job["strategy"]["matrix"] for name, job in load(WORKFLOWS[-1])["jobs"].items() if name == "tests"]
    stated = [c.rsplit(" ", 1)[1] for c in PROJECT["classifiers"] if re.search(r":: 3\.\d+$", c)]
    assert matrix["python"] == stated
    assert [name.split("-")[0] for name in matrix["os"]] == ["ubuntu", "macos", "windows"]


def test_the_action_hands_on_its_inputs() -> None:
    action = load("action.yml")
    text = (ROOT / "action.yml").read_text(encoding="utf-8")
    assert action["runs"]["using"] == "composite"
    assert [name for name in action["inputs"] if f"${{{{ inputs.{name} }}}}" not in text] == []
    options = {"--fail", "--warn", "--config", "--sarif"}
    assert options <= set(re.findall(r"--[a-z]+", "\n".join(lines(ROOT / "action.yml"))))
    assert wrong_words(f"meshgauge check {' '.join(sorted(options))}") == []


def test_the_page_of_the_gate_uses_inputs_that_the_action_has() -> None:
    page = (ROOT / "docs" / "check.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```yaml\n(.*?)^```$", page, re.DOTALL | re.MULTILINE)
    uses = [step for block in blocks for step in steps(yaml.safe_load(block)) if "uses" in step]
    (step,) = [step for step in uses if step["uses"].startswith("OWNER/meshgauge@")]
    assert set(step["with"]) <= set(load("action.yml")["inputs"])
    assert step["uses"].endswith(f"@v{meshgauge.__version__}")


@pytest.mark.skipif(sys.platform == "win32", reason="paths of bash are others there")
def test_the_script_of_the_action_runs(tmp_path: Path) -> None:
    check, page = (step["run"] for step in steps(load("action.yml")) if step.get("name") in ("Check", "Page"))
    inputs = {
        "MESHES": "examples/meshes/bracket_*.*\n",
        "FAIL": "nothing invalid\njens >= 0.2 @ 1%",
        "WARN": "jens > 0.9",
    }
    environment = {**os.environ, "CONFIG": "", "SARIF": str(tmp_path / "a.sarif"), **inputs}
    environment["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{environment['PATH']}"
    environment["PAGE"] = str(tmp_path / "a.html")
    done, paged = (
        subprocess.run(["bash", "-ec", script], cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
        for script in (check, page)
    )
    assert (done.returncode, paged.returncode) == (0, 0), done.stderr + paged.stderr
    assert "bracket_small.msh" in (tmp_path / "a.html").read_text(encoding="utf-8")
    assert "bracket_small.msh" in done.stdout
    assert done.stdout.count("jens > 0.9") >= 2
    assert (tmp_path / "a.sarif").stat().st_size > 0


@pytest.mark.parametrize("path", FORMS, **by_name)
def test_forms_of_issues_are_whole(path: Path) -> None:
    form = load(path)
    assert {"name", "description", "body"} <= set(form)
    ids = [field["id"] for field in form["body"]]
    assert len(ids) == len(set(ids))
    assert all(field["attributes"]["label"] for field in form["body"])
    for line in re.findall(
        r"meshgauge [a-z]+ [A-Z][^:\n]*?(?= prints|$)", path.read_text(encoding="utf-8"), re.MULTILINE
    ):
        assert wrong_words(line) == []


def test_the_image_copies_what_there_is_and_runs_the_command() -> None:
    text = (ROOT / "Dockerfile").read_text(encoding="utf-8").replace("\\\n", " ")
    orders = [line.split(None, 1) for line in text.splitlines() if line and not line.startswith("#")]
    assert {order for order, _ in orders} <= {"FROM", "RUN", "COPY", "ENV", "USER", "WORKDIR", "ENTRYPOINT", "CMD"}
    copied = [word for order, rest in orders if order == "COPY" for word in rest.split()[:-1]]
    assert all((ROOT / word).exists() for word in copied)
    kept = (ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines()
    assert {f"!{word}" for word in copied} <= set(kept)
    needed = [PROJECT["readme"], *(file for file in PROJECT["license-files"] if "*" not in file)]
    assert set(needed) <= set(copied), "what the build of the wheel reads"
    (extras,) = re.findall(r"/source\[([\w,]+)\]", text)
    assert set(extras.split(",")) <= set(PROJECT["optional-dependencies"])
    assert ["ENTRYPOINT", '["meshgauge"]'] in orders
    assert [order for order, _ in orders].index("USER") < [order for order, _ in orders].index("ENTRYPOINT")


def test_the_recipe_asks_for_what_the_project_asks_for() -> None:
    recipe = load("packaging/conda/recipe.yaml")
    assert recipe["context"]["version"] == meshgauge.__version__
    assert PROJECT["requires-python"] == f">={recipe['context']['python_min']}"
    run = {requirement.replace(" ", "") for requirement in recipe["requirements"]["run"]}
    assert run - {"python>=${{python_min}}"} == set(PROJECT["dependencies"])
    assert all((ROOT / file).is_file() for file in recipe["about"]["license_file"])
    assert recipe["about"]["summary"] == PROJECT["description"]
    for script in recipe["tests"][1]["script"]:
        assert wrong_words(script) == []
    (entry,) = recipe["build"]["python"]["entry_points"]
    assert entry == f"meshgauge = {PROJECT['scripts']['meshgauge']}"


def test_the_citation_is_of_this_version() -> None:
    citation = load("CITATION.cff")
    assert citation["cff-version"] == "1.2.0"
    assert str(citation["version"]) == meshgauge.__version__
    assert citation["license"] == PROJECT["license"]
    assert citation["authors"] == [{"name": "The meshgauge authors"}]
    assert f"## [{meshgauge.__version__}]" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_the_hook_runs_a_command_that_exists() -> None:
    (hook,) = load(".pre-commit-hooks.yaml")
    assert wrong_words(hook["entry"]) == []
    assert re.search(hook["files"], "meshes/part.vtu")


def test_all_is_every_extra_for_users() -> None:
    extras = PROJECT["optional-dependencies"]
    (line,) = extras["all"]
    of_all = set(re.fullmatch(r"meshgauge\[(.+)\]", line)[1].split(","))  # type: ignore[index]
    assert of_all == set(extras) - {"all", "test", "dev", "docs", "bench", "mutants"}
