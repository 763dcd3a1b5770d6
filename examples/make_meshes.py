"""Makes the meshes of ``examples/meshes``: a bracket of all four cell types.

    python examples/make_meshes.py [FOLDER]

A bar of cubes is cut into four lengths: hexahedra; wedges (each cube cut along a diagonal); pyramids (each cube cut
from a point in its middle); tetrahedra (the same, its faces cut along diagonals). A face between two cubes is cut if
either side wants it cut, always along the diagonal from its point of lowest id, so that the mesh is conforming. The bar
is then bent into an L and twisted, and its inner points are moved a little at random, every time alike.
"""

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

import meshio
import numpy as np
from numpy.typing import NDArray

import meshgauge
from meshgauge.cells import cell_type

Floats = NDArray[np.float64]
Cells = dict[str, NDArray[np.int64]]
Triple = tuple[int, int, int]

REGIONS = ("hexahedra", "wedges", "pyramids", "tetrahedra")

# Corners of a cube in the order of a hexahedron's nodes; its faces, counter-clockwise seen from inside (so that each
# makes a pyramid with a point in the middle), and the cube beyond each.
CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
FACES = {
    (0, 1, 2, 3): (0, 0, -1),
    (4, 7, 6, 5): (0, 0, 1),
    (0, 4, 5, 1): (0, -1, 0),
    (1, 5, 6, 2): (1, 0, 0),
    (2, 6, 7, 3): (0, 1, 0),
    (3, 7, 4, 0): (-1, 0, 0),
}


def cut_bar(lengths: tuple[int, int, int, int], height: int, width: int, *, holes: bool) -> tuple[Floats, Cells, Cells]:
    """A straight bar of unit cubes: its points, its cells by type, and the region of each cell by type.

    Parameters
    ----------
    lengths
        Number of cubes along each region of `REGIONS`.
    height, width
        Number of cubes the other two ways.
    holes
        Leave out cubes, for a hole through each end.
    """
    region_of = [region for region, n in enumerate(lengths) for _ in range(n)]
    length = len(region_of)

    def region(cube: Triple) -> int | None:
        """The region of a cube, None if there is no cube."""
        i, j, k = cube
        inside = 0 <= i < length and 0 <= j < height and 0 <= k < width
        in_hole = holes and width // 3 <= k < width - width // 3 and (2 <= i < 4 or length - 4 <= i < length - 2)
        return region_of[i] if inside and not in_hole else None

    cubes = [(i, j, k) for i in range(length) for j in range(height) for k in range(width)]
    ids: dict[Triple, int] = {}  # by twice the coordinates: the middle of a cube has odd ones
    nodes = {
        (i, j, k): [ids.setdefault((2 * (i + a), 2 * (j + b), 2 * (k + c)), len(ids)) for a, b, c in CORNERS]
        for i, j, k in cubes
        if region((i, j, k)) is not None
    }
    cells: dict[str, list[tuple[int, ...]]] = defaultdict(list)
    regions: dict[str, list[int]] = defaultdict(list)

    def add(name: str, here: int, *which: int) -> None:
        cells[name].append(which)
        regions[name].append(here)

    for (i, j, k), at in nodes.items():
        here = region_of[i]
        if here == 0:
            add("hexahedron", here, *at)
        elif here == 1:
            # The triangles face along the width, where the next cube is cut alike.
            add("wedge", here, at[0], at[1], at[2], at[4], at[5], at[6])
            add("wedge", here, at[0], at[2], at[3], at[4], at[6], at[7])
        else:
            middle = ids.setdefault((2 * i + 1, 2 * j + 1, 2 * k + 1), len(ids))
            for face, (di, dj, dk) in FACES.items():
                quad = [at[m] for m in face]
                if 3 in (here, region((i + di, j + dj, k + dk))):
                    first = quad.index(min(quad))
                    a, b, c, d = quad[first:] + quad[:first]
                    add("tetra", here, a, b, c, middle)
                    add("tetra", here, a, c, d, middle)
                else:
                    add("pyramid", here, *quad, middle)
    return (
        np.array(list(ids)) / 2,
        {name: np.array(rows) for name, rows in cells.items()},
        {name: np.array(rows) for name, rows in regions.items()},
    )


