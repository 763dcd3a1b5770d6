"""Nothing outside the table of cell types asks for a type: no name, no VTK id, no comparison with a row.

What depends on the type is a field of its row. A test of the source, by its syntax tree.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import TypeGuard

import pytest

from meshgauge.cells import BY_NAME, SHAPES

PACKAGE = Path(__file__).resolve().parent.parent / "src" / "meshgauge"

EXEMPT = {
    "cells.py": "the table",
    "surface_cells.py": "the table, as a mesh of surfaces sees it",
    "cli/ahead.py": "a table of the cells into which a cube is split",
    "io/formats": "their tables say what a format's own words and numbers stand for",
    "io/plumbing/meshio.py": "a table of meshio's words; pixels and voxels, which it has in another order",
    "io/plumbing/face_based.py": "a table of surface cells by their number of points",
    "io/plumbing/writing.py": "pixels and voxels, which are VTK's alone, as what other formats have",
    "quality/metrics/verdict_library.py": "a row names the shapes that Verdict has a measure for",
    "repair/rejoined.py": "the one type whose points can be joined anew",
    "quality/metrics/tetra.py": "a row names the one shape that it is defined for",
}
"""Where names may stand, and why."""

COMPARING = ("cells.py", "surface_cells.py", "io/formats", "io/plumbing/meshio.py")
"""Where a type may be compared with: what the table is made of, and what reads words of others."""

WORDS = {"empty", "line"}
"""Names of types that are words of everyday."""

NAMES = (set(BY_NAME) | set(SHAPES)) - WORDS
ROWS = {name.upper() for name in SHAPES}

FILES = sorted(PACKAGE.rglob("*.py"))


def without(places: Iterable[str]) -> list[Path]:
    """The files that are in none of the places."""

    def is_in(file: Path, place: str) -> bool:
        inside = file.relative_to(PACKAGE).as_posix()
        return inside == place or inside.startswith(f"{place}/")

    return [file for file in FILES if not any(is_in(file, place) for place in places)]


def name_of(file: Path) -> str:
    return file.relative_to(PACKAGE).as_posix()


def names_in(tree: ast.AST) -> Iterator[str]:
    """Literal names of cell types."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and node.value in NAMES:
            yield f"line {node.lineno}: {node.value!r}"


def comparisons_in(tree: ast.AST) -> Iterator[str]:
    """Comparisons with a row of the table, its name or a literal VTK id; rows taken by a literal id."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
            parts = [part for side in sides for part in (side.elts if isinstance(side, ast.Tuple) else [side])]
            if any(_is_row(part) for part in parts) or (
                any(_is_types(side) for side in sides) and any(_is_int(part) for part in parts)
            ):
                yield f"line {node.lineno}: {ast.unparse(node)}"
        elif _is_taken_by_id(node):
            yield f"line {node.lineno}: {ast.unparse(node)}"


def _is_taken_by_id(node: ast.AST) -> TypeGuard[ast.expr]:
    if isinstance(node, ast.Subscript):
        return _named(node.value) == "CELL_TYPES" and _is_int(node.slice)
    return isinstance(node, ast.Call) and _named(node.func) in ("cell_type", "type_name") and _is_int(node.args[0])


def _is_row(node: ast.expr) -> bool:
    if isinstance(node, ast.Attribute) and node.attr == "name":
        node = node.value
    return _named(node) in ROWS or (isinstance(node, ast.Constant) and node.value in NAMES)


def _is_types(node: ast.expr) -> bool:
    while isinstance(node, ast.Subscript):
        node = node.value
    return _named(node) in ("types", "vtk_id", "vtk_ids")


def _is_int(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and type(node.value) is int


def _named(node: ast.expr) -> str:
    return node.id if isinstance(node, ast.Name) else node.attr if isinstance(node, ast.Attribute) else ""


@cache
def tree_of(file: Path) -> ast.Module:
    return ast.parse(file.read_text(encoding="utf-8"))


def test_no_type_is_asked_for_by_name() -> None:
    assert [(name_of(file), place) for file in without(EXEMPT) for place in names_in(tree_of(file))] == []


def test_nothing_is_compared_with_a_type() -> None:
    assert [(name_of(file), place) for file in without(COMPARING) for place in comparisons_in(tree_of(file))] == []


def test_every_exemption_is_needed() -> None:
    for place in EXEMPT:
        files = [PACKAGE / place] if place.endswith(".py") else sorted((PACKAGE / place).rglob("*.py"))
        assert any(list(names_in(tree_of(file))) for file in files), place


@pytest.mark.parametrize(
    "source",
    [
        'row.name == "tetra"',
        'shape.name in ("wedge", "hexahedron")',
        "shape is WEDGE",
        "shape.name != HEXAHEDRON.name",
        "mesh.types == 42",
        "mesh.types[cells] == 42",
        "row.vtk_id in (8, 11)",
        "CELL_TYPES[42]",
        "cell_type(10)",
    ],
)
def test_each_way_of_asking_is_seen(source: str) -> None:
    assert list(comparisons_in(ast.parse(source)))
    assert not list(comparisons_in(ast.parse("len(types) == 1; row.shape is None; CELL_TYPES[vtk_id]; n == 4")))
