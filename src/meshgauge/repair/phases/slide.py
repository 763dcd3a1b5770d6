"""Sliding: once the mesh is as good as its boundary allows, points of the boundary move on the surface that it is."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...look.style import number_of, plural
from ...mesh import Mesh
from ...quality.measure import Quality
from ..acceptance import accept, is_better
from ..claims import Promise
from ..constraints import Constraints, Mask
from ..curved import move_nodes_between
from ..descent import Energy, Freedom
from ..deviation import deviation
from ..faces import mask_of
from ..hanging import NONE
from ..problem import Points, Problem, gather
from ..run import Run
from ..surface import CORNER, EDGE, FACE, INSIDE, Surface
from ..volumes import moved_rims, restore_volumes
from .mean import raise_mean
from .worst import raise_worst

STRIDES = (1.0, 0.5, 0.25, 0.1)
"""Shares of a step that are tried until the mesh is as good once its points are back on the surface."""

DEVIATION = 0.2
"""How far the middle of a new face or edge may be from the old surface, in mean edges around it."""


PASSES, GAIN = 2, 1e-3
"""How often the worst is raised anew, as long as it gains so much: on a surface each pass ends a little early."""

ATTEMPTS = 4
"""How often sliding starts anew, with points held whose faces went too far from the surface."""


@dataclass(frozen=True, eq=False)
class SlideResult:
    """The result of sliding: the mesh as it stands, the largest and mean deviation from the surface, and notes."""

    quality: Quality
    deviation: tuple[float, float]
    notes: tuple[str, ...]


class SlideConstraint:
    """Keeps points of the surface on it, and sets the directions in which the descent may move them."""

    def __init__(self, problem: Problem, of_points: NDArray[np.int64], surface: Surface, freedom: Freedom) -> None:
        ids = problem.point_ids
        self.problem = problem
        self.freedom = freedom
        self.surface = surface
        kind = freedom.kind
        self.on = np.flatnonzero((kind == EDGE) | (kind == FACE))
        self.ids = ids[self.on]
        self.is_curved = bool(surface.projection.is_curved()[surface.projection.groups[surface.item[self.ids]]].any())

    def project(self, points: Points) -> Points:
        """Points with those of the surface put on it; the axes of the freedom are those there."""
        out = points.copy()
        start = self.surface.item[self.ids].copy()
        out[self.on], axes = self.surface.projection.nearest(points[self.on], start)
        self.surface.item[self.ids] = start
        self.freedom.axes[self.on] = axes
        return out

    def added_to(self, energy: Energy) -> Energy:
        """The energy: points are put on the surface after some steps instead."""
        return energy

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
    held: Mask,
    limit: float,
    *,
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
    held
        ``(n_points,)`` points of it that do not slide.
    limit
        The largest distance between the surfaces before and after.
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
    kind[constraints.pinned | held] = CORNER
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
    least = float(np.nanmin(fixed.values))  # what is worse does not stand
    for _ in range(ATTEMPTS):
        points = _with_nodes_between(
            run.form or before.mesh, _slide(here, run, surface, kind, least), constraints, surface
        )
        if not promise.is_given:
            points = restore_volumes(surface, constraints, kind, points)
        slid, n_back = accept(
            before, points, strict=promise.strict, threads=threads, back=fixed, sizes=constraints.sizes
        )
        reached = np.asarray(slid.mesh.points, np.float64)
        apart = deviation(surface, reached, is_given=promise.is_given)
        hold = (
            _points_to_hold(promise, slid, surface, apart.of_faces, size, held, limit)
            & (kind != CORNER)
            & (kind != INSIDE)
        )
        if not hold.any() or run.is_over():
            break
        kind[hold] = CORNER
    notes = [summary]
    if n_back:
        notes.append(
            f"{number_of(n_back, 'point was put back to where it was', 'points were put back to where they were')} "
            "with the boundary fixed."
        )
    if hold.any() or apart.largest > limit or not is_better(slid, fixed):
        return SlideResult(
            fixed, (0.0, 0.0), (summary, "Sliding is not better: the result with the boundary fixed stands.")
        )
    return SlideResult(slid, (apart.largest, apart.mean), tuple(notes))


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


def _slide(
    here: Points,
    run: Run,
    surface: Surface,
    kind: NDArray[np.uint8],
    least: float,
) -> Points:
    """Points of the mesh after both phases with the surface released; the second keeps the least value."""
    whole = run.whole
    mine = kind[whole.point_ids]
    moving, of_points, of_cells = whole.of_corners(np.asarray(gather(mine > 0, whole.corners).any(axis=1)))
    points = here[whole.point_ids[of_points]].copy()
    lengths = moving.edge_lengths(points)
    freedom = Freedom(mine[of_points].copy(), np.zeros((len(points), 3)), moving.point_sizes(lengths))
    released = replace(
        run,
        moving=moving,
        points_of_moving=of_points,
        cells_of_moving=of_cells,
        freedom=freedom,
        base=here[whole.point_ids].copy(),
        phase_end=np.inf,
        hanging=NONE,
    )
    constraint = SlideConstraint(moving, of_points, surface, freedom)
    # A search starts from where a point was last: to go there first keeps searches short.
    points = constraint(points, points, np.full(moving.n_cells, -np.inf))
    references = moving.reference_lengths(points)
    for _ in range(PASSES):
        before = float(moving.qualities(points)[0].min(initial=1.0))
        points = raise_worst(released, points, references, phase="slide", constraint=constraint)
        if moving.qualities(points)[0].min(initial=1.0) < before + GAIN or released.is_over():
            break
    points = raise_mean(released, points, references, phase="slide", constraint=constraint, least=least)
    run.evaluations, run.stopped = released.evaluations, released.stopped
    out = here.copy()
    out[whole.point_ids[of_points]] = points
    return out
