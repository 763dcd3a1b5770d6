"""Polyhedral cells and their scores: solids, an octree transition, Voronoi cells before and after Lloyd's relaxation.

python examples/polyhedra.py [FOLDER]

Needs SciPy; with a folder, draws the pictures of docs/polyhedra.md into it (needs PyVista and matplotlib).
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from itertools import pairwise, product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Voronoi

from meshgauge.mesh.polyhedra import Polyhedra
from meshgauge.quality.polyhedra import PolyhedralQuality, measure_polyhedra
from meshgauge.quality.reference import solid

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


def _sides(face: list[int]) -> list[tuple[int, int]]:
    return [(face[i - 1], face[i]) for i in range(len(face))]


def draw(folder: Path, shown: dict[int, tuple[Points, list[Faces], PolyhedralQuality]]) -> None:
    """The pictures of docs/polyhedra.md."""
    import pyvista as pv
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    plotter = pv.Plotter(off_screen=True, shape=(2, 3), window_size=(1200, 860), border=False)
    for place, (title, points, faces) in enumerate(pictured(shown)):
        quality = measure_polyhedra(points, polyhedra([faces]), slice(0, 1))
        plotter.subplot(*divmod(place, 3))
        size = float(np.ptp(points, axis=0).max())
        surface = pv.PolyData(points, np.concatenate([[len(face), *face] for face in faces]))
        plotter.add_mesh(surface, color="#b9cbe0", opacity=0.75, ambient=0.35, diffuse=0.8)
        edges = surface.extract_feature_edges(0.01, boundary_edges=False)
        seams = pv.PolyData(points, lines=np.concatenate([[2, a, b] for face in faces for a, b in _sides(face)]))
        for lines, width in ((edges, 0.007), (seams, 0.004)):
            if lines.n_cells:
                plotter.add_mesh(lines.tube(radius=width * size), color="#3b4754")
        nodes, corners = points[quality.node_points], ~quality.node_is_hanging
        dots = pv.PolyData(nodes[corners])
        dots["J_ENS of the node"] = quality.node_jens[corners]
        plotter.add_mesh(
            dots.glyph(scale=False, orient=False, geom=pv.Sphere(radius=0.034 * size)),
            scalars="J_ENS of the node", cmap="viridis", clim=(0.0, 1.0), ambient=0.2, show_scalar_bar=place == 5,
            scalar_bar_args={"vertical": False, "position_x": 0.15, "width": 0.7, "position_y": 0.01, "height": 0.12,
                             "title": "J_ENS of the node; red: hanging", "title_font_size": 15, "label_font_size": 14,
                             "n_labels": 3, "fmt": "%.1f", "color": "#222222"},
        )  # fmt: skip
        if not corners.all():
            hanging = pv.PolyData(nodes[~corners])
            plotter.add_mesh(
                hanging.glyph(scale=False, orient=False, geom=pv.Sphere(radius=0.026 * size)), color="#d1300f"
            )
        plotter.add_text(f"{title}: {quality.values[0]:.3f}", font_size=11, position="upper_edge", color="#222222")
        plotter.view_vector((1.0, 0.62, 0.5))
        plotter.camera.focal_point = (points.max(axis=0) + points.min(axis=0)) / 2
        plotter.camera.parallel_projection = True
        plotter.camera.parallel_scale = 0.57 * float(np.linalg.norm(np.ptp(points, axis=0)))
    plotter.background_color = "white"
    plotter.screenshot(str(folder / "polyhedra.png"))
    plotter.close()

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
