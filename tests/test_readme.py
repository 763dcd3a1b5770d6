"""README and documentation hold: commands run, Python blocks print what they say, tables are those of the program."""

from __future__ import annotations

import doctest
import importlib.util
import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path
from types import ModuleType

import command_line
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").glob("*.md"))]


def blocks(page: Path, language: str) -> list[str]:
    """The fenced blocks of a language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


def commands(page: Path) -> list[str]:
    """Every command in a block of shell, without its comment."""
    lines = (line for block in blocks(page, "sh") for line in block.splitlines())
    return [part.split("  #")[0].strip() for line in lines for part in line.split("&&")]


RUN = [ROOT / "README.md", *(ROOT / "docs" / f"{name}.md" for name in ("start", "report", "abaqus", "openfoam"))]
"""Pages whose commands run here, one after the other; those of other pages run in the tests of their features."""


@pytest.fixture(scope="module")
def refresh() -> ModuleType:
    spec = importlib.util.spec_from_file_location("refresh", ROOT / "docs" / "refresh.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("page", RUN, ids=lambda p: p.name)
def test_commands_run(page: Path, tmp_path: Path) -> None:
    (tmp_path / "examples").symlink_to(ROOT / "examples", target_is_directory=True)
    run = [c for c in commands(page) if c.startswith("meshgauge")]
    assert run
    for command in run:
        arguments = []
        for word in shlex.split(command)[1:]:
            found = sorted(str(path.relative_to(tmp_path)) for path in tmp_path.glob(word)) if "*" in word else []
            arguments += found or [word]
        done = command_line.run(*arguments, cwd=tmp_path)
        # Of a mesh with inverted cells the doctor ends with 1.
        assert done.returncode == (1 if arguments[0] == "doctor" else 0), (command, done.stderr)
        assert done.stdout
        for at in (n for n, word in enumerate(arguments) if word in ("-o", "--csv", "--html", "--bad", "--undo")):
            assert (tmp_path / arguments[at + 1]).stat().st_size > 0, command


def test_the_first_two_commands_install_and_test() -> None:
    first, report, *_, install, test = commands(ROOT / "README.md")
    assert first == "pip install ."
    assert report.startswith("meshgauge report ")
    assert (ROOT / report.split()[-1]).is_file()
    assert install == "pip install '.[test]'"
    assert test == "python -m pytest -n auto"
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    assert any(requirement.startswith("pytest-xdist") for requirement in extras["test"])
    assert test.removeprefix("python ") in (ROOT / ".ci" / "run").read_text(encoding="utf-8")


@pytest.mark.parametrize("page", [p for p in PAGES if blocks(p, "python")], ids=lambda p: p.name)
def test_python_blocks_run_and_print_what_they_say(page: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    scope: dict[str, object] = {}
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.IGNORE_EXCEPTION_DETAIL)
    told: list[str] = []
    with np.printoptions():
        for n, block in enumerate(blocks(page, "python")):
            test = doctest.DocTestParser().get_doctest(block, scope, f"{page.name}, block {n}", str(page), 0)
            if not test.examples:  # a program, with no output shown
                exec(compile(block, test.name, "exec"), test.globs)
            runner.run(test, out=told.append, clear_globs=False)
            scope = test.globs
    assert runner.summarize(verbose=False).failed == 0, "".join(told)


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_parts_are_those_of_the_program(page: Path, refresh: ModuleType) -> None:
    text = page.read_text(encoding="utf-8")
    assert refresh.refreshed(text) == text, "run python docs/refresh.py"


def test_every_part_is_shown_somewhere(refresh: ModuleType) -> None:
    shown = {
        name for page in PAGES for name in re.findall(r"<!-- begin: ([a-z-]+) -->", page.read_text(encoding="utf-8"))
    }
    assert shown == set(refresh.PARTS)


@pytest.mark.parametrize("page", [*PAGES, ROOT / "examples" / "README.md"], ids=lambda p: p.name)
def test_links_lead_to_files(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
        assert target.startswith("https://") or (page.parent / target).exists(), f"{page.name}: {target}"


def test_what_vtk_says_of_three_cells() -> None:
    """The table beside other tools, as far as the tools are installed with meshgauge."""
    pyvista = pytest.importorskip("pyvista")
    import meshgauge
    from meshgauge.cells import BY_NAME, SHAPES

    def both(name: str, *scale: float) -> tuple[float, float]:
        points = np.array(SHAPES[name].points, float) * scale
        n = len(points)
        grid = pyvista.UnstructuredGrid(np.r_[n, np.arange(n)], [BY_NAME[name].vtk_id], points)
        theirs = float(grid.cell_quality("scaled_jacobian")["scaled_jacobian"][0])
        return float(meshgauge.jens(points, [range(n)], name)[0]), theirs

    assert both("pyramid", 1, 1, -1) == pytest.approx((-1, 0))
    assert both("hexahedron", 1, 1, 0) == (0, 1e30)
    assert both("penta_prism", 1, 1, 1) == pytest.approx((1, -1))


def test_the_picture_is_light_and_shown() -> None:
    shown = re.findall(r"!\[[^\]]+\]\(([^)]+)\)", README)
    assert shown == ["docs/pictures/bracket.png"]
    assert os.path.getsize(ROOT / shown[0]) < 300e3


@pytest.mark.long
def test_the_picture_can_be_made(tmp_path: Path) -> None:
    # In a process of its own: drawing may fail hard where there is no libGL.
    subprocess.run([sys.executable, ROOT / "examples" / "make_pictures.py", tmp_path], check=True, timeout=200)
    assert (tmp_path / "bracket.png").stat().st_size < 300e3
