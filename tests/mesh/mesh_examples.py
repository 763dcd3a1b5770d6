"""Small meshes with everything that a mesh can have."""

from __future__ import annotations

import numpy as np

from meshgauge import Mesh, Polyhedra
from meshgauge.mesh import CellBlock

POINTS = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)], np.float32)
CELLS = [("tetra", [(0, 1, 2, 3), (1, 2, 3, 4)])]


def two_polyhedra() -> Mesh:
    """Two tetrahedra given by faces; they share one, which is flipped for the second, and the second is a ghost."""
    faces = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3), (1, 2, 4), (2, 3, 4), (3, 1, 4)]
    poly = Polyhedra.from_owner_neighbour(
        np.arange(0, 22, 3), np.array(faces).ravel(), [0, 0, 0, 0, 1, 1, 1], [-1, -1, 1, -1, -1, -1, -1]
    )
    return Mesh(
        POINTS,
        np.full(2, 42, np.uint8),
        np.array([0, 4, 8]),
        np.array([0, 1, 2, 3, 1, 2, 3, 4]),
        poly,
        point_data={"t": np.arange(5.0)},
        cell_data={"vtkGhostType": np.array([0, 1], np.uint8), "label": np.array([7, 8])},
        field_data={"names": np.array(["a", "b"])},
        path="here",
        notes=("one",),
        purpose="fv",
        stored="double",
        sources=("/here", "/beside"),
        counted=("points",),
    )


def all_types() -> Mesh:
    """Blocks of every kind of cell, mixed, some by faces, with an unused point at either end, and data."""
    rng = np.random.default_rng(3)
    points = rng.random((30, 3))
    types = np.array([10, 42, 12, 10, 5, 42, 13, 14, 10], np.uint8)
    sizes = np.array([4, 4, 8, 4, 3, 5, 6, 5, 4])
    offsets = np.r_[0, np.cumsum(sizes)]
    connectivity = np.concatenate([1 + rng.choice(28, n, replace=False) for n in sizes])
    faces, cell_offsets = [], [0]
    for cell, kind in enumerate(types):
        if kind == 42:
            nodes = connectivity[offsets[cell] : offsets[cell + 1]]
            base, top = nodes[:-1], nodes[-1]
            faces += [base[::-1], *(np.array([a, b, top]) for a, b in zip(base, np.roll(base, -1), strict=True))]
        cell_offsets.append(len(faces))
    return Mesh(
        points,
        types,
        offsets,
        connectivity,
        Polyhedra(
            np.array(cell_offsets),
            np.arange(len(faces)),
            np.r_[0, np.cumsum([len(f) for f in faces])],
            np.concatenate(faces),
        ),
        (CellBlock("steel", 0, 3), CellBlock("glue", 3, 4), CellBlock("air", 4, 9)),
        point_data={"t": rng.random(30), "name": np.array([f"p{n}" for n in range(30)])},
        cell_data={"material": np.array([1, 1, 1, 2, 3, 3, 3, 3, 3]), "v": rng.random((9, 3))},
        field_data={"x": np.arange(3)},
    )


def parts(mesh: Mesh) -> dict[str, np.ndarray]:
    """Every array of a mesh, by name."""
    found = {name: getattr(mesh, name) for name in ("points", "types", "offsets", "connectivity")}
    if mesh.polyhedra is not None:
        found |= {f"polyhedra.{name}": getattr(mesh.polyhedra, name) for name in Polyhedra.__slots__}
    for data in ("point_data", "cell_data", "field_data"):
        found |= {f"{data}.{name}": values for name, values in getattr(mesh, data).items()}
    return {name: values for name, values in found.items() if values is not None}
