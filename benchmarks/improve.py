"""Improvement: worst and mean quality before and after, fixed and sliding, and what it costs.

    python benchmarks/improve.py [MESH ...] [--cells 30000] [--threads N]
    python benchmarks/improve.py --plane
    python benchmarks/improve.py --operations MESH ...

Without files: tangled grids of each cell type, made here. Four ways of each mesh: the boundary fixed, with `floor` 0.9
and 1, with `topology`, and sliding. Each figure is worst / mean J_ENS, cells that are still invalid, and seconds of the
processor, all threads together; kernels are compiled before. The ceiling is the most that the worst cell can have with
the boundary fixed. The last column is the peak of the process until then.

With `--plane` a tangled square of quads and of triangles, its boundary fixed, and quads of a plate with a notch, beside
Gmsh's ways of `optimize` for surfaces and PyVista's `smooth`: what each makes of them, in J_ENS. Mesquite has no
package that can be installed.

With `--operations` what each operation of `topology` brings: worst / mean and seconds without it, `floor` 1.
"""

from __future__ import annotations

import argparse
import os
import resource
from collections.abc import Iterator
from contextlib import contextmanager
from types import FunctionType

import numba
import numpy as np
from grids import MAKE, cells_of
from versions import versions

import meshgauge
from meshgauge.kernels.repair import reconnection

WAYS = (
    {"floor": 0.9},
    {"floor": 1.0},
    {"floor": 1.0, "topology": True},
    {"floor": 1.0, "boundary": "slide"},
)


OPERATIONS = {
    "edge_removal": "removing edges (3-2, 4-4 flips)",
    "face_removal": "removing faces (2-3 flips)",
    "insertion": "putting points in",
    "collapse": "taking points out",
}
"""Functions of the kernels' module, and what they do."""


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


def square(n: int, kind: str, noise: float) -> meshgauge.Mesh:
    """``n`` by ``n`` quads, or twice as many triangles, inner points moved by up to a share of an edge."""
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0), indexing="ij")
    inside = (x > 0) & (x < n) & (y > 0) & (y < n)
    x, y = (one + inside * np.random.default_rng(m).uniform(-noise, noise, x.shape) for m, one in enumerate((x, y)))
    at = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    quads = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=-1).reshape(-1, 4)
    cells = quads if kind == "quad" else np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]])
    return meshgauge.Mesh.from_arrays(np.stack([x.ravel(), y.ravel()], axis=1), {kind: cells})


def by_gmsh(mesh: meshgauge.Mesh, method: str) -> np.ndarray:
    """The points of a square as Gmsh leaves them, which is given the square's corners and sides, too."""
    import gmsh

    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    x, ids = np.asarray(mesh.points, np.float64), np.arange(1, mesh.n_points + 1)
    (left, low, _), (right, high, _) = x.min(axis=0), x.max(axis=0)
    corners = [(left, low), (right, low), (right, high), (left, high)]
    geo, model = gmsh.model.geo, gmsh.model.mesh
    points = [geo.addPoint(*corner, 0.0) for corner in corners]
    lines = [geo.addLine(points[m], points[(m + 1) % 4]) for m in range(4)]
    face = geo.addPlaneSurface([geo.addCurveLoop(lines)])
    geo.synchronize()
    is_inside = np.ones(mesh.n_points, bool)
    for tag, corner in zip(points, corners, strict=True):
        at = np.flatnonzero((x[:, :2] == corner).all(axis=1))
        model.addNodes(0, tag, ids[at], x[at].ravel())
        model.addElementsByType(tag, 15, [], ids[at])
        is_inside[at] = False
    for m, tag in enumerate(lines):
        axis, fixed = m % 2, corners[m][1 - m % 2]
        at = np.flatnonzero(x[:, 1 - axis] == fixed)
        at = at[np.argsort(x[at, axis] if m < 2 else -x[at, axis])]
        way = np.abs(x[at, axis] - x[at[0], axis])
        model.addNodes(1, tag, ids[at[1:-1]], x[at[1:-1]].ravel(), way[1:-1] / way[-1])
        model.addElementsByType(tag, 1, [], np.stack([ids[at[:-1]], ids[at[1:]]], axis=1).ravel())
        is_inside[at] = False
    at = np.flatnonzero(is_inside)
    model.addNodes(2, face, ids[at], x[at].ravel(), x[at, :2].ravel())
    kind = 3 if "quad" in mesh.type_counts() else 2
    model.addElementsByType(face, kind, [], ids[mesh.connectivity])
    model.optimize(method, False, 5)
    tags, places, _ = model.getNodes()
    at = np.zeros(int(max(tags)) + 1, np.int64)
    at[np.asarray(tags, np.int64)] = np.arange(len(tags))
    nodes = at[np.asarray(model.getElementsByType(kind)[1], np.int64)]  # it numbers them anew
    out = x.copy()
    out[mesh.connectivity] = np.asarray(places).reshape(-1, 3)[nodes]
    gmsh.finalize()
    return out


