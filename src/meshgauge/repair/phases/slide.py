"""Sliding: once the mesh is as good as its boundary allows, points of the boundary move on the surface that it is."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...look.style import number_of, plural
from ...mesh import Mesh
from ...quality.measure import Quality
from ..acceptance import SAME, accept, is_better, n_unusable
from ..claims import Promise
from ..constraints import Constraints, Mask
from ..curved import move_nodes_between
from ..descent import Energy, Freedom
from ..deviation import Deviation, deviation
from ..faces import mask_of
from ..hanging import NONE
from ..problem import Points, Problem, gather
from ..run import Run
from ..surface import CORNER, EDGE, FACE, INSIDE, Surface
from ..surface_edges import SurfaceEdges
from ..volumes import moved_rims, restore_volumes
from .mean import raise_mean
from .untangle import smooth, untangle
from .worst import raise_worst

STRIDES = (1.0, 0.5, 0.25, 0.1)
"""Shares of a step that are tried until the mesh is as good once its points are back on the surface."""

DEVIATION = 0.2
"""How far the middle of a new face or edge may be from the old surface, in mean edges around it."""


PASSES, GAIN = 2, 1e-3
"""How often the worst is raised anew, as long as it gains so much: on a surface each pass ends a little early."""

ATTEMPTS = 4
"""How often sliding starts anew, with points held whose faces went too far from the surface."""

WEIGHT, FIRM, MANY = 1.0, 100.0, 0.05
"""Weights of what pulls edges of curved patches that get too long: where cells are invalid, and once faces at more than
a share of the points went too far."""


@dataclass(frozen=True, eq=False)
class SlideResult:
    """The result of sliding: the mesh as it stands, the largest and mean deviation from the surface, and notes."""

    quality: Quality
    deviation: tuple[float, float]
    notes: tuple[str, ...]


class SlideConstraint:
    """Keeps points of the surface on it, and sets the directions in which the descent may move them."""

    def __init__(self, problem: Problem, surface: Surface, freedom: Freedom, edges: SurfaceEdges) -> None:
        ids = problem.point_ids
        self.problem = problem
        self.freedom = freedom
        self.surface = surface
        kind = freedom.kind
        self.on = np.flatnonzero((kind == EDGE) | (kind == FACE))
        self.ids = ids[self.on]
        self.is_curved = bool(surface.projection.is_curved()[surface.projection.groups[surface.item[self.ids]]].any())
        self.edges = edges

    def project(self, points: Points) -> Points:
        """Points with those of the surface put on it; the axes of the freedom are those there."""
        out = points.copy()
        start = self.surface.item[self.ids].copy()
        out[self.on], axes = self.surface.projection.nearest(points[self.on], start)
        self.surface.item[self.ids] = start
        self.freedom.axes[self.on] = axes
        return out

    def added_to(self, energy: Energy) -> Energy:
        """The energy with that of edges that are too long; points are put on the surface after some steps."""
        return self.edges.added_to(energy)

    def __call__(self, before: Points, after: Points, floors: Points) -> Points:
        """As far as one can go from one to the other along the surface with every cell above its floor."""
        start = self.surface.item[self.ids].copy()
        for stride in STRIDES:
            self.surface.item[self.ids] = start
            trial = self.project(before + stride * (after - before))
            if (self.problem.qualities(trial)[0] > floors).all():
                return trial
        self.surface.item[self.ids] = start
        return self.project(before)


def slide(
    promise: Promise,
    fixed: Quality,
    run: Run,
    surface: Surface,
    released: Mask,
    limit: float,
    *,
    target: float | None,
    threads: int | None,
) -> SlideResult:
    """Let points of the boundary slide, of a mesh that was improved with it fixed.

    Parameters
    ----------
    promise
        What must hold; the boundary of the mesh as it was given is the surface.
    fixed
        Of the mesh as it is.
    run
        As it was improved so far.
    surface
        The boundary of the mesh as it was given, or what the user gave instead.
    released
        ``(n_points,)`` points of it that have left it, and do not slide.
    limit
        The largest distance between the surfaces before and after.
    target
        As for `is_better`.
    threads
        As for `improve`.
    """
    before, constraints = promise.before, promise.constraints
    old = np.asarray(before.mesh.points, np.float64)
    here = np.asarray(fixed.mesh.points, np.float64).copy()
    if run.raised is not None and fixed is not before:
        # Raising the mean goes away from where the worst can be raised further.
        here[run.whole.point_ids[run.points_of_moving]] = run.raised
    kind = surface.kind.copy()
    kind[constraints.pinned | released] = CORNER
    patches = number_of(surface.n_patches, "patch", "patches")
    on_patches = number_of(int(np.count_nonzero(kind == FACE)), "point slides", "points slide")
    summary = (
        f"The boundary has {patches} and {plural(surface.n_curves, 'edge')} at {surface.feature_angle:g}°; "
        f"{on_patches} on patches and {int(np.count_nonzero(kind == EDGE)):,} along edges."
    )
    if not ((kind == FACE) | (kind == EDGE)).any():
        return SlideResult(fixed, (0.0, 0.0), ("No point of the boundary can slide.",))
    sizes = run.whole.point_sizes(run.whole.edge_lengths(old[run.whole.point_ids]))
    size = np.ones(len(old))
    size[run.whole.point_ids] = sizes
    sliding = _Sliding(here, old, run, surface)
    # First as far as the mean goes with what it may take of the worst, then with the least of the mesh as it is kept.
    levels = (-np.inf, float(np.nanmin(fixed.values)))

    def held(points: Points) -> tuple[Quality, Mask]:
        points = _with_nodes_between(run.form or before.mesh, points, constraints, surface)
        if not promise.is_given:
            points = restore_volumes(surface, constraints, kind, points)
        slid, _ = accept(before, points, strict=promise.strict, threads=threads, back=fixed, sizes=constraints.sizes)
        return slid, np.asarray((slid.mesh.points != points).any(axis=1))

    def too_far(slid: Quality) -> tuple[Deviation, Mask]:
        apart = deviation(surface, np.asarray(slid.mesh.points, np.float64), is_given=promise.is_given)
        hold = _points_to_hold(promise, slid, surface, apart.of_faces, size, released, limit)
        return apart, hold & (kind != CORNER) & (kind != INSIDE)

    best, notes = SlideResult(fixed, (0.0, 0.0), ()), [summary]
    # What is untangled goes far, and so does what is beside points that have left the surface; else all stays near.
    weight = WEIGHT if n_unusable(fixed) or released.any() else 0.0
    hold, untangles = np.zeros(len(old), bool), True
    for attempt in range(2 * ATTEMPTS):
        if attempt < ATTEMPTS:
            raised = sliding.raised(kind, weight, untangles=untangles)
            untangles = raised.untangles
            for least in levels:
                slid, back = held(sliding.evened(raised, least))
                if _is_gain(slid, fixed, target) or run.is_over():
                    break
        else:
            # Those that still are too far go back to where they were.
            points = np.asarray(slid.mesh.points, np.float64).copy()
            points[hold] = np.asarray(fixed.mesh.points, np.float64)[hold]
            slid, back = held(points)
        apart, hold = too_far(slid)
        if not hold.any() and apart.largest <= limit and _is_gain(slid, best.quality, target):
            best, n_back = SlideResult(slid, (apart.largest, apart.mean), ()), int(np.count_nonzero(back))
        if run.is_over() or not (hold.any() or (back.any() and best.quality is fixed)):
            break
        if np.count_nonzero(hold) > MANY * np.count_nonzero((kind == EDGE) | (kind == FACE)) and weight < FIRM:
            weight = FIRM
            continue
        hold |= back & (best.quality is fixed)
        kind[hold] = CORNER
    if best.quality is fixed:
        notes.append("Sliding is not better: the result with the boundary fixed stands.")
    elif n_back:
        notes.append(
            f"{number_of(n_back, 'point was put back to where it was', 'points were put back to where they were')} "
            "with the boundary fixed."
        )
    return replace(best, notes=tuple(notes))


def _is_gain(slid: Quality, other: Quality, target: float | None) -> bool:
    """True if a mesh is better, and its worst no worse unless fewer cells are invalid."""
    worst = (float(np.nanmin(quality.values)) for quality in (slid, other))
    is_kept = next(worst) >= next(worst) - SAME or n_unusable(slid) < n_unusable(other)
    return is_kept and is_better(slid, other, target)


def _points_to_hold(
    promise: Promise, slid: Quality, surface: Surface, far: Points, size: Points, released: Mask, limit: float
) -> NDArray[np.bool_]:
    """Points of the surface that have to stay: their faces left it, their patch grew, or a region lost volume.

    Faces of points that were released before have left it, and may, up to the limit.
    """
    points = np.asarray(slid.mesh.points, np.float64)
    if promise.is_given:
        return np.zeros(len(points), bool)
    ids, offsets = surface.faces, surface.face_offsets
    own = np.where(np.logical_or.reduceat(released[ids], offsets[:-1]), np.inf, DEVIATION)
    limits = np.minimum(own * np.minimum.reduceat(size[ids], offsets[:-1]), limit)
    hold = mask_of(len(points), ids[np.repeat(far > limits, np.diff(offsets))])
    hold |= moved_rims(surface, np.asarray(promise.before.mesh.points, np.float64), points)
    if not hold.any() and not promise.keeps_volumes(slid):
        # What the points inside curved patches could not make up for: whatever parts regions, and curves.
        between = np.repeat(surface.face_sides[:, 1] >= 0, np.diff(offsets))
        curved = surface.facets.is_curved()[np.maximum(surface.facets.groups[surface.item], 0)] & (surface.item >= 0)
        hold |= mask_of(len(points), ids[between]) | curved
    return hold


def _with_nodes_between(mesh: Mesh, points: Points, constraints: Constraints, surface: Surface) -> Points:
    """Points with the nodes between corners of curved cells following, those of the surface on it."""
    out = move_nodes_between(mesh, points, constraints.cells, constraints.pinned)
    follows = (out != points).any(axis=1) & ((surface.kind == EDGE) | (surface.kind == FACE))
    ids = np.flatnonzero(follows)
    out[ids], _ = surface.projection.nearest(out[ids], surface.item[ids])
    return out


@dataclass(frozen=True, eq=False)
class _Raised:
    """Points with the worst raised, and what the next phase goes on with."""

    run: Run
    constraint: SlideConstraint
    points: Points
    lengths: NDArray[np.float32]
    items: NDArray[np.int64]
    untangles: bool  #: False if all could not be made positive


@dataclass(frozen=True, eq=False)
class _Sliding:
    """The phases with the surface released.

    Attributes
    ----------
    here, given
        ``(n_points, 3)`` points of the mesh as they are, and as they were given.
    run
        As the mesh was improved so far.
    surface
        What points slide on.
    """

    here: Points
    given: Points
    run: Run
    surface: Surface

    def raised(self, kind: NDArray[np.uint8], weight: float, *, untangles: bool) -> _Raised:
        """The worst raised, once all is positive if that is asked for and can be.

        ``kind`` tells what each point of the mesh may do, ``weight`` how hard edges are pulled that get too long.
        """
        run, whole = self.run, self.run.whole
        mine = kind[whole.point_ids]
        moving, of_points, of_cells = whole.of_corners(np.asarray(gather(mine > 0, whole.corners).any(axis=1)))
        ids = whole.point_ids[of_points]
        points = self.here[ids].copy()
        lengths = moving.edge_lengths(points)
        freedom = Freedom(mine[of_points].copy(), np.zeros((len(points), 3)), moving.point_sizes(lengths))
        released = replace(
            run,
            moving=moving,
            points_of_moving=of_points,
            cells_of_moving=of_cells,
            freedom=freedom,
            base=self.here[whole.point_ids].copy(),
            phase_end=np.inf,
            hanging=NONE,
        )
        constraint = SlideConstraint(
            moving, self.surface, freedom, SurfaceEdges(moving, self.surface, self.given, weight)
        )
        # A search starts from where a point was last: to go there first keeps searches short.
        points = constraint(points, points, np.full(moving.n_cells, -np.inf))
        if untangles and (moving.qualities(points)[0] <= 0.0).any():
            items, axes = self.surface.item.copy(), freedom.axes.copy()
            untangled, is_untangled = untangle(released, points, constraint=constraint)
            if is_untangled:
                points = smooth(released, untangled, self.given[ids], constraint=constraint)
            else:
                # What is left would be paid for by cells around: the worst is raised from where all was.
                self.surface.item[:], freedom.axes[:] = items, axes
                untangles = False
        references = moving.reference_lengths(points)
        for _ in range(PASSES):
            before = float(moving.qualities(points)[0].min(initial=1.0))
            points = raise_worst(released, points, references, phase="slide", constraint=constraint)
            if moving.qualities(points)[0].min(initial=1.0) < before + GAIN or released.is_over():
                break
        run.evaluations, run.stopped = released.evaluations, released.stopped
        return _Raised(released, constraint, points, references, self.surface.item.copy(), untangles)

    def evened(self, raised: _Raised, least: float) -> Points:
        """``(n_points, 3)`` points of the mesh with the mean raised, too; no cell that has it falls below a least."""
        released, points = raised.run, raised.points
        self.surface.item[:] = raised.items
        constraint = raised.constraint
        points = constraint(points, points, np.full(released.moving.n_cells, -np.inf))
        points = raise_mean(released, points, raised.lengths.copy(), phase="slide", constraint=constraint, least=least)
        self.run.evaluations, self.run.stopped = released.evaluations, released.stopped
        out = self.here.copy()
        out[self.run.whole.point_ids[released.points_of_moving]] = points
        return out
