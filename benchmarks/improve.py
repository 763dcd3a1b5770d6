"""Improvement: worst and mean quality before and after, fixed and sliding, and what it costs.

    python benchmarks/improve.py [MESH ...] [--cells 30000] [--threads N]

Without files: tangled grids of each cell type, made here. Four ways of each mesh: the boundary fixed, with `floor` 0.9
and 1, with `topology`, and sliding. Each figure is worst / mean J_ENS, cells that are still invalid, and seconds of the
processor, all threads together; kernels are compiled before. The ceiling is the most that the worst cell can have with
the boundary fixed. The last column is the peak of the process until then.
"""

from __future__ import annotations

import argparse
import os
import resource
from collections.abc import Iterator

import numpy as np
from grids import MAKE, cells_of
from versions import versions

import meshgauge

WAYS = (
    {"floor": 0.9},
    {"floor": 1.0},
    {"floor": 1.0, "topology": True},
    {"floor": 1.0, "boundary": "slide"},
)


def made(least: int) -> Iterator[tuple[str, meshgauge.Mesh]]:
    """A tangled grid of each type: inner points moved by up to half an edge along each axis."""
    for kind in MAKE:
        points, cells = cells_of(kind, least)
        points = np.rint(2.0 * points) / 2.0
        inside = ((points > points.min(axis=0)) & (points < points.max(axis=0))).all(axis=1)
        points[inside] += np.random.default_rng(0).uniform(-0.5, 0.5, (int(inside.sum()), 3))
        yield f"{kind}, tangled", meshgauge.Mesh.from_arrays(points, {kind: cells})


def seconds() -> float:
    """Of the processor, used so far."""
    times = os.times()
    return times.user + times.system


def row(name: str, mesh: meshgauge.Mesh, threads: int | None) -> str:
    columns = []
    for way in WAYS:
        start = seconds()
        result = meshgauge.improve(mesh, threads=threads, everywhere=True, **way)  # type: ignore[arg-type]
        spent = seconds() - start
        after, left = result.after.summary().all, sum(result.report.status_after.values())
        left -= result.report.status_after.get("ok", 0) + result.report.status_after.get("undecided", 0)
        columns.append(f"{after.min:.3f} / {after.mean:.3f}, {left:,} ({spent:.1f} s)")
    before, ceiling = result.before.summary().all, result.report.ceiling
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    cells = [name, f"{mesh.n_cells:,}", f"{before.min:.3f} / {before.mean:.3f}", f"{ceiling:.3f}", *columns]
    return f"| {' | '.join(cells)} | {peak:,.0f} MB |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("meshes", nargs="*", metavar="MESH")
    parser.add_argument("--cells", type=int, default=30_000, help="of each grid made here")
    parser.add_argument("--threads", type=int)
    options = parser.parse_args()
    for _, small in made(200):
        for way in WAYS:
            meshgauge.improve(small, everywhere=True, **way)  # type: ignore[arg-type]
    print(versions())
    print("| mesh | cells | before | ceiling | fixed, floor .9 | fixed, floor 1 | topology | sliding | peak |")
    print("|---|---:|---|---:|---|---|---|---|---:|")
    meshes = ((os.path.basename(path), meshgauge.read(path)) for path in options.meshes)
    for name, mesh in meshes if options.meshes else made(options.cells):
        print(row(name, mesh, options.threads), flush=True)


if __name__ == "__main__":
    main()
