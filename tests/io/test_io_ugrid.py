"""UGRID: the order of nodes of the format's definition, and what meshio reads and writes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from io_meshes import LINEAR, mesh_of

import meshgauge
from meshgauge import io
from meshgauge.cells import type_name

PYRAMID = """5 0 0 0 1 0 0
0 0 0
1 0 0
0.5 0.5 -0.7071067811865476
0 1 0
1 1 0
1 2 3 4 5
"""
"""One pyramid. "UGRID Element Connectivity" of the SimCenter: nodes 1, 4, 5 and 2 are its base, 3 is its apex.

     1---4
     |\\ /|
     | 3 |    seen from the apex
     |/ \\|
     2---5
"""


def test_a_pyramid_stands_as_the_format_defines(tmp_path: Path) -> None:
    (tmp_path / "a.ugrid").write_text(PYRAMID)
    mesh = io.read(tmp_path / "a.ugrid")
    assert mesh.nodes(0).tolist() == [0, 3, 4, 1, 2]
    assert meshgauge.measure(mesh).values == pytest.approx([1.0])
    io.write(tmp_path / "b.ugrid", mesh)
    assert (tmp_path / "b.ugrid").read_text().split()[-5:] == PYRAMID.split()[-5:]


@pytest.mark.parametrize("extension", [".b8.ugrid", ".lb8.ugrid"])
def test_meshio_reads_what_is_written_and_the_other_way_round(tmp_path: Path, extension: str) -> None:
    meshio = pytest.importorskip("meshio")
    mesh = mesh_of(*LINEAR, n=1)
    io.write(tmp_path / f"a{extension}", mesh)
    theirs = meshio.read(tmp_path / f"a{extension}")
    blocks = [(block.type, block.data) for block in theirs.cells]
    assert sorted(name for name, _ in blocks) == sorted(LINEAR)
    read = meshgauge.Mesh.from_arrays(theirs.points, blocks)
    assert meshgauge.measure(read).values == pytest.approx(np.ones(len(LINEAR)))
    meshio.Mesh(mesh.points, [(type_name(mesh.types[c]), mesh.nodes(c)[None]) for c in range(mesh.n_cells)]).write(
        tmp_path / f"b{extension}"
    )
    assert meshgauge.measure(io.read(tmp_path / f"b{extension}")).values == pytest.approx(np.ones(len(LINEAR)))
