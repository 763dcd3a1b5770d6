"""What the number means to a solver: the study behind docs/meaning.md.

    python benchmarks/meaning.py [--quick] [--check] [--pictures docs/pictures]

Single cells and whole meshes are measured, and solved with first-order elements (`first_order`); tables are printed,
and pictures written with ``--pictures``. ``--check`` first compares the elements with scikit-fem and NGSolve, if they
are installed. Needs SciPy, and Matplotlib for pictures. Some minutes; ``--quick``: half a minute.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from first_order import LOSSES, NODES_OF_CUBE, Ids, Values, cell_losses, ideal, mesh_losses
from grids import MAKE
from scipy.stats import spearmanr
from versions import versions

import meshgauge

TYPES = tuple(NODES_OF_CUBE)
CANDIDATES = ("jens", "jens_mean", "shape", "edge_ratio", "verdict_scaled_jacobian", "verdict_shape")
CELL_LOSSES = ("condition", "elastic condition", "error", "steps", "elastic steps")
POOR = 0.2
BANDS = np.linspace(0.0, 1.0, 21)

# The most even mesh of a type as a grid of cubes, cut as in `grids`, under this linear map: regular hexahedra and
# wedges, the tetrahedra of the body-centred cubic lattice, six pyramids a cube.
EVEN = {
    "tetra": np.array([(-1.0, 1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 1.0, -1.0)]).T,
    "pyramid": np.eye(3),
    "wedge": np.array([(1.0, 0.0, 0.0), (-0.5, 0.75**0.5, 0.0), (0.0, 0.0, 1.0)]).T,
    "hexahedron": np.eye(3),
}


def measured(name: str, points: Values, cells: Ids, metrics: Iterable[str] = ()) -> meshgauge.Quality:
    return meshgauge.measure(meshgauge.Mesh.from_arrays(points, {name: cells}), metrics=list(metrics))


# --- single cells


def noise(x: Values, n: int, rng: np.random.Generator) -> Values:
    """Every coordinate moves by up to a share of the edge, 0 to 0.7."""
    return x + rng.uniform(0.0, 0.7, (n, 1, 1)) * rng.uniform(-1.0, 1.0, (n, *x.shape))


def stretched(x: Values, n: int, rng: np.random.Generator) -> Values:
    """1:1 to 1:16 or 16:1 along any direction."""
    along = directions(n, rng)
    factor = 16.0 ** rng.uniform(-1.0, 1.0, n)
    return x + (factor - 1.0)[:, None, None] * (x @ along[:, :, None]) * along[:, None]


def sheared(x: Values, n: int, rng: np.random.Generator) -> Values:
    """Planes of any direction slide over each other, by up to 16 times their distance."""
    normal, other = directions(n, rng), directions(n, rng)
    along = np.cross(normal, other)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    return x + (16.0 ** rng.uniform(-1.0, 1.0, n))[:, None, None] * (x @ normal[:, :, None]) * along[:, None]


def directions(n: int, rng: np.random.Generator) -> Values:
    out = rng.normal(size=(n, 3))
    return out / np.linalg.norm(out, axis=1, keepdims=True)


DEFORMED: dict[str, Callable[[Values, int, np.random.Generator], Values]] = {
    "noise": noise,
    "stretching": stretched,
    "shear": sheared,
}


@dataclass(frozen=True)
class Sample:
    """Valid cells of one type: candidates and losses, each ``(n,)``."""

    candidates: dict[str, Values]
    losses: dict[str, Values]


def sample(name: str, how: str, n: int) -> Sample:
    """At least ``n`` valid cells of a type, deformed at random."""
    rng = np.random.default_rng([TYPES.index(name), list(DEFORMED).index(how)])
    kept: list[Values] = []
    while sum(map(len, kept)) < n:
        x = DEFORMED[how](ideal(name), n, rng)
        points, cells = x.reshape(-1, 3), np.arange(x.shape[0] * x.shape[1]).reshape(x.shape[:2])
        kept.append(x[measured(name, points, cells).status == meshgauge.Status.OK])
    x = np.concatenate(kept)[:n]
    points, cells = x.reshape(-1, 3), np.arange(n * x.shape[1]).reshape(n, -1)
    quality = measured(name, points, cells, CANDIDATES)
    parts = [cell_losses(name, part) for part in np.array_split(x, max(1, n // 500))]
    losses = {loss: np.concatenate([part[loss] for part in parts]) for loss in CELL_LOSSES}
    return Sample({one: quality.values_of(one) for one in CANDIDATES}, losses)


Samples = dict[tuple[str, str], Sample]


def in_band(values: Values, of: Values, low: float, high: float) -> float:
    """Median of values where ``of`` is in the band; NaN of fewer than twenty."""
    inside = values[(of >= low) & (of < high)]
    return float(np.median(inside)) if len(inside) >= 20 else np.nan


def print_bands(samples: Samples, low: float = 0.2, high: float = 0.25) -> None:
    print(f"\nwhat a cell of J_ENS {low:.2f} to {high:.2f} costs, the ideal cell of its type and volume = 1 (medians)")
    print(f"{'':10} {'':18}" + "".join(f"{name:>12}" for name in TYPES) + f"{'spread':>10}")
    for how in DEFORMED:
        for loss in CELL_LOSSES:
            of = [samples[name, how] for name in TYPES]
            row = [in_band(one.losses[loss], one.candidates["jens"], low, high) for one in of]
            print(f"{how:10} {loss:18}" + "".join(f"{v:12.2f}" for v in row) + f"{max(row) / min(row):10.2f}")


def spreads(samples: Samples, candidate: str, how: str, loss: str) -> Values:
    """Of each band of a candidate, 0.1 to 0.8, the dearest type over the cheapest."""
    of = [samples[name, how] for name in TYPES]
    bands = pairwise(BANDS[2:17])
    rows = [[in_band(one.losses[loss], one.candidates[candidate], *band) for one in of] for band in bands]
    return np.array([max(row) / min(row) for row in rows if not np.isnan(row).any()])


def print_spreads(samples: Samples) -> None:
    print("\none scale for four types? dearest type over cheapest at the same value of a candidate: median and worst")
    print(f"{'':24}" + "".join(f"{how:>20}" for how in DEFORMED))
    for candidate in CANDIDATES:
        row = []
        for how in DEFORMED:
            found = np.concatenate([spreads(samples, candidate, how, loss) for loss in CELL_LOSSES])
            row.append(f"{np.median(found):.1f}, {found.max():.1f}" if len(found) else "-")
        print(f"{candidate:24}" + "".join(f"{one:>20}" for one in row))


def ranks(samples: Samples) -> dict[tuple[str, str, str], float]:
    """Spearman's correlation of a candidate with a loss, the types pooled; -1: the worst cells cost most."""
    out = {}
    for how in DEFORMED:
        for loss in CELL_LOSSES:
            costs = np.concatenate([samples[name, how].losses[loss] for name in TYPES])
            for candidate in CANDIDATES:
                values = np.concatenate([samples[name, how].candidates[candidate] for name in TYPES])
                out[candidate, how, loss] = float(spearmanr(values, costs).statistic)
    return out


