"""Mending what is bad: seconds of the processor that it takes, beside those that measuring the mesh takes.

    python benchmarks/mend.py [--cells 1000000] [--dents 10 100] [--noise 0.25] [--threads N]

Grids of hexahedra: with single points gone astray by more than an edge, and with all inner points moved at random by up
to the noise along each axis. Reading and writing are apart; kernels are compiled before. The last column is the peak of
the process until then.
"""

from __future__ import annotations

import argparse
import os
import resource

import numpy as np
from grids import cells_of
from versions import versions

import meshgauge


def grid(least: int) -> tuple[np.ndarray, np.ndarray]:
    """Points of a grid of unit cubes, and its cells."""
    points, cells = cells_of("hexahedron", least)
    return np.rint(2.0 * points) / 2.0, cells


def dented(least: int, n: int) -> meshgauge.Mesh:
    """A grid with n inner points gone astray."""
    points, cells = grid(least)
    rng = np.random.default_rng(0)
    inside = np.flatnonzero(((points > points.min(axis=0) + 2) & (points < points.max(axis=0) - 2)).all(axis=1))
    points[rng.choice(inside, n, replace=False)] += rng.choice([-1, 1], (n, 3)) * rng.uniform(0.9, 1.3, (n, 3))
    return meshgauge.Mesh.from_arrays(points, {"hexahedron": cells})


def noisy(least: int, by: float) -> meshgauge.Mesh:
    """A grid with all inner points moved."""
    points, cells = grid(least)
    inside = ((points > points.min(axis=0)) & (points < points.max(axis=0))).all(axis=1)
    points[inside] += np.random.default_rng(0).uniform(-by, by, (int(inside.sum()), 3))
    return meshgauge.Mesh.from_arrays(points, {"hexahedron": cells})


def seconds() -> float:
    """Of the processor, used so far."""
    times = os.times()
    return times.user + times.system


def row(name: str, mesh: meshgauge.Mesh, threads: int | None) -> str:
    start = seconds()
    meshgauge.measure(mesh, threads=threads)
    measured = seconds()
    report = meshgauge.improve(mesh, threads=threads).report
    spent = seconds() - measured
    counts = f"{report.n_below_before:,} -> {report.n_below:,}"
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    cells = [name, f"{mesh.n_cells:,}", counts, f"{report.displacement.n_points:,}"]
    return f"| {' | '.join(cells)} | {measured - start:.2f} | {spent:.2f} | {peak:,.0f} MB |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, default=1_000_000)
    parser.add_argument("--dents", type=int, nargs="*", default=[10, 100])
    parser.add_argument("--noise", type=float, default=0.25)
    parser.add_argument("--threads", type=int)
    options = parser.parse_args()
    for small in (dented(60_000, 5), noisy(60_000, options.noise)):
        meshgauge.improve(small)
    print(versions())
    print("| mesh | cells | below 0.2 | points moved | measuring, s | mending, s | peak |")
    print("|---|---:|---|---:|---:|---:|---:|")
    for n in options.dents:
        print(row(f"{n} dents", dented(options.cells, n), options.threads), flush=True)
    if options.noise:
        print(row(f"noise {options.noise:g}", noisy(options.cells, options.noise), options.threads), flush=True)


if __name__ == "__main__":
    main()
