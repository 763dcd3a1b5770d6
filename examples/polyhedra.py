"""Polyhedral cells and their scores: solids, an octree transition, Voronoi cells before and after Lloyd's relaxation.

python examples/polyhedra.py [FOLDER]

Needs SciPy; with a folder, draws the pictures of docs/polyhedra.md into it (needs matplotlib).
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Voronoi

from meshgauge.polyhedra import Polyhedra
from meshgauge.polyhedral_quality import PolyhedralQuality, measure_polyhedra
from meshgauge.reference import solid

Points = NDArray[np.float64]
Faces = list[list[int]]

N_CELLS, SEED = 400, 2014
SHOWN = (0, 1, 2, 5, 10, 20, 40)
"""Steps of the relaxation of which the distribution is shown."""


def polyhedra(cells: Sequence[Sequence[Sequence[int]]]) -> Polyhedra:
    """Flat arrays of cells given as lists of faces."""
    faces = [face for cell in cells for face in cell]
    return Polyhedra(
        cell_offsets=np.cumsum([0] + [len(cell) for cell in cells]),
        cell_faces=np.arange(len(faces)),
        face_offsets=np.cumsum([0] + [len(face) for face in faces]),
        face_points=np.array([point for face in faces for point in face]),
    )


def voronoi(seeds: Points) -> tuple[Points, list[Faces]]:
    """The Voronoi cells of points in the unit cube, repeated in every direction; faces outward."""
    n = len(seeds)
    shifts = sorted(product((-1, 0, 1), repeat=3), key=lambda s: sum(map(abs, s)))
    around = (seeds + np.array(shifts)[:, None]).reshape(-1, 3)
    near = np.all((around > -0.6) & (around < 1.6), axis=1)
    near[:n] = True
    sites = around[near]
    found = Voronoi(sites)
    cells: list[Faces] = [[] for _ in range(n)]
    for pair, ring in zip(found.ridge_points, found.ridge_vertices, strict=True):
        if min(pair) >= n:
            continue
        x = found.vertices[ring]
        normal = np.cross(x - x[0], np.roll(x, -1, axis=0) - x[0]).sum(axis=0)
        is_outward = normal @ (sites[pair[1]] - sites[pair[0]]) > 0.0
        for cell, outward in ((pair[0], is_outward), (pair[1], not is_outward)):
            if cell < n:
                cells[cell].append(list(ring) if outward else list(ring)[::-1])
    return found.vertices, cells


def centroid(points: Points, faces: Faces) -> Points:
    """Centre of mass of a convex cell."""
    origin = points[faces[0][0]]
    volume, moment = 0.0, np.zeros(3)
    for face in faces:
        a, *ring = points[face] - origin
        for b, c in pairwise(ring):
            part = a @ np.cross(b, c)
            volume, moment = volume + part, moment + part * (a + b + c) / 4.0
    return np.asarray(origin + moment / volume)


def relaxation(n: int, steps: int) -> dict[int, tuple[Points, list[Faces], PolyhedralQuality]]:
    """Voronoi cells of n random points, and their quality, at the steps of Lloyd's relaxation that are shown."""
    seeds = np.random.default_rng(SEED).random((n, 3))
    shown = {}
    for step in range(steps + 1):
        points, cells = voronoi(seeds)
        if step in SHOWN:
            shown[step] = points, cells, measure_polyhedra(points, polyhedra(cells), slice(0, n))
        seeds = np.array([centroid(points, faces) for faces in cells]) % 1.0
    return shown


def transition() -> tuple[Points, Faces]:
    """A cube beside four smaller ones."""
    grid = np.array(list(product((0.0, 0.5, 1.0), repeat=3)))
    at = {tuple(int(2 * v) for v in p): i for i, p in enumerate(grid)}
    ring = [(2, 0, 0), (2, 1, 0), (2, 2, 0), (2, 2, 1), (2, 2, 2), (2, 1, 2), (2, 0, 2), (2, 0, 1)]
    far = [(0, 0, 0), (0, 2, 0), (0, 2, 2), (0, 0, 2)]
    faces = [[*(ring[i] for i in (j, j + 1)), (2, 1, 1), ring[j - 1]] for j in (0, 2, 4, 6)]
    faces += [[ring[2 * i], far[i], far[(i + 1) % 4], ring[(2 * i + 2) % 8], ring[2 * i + 1]] for i in range(4)]
    named = [[at[p] for p in face] for face in [*faces, far[::-1]]]
    used = sorted({i for face in named for i in face})
    return grid[used], [[used.index(i) for i in face] for face in named]


