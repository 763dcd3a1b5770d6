"""Releasing the boundary: where a bad cell lies on it, points leave their surface, held by springs, and are drawn back.

With four points of a corner on the surface, no sliding makes it positive. So points near bad cells may leave their
patches, curves and corners; springs pull them back. Once all is positive, the springs are stiffened above a barrier
until no point is further off than the tolerance, and the worst is raised with what is left of it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...doctor.points import extent
from ...look.style import number_of
from ...quality.measure import Quality
from ..acceptance import accept, is_below, is_better
from ..claims import Promise
from ..components import components
from ..constraints import Mask
from ..curved import move_nodes_between
from ..descent import DescentResult, Energy, Freedom
from ..deviation import Deviation, deviation, mean_from_old
from ..energies import QualityEnergy, ShapeEnergy
from ..faces import mask_of
from ..hanging import NONE
from ..problem import Ids, Part, Points, Problem
from ..run import Run
from ..surface import EDGE, FACE, INSIDE, Surface
from ..volumes import KEPT, VolumeKeeper
from .mean import raise_mean
from .untangle import reference_lengths_of_cells
from .worst import raise_worst

RINGS = (3, 6, 12)
"""Cells around bad ones whose points are released with theirs, at first and then."""

ROUNDS, ITERATIONS, FIRST = 60, 20, 1e-2
"""Values of ε while untangling, iterations for each, and the first: points are to go no further than they must."""

PULL, PATIENCE, SOFTER, SOFTEST = 3.0, 6, 0.6, 0.01
"""Weight of the springs while untangling; after so many rounds it falls by a factor each, down to the last."""

LEVELS, DRAWS, STIFFER = (0.2, 0.1, 0.02), 8, 3.0
"""What corners keep while points are drawn back, until they are near enough; how often springs are stiffened for each,
and by which factor."""

BARRIER, KEEP = 1e-3, 0.8
"""Weight of the barrier meanwhile, and the share of its value that no corner may lose at a time."""

SLACK, LESS, TRIES = 0.6, 0.7, 4
"""Share of the tolerance within which no spring pulls, since faces go further off than points do; by how much less of
it is tried where faces went too far, and how often."""

CLOSE = 0.8
"""Share of the tolerance, or of what the furthest face is off, from which on points of faces slide no more."""

STIFF, SOFT = 1e3, 1.0
"""Weights of the springs while the worst is raised: of points beyond the slack, and of all."""

STRETCHED, HARDER, HARDEST = 1.1, 4.0, 1e8
"""Share of the slack that makes springs stiffer, by which factor and up to what: a threshold that comes near pushes
ever harder."""

SMALL = 1e-3
"""Share of its size that a spring is measured in at least, however little it may be stretched."""

END = 2e-3
"""Distance of the threshold below the least corner, at last, while the worst is raised: what is nearer costs much."""

MEAN, PART = 8e-4, 0.25
"""Share of the diagonal, and of the tolerance, that the surfaces are to be apart in the mean at most, if they can."""

SETTLES, FIRMER = 4, 3.0
"""How often all is raised anew to that end, with soft springs firmer by the factor."""

GIVE, STRIDES, OFF = 0.95, (1.0, 0.5, 0.25), 0.5
"""What floors of cells give way to keep volumes, shares of the way that are tried, and the share of what a volume may
change by at which cells need not give more."""

ROUNDING = 1e-6
"""Share of the tolerance that a point has not moved by."""

ATTEMPTS = 4
"""How often points of faces that are too far off go back to where they were."""


@dataclass(frozen=True, eq=False)
class ReleaseResult:
    """The mesh as it stands, its points that were released, the largest and mean deviation from the surface, notes."""

    quality: Quality
    released: Mask
    deviation: tuple[float, float]
    notes: tuple[str, ...]


def release(
    promise: Promise,
    reached: Quality,
    run: Run,
    surface: Surface,
    limit: float,
    *,
    target: float,
    is_wide: bool,
    threads: int | None,
) -> ReleaseResult:
    """Mend cells with points of the boundary off their surface by no more than a limit.

    Parameters
    ----------
    promise
        What must hold.
    reached
        Of the mesh as it stands.
    run
        As it was improved so far.
    surface
        The boundary of the mesh as it was given.
    limit
        The largest distance between the surfaces before and after.
    target
        Cells that are invalid or below it are mended.
    is_wide
        True if points far around are released first: where all of that can be brought back, more is reached.
    threads
        As for `improve`.
    """
    start, off, released = reached, (0.0, 0.0), np.zeros(len(surface.kind), bool)
    tried: list[Mask] = []
    for rings in (RINGS[-1], *RINGS) if is_wide else RINGS:
        bad = is_below(reached, target)[run.whole.cell_ids]
        near = run.whole.grow(bad, rings)
        if not bad.any() or run.is_over():
            break
        if any(np.array_equal(near, one) for one in tried):
            continue
        groups = _groups(run.whole, near) if tried or not is_wide else []
        tried.append(near)
        # All at once share what each gives; if one of them fails, the others stand alone.
        for group in (near, *groups) if len(groups) != 1 else groups:
            if run.is_over():
                break
            if not (group & is_below(reached, target)[run.whole.cell_ids]).any():
                continue
            work = _Release(run, promise, reached, surface, limit, group)
            points = work.points()
            run.evaluations, run.stopped = work.run.evaluations, work.run.stopped
            after, apart = _within(promise, reached, points, surface, limit, threads)
            if apart.largest <= limit and is_better(after, reached, target) and not promise.broken(after):
                way = np.asarray(after.mesh.points, np.float64) - np.asarray(reached.mesh.points, np.float64)
                released |= work.released & (np.linalg.norm(way, axis=1) > ROUNDING * limit)
                reached, off = after, (apart.largest, apart.mean)
    if reached is start:
        return ReleaseResult(start, np.zeros_like(released), off, ("Points off the boundary are not better.",))
    n = int(np.count_nonzero(released))
    count = number_of(n, "point of the boundary was released", "points of the boundary were released")
    return ReleaseResult(reached, released, off, (f"{count} to mend cells beside.",))


def _groups(whole: Problem, cells: Mask) -> list[Mask]:
    """Some cells in groups that share no point, each ``(n_cells,)``: what becomes of one is nothing to another."""
    owner = np.repeat(np.arange(whole.n_cells), np.diff(whole.cells))
    mine = cells[owner]
    nodes = whole.corners[mine].astype(np.int64)
    label = components(
        whole.n_cells + whole.n_points, np.repeat(owner[mine], nodes.shape[1]), whole.n_cells + nodes.reshape(-1)
    )[: whole.n_cells]
    return [cells & (label == one) for one in np.unique(label[cells])]


def _within(
    promise: Promise, reached: Quality, points: Points, surface: Surface, limit: float, threads: int | None
) -> tuple[Quality, Deviation]:
    """The mesh with new points as far as they are acceptable and their faces no further off than the limit."""
    here = np.asarray(reached.mesh.points, np.float64)
    for _ in range(ATTEMPTS):
        after, _ = accept(promise.before, points, strict=promise.strict, threads=threads, back=reached)
        points = np.asarray(after.mesh.points, np.float64).copy()
        apart = deviation(surface, points, is_given=promise.is_given)
        if apart.largest <= limit:
            break
        back = _points_of_faces(surface, apart, limit)
        points[back] = here[back]
    return after, apart


def _points_of_faces(surface: Surface, apart: Deviation, limit: float) -> Ids:
    """Points of the faces that are about as far off as the limit, or as the furthest."""
    off = np.maximum(apart.of_faces, apart.of_old_faces)
    far = off > CLOSE * min(limit, float(off.max()))
    return surface.faces[np.repeat(far, np.diff(surface.face_offsets))]


@dataclass(eq=False)
class Springs:
    """Springs from points of a problem to the nearest places on their surface; a `PointConstraint`.

    Attributes
    ----------
    problem
        Of the cells near bad ones.
    surface
        The boundary as it was given.
    points
        ``(n,)`` points of the problem that were released.
    sizes, origin
        ``(n,)`` and ``(n, 3)`` mean length of the edges at each, and where it was.
    base
        Points of the mesh as it stands.
    keeper
        Keeps volumes; None: nothing to keep.
    slack, weight, soft
        Springs pull with the weight beyond the slack, in units of it, and softly everywhere, in units of the size.
    """

    problem: Problem
    surface: Surface
    points: Ids
    sizes: Points
    origin: Points
    base: Points
    keeper: VolumeKeeper | None
    slack: float = 0.0
    weight: float = 0.0
    soft: float = PULL
    is_curved: bool = True

    def __post_init__(self) -> None:
        ids = self.problem.point_ids[self.points]
        kind = self.surface.kind[ids]
        self._sliding = np.flatnonzero(((kind == EDGE) | (kind == FACE)) & (self.surface.item[ids] >= 0))
        self._items = self.surface.item[ids[self._sliding]].copy()
        self._places = self.origin.copy()
        owner = np.full(len(self.points), -1)
        for n, part in enumerate(self.problem.parts):
            owner[(owner < 0) & (self.points >= part.low) & (self.points < part.high)] = n
        self._of = {part: np.flatnonzero(owner == n) for n, part in enumerate(self.problem.parts)}

    def anchor(self, points: Mask) -> None:
        """Pull some points of the mesh to where they were, not to the nearest place."""
        stay = points[self.problem.point_ids[self.points[self._sliding]]]
        self._places[self._sliding[stay]] = self.origin[self._sliding[stay]]
        self._sliding, self._items = self._sliding[~stay], self._items[~stay]

    def draw(self, points: Points) -> float:
        """Let springs pull to the places that are nearest to the points; the largest distance of a point from its."""
        here = points[self.points]
        if len(self._sliding):
            queries = np.ascontiguousarray(here[self._sliding])
            self._places[self._sliding], _ = self.surface.projection.nearest(queries, self._items)
        return float(np.linalg.norm(here - self._places, axis=1).max(initial=0.0))

    def __call__(self, before: Points, after: Points, floors: Points) -> Points:
        """The points after some steps, with the volumes kept."""
        after = self.keep_volumes(after, np.where(floors > 0.0, GIVE * floors, floors))
        if self.draw(after) > STRETCHED * self.slack:
            self.weight = min(HARDER * self.weight, HARDEST)
        return after

    def keep_volumes(self, points: Points, floors: Points) -> Points:
        """Points with the volumes of regions as they were, as far as cells stay above their floors."""
        if self.keeper is None:
            return points
        way = self.keeper(self._of_mesh(points))[self.problem.point_ids] - points
        for stride in STRIDES:
            trial: Points = points + stride * way
            if (self.problem.qualities(trial)[0] > floors).all():
                return trial
        return points

    def keeps_volumes(self, points: Points) -> bool:
        """True if no region's volume is off by more than it may."""
        return self.keeper is None or self.keeper.keeps(self._of_mesh(points))

    def _of_mesh(self, points: Points) -> Points:
        out = self.base.copy()
        out[self.problem.point_ids] = points
        return out

    def added_to(self, energy: Energy) -> Energy:
        """The energy with that of the springs."""

        def both(points: Points, part: Part, gradient: Points) -> tuple[float, float]:
            value, least = energy(points, part, gradient)
            mine = self._of[part]
            ids = self.points[mine]
            way = points[ids] - self._places[mine]
            far = np.sqrt(np.einsum("ij,ij->i", way, way))
            soft = self.soft / (self.sizes[mine] * self.sizes[mine])
            unit = np.maximum(self.slack, SMALL * self.sizes[mine])
            stiff = self.weight / (unit * unit)
            over = np.maximum(far - self.slack, 0.0)
            pull = 2.0 * (soft + stiff * over / np.where(far > 0.0, far, 1.0))
            gradient[ids - part.low] += pull[:, None] * way
            return value + float(soft @ (far * far)) + float(stiff @ (over * over)), least

        return both