def by_pyvista(mesh: meshgauge.Mesh) -> np.ndarray:
    """Laplacian smoothing with the boundary fixed, as many rounds as help."""
    import pyvista

    n = len(mesh.connectivity) // mesh.n_cells
    data = pyvista.PolyData.from_regular_faces(np.asarray(mesh.points), mesh.connectivity.reshape(-1, n))
    return np.asarray(data.smooth(n_iter=100, relaxation_factor=0.2, boundary_smoothing=False).points, np.float64)


def in_a_plane(threads: int | None) -> None:
    ways = {
        "meshgauge, everywhere": lambda mesh: meshgauge.improve(mesh, threads=threads, everywhere=True).mesh.points,
        "meshgauge, near bad cells": lambda mesh: meshgauge.improve(mesh, threads=threads).mesh.points,
        "Gmsh, UntangleMeshGeometry": lambda mesh: by_gmsh(mesh, "UntangleMeshGeometry"),
        "Gmsh, Laplace2D": lambda mesh: by_gmsh(mesh, "Laplace2D"),
        "Gmsh, Relocate2D": lambda mesh: by_gmsh(mesh, "Relocate2D"),
        "PyVista, smooth": by_pyvista,
    }
    notched = square(40, "quad", 0.3)
    x, y, z = np.asarray(notched.points, np.float64).T
    notched = notched.replace(points=np.stack([x, y * (1.0 - 0.8 * np.exp(-(((x - 20.0) / 6.0) ** 2))), z], axis=1))
    meshes = [square(40, "quad", 0.45), square(40, "triangle", 0.45), notched]
    print("| 40 x 40 cells | quads, 0.45 | triangles, 0.45 | quads with a notch, 0.3 |\n|---|---|---|---|")
    for name, way in {"as given": lambda mesh: mesh.points, **ways}.items():
        way(square(4, "quad", 0.1))  # kernels are compiled
        cells = [name]
        for mesh in meshes:
            if name.startswith("Gmsh") and mesh is notched:  # its geometry would have to be given, too
                cells.append("")
                continue
            start = seconds()
            points = way(mesh)
            spent = seconds() - start
            values = meshgauge.measure(mesh.replace(points=points)).values
            cells.append(f"{values.min():.3f} / {values.mean():.3f}, {int((values <= 0.0).sum()):,} ({spent:.1f} s)")
        print(f"| {' | '.join(cells)} |", flush=True)


@contextmanager
def without(*operations: str) -> Iterator[None]:
    """Operations of `topology` that are never done: their kernel is compiled anew, for this alone."""

    def compiled(function: FunctionType) -> FunctionType:
        return numba.njit(error_model="numpy", nogil=True)(function)  # not into the cache of those that do all

    space = {**vars(reconnection), **{name: compiled(lambda *_: False) for name in operations}}
    for helper in ("_operate", "_try", "_raise"):
        space[helper] = compiled(FunctionType(getattr(reconnection, helper).py_func.__code__, space))
    whole, reconnection._raise = reconnection._raise, space["_raise"]
    try:
        yield
    finally:
        reconnection._raise = whole


def by_operation(meshes: dict[str, meshgauge.Mesh], threads: int | None) -> None:
    print("| left out |" + "".join(f" {name} |" for name in meshes) + "\n|---|" + "---|" * len(meshes))
    ways = {"nothing": (), **{text: (name,) for name, text in OPERATIONS.items()}, "all of these": tuple(OPERATIONS)}
    small = next(mesh for name, mesh in made(200) if name.startswith("tetra"))
    for text, names in ways.items():
        with without(*names):
            meshgauge.improve(small, everywhere=True, topology=True)  # kernels are compiled
            cells = [text]
            for mesh in meshes.values():
                start = seconds()
                result = meshgauge.improve(mesh, threads=threads, everywhere=True, floor=1.0, topology=True)
                values = result.after.values
                cells.append(f"{values.min():.3f} / {values.mean():.3f} ({seconds() - start:.1f} s)")
            print(f"| {' | '.join(cells)} |", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("meshes", nargs="*", metavar="MESH")
    parser.add_argument("--cells", type=int, default=30_000, help="of each grid made here")
    parser.add_argument("--threads", type=int)
    parser.add_argument("--plane", action="store_true", help="surface cells in a plane, beside other programs")
    parser.add_argument("--operations", action="store_true", help="of topology, each left out once")
    options = parser.parse_args()
    if options.plane:
        print(versions())
        in_a_plane(options.threads)
        return
    if options.operations:
        print(versions())
        by_operation({os.path.basename(path): meshgauge.read(path) for path in options.meshes}, options.threads)
        return
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
