"""Speed of the cell kernels against VTK's Verdict and against reading the points alone, in one run.

    python benchmarks/cells.py [--cells 1000000] [--rounds 9] [--threads 2] [--page docs/speed.md]

Same arrays, the same number of threads. Each round times all contenders in turn, each for a twentieth of a second or
once; the fastest run of each counts. A gather reads the points of each cell and writes one float: what no metric can be
faster than; once unrolled over the nodes, which is the best that Numba makes of it, and once as a plain loop. With
`--page` the rows of that page's table are written again, and what they were measured with.
"""

from __future__ import annotations

import argparse
import platform
import re
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numba
import numpy as np
from grids import MAKE, cells_of
from versions import versions
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkPoints, vtkSMPTools
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkUnstructuredGrid
from vtkmodules.vtkFiltersVerdict import vtkCellQuality

from meshgauge.cells import BY_NAME
from meshgauge.kernels.cells import driver
from meshgauge.surface_cells import SURFACE_TYPES

U = np.uint64
CHUNK = 1 << 16
WANTED = {
    "tetra": (12, 22, 0.4),
    "hexahedron": (7, 13, 0.65),
    "wedge": (5, 9, 0.65),
    "pyramid": (12, 24, 0.65),
    "triangle": (10, 20, 0.5),
    "quad": (10, 20, 0.5),
}
"""Ratios that the project wants: to VTK on all threads, to VTK on one (as its wheel runs), to the gather."""


def gather_source(n_nodes: int) -> str:
    """A kernel with no loop over the nodes and no chain of additions: the best that Numba makes of a gather."""
    terms = [f"x[p{j}] + (x[p{j} + U(1)] + x[p{j} + U(2)])" for j in range(n_nodes)]
    while len(terms) > 1:
        terms = [f"({' + '.join(terms[m : m + 2])})" for m in range(0, len(terms), 2)]
    loads = "\n".join(f"        p{j} = U(3) * U(cells[o + U({j})])" for j in range(n_nodes))
    return (
        f"def gather(x, cells, out):\n    for c in range(len(out)):\n        o = U({n_nodes}) * U(c)\n{loads}\n"
        f"        out[c] = {terms[0]}\n"
    )


@numba.njit(error_model="numpy", nogil=True)
def gather_by_loop(x: Any, cells: Any, n_nodes: Any, out: Any) -> None:
    """The same as one would write it first: a loop over the nodes, three running sums."""
    for c in range(len(out)):
        a, b, d = 0.0, 0.0, 0.0
        for j in range(n_nodes):
            p = U(3) * U(cells[U(c * n_nodes + j)])
            a += x[p]
            b += x[p + U(1)]
            d += x[p + U(2)]
        out[c] = a + b + d


def gather(n_nodes: int) -> Callable[..., None]:
    scope: dict[str, Any] = {"U": U}
    exec(gather_source(n_nodes), scope)
    compiled: Callable[..., None] = numba.njit(error_model="numpy", nogil=True)(scope["gather"])
    return compiled


def verdict(points: np.ndarray, cells: np.ndarray, vtk_id: int) -> vtkCellQuality:
    """VTK's filter on the same arrays."""
    place = vtkPoints()
    place.SetData(numpy_to_vtk(points))
    offsets = numpy_to_vtkIdTypeArray(np.arange(len(cells) + 1) * cells.shape[1], deep=True)
    array = vtkCellArray()
    array.SetData(offsets, numpy_to_vtkIdTypeArray(cells.reshape(-1)))
    grid = vtkUnstructuredGrid()
    grid.SetPoints(place)
    grid.SetCells(vtk_id, array)
    grid._keep = (points, cells)  # VTK holds no reference to what NumPy owns
    quality = vtkCellQuality()
    quality.SetInputData(grid)
    quality.SetQualityMeasureToScaledJacobian()
    return quality