class _Release:
    """The cells near bad ones with the boundary released."""

    def __init__(
        self,
        run: Run,
        promise: Promise,
        reached: Quality,
        surface: Surface,
        limit: float,
        near: NDArray[np.bool_],
    ) -> None:
        self.promise, self.surface, self.limit, self.target = promise, surface, limit, run.target
        self.run = run = _local(run, reached, near, promise.constraints.pinned)
        self.part = part = run.moving
        old, now = (np.asarray(one.mesh.points, np.float64) for one in (promise.before, reached))
        on = np.flatnonzero((surface.kind[part.point_ids] != INSIDE) & (run.freedom.kind == 3))
        ids = part.point_ids[on]
        self.released = mask_of(len(old), ids)
        self.diagonal = extent(old)[1]
        keeper = None
        if not promise.is_given:
            was, is_now = promise.volumes(reached)
            keeper = VolumeKeeper(surface, now, self.released, was - is_now, OFF * KEPT * np.abs(was))
        self.springs = Springs(part, surface, on, run.freedom.scale[on], old[ids], now, keeper)
        self.descent = run.descent(part, np.arange(part.n_points))

    def points(self) -> Points:
        """Points of the mesh as near to the surface as they could be brought, with all positive if they can be."""
        run, part = self.run, self.part
        here = self._untangle(run.base[run.points_of_moving].copy())
        if not (part.qualities(here)[0] > 0.0).all():
            return self._of_mesh(here)
        slack = SLACK * self.limit
        for _ in range(TRIES):
            here = self._draw_back(here, slack)
            if self._is_near(here):
                here = self._raise(here, slack)
                if self._is_near(here):
                    break
                slack *= LESS
            if run.is_over():
                break
        return self._of_mesh(here)

    def _of_mesh(self, here: Points) -> Points:
        """``(n_points, 3)`` points of the mesh, nodes between the corners of curved cells following."""
        run, mesh, constraints = self.run, self.promise.before.mesh, self.promise.constraints
        out, base = np.asarray(mesh.points, np.float64).copy(), run.base.copy()
        base[run.points_of_moving] = here
        out[run.whole.point_ids] = base
        return move_nodes_between(mesh, out, constraints.cells, constraints.pinned)

    def _is_near(self, here: Points) -> bool:
        """True if no face is too far off; points of those that are slide no more."""
        apart = deviation(self.surface, self._of_mesh(here), is_given=self.promise.is_given)
        if apart.largest <= self.limit:
            return True
        self.springs.anchor(mask_of(len(self.released), _points_of_faces(self.surface, apart, self.limit)))
        return False

    def _descend(self, energy: Energy, here: Points, first_step: float = 0.02) -> DescentResult:
        def watch(now: Points, value: float, least: float) -> bool:
            self.run.record("release", now)
            return self.run.is_over()

        reached = self.descent.run(
            self.springs.added_to(energy), here, iterations=ITERATIONS, first_step=first_step, tolerance=1e-5,
            watch=watch,
        )  # fmt: skip
        self.run.evaluations += reached.evaluations
        return reached

    def _untangle(self, here: Points) -> Points:
        run, springs, part = self.run, self.springs, self.part
        shape = ShapeEnergy(part, reference_lengths_of_cells(part, here, local=False))
        epsilon = FIRST
        for n in range(ROUNDS):
            shape.epsilon2 = epsilon * epsilon
            reached = self._descend(shape, here, first_step=0.05)
            here = reached.points
            if reached.least > 0.0 or run.is_over():
                break
            epsilon = max(0.2 * abs(reached.least), 1e-5)
            springs.draw(here)
            if n >= PATIENCE:
                springs.soft = max(SOFTER * springs.soft, SOFTEST)
        return here

    def _draw_back(self, here: Points, slack: float) -> Points:
        """Points nearer to the surface than the slack, or as near as positive corners allow."""
        springs, part = self.springs, self.part
        lengths = part.reference_lengths(here)
        springs.slack, springs.soft = 0.5 * slack, 0.0
        for level in LEVELS:
            springs.weight = 1.0
            for _ in range(DRAWS):
                if springs.draw(here) <= slack or self.run.is_over():
                    return here
                least = np.minimum(KEEP * part.qualities(here)[0], level)
                reached = self._descend(QualityEnergy(part, lengths, least, barrier=BARRIER), here)
                here = springs.keep_volumes(reached.points, np.minimum(least, 0.0))
                springs.weight *= STIFFER
        return here

    def _raise(self, here: Points, slack: float) -> Points:
        """Points with the worst and the mean raised, by firmer springs where the surfaces are too far apart."""
        run, springs, part = self.run, self.springs, self.part
        springs.slack, springs.weight, springs.soft = slack, STIFF, SOFT
        aim = min(MEAN * self.diagonal, PART * self.limit)
        for _ in range(SETTLES):
            springs.draw(here)
            lengths = part.reference_lengths(here)
            here = raise_worst(run, here, lengths, phase="release", constraint=springs, end=END)
            here = raise_mean(run, here, lengths, phase="release", constraint=springs)
            here = springs(here, here, np.minimum(KEEP * part.qualities(here)[0], self.target))
            if run.is_over() or mean_from_old(self.surface, self._of_mesh(here)) <= aim:
                break
            springs.weight, springs.soft = STIFF, FIRMER * springs.soft
        return here


def _local(run: Run, reached: Quality, cells: NDArray[np.bool_], pinned: Mask) -> Run:
    """A run on some cells; points of other cells hold still, and those that are pinned."""
    whole = run.whole
    near = np.repeat(cells, np.diff(whole.cells))
    part, of_points, of_cells = whole.of_corners(near)
    held = pinned[whole.point_ids]
    held[whole.corners[~near]] = True
    points = np.asarray(reached.mesh.points, np.float64)[whole.point_ids]
    sizes = part.point_sizes(part.edge_lengths(points[of_points]))
    freedom = Freedom(np.where(held[of_points], 0, 3).astype(np.uint8), np.zeros((len(of_points), 3)), sizes)
    return replace(
        run, moving=part, points_of_moving=of_points, cells_of_moving=of_cells, freedom=freedom, base=points.copy(),
        phase_end=np.inf, hanging=NONE,
    )  # fmt: skip
