"""Who may import whom: the table of floors, held by reading every import."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parent.parent / "src" / "meshgauge"

FLOORS = (
    ("_version", "_lazy", "errors", "cells", "status", "look"),
    ("files", "surface_cells", "schemas"),
    ("kernels",),
    ("mesh",),
    ("quality", "io"),
    ("slices", "doctor", "plot"),
    ("report",),
    ("check", "compare", "repair", "view"),
    ("integrations", "cli"),
    ("__main__", "__init__"),
)
"""A module imports from floors below its own only; nothing from a neighbour, without exceptions."""

FLOOR = {name: floor for floor, names in enumerate(FLOORS) for name in names}

FILES = sorted(PACKAGE.rglob("*.py"))


def module_of(path: Path) -> str:
    """First name below the package: the file, or the folder it is in."""
    first = path.relative_to(PACKAGE).parts[0]
    return first.removesuffix(".py")


@cache
def nodes_of(path: Path) -> list[ast.AST]:
    """The imports and calls of a file."""
    every = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    return [node for node in every if isinstance(node, ast.Import | ast.ImportFrom | ast.Call)]


def imports(path: Path) -> set[str]:
    """Modules of ours that a file imports, by their first name below the package."""
    depth = len(path.relative_to(PACKAGE).parts)
    found: set[str] = set()
    for node in nodes_of(path):
        if isinstance(node, ast.Import):
            found |= {a.name.split(".")[1] for a in node.names if a.name.startswith("meshgauge.")}
        elif isinstance(node, ast.ImportFrom):
            if node.level == depth:
                found |= {node.module.split(".")[0]} if node.module else {a.name for a in node.names}
            elif node.level == 0 and (node.module or "").startswith("meshgauge."):
                found.add((node.module or "").split(".")[1])
    return {name for name in found if name in FLOOR or (PACKAGE / f"{name}.py").exists() or (PACKAGE / name).is_dir()}


def test_every_module_has_a_floor() -> None:
    assert {module_of(path) for path in FILES} <= set(FLOOR)


def test_the_page_shows_the_floors() -> None:
    page = (PACKAGE.parents[1] / "docs" / "architecture.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (\d+) \| (`.*?`) \|", page, re.MULTILINE)
    shown = {int(floor): set(re.findall(r"`(\w+)`", names)) for floor, names in rows}
    assert shown == {floor: set(names) for floor, names in enumerate(FLOORS)}


def test_imports_come_from_lower_floors() -> None:
    wrong = {}
    for path in FILES:
        here = module_of(path)
        allowed = {name for name in FLOOR if FLOOR[name] < FLOOR[here]} | {here}
        if not imports(path) <= allowed:
            wrong[str(path.relative_to(PACKAGE))] = imports(path) - allowed
    assert wrong == {}


LAZY = {
    "__init__.py",
    "check/__init__.py",
    "io/__init__.py",
    "io/formats/table.py",
    "mesh/mesh.py",
    "plot/__init__.py",
    "quality/measure.py",
    "slices/__init__.py",
}
"""Files that find what they name by its name: packages and formats that load on use, methods that lead up a floor."""


def name_of(function: ast.expr) -> str:
    return function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")


def finds_by_name(path: Path) -> bool:
    """True if a file uses `_lazy`, or imports a module of ours by a name that is not an import."""
    for node in nodes_of(path):
        if isinstance(node, ast.ImportFrom) and (node.module == "_lazy" or "_lazy" in {a.name for a in node.names}):
            return True
        if isinstance(node, ast.Call) and name_of(node.func) in ("import_module", "__import__"):
            first = node.args[0].values[0] if isinstance(node.args[0], ast.JoinedStr) else node.args[0]
            text = first.value if isinstance(first, ast.Constant) else ""
            if not text or text.startswith((".", "meshgauge")):
                return True
    return False


def test_who_finds_by_name_is_listed() -> None:
    used = {path.relative_to(PACKAGE).as_posix() for path in FILES if finds_by_name(path)}
    at_the_top = {name for name in used if name.startswith("cli/")}  # may import whatever there is
    assert used - at_the_top == LAZY | {"_lazy.py"}


def loaded_by(code: str) -> set[str]:
    program = f"import sys; {code}; print(*sorted({{m.split('.')[0] for m in sys.modules}}))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


HEAVY = {"numba", "vtkmodules", "vtk", "pyvista", "meshio", "h5py", "matplotlib", "rich", "typer", "jinja2"}


@pytest.mark.parametrize(
    ("code", "allowed"),
    [
        ("import meshgauge", set()),
        ("import meshgauge; meshgauge.Mesh, meshgauge.read, meshgauge.METRICS", set()),
        ("import meshgauge; meshgauge.check, meshgauge.compare, meshgauge.doctor, meshgauge.io", {"numba"}),
        ("import meshgauge; meshgauge.io, meshgauge.plot, meshgauge.Polyhedra, meshgauge.regions", set()),
        ("import meshgauge.cli.main", {"typer", "rich"}),
        (
            "import meshgauge; meshgauge.jens([(0,0,0),(1,0,0),(0,1,0),(0,0,1)], [(0,1,2,3)], 'tetra')",
            {"numba"},
        ),
    ],
)
def test_importing_is_cheap(code: str, allowed: set[str]) -> None:
    assert not loaded_by(code) & (HEAVY - allowed)