def print_ranks(found: dict[tuple[str, str, str], float]) -> None:
    print("\nrank correlation with the loss, types pooled (-1: ranks cells as the solver does)")
    print(f"{'':10} {'':18}" + "".join(f"{one.removeprefix('verdict_')[:12]:>14}" for one in CANDIDATES))
    for how in DEFORMED:
        for loss in CELL_LOSSES:
            print(f"{how:10} {loss:18}" + "".join(f"{found[one, how, loss]:14.2f}" for one in CANDIDATES))
    means = [np.mean([v for (one, *_), v in found.items() if one == candidate]) for candidate in CANDIDATES]
    print(f"{'mean':10} {'':18}" + "".join(f"{v:14.2f}" for v in means))


# --- meshes


@dataclass(frozen=True)
class Solved:
    """A mesh of one type: how good it is, and what it costs relative to the even mesh of the type."""

    name: str
    kind: str
    least: float
    n_poor: int
    n_cells: int
    mean: float
    mean_of_nodes: float
    losses: dict[str, float]

    @property
    def share(self) -> float:
        return self.n_poor / self.n_cells


class Even:
    """The even mesh of a type, and what is made of it."""

    def __init__(self, name: str, n: int) -> None:
        self.name = name
        self.grid, self.cells = MAKE[name][0](n, 0.0)
        self.fixed = ((self.grid == 0.0) | (self.grid == n)).any(axis=1)
        self.points = self.grid @ EVEN[name].T
        self.middle = int(np.argmin(((self.points - self.points.mean(axis=0)) ** 2).sum(axis=1) + 1e9 * self.fixed))
        self.base = mesh_losses(name, self.points, self.cells, self.fixed)

    def jens(self, points: Values, cells: Ids | None = None) -> Values:
        return measured(self.name, points, self.cells if cells is None else cells).values

    def solved(self, points: Values, kind: str) -> Solved:
        quality = measured(self.name, points, self.cells, ["jens_mean"])
        assert (quality.status == meshgauge.Status.OK).all()
        values = quality.values
        found = mesh_losses(self.name, points, self.cells, self.fixed)
        return Solved(
            self.name,
            kind,
            float(values.min()),
            int((values < POOR).sum()),
            len(values),
            float(values.mean()),
            float(quality.values_of("jens_mean").mean()),
            {loss: found[loss] / self.base[loss] for loss in LOSSES},
        )

    def one_bad(self, least: float) -> Values:
        """One point moved, towards that point or middle of a cell around it that spoils the fewest others, until the
        least value is as given."""
        around = self.cells[(self.cells == self.middle).any(axis=1)]
        goals = [self.points[np.setdiff1d(cell, [self.middle])].mean(axis=0) for cell in around]
        goals += [self.points[i] for i in np.setdiff1d(around, [self.middle])]
        found = []
        for goal in goals:
            step = np.zeros_like(self.points)
            step[self.middle] = goal - self.points[self.middle]
            moved = self._until(step, least, around)
            if moved is not None:
                found.append((int((self.jens(moved, around) < POOR).sum()), len(found), moved))
        return min(found, key=lambda one: one[:2])[2]

    def all_bad(self, least: float, rng: np.random.Generator) -> Values:
        """Every second layer of points slides, in a random direction, until the least value is as given: all cells are
        sheared, one way and the other in turn, and the domain stays."""
        angle = rng.uniform(0.0, 2.0 * np.pi)
        along = EVEN[self.name] @ (np.cos(angle), np.sin(angle), 0.0)
        moved = self._until(100.0 * np.outer(1.0 - np.abs(self.grid[:, 2] % 2.0 - 1.0), along), least)
        assert moved is not None
        return moved

    def _until(self, step: Values, least: float, cells: Ids | None = None) -> Values | None:
        """The points moved by that share of a step at which the least value is as given; None if it jumps there."""
        low, high = 0.0, 1.0
        for _ in range(40):
            t = 0.5 * (low + high)
            low, high = (t, high) if self.jens(self.points + t * step, cells).min() > least else (low, t)
        moved = self.points + low * step
        return moved if self.jens(moved, cells).min() < 1.01 * least else None

    def noisy(self, amplitude: float, share: float, rng: np.random.Generator) -> Values:
        """A share of the points inside, one at least, moves at random; those of cells that are invalid then, less."""
        inside = rng.permutation(np.flatnonzero(~self.fixed))
        inside = inside[: max(1, round(share * len(inside)))]
        by = np.zeros_like(self.points)
        edge = np.cbrt(abs(np.linalg.det(EVEN[self.name])))
        by[inside] = amplitude * edge * rng.uniform(-1.0, 1.0, (len(inside), 3))
        while True:
            status = measured(self.name, self.points + by, self.cells).status
            bad = self.cells[status != meshgauge.Status.OK]
            if not len(bad):
                return self.points + by
            by[np.unique(bad)] *= 0.8


