"""The recipes of CONTRIBUTING.md, followed to the letter in a copy of the checkout."""

from __future__ import annotations

import importlib.util
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
TEXT = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
RECIPES = dict(re.findall(r"^### (Add .*?)\n(.*?)(?=^### |\Z)", TEXT, re.DOTALL | re.MULTILINE))

TESTS = """
import shlex, sys, pytest
for line in sys.argv[1:]:
    if code := pytest.main(shlex.split(line)):
        sys.exit(f"pytest {line}: {code}")
"""
"""Several runs of pytest in one process, which takes seconds to start."""


def change(root: Path, diff: str) -> None:
    """Apply a diff without line numbers: what it takes away or keeps must stand in the file exactly once."""
    for file in re.split(r"^--- ", diff, flags=re.MULTILINE)[1:]:
        name, hunks = file.split("\n", 1)
        path = root / name
        text = path.read_text(encoding="utf-8")
        for hunk in re.split(r"^@@\n", hunks, flags=re.MULTILINE):
            lines = [line for line in hunk.split("\n") if line]
            before, after = ("\n".join(line[1:] for line in lines if line[0] in marks) for marks in (" -", " +"))
            assert text.count(before) == 1, f"{name}: {before!r} stands there {text.count(before)} times"
            text = text.replace(before, after)
        path.write_text(text, encoding="utf-8")


def test_every_recipe_has_code_and_a_test() -> None:
    assert len(RECIPES) >= 4
    for recipe in RECIPES.values():
        assert "```diff" in recipe
        assert "$ python -m pytest" in recipe


def follow(root: Path, *names: str, fuzz: bool) -> None:
    """Do what recipes say in a copy of the checkout, one after the other, and run their commands and tests.

    Without ``fuzz`` only that a new reader is among those that get broken files, not hundreds of these for all.
    """
    for folder in ("src", "tests", "docs", "examples", "benchmarks"):
        shutil.copytree(
            ROOT / folder,
            root / folder,
            ignore=shutil.ignore_patterns("__pycache__", "pictures", "_build", "generated"),
        )
    for file in ("pyproject.toml", "README.md", "CHANGELOG.md", "CONTRIBUTING.md"):
        shutil.copy(ROOT / file, root)
    lines: list[str] = []
    for recipe in map(RECIPES.__getitem__, names):
        for path, code in re.findall(r"^```python file=(\S+)\n(.*?)^```$", recipe, re.DOTALL | re.MULTILINE):
            assert not (root / path).exists()
            (root / path).write_text(code, encoding="utf-8")
        for diff in re.findall(r"^```diff\n(.*?)^```$", recipe, re.DOTALL | re.MULTILINE):
            change(root, diff)
        lines += re.findall(r"^\$ python (.*)$", recipe, re.MULTILINE)
    environment = {**os.environ, "PYTHONPATH": str(root / "src"), "PYTHONIOENCODING": "utf-8"}
    # Pages are left out: they print reports of large meshes, slow, and are held by tests of their own.
    commands = [
        ["-m", *shlex.split(line.removeprefix("-m "))] for line in lines if not re.search("refresh|pytest", line)
    ]
    if importlib.util.find_spec("ruff"):
        commands = [["-m", "ruff", "check", "."], ["-m", "ruff", "format", "--check", "."], *commands]
    tests = [line.removeprefix("-m pytest ") for line in lines if line.startswith("-m pytest ")]
    if not fuzz:
        tests = [line.replace("-k own", "-k test_every_own_reader_is_fuzzed") for line in tests]
    for command in [*commands, ["-c", TESTS, *tests]]:
        done = subprocess.run(
            [sys.executable, *command], cwd=root, env=environment, capture_output=True, encoding="utf-8",
            timeout=300, check=False,
        )  # fmt: skip
        assert done.returncode == 0, f"{command}\n{done.stdout[-3000:]}\n{done.stderr[-2000:]}"


def test_all_recipes_work_one_after_the_other(tmp_path: Path) -> None:
    follow(tmp_path, *RECIPES, fuzz=False)


@pytest.mark.long
@pytest.mark.parametrize("name", RECIPES)
def test_a_recipe_works_alone(name: str, tmp_path: Path) -> None:
    follow(tmp_path, name, fuzz=True)
