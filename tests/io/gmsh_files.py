"""Files that Gmsh writes in the formats of others: an oracle for node orders and groups."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from meshgauge.cells import CELL_TYPES, SHAPES
from meshgauge.mesh import Mesh

CELLS = {"wedge": 28, "hexahedron": 8, "tetra": 100}
BODIES = {"prisms": 28, "bricks": 8, "tets": 100}
FLOOR = ("floor", 14)

_FACE_NODES = {
    "wedge18": ((0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    "hexahedron27": (
        (3, 0, 4, 7),
        (1, 2, 6, 5),
        (0, 1, 5, 4),
        (2, 3, 7, 6),
        (0, 1, 2, 3),
        (4, 5, 6, 7),
        tuple(range(8)),
    ),
}


def three_bodies(gmsh: Any, path: Path, order: int = 1, *, is_incomplete: bool = False) -> None:
    """A body of wedges, one of hexahedra and one of tetrahedra, each a physical group, and the first one's floor."""
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.SecondOrderIncomplete", is_incomplete)
        gmsh.option.setNumber("Mesh.MeshSizeMin", 0.5)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.5)
        gmsh.model.add("three")
        occ = gmsh.model.occ
        floor, square = occ.addRectangle(0, 0, 0, 1, 1), occ.addRectangle(2, 0, 0, 1, 1)
        occ.extrude([(2, floor), (2, square)], 0, 0, 1, numElements=[2], recombine=True)
        occ.addBox(4, 0, 0, 1, 1, 1)
        occ.synchronize()
        gmsh.model.mesh.setTransfiniteSurface(square)
        gmsh.model.mesh.setRecombine(2, square)
        for (_, volume), (tag, name) in zip(gmsh.model.getEntities(3), enumerate(BODIES, 7), strict=True):
            gmsh.model.addPhysicalGroup(3, [volume], tag, name)
        gmsh.model.addPhysicalGroup(2, [floor], 3, FLOOR[0])
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(order)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()


def assert_straight(mesh: Mesh) -> None:
    """All solids are valid; their other nodes are at the middles of edges and faces, where their types have them."""
    for vtk_id in np.unique(mesh.types).tolist():
        row = CELL_TYPES[vtk_id]
        if row.shape is None:
            continue
        cells = np.flatnonzero(mesh.types == vtk_id)
        x = mesh.points[mesh.connectivity[mesh.offsets[cells][:, None] + np.arange(row.n_nodes or 0)]]
        for a, i, j, k in row.shape.triples:
            assert (np.linalg.det(x[:, [i, j, k]] - x[:, [a]]) > 0).all(), row.name
        if row.n_nodes == row.shape.n_nodes:
            continue
        middles = [*SHAPES[row.shape.name].edges, *_FACE_NODES.get(row.name, ())]
        at = row.shape.n_nodes
        assert at + len(middles) == row.n_nodes
        for node, ends in enumerate(middles, at):
            np.testing.assert_allclose(
                x[:, node], x[:, list(ends)].mean(axis=1), atol=2e-6, err_msg=f"{row.name} {node}"
            )


def solids(mesh: Mesh) -> dict[str, int]:
    """Solid cells by their shape."""
    found: dict[str, int] = {}
    for name, n in mesh.type_counts().items():
        row = next(r for r in CELL_TYPES.values() if r.name == name)
        if row.shape is not None:
            found[row.shape.name] = found.get(row.shape.name, 0) + n
    return found
