"""Speed around the kernels: what is lost between a kernel and a call, with the limit and the peer beside it.

    python benchmarks/around.py [--cells 4000000] [--rounds 7] [--threads 2] [CASE ...]

Cases: `tetra` and `pyramid`, `meshgauge.jens` on arrays against its kernel alone, against reading the points of each
cell (the gather of `cells.py`, which no metric can be faster than) and against VTK; `order`, measuring a mesh of four
types that alternate, or are in random order, against the same sorted by type; `doctor`, the diagnosis of hexahedra
against reading its arrays once.

Processor seconds, the least of the rounds, in which all contenders take turns: others on the machine disturb them less.
With `--bare CASE` the seconds of ours alone are printed, which `commits.py` compares.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from grids import MAKE, cells_of, hexahedra

import meshgauge
from meshgauge import Mesh
from meshgauge.cells import BY_NAME
from meshgauge.kernels.cells import driver

CHUNK = 1 << 16
KINDS = {10: (0, 1, 3, 4), 14: (0, 1, 2, 3, 4), 13: (0, 1, 2, 4, 5, 6), 12: tuple(range(8))}
"""Of each type the corners of the cube that make its cell."""

Contenders = dict[str, Callable[[], object]]


def arrays(name: str, least: int, threads: int, *, bare: bool) -> tuple[int, Contenders]:
    """`meshgauge.jens` on the arrays of cells of one type."""
    points, cells = cells_of(name, least)
    ours: Contenders = {"jens": lambda: meshgauge.jens(points, cells, name, threads=threads)}
    if bare:
        return len(cells), ours
    from cells import gather, verdict
    from vtkmodules.vtkCommonCore import vtkSMPTools

    row, out, n = BY_NAME[name], np.empty(len(cells)), cells.shape[1]
    driver.prepare(row, points, len(cells))
    x, ids, read = points.reshape(-1), cells.reshape(-1), gather(n)
    quality, pool, starts = verdict(points, cells, row.vtk_id), ThreadPoolExecutor(threads), range(0, len(cells), CHUNK)

    def kernel_of(start: int) -> None:
        here = slice(start, start + CHUNK)
        driver.cell_jens(points, cells[here], row, out[here], compiled=True)

    def kernel() -> None:
        list(pool.map(kernel_of, starts))

    def gathered() -> None:
        list(pool.map(lambda s: read(x, ids[n * s : n * (s + CHUNK)], out[s : s + CHUNK]), starts))

    def vtk() -> None:
        vtkSMPTools.SetBackend("STDThread")
        vtkSMPTools.Initialize(threads)
        quality.Modified()
        quality.Update()

    return len(cells), {**ours, "kernel": kernel, "gather (the limit)": gathered, "VTK": vtk}


def alternating(least: int, order: str) -> Mesh:
    """A mesh of four types, each cell of another type than the one before; or the same in another order."""
    points, cubes = hexahedra(max(round((least / len(KINDS)) ** (1 / 3)), 1))
    types = np.tile(np.array(list(KINDS), np.uint8), len(cubes))
    sizes = np.tile([len(corners) for corners in KINDS.values()], len(cubes))
    nodes = np.concatenate([cubes[:, list(corners)] for corners in KINDS.values()], axis=1).reshape(-1)
    starts = np.cumsum(sizes) - sizes
    cells = {
        "alternating": np.arange(len(types)),
        "sorted": np.argsort(types, kind="stable"),
        "random": np.random.default_rng(0).permutation(len(types)),
    }[order]
    offsets = np.concatenate([[0], np.cumsum(sizes[cells])])
    at = np.repeat(starts[cells] - offsets[:-1], sizes[cells]) + np.arange(offsets[-1])
    return Mesh(points, types[cells], offsets, nodes[at])


def orders(least: int, threads: int, *, bare: bool) -> tuple[int, Contenders]:
    """Measuring meshes of several types."""
    meshes = {order: alternating(least, order) for order in ("alternating", "random", "sorted")}
    if bare:
        del meshes["random"], meshes["sorted"]
    return meshes["alternating"].n_cells, {
        order: lambda mesh=mesh: meshgauge.measure(mesh, threads=threads)  # type: ignore[misc]
        for order, mesh in meshes.items()
    }


def doctor(least: int, threads: int, *, bare: bool) -> tuple[int, Contenders]:
    """The diagnosis of hexahedra that are measured."""
    from meshgauge.doctor import diagnosis

    points, cells = hexahedra(round(least ** (1 / 3)))
    mesh = Mesh.from_arrays(points, [("hexahedron", cells)])
    quality = meshgauge.measure(mesh, threads=threads)
    ours: Contenders = {"diagnosis": lambda: diagnosis(mesh, quality)}
    return len(cells), ours if bare else {**ours, "bytes (the limit)": lambda: points.sum() + cells.sum()}


CASES: dict[str, Callable[..., tuple[int, Contenders]]] = {
    **{
        name: lambda least, threads, *, bare, name=name: arrays(name, least, threads, bare=bare)
        for name in MAKE
        if name in ("tetra", "pyramid")
    },
    "order": orders,
    "doctor": doctor,
}


def seconds(contenders: Contenders, rounds: int) -> dict[str, float]:
    """Least processor seconds of each; a first round, that compiles, does not count."""
    best = dict.fromkeys(contenders, np.inf)
    for turn in range(rounds + 1):
        for name, work in contenders.items():
            start = time.process_time()
            work()
            taken = time.process_time() - start
            best[name] = min(best[name], taken) if turn else best[name]
    return best


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, default=4_000_000)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--bare", choices=list(CASES))
    parser.add_argument("cases", nargs="*", choices=[*CASES, []])
    asked = parser.parse_args()
    if asked.bare:
        _, ours = CASES[asked.bare](asked.cells, asked.threads, bare=True)
        print(*seconds(ours, asked.rounds).values())
        return
    from versions import versions

    print(versions("vtk"))
    print("| case | cells | | processor s | million cells a second | times the first |\n|---|---|---|---|---|---|")
    for name in asked.cases or CASES:
        n, contenders = CASES[name](asked.cells, asked.threads, bare=False)
        taken = seconds(contenders, asked.rounds)
        first = next(iter(taken.values()))
        for who, one in taken.items():
            print(f"| {name} | {n:,} | {who} | {one:.3f} | {n / one / 1e6:.1f} | {one / first:.2f} |", flush=True)


if __name__ == "__main__":
    main()