LEAST = (0.15, 0.03)


def meshes(quick: bool) -> list[Solved]:
    out = []
    for name in TYPES:
        even = Even(name, 5 if quick else {"hexahedron": 11, "wedge": 9}.get(name, 7))
        out.append(even.solved(even.points, "even"))
        for least in LEAST:
            out.append(even.solved(even.one_bad(least), f"one at {least}"))
            seeds = range(1 if quick else 4)
            spoilt = (even.all_bad(least, np.random.default_rng(seed)) for seed in seeds)
            out += [even.solved(points, f"all at {least}") for points in spoilt]
        for seed in range(1 if quick else 2):
            rng = np.random.default_rng(seed)
            for share in (0.01, 0.1, 1.0) if quick else (0.003, 0.01, 0.03, 0.1, 0.3, 1.0):
                amplitudes = (0.5,) if quick else (0.2, 0.35, 0.5)
                out += [even.solved(even.noisy(a, share, rng), "noise") for a in amplitudes]
    return out


MEASURES: dict[str, Callable[[Solved], float]] = {
    "least value": lambda one: -one.least,
    "share below 0.2": lambda one: one.share,
    "mean of cells": lambda one: -one.mean,
    "mean of nodes": lambda one: -one.mean_of_nodes,
}


def print_meshes(found: list[Solved]) -> None:
    print("\nmeshes, the even mesh of the type = 1 (medians)")
    head = "".join(f"{loss.replace('elastic', 'el.').replace('condition', 'cond.'):>12}" for loss in LOSSES)
    print(f"{'':12}{'':14}{'cells':>7}{'poor':>6}{'least':>7}{head}")
    for name in TYPES:
        for kind in ("even", *(f"{which} at {least}" for which in ("one", "all") for least in LEAST)):
            of = [one for one in found if one.name == name and one.kind == kind]
            costs = "".join(f"{np.median([one.losses[loss] for one in of]):12.3f}" for loss in LOSSES)
            print(f"{name:12}{kind:14}{of[0].n_cells:7}{of[0].n_poor:6}{of[0].least:7.3f}{costs}")
    print("\nwhat tells which mesh costs more: rank correlation over all meshes, and the least within a type")
    print(f"{'':18}" + "".join(f"{loss:>20}" for loss in LOSSES))
    for title, measure in MEASURES.items():
        row = []
        for loss in LOSSES:
            each = [_rank([one for one in found if one.name == name], measure, loss) for name in TYPES]
            row.append(f"{_rank(found, measure, loss):.2f}, {min(each):.2f}")
        print(f"{title:18}" + "".join(f"{one:>20}" for one in row))


def _rank(meshes: list[Solved], measure: Callable[[Solved], float], loss: str) -> float:
    return float(spearmanr([measure(one) for one in meshes], [one.losses[loss] for one in meshes]).statistic)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--pictures", type=Path)
    asked = parser.parse_args()
    print(versions("scipy"))
    if asked.check:
        from first_order_check import differences

        for library, name, difference in differences():
            print(f"{library:10}{name:12}{difference:.1e}")
    start = time.perf_counter()
    samples = {(name, how): sample(name, how, 1500 if asked.quick else 4000) for name in TYPES for how in DEFORMED}
    print_bands(samples)
    print_spreads(samples)
    correlations = ranks(samples)
    print_ranks(correlations)
    solved = meshes(asked.quick)
    print_meshes(solved)
    print(f"\n{time.perf_counter() - start:.0f} s")
    if asked.pictures:
        import meaning_pictures

        meaning_pictures.write(asked.pictures, samples, correlations, solved)


if __name__ == "__main__":
    main()
