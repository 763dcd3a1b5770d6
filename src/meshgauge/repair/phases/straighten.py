"""Straightening: for finite volumes, faces that are too far from orthogonal or too skew come within the limits.

J_ENS does not see them: it looks at corners, they at the centres of two cells. Points near them move, one by one, while
no cell falls below the target or below what it has, and no other face passes a limit; see
`meshgauge.kernels.finite_volume.straighten`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...cells import POLYHEDRON
from ...kernels.finite_volume.straighten import straighten as kernel
from ...mesh.polyhedra import ragged_positions
from ...quality.faces import FaceQuality
from ...quality.measure import Quality
from ...quality.metrics import METRICS
from ..acceptance import accept, is_better
from ..constraints import Constraints
from ..hard_faces import MEASURES, cells_at, hard_faces
from ..polyhedral import WARP, warps
from ..problem import Ids, Points, Problem
from ..run import Run
from ..sizes import WITHIN

RINGS = 2
"""Cells around those of hard faces whose points move."""

AIM = 0.97
"""Share of the limits that is aimed for."""

SIDE = 0.01
"""Share of the distance of a cell's centre from each of its faces that is kept."""

FLATTEST = 0.85
"""Flatness that faces keep, if they have it; the limit is .8."""

SWEEPS = 20
"""After so many the time is looked at, and whether it goes on."""

ENOUGH = 0.99
"""It goes on while that lowers what is left to this share at most."""


def straighten(
    before: Quality, after: Quality, constraints: Constraints, run: Run, *, strict: bool, threads: int | None
) -> Quality:
    """The mesh with fewer hard faces, or with a worst that is less hard, if it can be; points of the boundary stay.

    Parameters
    ----------
    before, after
        Of the mesh given, and as it was left so far.
    constraints, run
        Of the repair.
    strict
        No cell may have less than it began with.
    threads
        As for `measure`.
    """
    faces = FaceQuality(after.mesh, threads)
    hard = hard_faces(faces)
    moving = _moving(faces, hard, constraints, run)
    if not len(moving):
        return after
    points, sweep = _sweep(before, faces, moving, constraints, run, strict=strict)
    left = np.inf
    while not run.is_stopped():
        now = sweep()
        if now == 0.0 or now > ENOUGH * left:
            break
        left = now
    constraints.hanging.follow(points, np.asarray(before.mesh.points, np.float64))
    better, _ = accept(
        before,
        points,
        strict=strict,
        threads=threads,
        back=after,
        sizes=constraints.sizes,
        hanging=constraints.hanging,
    )
    return better if is_better(better, after) else after


def _moving(faces: FaceQuality, hard: NDArray[np.bool_], constraints: Constraints, run: Run) -> Ids:
    """Points near hard faces that may move, in the order of the problem; none that hangs or is hung on."""
    whole = run.whole
    at = cells_at(faces, hard)[whole.cell_ids]
    if not at.any():
        return np.empty(0, np.int64)
    near = whole.point_ids[whole.points_at(whole.grow(at, RINGS))]
    stays = constraints.fixed | constraints.hanging.linked(len(constraints.fixed))
    return near[~stays[near]]


def _sweep(
    before: Quality, faces: FaceQuality, moving: Ids, constraints: Constraints, run: Run, *, strict: bool
) -> tuple[Points, Callable[[], float]]:
    """The points as they are, and what moves them, in place, by some sweeps, and returns what is left."""
    mesh, whole = faces.mesh, run.whole
    points = np.array(mesh.points, np.float64)
    faces_of_cells, cell_ends = _grouped(
        np.concatenate([faces.owner, faces.neighbour[faces.is_inner]]),
        np.concatenate([np.arange(faces.n_faces), np.flatnonzero(faces.is_inner)]),
        mesh.n_cells,
    )
    sizes = np.diff(faces.offsets)
    at_points = _grouped(faces.points, np.repeat(np.arange(faces.n_faces), sizes), mesh.n_points)
    own_faces, own_face_ends = _of(at_points, moving)
    rows = np.repeat(np.arange(len(moving)), np.diff(own_face_ends))
    own_cells, own_cell_ends = _pairs(
        np.concatenate([rows, rows]),
        np.concatenate([faces.owner[own_faces], faces.neighbour[own_faces]]),
        len(moving),
    )
    some, counts = own_cells, np.diff(cell_ends)[own_cells]
    near_faces, near_face_ends = _pairs(
        np.repeat(np.repeat(np.arange(len(moving)), np.diff(own_cell_ends)), counts),
        faces_of_cells[ragged_positions(cell_ends[some], counts)],
        len(moving),
    )
    corners = np.asarray(whole.point_ids[whole.corners], np.int64)
    at_corners = _grouped(corners.reshape(-1), np.repeat(np.arange(len(corners)), 4), mesh.n_points)
    own_corners, own_corner_ends = _of(at_corners, moving)
    measured = np.stack([_over(faces, "non_orthogonality"), _over(faces, "skewness")], axis=1)
    outside = _over(faces, "boundary_skewness")
    measured[~faces.is_inner] = np.stack([np.zeros_like(outside), outside], axis=1)[~faces.is_inner]
    limits = np.array([METRICS[name].acceptable[1] for name in (*MEASURES, "boundary_skewness")])
    state = (faces.centres.copy(), faces.areas.copy(), faces.cell_centres.copy())
    floors = _floors(before, points, whole, run.target, strict=strict)
    bounds, volumes = _bounds(before, faces, measured), _volumes(constraints, mesh.n_cells)

    def sweep() -> float:
        left: float = kernel(
            points,
            faces.points,
            faces.offsets,
            faces.owner,
            faces.neighbour,
            faces_of_cells,
            cell_ends,
            moving,
            own_faces,
            own_face_ends,
            own_cells,
            own_cell_ends,
            near_faces,
            near_face_ends,
            own_corners,
            own_corner_ends,
            corners,
            floors,
            bounds,
            volumes,
            limits,
            AIM,
            SWEEPS,
            measured,
            *state,
        )
        run.evaluations += SWEEPS
        return left

    return points, sweep


