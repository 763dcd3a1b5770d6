"""Releasing the boundary: where a bad cell lies on it, points leave their surface, held by springs, and are drawn back.

With four points of a corner on the surface, no sliding makes it positive. So points near bad cells may leave their
patches, curves and corners; springs pull them back. Once all is positive, the springs are stiffened above a barrier
until no point is further off than the tolerance, and the worst is raised with what is left of it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...look.style import number_of
from ...quality.measure import Quality
from ..acceptance import accept, is_below, is_better, n_unusable
from ..claims import Promise
from ..constraints import Mask
from ..curved import move_nodes_between
from ..descent import DescentResult, Energy, Freedom
from ..deviation import deviation
from ..faces import mask_of
from ..energies import QualityEnergy, ShapeEnergy
from ..problem import Ids, Part, Points, Problem
from ..run import Run
from ..surface import EDGE, FACE, INSIDE, Surface
from ..volumes import VolumeKeeper
from .mean import raise_mean
from .untangle import reference_lengths_of_cells
from .worst import raise_worst

RINGS = (3, 6, 12)
"""Cells around bad ones whose points are released with theirs, at first and then."""

ROUNDS, ITERATIONS = 60, 20
"""Values of ε while untangling, and iterations for each."""

PULL, PATIENCE, SOFTER, SOFTEST = 3.0, 6, 0.6, 0.01
"""Weight of the springs while untangling; after so many rounds it falls by a factor each, down to the last."""

DRAWS, STIFFER = 12, 2.0
"""How often the springs are stiffened, and by which factor."""

LEVELS = (0.2, 0.1, 0.05, 0.02)
"""What corners keep while points are drawn back, the first with which they come near enough."""

SLACK, LESS = 0.6, 0.7
"""Share of the tolerance within which no spring pulls: faces go further off than points do; and by how much less of
it is tried where they went too far."""

ATTEMPTS, TRIES, CLOSE = 4, 6, 0.8
STRETCHED, HARDER = 1.1, 4.0

STIFF, SOFT = 1e3, 1.0
"""Weights of the springs while the worst is raised, of points that are further off than the slack, and of all."""

FIRST = 1e-2
"""The first ε: points are to leave the surface no further than they must."""

BARRIER, KEEP = 1e-3, 0.8
"""Weight of the barrier while points are drawn back, and the share of its value that no corner may lose at a time."""


@dataclass(eq=False)
class Springs:
    """Springs from points of a problem to the nearest places on their surface; a `PointConstraint`.

    Attributes
    ----------
    points
        Points of the problem that are on the surface.
    slack
        Distance within which no spring pulls.
    weight
        Energy of a spring that is stretched by the size of its point beyond that.
    """

    problem: Problem
    surface: Surface
    points: Ids
    sizes: Points
    origin: Points
    keeper: VolumeKeeper | None = None
    slack: float = 0.0
    weight: float = PULL
    soft: float = 0.0
    is_curved: bool = True

    def __post_init__(self) -> None:
        ids = self.problem.point_ids[self.points]
        kind = self.surface.kind[ids]
        self._slides = np.flatnonzero(((kind == EDGE) | (kind == FACE)) & (self.surface.item[ids] >= 0))
        self._items = self.surface.item[ids[self._slides]].copy()
        self.places = self.origin.copy()
        owner = np.full(len(self.points), -1)
        for n, part in enumerate(self.problem.parts):
            owner[(owner < 0) & (self.points >= part.low) & (self.points < part.high)] = n
        self._of = {part: np.flatnonzero(owner == n) for n, part in enumerate(self.problem.parts)}

    def anchor(self, points: Mask) -> None:
        """Pull some points of the mesh to where they were, not to the nearest place."""
        stay = points[self.problem.point_ids[self.points[self._slides]]]
        say("anchored", stay.sum(), "of", len(stay))
        self.places[self._slides[stay]] = self.origin[self._slides[stay]]
        self._slides, self._items = self._slides[~stay], self._items[~stay]

    def draw(self, points: Points) -> Points:
        """Set the places to those nearest to the points; the distances from them."""
        here = points[self.points]
        if len(self._slides):
            self.places[self._slides], _ = self.surface.projection.nearest(here[self._slides], self._items)
        far: Points = np.linalg.norm(here - self.places, axis=1)
        return far

    def __call__(self, before: Points, after: Points, floors: Points) -> Points:
        """The points after some steps stand, and springs pull to the places that are nearest now."""
        after = self.kept(after, floors)
        if self.draw(after).max(initial=0.0) > STRETCHED * self.slack:
            # A threshold that comes near pushes ever harder.
            self.weight *= HARDER
        return after

    def kept(self, points: Points, floors: Points) -> Points:
        """Points with the volumes of regions as they were, as long as cells stay above their floors."""
        if self.keeper is None:
            return points
        whole = self.keeper.old.copy()
        ids = self.problem.point_ids
        whole[ids] = points
        way = self.keeper(whole)[ids] - points
        for share in (1.0, 0.5, 0.25):
            trial = points + share * way
            if (self.problem.qualities(trial)[0] > floors).all():
                return trial
        return points

    def added_to(self, energy: Energy) -> Energy:
        """The energy with that of the springs."""

        def both(points: Points, part: Part, gradient: Points) -> tuple[float, float]:
            value, least = energy(points, part, gradient)
            mine = self._of[part]
            ids, scale = self.points[mine], self.sizes[mine]
            way = points[ids] - self.places[mine]
            far = np.sqrt(np.einsum("ij,ij->i", way, way))
            unit = self.slack or scale
            over = np.maximum(far - self.slack, 0.0) / unit
            soft = self.soft / (scale * scale)
            pull = 2.0 * (self.weight * over / (unit * np.where(far > 0.0, far, 1.0)) + soft)
            gradient[ids - part.low] += pull[:, None] * way
            return value + self.weight * float(over @ over) + float(soft @ (far * far)), least

        return both


@dataclass(frozen=True, eq=False)
class ReleaseResult:
    """The result of releasing the boundary: the mesh as it stands, which points were, how far it is off, notes."""

    quality: Quality
    released: Mask
    deviation: float
    notes: tuple[str, ...]


def release(
    promise: Promise, reached: Quality, run: Run, surface: Surface, limit: float, *, threads: int | None
) -> ReleaseResult:
    """Mend cells at the boundary with its points off the surface by no more than a limit.

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
    threads
        As for `improve`.
    """
    start, off, released = reached, 0.0, np.zeros(len(surface.kind), bool)
    for rings in RINGS:
        bad = is_below(reached, run.target)[run.whole.cell_ids]
        if not bad.any() or run.is_over():
            break
        work = _Release(_local(run, reached, bad, rings, promise.constraints.pinned), promise, surface, limit)
        points = work.points()
        run.evaluations, run.stopped = work.run.evaluations, work.run.stopped
        for _ in range(ATTEMPTS):
            after, _ = accept(
                promise.before, points, strict=promise.strict, threads=threads, back=reached,
                sizes=promise.constraints.sizes,
            )  # fmt: skip
            points = np.asarray(after.mesh.points, np.float64).copy()
            apart = deviation(surface, points, is_given=promise.is_given)
            say("accepted", n_unusable(after), "below", is_below(after, run.target).sum(), "dev", apart.largest/limit, promise.broken(after))
            if apart.largest <= limit:
                break
            # Faces that are too far off go back to where they were.
            far = np.repeat(apart.of_faces > min(limit, 0.9 * apart.of_faces.max()), np.diff(surface.face_offsets))
            back = surface.faces[far]
            points[back] = np.asarray(reached.mesh.points, np.float64)[back]
        if apart.largest <= limit and is_better(after, reached, run.target) and not promise.broken(after):
            reached, off = after, apart.largest
            released |= work.released
    if reached is start:
        return ReleaseResult(start, np.zeros_like(released), 0.0, ("Releasing the boundary is not better.",))
    n = int(np.count_nonzero(released))
    count = number_of(n, "point of the boundary was released", "points of the boundary were released")
    return ReleaseResult(reached, released, off, (f"{count} to mend cells at it.",))


def _local(run: Run, reached: Quality, bad: NDArray[np.bool_], rings: int, pinned: Mask) -> Run:
    """A run on the cells near bad ones; points of other cells hold still, and those that are pinned."""
    whole = run.whole
    near = np.repeat(whole.grow(bad, rings), np.diff(whole.cells))
    part, of_points, of_cells = whole.of_corners(near)
    held = pinned[whole.point_ids]
    held[whole.corners[~near]] = True
    points = np.asarray(reached.mesh.points, np.float64)[whole.point_ids]
    sizes = part.point_sizes(part.edge_lengths(points[of_points]))
    freedom = Freedom(np.where(held[of_points], 0, 3).astype(np.uint8), np.zeros((len(of_points), 3)), sizes)
    return replace(
        run, moving=part, points_of_moving=of_points, cells_of_moving=of_cells, freedom=freedom, base=points.copy(),
        phase_end=np.inf,
    )  # fmt: skip


def say(*what):
    import os
    if os.environ.get("RELDEBUG"):
        print("   ", *what, flush=True)


class _Release:
    """One attempt: the cells near bad ones, untangled with springs at their points on the surface, and drawn back."""

    def __init__(self, run: Run, promise: Promise, surface: Surface, limit: float) -> None:
        self.run, self.promise, self.surface, self.limit = run, promise, surface, limit
        part = self.part = run.moving
        old = np.asarray(promise.before.mesh.points, np.float64)
        on = np.flatnonzero((surface.kind[part.point_ids] != INSIDE) & (run.freedom.kind == 3))
        self.released = mask_of(len(old), part.point_ids[on])
        keeper = None
        if not promise.is_given:
            keeper = VolumeKeeper(surface, old, self.released, len(promise.constraints.region_names))
        self.springs = Springs(part, surface, on, run.freedom.scale[on], old[part.point_ids[on]], keeper)
        self.descent = run.descent(part, np.arange(part.n_points))

    def points(self) -> Points:
        """Points of the mesh as far as they were brought."""
        run, part = self.run, self.part
        here = self._untangled(run.base[run.points_of_moving].copy())
        if not (part.qualities(here)[0] > 0.0).all():
            return self._of_mesh(here)
        slack = SLACK * self.limit
        for _ in range(TRIES):
            here = self._drawn_back(here, slack)
            if self._is_near(here):
                raised = self._raised(here, slack)
                if self._is_near(raised):
                    return self._of_mesh(raised)
                here, slack = raised, LESS * slack
            if self.run.is_over():
                break
        return self._of_mesh(here)

    def _is_near(self, here: Points) -> bool:
        """True if no face is too far off; the points of those that are slide no more."""
        apart = deviation(self.surface, self._of_mesh(here), is_given=self.promise.is_given)
        say("deviation", apart.largest/self.limit, apart.of_faces.max()/self.limit, apart.of_old_faces.max()/self.limit)
        if apart.largest <= self.limit:
            return True
        off = np.maximum(apart.of_faces, apart.of_old_faces)
        far = off > CLOSE * min(self.limit, float(off.max()))
        ids = self.surface.faces[np.repeat(far, np.diff(self.surface.face_offsets))]
        self.springs.anchor(mask_of(len(self.released), ids))
        return False

    def _of_mesh(self, here: Points) -> Points:
        """``(n_points, 3)`` points of the mesh, nodes between the corners of curved cells following."""
        run, mesh, constraints = self.run, self.promise.before.mesh, self.promise.constraints
        out, base = np.asarray(mesh.points, np.float64).copy(), run.base.copy()
        base[run.points_of_moving] = here
        out[run.whole.point_ids] = base
        return move_nodes_between(mesh, out, constraints.cells, constraints.pinned)

    def _watch(self, now: Points, value: float, least: float) -> bool:
        self.run.record("release", now)
        return self.run.is_over()

    def _down(self, energy: Energy, here: Points, first_step: float = 0.02) -> DescentResult:
        """Further down an energy, with the springs."""
        reached = self.descent.run(
            self.springs.added_to(energy), here, iterations=ITERATIONS, first_step=first_step, tolerance=1e-5,
            watch=self._watch,
        )  # fmt: skip
        self.run.evaluations += reached.evaluations
        return reached

    def _untangled(self, here: Points) -> Points:
        run, springs, part = self.run, self.springs, self.part
        shape = ShapeEnergy(part, reference_lengths_of_cells(part, here, local=False))
        springs.slack, springs.weight, springs.soft = 0.0, PULL, 0.0
        epsilon = FIRST
        for n in range(ROUNDS):
            shape.epsilon2 = epsilon * epsilon
            reached = self._down(shape, here, first_step=0.05)
            here = reached.points
            self.say(f"  round {n} w {springs.weight:.3g} eps {epsilon:.2g} least {reached.least:.3g}", here)
            if reached.least > 0.0 or run.is_over():
                break
            epsilon = max(0.2 * abs(reached.least), 1e-5)
            springs.draw(here)
            if n >= PATIENCE:
                springs.weight = max(SOFTER * springs.weight, SOFTEST)
        self.say("untangled", here)
        return here

    def say(self, what, here):
        q = self.part.qualities(here)[1]
        say(what, self.part.n_cells, "inv", (q <= 0).sum(), "min %.4f mean %.4f" % (q.min(), q.mean()), "far/limit %.2f mean %.3f" % (self.springs.draw(here).max(initial=0)/self.limit, self.springs.draw(here).mean()/self.limit), self.run.evaluations)

    def _drawn_back(self, here: Points, slack: float) -> Points:
        """Points with those of the surface nearer to it than the slack, or as near as positive corners allow."""
        springs, part = self.springs, self.part
        lengths = part.reference_lengths(here)
        springs.slack, springs.soft = 0.5 * slack, 0.0
        for level in LEVELS:
            springs.weight = 1.0
            for _ in range(DRAWS):
                if (springs.draw(here) <= slack).all() or self.run.is_over():
                    self.say(f"drawn {level}", here)
                    return here
                thresholds = np.minimum(KEEP * part.qualities(here)[0], level)
                reached = self._down(QualityEnergy(part, lengths, thresholds, barrier=BARRIER), here)
                here = springs.kept(reached.points, np.minimum(thresholds, 0.0))
                springs.weight *= STIFFER
        self.say(f"drawn {level}", here)
        return here

    def _raised(self, here: Points, slack: float) -> Points:
        springs, part = self.springs, self.part
        springs.slack, springs.weight, springs.soft = slack, STIFF, SOFT
        lengths = part.reference_lengths(here)
        here = raise_worst(self.run, here, lengths, phase="release", constraint=springs)
        here = raise_mean(self.run, here, lengths, phase="release", constraint=springs)
        self.say("raised", here)
        return springs(here, here, np.minimum(KEEP * part.qualities(here)[0], self.run.target))