def bend(grid: Floats, *, radius: float, twist: float) -> Floats:
    """The bar as an L: two straight legs joined by a quarter of a ring, the second turning about its axis.

    Parameters
    ----------
    grid
        ``(n, 3)`` points of the straight bar, from the origin.
    radius
        Inner radius of the bend, in cubes.
    twist
        Turn of the second leg, in radians a cube.
    """
    along, up, over = grid.T
    length, height, width = grid.max(axis=0)
    arc = (radius + height / 2) * np.pi / 2
    start = (length - arc) / 2
    angle = np.clip((along - start) / arc, 0, 1) * np.pi / 2
    beyond = np.maximum(along - start - arc, 0)
    turn = twist * beyond
    y, z = up - height / 2, over - width / 2
    y, z = y * np.cos(turn) - z * np.sin(turn), y * np.sin(turn) + z * np.cos(turn)
    from_centre = radius + height / 2 - y
    return np.stack(
        [
            np.minimum(along, start) + from_centre * np.sin(angle) + beyond * np.cos(angle),
            radius + height - from_centre * np.cos(angle) + beyond * np.sin(angle),
            z + width / 2,
        ],
        axis=1,
    )


def inner_points(cells: Cells, n_points: int) -> NDArray[np.int64]:
    """The points that are not on the boundary, whose faces belong to one cell only."""
    count: dict[frozenset[int], int] = defaultdict(int)
    for name, rows in cells.items():
        for face in cell_type(name).shape.faces:
            for nodes in rows[:, face]:
                count[frozenset(nodes.tolist())] += 1
    outer = {point for face, n in count.items() if n == 1 for point in face}
    return np.array([point for point in range(n_points) if point not in outer])


def worst_at(points: Floats, cells: Cells, point: int) -> float:
    """The least quality of the cells at a point."""
    return min(
        meshgauge.jens(points, rows[(rows == point).any(axis=1)], name).min()
        for name, rows in cells.items()
        if (rows == point).any()
    )


def push(points: Floats, cells: Cells, point: int, direction: Floats, below: float) -> None:
    """Move one point in small steps until the worst of its cells is below a quality."""
    for _ in range(200):
        if worst_at(points, cells, point) < below:
            return
        points[point] += 0.01 * direction
    raise RuntimeError(f"point {point}: no cell came below {below}")


def bracket(
    lengths: tuple[int, int, int, int], height: int, width: int, *, holes: bool, poor: int = 0, bad: Sequence[str] = ()
) -> meshgauge.Mesh:
    """The mesh, with some inner points moved: ``poor`` of them until a cell is poor, then, for each type named in
    ``bad``, one that only cells of this type share, until a cell is inverted."""
    rng = np.random.default_rng(2014)
    grid, cells, regions = cut_bar(lengths, height, width, holes=holes)
    points = bend(grid, radius=height, twist=0.04)
    inner = inner_points(cells, len(points))
    points[inner] += rng.uniform(-0.12, 0.12, (len(inner), 3))
    shuffled = rng.permutation(inner)
    users = {name: set(np.unique(rows).tolist()) for name, rows in cells.items()}
    chosen = [(point, 0.15) for point in shuffled[:poor]]
    for name in bad:
        others = set().union(*(ids for other, ids in users.items() if other != name))
        chosen.append((next(p for p in shuffled[poor:] if p in users[name] - others), -0.05))
    for point, below in chosen:
        direction = rng.normal(size=3)
        push(points, cells, int(point), direction / np.linalg.norm(direction), below)
    order = ["hexahedron", "wedge", "pyramid", "tetra"]
    return meshgauge.Mesh.from_arrays(
        0.01 * points,  # a cube is a centimetre, lengths are in metres
        [(name, cells[name]) for name in order],
        cell_data={"region": np.concatenate([regions[name] for name in order]).astype(np.uint8)},
    )


def write_gmsh(path: Path, mesh: meshgauge.Mesh) -> None:
    """As Gmsh writes it by default in version 2: text, each region a named physical group."""
    region = np.asarray(mesh.cell_data["region"], np.int64) + 1
    blocks, tags = [], []
    for row, _, ids in mesh.groups():
        first, last = np.arange(mesh.n_cells)[ids][[0, -1]]
        nodes = mesh.connectivity[mesh.offsets[first] : mesh.offsets[last + 1]]
        blocks.append((row.name, nodes.reshape(-1, row.n_nodes)))
        tags.append(region[ids])
    source = meshio.Mesh(
        mesh.points,
        blocks,
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data={name: np.array([m + 1, 3]) for m, name in enumerate(REGIONS)},
    )
    source.write(path, file_format="gmsh22", binary=False, float_fmt=".9g")


def main(folder: Path | None = None) -> None:
    """Write the three meshes into a folder, by default the one beside this file."""
    folder = folder or Path(__file__).with_name("meshes")
    folder.mkdir(parents=True, exist_ok=True)
    lengths = (13, 10, 6, 6)
    meshgauge.write(folder / "bracket_good.vtu", bracket(lengths, 6, 8, holes=True))
    meshgauge.write(
        folder / "bracket.vtu", bracket(lengths, 6, 8, holes=True, poor=25, bad=("hexahedron", "wedge", "pyramid"))
    )
    write_gmsh(folder / "bracket_small.msh", bracket((4, 3, 2, 2), 2, 3, holes=False))


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