def pictured(shown: dict[int, tuple[Points, list[Faces], PolyhedralQuality]]) -> list[tuple[str, Points, Faces]]:
    """Title, points and faces of the cells of the picture."""
    cells = [(name, one.points, [list(f) for f in one.faces]) for name in PICTURED if (one := solid(name))]
    for step, title in ((0, "a Voronoi cell"), (max(shown), f"after {max(shown)} steps of Lloyd")):
        points, all_faces, quality = shown[step]
        faces = all_faces[int(np.argsort(quality.values)[len(quality.values) // 2])]
        used = sorted({i for face in faces for i in face})
        cells.append((title, points[used], [[used.index(i) for i in face] for face in faces]))
    return [*cells, ("an octree transition", *transition())]


PICTURED = ("octahedron", "dodecahedron", "truncated octahedron")


def draw(folder: Path, shown: dict[int, tuple[Points, list[Faces], PolyhedralQuality]]) -> None:
    """The pictures of docs/polyhedra.md."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    figure = Figure(figsize=(12, 8), layout="constrained")
    FigureCanvasAgg(figure)
    dots: Any = None
    for place, (title, points, faces) in enumerate(pictured(shown), 1):
        quality = measure_polyhedra(points, polyhedra([faces]), slice(0, 1))
        axes: Any = figure.add_subplot(2, 3, place, projection="3d")
        axes.add_collection3d(
            Poly3DCollection([points[face] for face in faces], facecolor=(0.5, 0.6, 0.7, 0.13), edgecolor="#444444")
        )
        corners = ~quality.node_is_hanging
        x, y, z = points[quality.node_points].T
        dots = axes.scatter(
            x[corners], y[corners], z[corners], c=quality.node_jens[corners], cmap="viridis", vmin=0, vmax=1, s=45,
            depthshade=False,
        )  # fmt: skip
        axes.scatter(x[~corners], y[~corners], z[~corners], facecolors="none", edgecolors="#d1300f", s=60)
        middle, reach = (points.max(axis=0) + points.min(axis=0)) / 2, np.ptp(points, axis=0).max() / 2
        for axis, centre in zip("xyz", middle, strict=True):
            getattr(axes, f"set_{axis}lim")(centre - reach, centre + reach)
        axes.set_box_aspect((1, 1, 1))
        axes.set_axis_off()
        axes.view_init(elev=22, azim=34)
        axes.set_title(f"{title}: {quality.values[0]:.3f}")
    figure.colorbar(dots, ax=figure.axes, shrink=0.6, label="J_ENS of the node; rings: hanging nodes")
    figure.savefig(folder / "polyhedra.png", dpi=90)

    figure = Figure(figsize=(9, 4.5), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    for step, (_, _, quality) in shown.items():
        shade = 0.85 * (1.0 - list(shown).index(step) / (len(shown) - 1))
        x, y = np.sort(quality.values), (np.arange(len(quality.values)) + 1.0) / len(quality.values)
        axes.plot(x, y, color=(shade, shade, 0.4 + 0.5 * shade), label=f"{step} steps")
    axes.set(xlabel="quality (J_ENS)", ylabel="fraction of cells at or below", xlim=(0, 1), ylim=(0, 1))
    axes.axvspan(0.0, 0.2, color="#f0a202", alpha=0.15, linewidth=0)
    axes.legend(title="Lloyd's relaxation")
    figure.savefig(folder / "lloyd.png", dpi=90)


def main(folder: Path | None, n: int = N_CELLS, steps: int = SHOWN[-1]) -> None:
    shown = relaxation(n, steps)
    print("  step    least   median     mean   below 0.2")
    for step, (_, _, quality) in shown.items():
        v = quality.values
        print(f"{step:6d} {v.min():8.4f} {np.median(v):8.3f} {v.mean():8.3f} {np.mean(v < 0.2):10.1%}")
    for title, points, faces in pictured(shown):
        quality = measure_polyhedra(points, polyhedra([faces]), slice(0, 1))
        print(f"{title:28s} {quality.values[0]:.3f}")
    if folder is not None:
        draw(folder, shown)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