def timed(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def fastest(work: Callable[[], object], least: float = 0.05) -> float:
    """The fastest of as many runs as fit into ``least`` seconds: the first one wakes threads and fills caches."""
    end = time.perf_counter() + least
    best = timed(work)
    while time.perf_counter() < end:
        best = min(best, timed(work))
    return best


def contest(name: str, least: int, rounds: int, threads: int) -> dict[str, float]:
    """Million cells a second of each contender; printed too."""
    row = SURFACE_TYPES[BY_NAME[name].vtk_id] if BY_NAME[name].dimension == 2 else BY_NAME[name]
    points, cells = cells_of(name, least)
    x, ids, out = points.reshape(-1), cells.reshape(-1), np.empty(len(cells))
    n = cells.shape[1]
    read = gather(n)
    read(x, ids[:0], out[:0])
    gather_by_loop(x, ids[:0], n, out[:0])
    driver.prepare(row, points, len(cells))
    pool = ThreadPoolExecutor(threads)
    starts = range(0, len(cells), CHUNK)

    def ours() -> None:
        list(
            pool.map(
                lambda s: driver.cell_jens(points, cells[s : s + CHUNK], row, out[s : s + CHUNK], compiled=True), starts
            )
        )

    def gathered() -> None:
        list(pool.map(lambda s: read(x, ids[n * s : n * (s + CHUNK)], out[s : s + CHUNK]), starts))

    def looped() -> None:
        list(pool.map(lambda s: gather_by_loop(x, ids[n * s : n * (s + CHUNK)], n, out[s : s + CHUNK]), starts))

    quality = verdict(points, cells, row.vtk_id)

    def vtk(backend: str, count: int) -> Callable[[], None]:
        def run() -> None:
            vtkSMPTools.SetBackend(backend)
            vtkSMPTools.Initialize(count)
            quality.Modified()
            quality.Update()

        return run

    contenders = {
        "jens": ours,
        "gather": gathered,
        "loop": looped,
        "all": vtk("STDThread", threads),
        "one": vtk("Sequential", 1),
    }
    best = dict.fromkeys(contenders, np.inf)
    for _ in range(rounds):
        for key, work in contenders.items():
            best[key] = min(best[key], fastest(work))
    ours()
    agree = ""
    if row.dimension == 3 and name != "pyramid":  # Verdict ignores the apex
        theirs = vtk_to_numpy(quality.GetOutput().GetCellData().GetArray("CellQuality"))
        agree = f"largest difference {np.abs(theirs - out).max():.0e} below the peak" if name == "hexahedron" else ""
    rate = {key: len(cells) / seconds / 1e6 for key, seconds in best.items()}
    wanted = WANTED[name]
    print(
        f"| {name} | {len(cells):,} | {rate['jens']:.0f} | {rate['all']:.0f} | {rate['one']:.0f} | "
        f"{rate['gather']:.0f} | {rate['loop']:.0f} | {rate['jens'] / rate['all']:.1f} (>= {wanted[0]}) | "
        f"{rate['jens'] / rate['one']:.1f} (>= {wanted[1]}) | {rate['jens'] / rate['gather']:.2f} (>= {wanted[2]}) | "
        f"{rate['jens'] / rate['loop']:.2f} | "
        f"{agree}",
        flush=True,
    )
    pool.shutdown()
    return rate


def write_page(page: Path, rates: dict[str, dict[str, float]], threads: int, rounds: int) -> None:
    """The table of a page: a row for each type that it has one for, and what was measured with."""
    text = page.read_text(encoding="utf-8")
    for name, rate in rates.items():
        columns = [f"{rate[key]:.0f}" for key in ("jens", "all", "one", "gather")]
        columns += [f"{rate['jens'] / rate[key]:.1f}" for key in ("all", "one")]
        text = re.sub(rf"^\| {name} \|.*$", f"| {name} | {' | '.join(columns)} |", text, flags=re.MULTILINE)
    packages = [f"{title} {version(name)}" for title, name in (("NumPy", "numpy"), ("Numba", "numba"), ("VTK", "vtk"))]
    measured = (
        f"Measured on {versions().split(';')[0]}, with Python {platform.python_version()}, meshgauge "
        f"{version('meshgauge')}, {packages[0]}, {packages[1]} and {packages[2]}, the same arrays\nand threads "
        f"for all, best of {rounds} rounds."
    )
    text = re.sub(r"^Measured on .*\n.* rounds\.", measured, text, count=1, flags=re.MULTILINE)
    text = re.sub(r"(million cells, )\d+( threads:)", rf"\g<1>{threads}\g<2>", text, count=1)
    page.write_text(text, encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, default=1_000_000)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--only", choices=list(MAKE))
    parser.add_argument("--page", type=Path)
    asked = parser.parse_args()
    print(versions("vtk"))
    print(f"million cells a second, {asked.threads} threads, best of {asked.rounds} rounds\n")
    print("| type | cells | J_ENS | VTK | 1 thread | gather | by loop | to VTK | to 1 thread | to gather | to loop |")
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    names = [asked.only] if asked.only else list(MAKE)
    rates = {name: contest(name, asked.cells, asked.rounds, asked.threads) for name in names}
    if asked.page is not None:
        write_page(asked.page, rates, asked.threads, asked.rounds)


if __name__ == "__main__":
    main()
