"""Speed on polyhedra: Voronoi cells of random points, nearly all of a form of their own, and hexahedra as polyhedra.

    python benchmarks/polyhedra.py [--cells 100000] [--rounds 5] [CASE ...]

Corners are nodes of cells. CASE are meshes whose polyhedra are measured beside, such as folders of OpenFOAM.
Needs SciPy. The first line is the first polyhedral mesh in an environment, whose kernels are to be compiled.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time

import numpy as np
from grids import hexahedra
from numpy.typing import NDArray
from scipy.spatial import Voronoi
from versions import versions

import meshgauge
from meshgauge.cells import cell_type
from meshgauge.mesh.polyhedra import Polyhedra
from meshgauge.quality.polyhedra import measure_polyhedra

Points = NDArray[np.float64]
Cells = NDArray[np.int64]

COMPILING = """
import time
from meshgauge.kernels.jit import warm_up
from meshgauge.kernels.polyhedra import driver
warm_up()
start = time.process_time(), time.perf_counter()
driver.prepare()
print(time.process_time() - start[0], time.perf_counter() - start[1])
"""


def voronoi(n: int) -> tuple[Points, Polyhedra, Cells]:
    """The Voronoi cells of n random points in the unit cube, and the ids of those that lie inside of it."""
    seeds = np.random.default_rng(0).random((n, 3))
    found = Voronoi(seeds)
    sizes = np.array([len(ring) for ring in found.ridge_vertices])
    ids = np.array([point for ring in found.ridge_vertices for point in ring])
    starts = np.cumsum(sizes) - sizes
    following = np.arange(1, len(ids) + 1)
    following[starts + sizes - 1] = starts
    origin = np.repeat(starts, sizes)
    x = found.vertices[ids]
    areas = np.add.reduceat(np.cross(x - x[origin], x[following] - x[origin]), starts)
    owner, neighbour = found.ridge_points.T
    inward = (areas * (seeds[neighbour] - seeds[owner])).sum(axis=1) < 0.0
    owner, neighbour = np.where(inward, neighbour, owner), np.where(inward, owner, neighbour)
    is_open = np.minimum.reduceat(ids, starts) < 0
    inside = np.ones(n, bool)
    outside = ((x < 0.0) | (x > 1.0)).any(axis=1)
    bad = is_open | np.logical_or.reduceat(outside, starts)
    inside[owner[bad]] = inside[neighbour[bad]] = False
    offsets = np.concatenate([[0], np.cumsum(sizes)])
    return found.vertices, Polyhedra.from_owner_neighbour(offsets, ids, owner, neighbour), np.flatnonzero(inside)


def as_polyhedra(cells: Cells) -> Polyhedra:
    """Hexahedra, each with faces of its own."""
    shape = cell_type("hexahedron").shape
    assert shape is not None
    return Polyhedra(
        cell_offsets=np.arange(0, 6 * len(cells) + 1, 6),
        cell_faces=np.arange(6 * len(cells)),
        face_offsets=np.arange(0, 24 * len(cells) + 1, 4),
        face_points=cells[:, np.array(shape.faces).ravel()].ravel(),
    )


def report(name: str, points: Points, polyhedra: Polyhedra, cells: Cells, rounds: int) -> None:
    best, corners = np.inf, 0
    for _ in range(rounds):
        start = time.perf_counter()
        quality = measure_polyhedra(points, polyhedra, cells)
        best = min(best, time.perf_counter() - start)
        corners = len(quality.node_points)
    print(f"{name:44s} {len(cells):9,} cells {best:6.2f} s {corners / best / 1e6:6.2f} M corners/s")


def main() -> None:
    options = argparse.ArgumentParser()
    options.add_argument("--cells", type=int, default=100_000)
    options.add_argument("--rounds", type=int, default=5)
    options.add_argument("cases", nargs="*")
    given = options.parse_args()
    print(versions("scipy"))
    with tempfile.TemporaryDirectory() as cache:
        environment = {**os.environ, "NUMBA_CACHE_DIR": cache}
        for turn in ("compiling", "from the cache"):
            done = subprocess.run(
                [sys.executable, "-c", COMPILING], env=environment, check=True, capture_output=True, text=True
            )
            cpu, wall = (float(value) for value in done.stdout.split())
            print(f"{turn}: {cpu:.1f} s of processor, {wall:.1f} s")
    report("Voronoi cells of random points", *voronoi(given.cells), given.rounds)
    points, cells = hexahedra(round(given.cells ** (1 / 3)))
    report("hexahedra as polyhedra", points, as_polyhedra(cells), np.arange(len(cells)), given.rounds)
    for case in given.cases:
        mesh = meshgauge.read(case)
        if mesh.polyhedra is None:
            continue
        cells = np.flatnonzero(np.diff(mesh.polyhedra.cell_offsets))
        report(case[-44:], mesh.points, mesh.polyhedra, cells, given.rounds)


if __name__ == "__main__":
    main()
