"""Who may import whom: the table of floors, held by reading every import."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parent.parent / "src" / "meshgauge"

FLOORS = (
    ("errors", "cells", "status", "_jit", "_threads", "_html"),
    ("metrics", "kernels", "reference"),
    ("mesh", "polyhedra", "connectivity", "cast", "topology", "regions"),
    ("_quality", "validity", "summary", "arrays", "doctor", "polyhedral_quality", "io"),
    ("improvement", "gate", "compare"),
    ("parallel", "report", "plot"),
    ("cli", "integrations", "viewer", "__init__", "__main__"),
)
FLOOR = {name: floor for floor, names in enumerate(FLOORS) for name in names}

MAY_IMPORT_THEIR_FLOOR = {
    # One subject in several files: a value of a cell, what it says of a mesh, and their sum.
    "_quality": {"validity", "summary", "arrays", "polyhedral_quality"},
    "validity": {"summary", "arrays"},
    "doctor": {"_quality", "validity", "summary", "arrays"},
    "topology": {"mesh", "cast", "polyhedra"},
    "connectivity": {"mesh", "cast", "polyhedra"},
    "regions": {"mesh"},
    "mesh": {"cast", "polyhedra"},
    "cast": {"polyhedra"},
    "cli": {"viewer"},
    "__main__": {"cli"},
    "__init__": set(),
}

FILES = sorted(PACKAGE.rglob("*.py"))


def module_of(path: Path) -> str:
    """First name below the package: the file, or the folder it is in."""
    first = path.relative_to(PACKAGE).parts[0]
    return first.removesuffix(".py")


def imports(path: Path) -> set[str]:
    """Modules of ours that a file imports, by their first name below the package."""
    depth = len(path.relative_to(PACKAGE).parts)
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
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


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_imports_come_from_lower_floors(path: Path) -> None:
    here = module_of(path)
    allowed = {name for name in FLOOR if FLOOR[name] < FLOOR[here]} | MAY_IMPORT_THEIR_FLOOR.get(here, set()) | {here}
    assert imports(path) <= allowed


def test_kernels_never_see_a_mesh_and_formats_never_measure() -> None:
    for path in FILES:
        if module_of(path) in ("kernels", "metrics"):
            assert "mesh" not in imports(path), path
        if module_of(path) == "io":
            assert not imports(path) & {"_quality", "validity", "summary", "arrays"}, path


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
        ("import meshgauge.cli.main", {"typer", "rich"}),
        (
            "import meshgauge; meshgauge.jens([(0,0,0),(1,0,0),(0,1,0),(0,0,1)], [(0,1,2,3)], 'tetra')",
            {"numba"},
        ),
    ],
)
def test_importing_is_cheap(code: str, allowed: set[str]) -> None:
    assert not loaded_by(code) & (HEAVY - allowed)
