"""A reader of our own gives what a library gives, wherever that one is right: cells, their corners and their sense."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import grown_files
import numpy as np
import plt_files
import pytest
import test_io_elmer as elmer
import test_io_femap as femap
import test_io_tecplot_binary as tecplot

from meshgauge import io
from meshgauge.cells import CELL_TYPES
from meshgauge.io.plumbing import meshio as bridge
from meshgauge.mesh import Mesh

CALLED = {"ansys": "ansysInp", "fluent": "ansys", "tecplot-binary": "tecplot"}
"""What meshio++ calls a format, where it is another name than ours."""

NOT_RIGHT = {
    "med": "takes MED's order of nodes for VTK's: every solid cell is inverted",
    "exodus": "fails on files that state no num_nodes",
    "femap": "fails on properties whose records are cut short",
    "gambit": "has no reader",
    "frontistr": "has no reader",
    "plot3d": "has no reader",
    "rf": "has no reader",
    "hedra": "has no reader",
    "ovm": "has no reader",
}
"""Where meshio++ is no oracle for the files of `grown_files`."""


def by_library(path: Path, name: str) -> Mesh:
    library: Any = pytest.importorskip("meshioplusplus")
    return bridge.mesh(library.read(str(path), file_format=CALLED.get(name, name)), path, ())


def solids(mesh: Mesh) -> list[tuple[str, bool, list[list[float]]]]:
    """Type, whether a corner is negative, and the corners of each solid cell, whatever they are numbered from."""
    made = []
    for cell, vtk_id in enumerate(mesh.types.tolist()):
        shape = CELL_TYPES[vtk_id].shape
        if shape is not None:
            x = mesh.points[mesh.nodes(cell)][: shape.n_nodes]
            is_negative = any(np.linalg.det(x[[i, j, k]] - x[a]) < 0 for a, i, j, k in shape.triples)
            made.append((CELL_TYPES[vtk_id].name, is_negative, sorted(np.round(x, 9).tolist())))
    return sorted(made)


@pytest.mark.parametrize("name", [name for name in grown_files.MAKERS if name not in NOT_RIGHT])
def test_tetrahedra_of_every_format(name: str, tmp_path: Path) -> None:
    path = grown_files.MAKERS[name](tmp_path, 3)
    mine, theirs = io.read(path), by_library(path, name)
    assert solids(mine) == solids(theirs)
    assert len(solids(mine)) == 3
    assert not any(is_negative for _, is_negative, _ in solids(mine))


def test_every_own_reader_has_its_library_or_a_reason() -> None:
    assert set(NOT_RIGHT) <= set(grown_files.MAKERS)


def assert_same(path: Path, name: str) -> None:
    """Every node of every cell is the same one."""
    mine, theirs = io.read(path), by_library(path, name)
    np.testing.assert_array_equal(mine.points, theirs.points)
    np.testing.assert_array_equal(mine.types, theirs.types)
    np.testing.assert_array_equal(mine.connectivity, theirs.connectivity)


@pytest.mark.parametrize("code", elmer.SOLID)
def test_nodes_of_elmer(code: int, tmp_path: Path) -> None:
    folder = elmer.write(tmp_path, elmer.places(code), [(1, code, *range(1, code % 100 + 1))])
    assert_same(folder / "mesh.header", "elmer")


def test_parts_of_elmer(tmp_path: Path) -> None:
    mine = io.read(elmer.parts(tmp_path) / "partitioning.2")
    theirs = by_library(tmp_path / "partitioning.2", "elmer")
    np.testing.assert_array_equal(mine.connectivity, theirs.connectivity)


@pytest.mark.parametrize("name", [name for name in femap.SOLID if name != "pyramid13"])
def test_nodes_of_femap(name: str, tmp_path: Path) -> None:
    (tmp_path / "a.neu").write_text(femap.neutral(name))
    assert_same(tmp_path / "a.neu", "femap")


@pytest.mark.parametrize("version", [107, 109, 111, 112])
@pytest.mark.parametrize("order", ["<", ">"])
def test_zones_of_tecplot(version: int, order: str, tmp_path: Path) -> None:
    ordered = plt_files.Zone([*tecplot.GRID, tecplot.GRID[0]], shape=(3, 4, 2))
    for number, zones in enumerate(([tecplot.element("hexahedron")], [tecplot.element("tetra")], [ordered])):
        path = plt_files.plt(tmp_path / f"{number}.plt", tecplot.NAMES, zones, version=version, order=order,
                             extra=plt_files.drawing(order))  # fmt: skip
        assert_same(path, "tecplot")
