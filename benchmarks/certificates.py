"""Speed of the certificates inside hexahedra against Gmsh's, in one run on one mesh; how often corners mislead.

    python benchmarks/certificates.py [--cells 200000] [--rounds 5] [--threads 2] [--random 1000000]

Gmsh (package `gmsh`) is asked for the minimum of the Jacobian determinant of the same cells, by its plugin
AnalyseMeshQuality and by `getElementQualities("minDetJac")`, with the same number of threads. Then unit cubes and
wedges with uniform noise of ±a on every coordinate: the share of those with positive corners that are invalid inside.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from grids import cells_of
from versions import versions

from meshgauge import Mesh, Status, measure
from meshgauge.cells import SHAPES
from meshgauge.kernels.certificate.bounds import bounds

CHUNK = 1 << 16


def best(work: Callable[[], object], rounds: int) -> float:
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def against_gmsh(n_cells: int, rounds: int, threads: int) -> None:
    import gmsh

    points, cells = cells_of("hexahedron", n_cells)
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("General.NumThreads", threads)
    gmsh.model.add("grid")
    volume = gmsh.model.addDiscreteEntity(3)
    gmsh.model.mesh.addNodes(3, volume, np.arange(1, len(points) + 1), points.reshape(-1))
    tags = np.arange(1, len(cells) + 1)
    gmsh.model.mesh.addElementsByType(volume, 5, tags, (cells + 1).reshape(-1))
    plugin = gmsh.plugin
    plugin.setNumber("AnalyseMeshQuality", "JacobianDeterminant", 1)
    plugin.setNumber("AnalyseMeshQuality", "CreateView", 0)
    plugin.setNumber("AnalyseMeshQuality", "Recompute", 1)
    theirs = {
        "AnalyseMeshQuality": best(lambda: plugin.run("AnalyseMeshQuality"), rounds),
        "minDetJac": best(lambda: gmsh.model.mesh.getElementQualities(tags, "minDetJac"), rounds),
    }
    gmsh.finalize()
    pool = ThreadPoolExecutor(threads)

    def ours() -> None:
        starts = range(0, len(cells), CHUNK)
        list(pool.map(lambda s: bounds("hexahedron", points, cells[s : s + CHUNK]), starts))

    ours()
    seconds = best(ours, rounds)
    print(f"\n{len(cells):,} hexahedra, {threads} threads, best of {rounds}")
    print(f"  certificates: {len(cells) / seconds / 1e6:.1f} M/s")
    for name, other in theirs.items():
        print(f"  Gmsh {name}: {len(cells) / other / 1e6:.2f} M/s, ratio {other / seconds:.0f} (>= 20)")


def frequencies(n_cells: int) -> None:
    print("\nshare of the cells with positive corners that are invalid inside\n")
    print("| cell | a | positive corners | invalid inside | share |\n|---|---|---|---|---|")
    rng = np.random.default_rng(0)
    for name in ("hexahedron", "wedge"):
        shape = np.array(SHAPES[name].points, float)
        for a in (0.4, 0.5, 0.7):
            nodes = shape + rng.uniform(-a, a, (n_cells, *shape.shape))
            ids = np.arange(n_cells * len(shape)).reshape(n_cells, -1)
            quality = measure(Mesh.from_arrays(nodes.reshape(-1, 3), [(name, ids)]))
            positive, inside = int((quality.values > 0).sum()), int((quality.status == Status.INVERTED_INSIDE).sum())
            print(f"| {name} | {a} | {positive:,} | {inside:,} | {inside / positive:.4%} |", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, default=200_000)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--random", type=int, default=1_000_000, help="random cells of each kind; 0 for none")
    asked = parser.parse_args()
    try:
        import gmsh  # noqa: F401
    except ImportError:
        print("Gmsh is not installed: pip install gmsh")
    else:
        print(versions("gmsh"))
        against_gmsh(asked.cells, asked.rounds, asked.threads)
    if asked.random:
        frequencies(asked.random)


if __name__ == "__main__":
    main()