def _floors(before: Quality, points: Points, whole: Problem, target: float, *, strict: bool) -> Points:
    """``(n_corners,)`` the least J_S that each corner may have: that of the target, or of what its cell has if that is
    less. Four points of a face that are to be in a plane have none."""
    constants = whole.constants[whole.kinds]
    at = whole.point_ids[whole.corners]
    edges = points[at[:, 1:]] - points[at[:, :1]]
    with np.errstate(all="ignore"):
        js = np.linalg.det(edges) / np.linalg.norm(edges, axis=2).prod(axis=1)
        of_ideal = np.where(constants > 0.0, js / constants, np.inf)
    least = np.minimum.reduceat(of_ideal, whole.cells[:-1])
    if strict:
        had = before.values[whole.cell_ids]
        floor = np.minimum(least, had)
    else:
        floor = np.minimum(least, target)
    floors = constants * np.repeat(floor, np.diff(whole.cells))
    return np.where((constants > 0.0) & np.isfinite(floors), floors, -np.inf)


def _bounds(before: Quality, faces: FaceQuality, measured: Points) -> Points:
    """``(n_faces, 5)`` for the kernel: hard faces may become no harder, others not hard; centres stay on their side of
    each face, and faces as flat as `is_warped` wants them."""
    side = 3.0 * faces.pyramid_volume
    is_poly = faces.mesh.types == POLYHEDRON.vtk_id
    at_poly = is_poly[faces.owner] | (faces.is_inner & is_poly[faces.neighbour])
    had = warps(faces.points, faces.offsets, np.asarray(before.mesh.points, np.float64))
    return np.stack(
        [
            np.maximum(measured[:, 0], 1.0),
            np.maximum(measured[:, 1], 1.0),
            np.where(side > 0.0, SIDE * side, -np.inf),
            np.minimum(np.nan_to_num(faces.flatness, nan=0.0), FLATTEST),
            np.where(at_poly, np.maximum(had, WARP[faces.mesh.purpose]), np.inf),
        ],
        axis=1,
    )


def _volumes(constraints: Constraints, n_cells: int) -> Points:
    """``(n_cells, 2)`` the least and the largest volume of each cell."""
    volumes = np.tile([-np.inf, np.inf], (n_cells, 1))
    sizes = constraints.sizes
    if sizes is not None:
        share = WITHIN * sizes.share
        volumes[sizes.cells] = sizes.volumes[:, None] * [1.0 - share, 1.0 + share]
    return volumes


def _over(faces: FaceQuality, name: str) -> Points:
    """A measure over its limit; 0 where it is not defined."""
    values: Points = getattr(faces, name) / METRICS[name].acceptable[1]
    return np.nan_to_num(values, nan=0.0, posinf=np.inf)


def _grouped(keys: Ids, values: Ids, n: int) -> tuple[Ids, Ids]:
    """Values by key, and where those of each key begin."""
    order = np.argsort(keys, kind="stable")
    return values[order], np.concatenate([[0], np.cumsum(np.bincount(keys, minlength=n))])


def _of(grouped: tuple[Ids, Ids], keys: Ids) -> tuple[Ids, Ids]:
    """The values of some keys, and where those of each begin."""
    values, ends = grouped
    counts = ends[keys + 1] - ends[keys]
    return values[ragged_positions(ends[keys], counts)], np.concatenate([[0], np.cumsum(counts)])


def _pairs(rows: Ids, values: Ids, n: int) -> tuple[Ids, Ids]:
    """The different values of each row, ascending, negative ones left out, and where those of each row begin."""
    known = values >= 0
    width = int(values.max(initial=0)) + 1
    pairs = np.unique(rows[known] * width + values[known])
    return pairs % width, np.searchsorted(pairs // width, np.arange(n + 1))
