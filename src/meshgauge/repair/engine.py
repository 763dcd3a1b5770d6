"""Improving a mesh: the phases one after another, acceptance, and the report."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..doctor.points import extent
from ..errors import MeshError, expect
from ..kernels.path import NUMPY_UP_TO, numpy_up_to
from ..look.bands import POOR, PoorBelow
from ..mesh import Mesh
from ..quality.measure import Quality, measure
from .acceptance import is_to_mend, status_counts
from .alternate import Way, alternate
from .attempt import Attempting
from .ceiling import ceiling
from .constraints import Mask, constraints_of, fixed_mask
from .descent import workers
from .hard_faces import hardness
from .near_bad import Reached, repair_everywhere, repair_near_bad
from .parts import FEW
from .patch import PatchOfMesh, WholeMesh, whole_patch
from .patch_report import Known, patch_report
from .polyhedral import corners as corners_of
from .problem import Ids, Points, problem
from .reconnection import OBJECTIVES
from .report import RepairReport
from .rounding import Rounding
from .run import Progress
from .scale import power_of, rescaled, restored, scaled
from .shells.improve import improve_shells
from .target import scaled_surface
from .whole import Options

BOUNDARIES = ("fixed", "slide")
"""What may happen to points of the boundary."""

FLOOR, SIZE_CHANGE = 0.9, 0.1
"""The share of the worst quality that raising the mean keeps, and by which sizes of good cells may change."""

WHOLE_UP_TO = 1 << 16
"""Cells up to which the bound on the worst cell is searched in all of them, not only near bad ones."""


@dataclass(frozen=True, eq=False, repr=False)
class Improvement:
    """The result of `improve`.

    Attributes
    ----------
    mesh
        The mesh with its points moved; cells, their numbering, data and regions are those of the mesh given. It is the
        mesh given if nothing better was found.
    before, after
        What was measured on the mesh given, and on ``mesh``.
    report
        What was checked, what it cost, and what is left.
    """

    mesh: Mesh
    before: Quality
    after: Quality
    report: RepairReport

    @property
    def history(self) -> tuple[Progress, ...]:
        """Worst and mean quality over time."""
        return self.report.history

    def undo(self) -> Mesh:
        """The mesh as it was given, to the last bit."""
        return self.before.source

    def __repr__(self) -> str:
        return f"<Improvement: {self.report.verdict}>"


def improve(
    mesh: Mesh,
    *,
    everywhere: bool = False,
    boundary: str = "fixed",
    target: float = POOR,
    floor: float | None = None,
    size_change: float = SIZE_CHANGE,
    topology: bool = False,
    objective: str = OBJECTIVES[0],
    split_hopeless: bool = False,
    strict: bool = False,
    seconds: float | None = None,
    fixed: ArrayLike | None = None,
    keep: Sequence[str] = (),
    surface: Any = None,
    feature_angle: float = 40.0,
    tolerance: float | None = None,
    progress: Callable[[Progress], object] | None = None,
    should_stop: Callable[[], bool] | None = None,
    threads: int | None = None,
    keep_bricks: bool = False,
    poor_below: float | Mapping[str, float] | PoorBelow | None = None,
    rounding: Rounding | Sequence[Rounding] | None = None,
) -> Improvement:
    """Move the points of a mesh so that no cell is inverted, the worst is as good as it can be, and the mean is high.

    Topology, numbering, data and regions stay. Three phases: untangling, if a cell is inverted (regularised energy of
    Garanzha et al., ACM TOG 2021); raising the least J_S/k of all corners, by a barrier that follows it; raising the
    mean without giving the worst away. What was reached stands only where no cell pays for it: see `RepairReport`.

    Parameters
    ----------
    mesh
        Any mesh. For finite volumes, inner faces beyond the limits of non-orthogonality and skewness are to come within
        them, too. Cells of high order take no part: their points stay. Faces of polyhedra are kept as flat as they are,
        or within a hundredth of their radius; nodes that hang follow their edge or face.
    everywhere
        False: only points near cells that are invalid or below the target move, in rings that grow while it helps; all
        else stays to the last bit. True: all points move, and the worst and the mean of the whole mesh rise.
    boundary
        "fixed": points of the boundary stay to the last bit. "slide": they move on the surface that the boundary is
        now, edges of it along themselves, corners not at all; if that is not better, the result for "fixed" stands.
    target
        J_ENS in [0, 1) that every cell should have; cells that stay below it are listed with the reason. 0: invalid
        cells only.
    floor
        With ``everywhere``: the share in [0, 1] of the worst quality that raising the mean must keep; None: 0.9.
    size_change
        Without ``everywhere``: by which share a cell of J_ENS 0.9 or more may change its volume, and its height if it
        is a wedge or hexahedron whose longest edge is more than five times its shortest.
    topology
        True: tetrahedra are joined anew, too (flips, removal of edges and faces, collapses, new points), in turn with
        moving points. Faces of the boundary, between regions and to cells of other types stay. The mesh has other
        cells then; its data ``meshgauge:old_point`` and ``meshgauge:old_cell`` tell which each was, -1 if it is new.
    objective
        With ``topology``: what joining anew raises: "jens", or "dihedral", the least sine of the dihedral angles.
    split_hopeless
        True: linear hexahedra, wedges and pyramids that are still invalid once points have moved are split into
        pyramids and tetrahedra about a new point, where all of these can be valid; where it needs it, inner faces are
        cut and neighbours are split with them. What stays and what the data tell is as for ``topology``.
    strict
        No cell ends with less than it began with; no new one has less than the worst had.
    seconds
        Time after which the best so far is the result, checked and measured; None: no limit. Measuring the mesh and
        looking at it once takes what it takes.
    fixed
        Further points that must not move: a mask ``(n_points,)`` or ids; by the numbers of the file:
        ``np.isin(mesh.point_data["label"], [100, 200])``.
    keep
        Names of cell data: faces between cells of which they differ stay as those between regions do.
    surface
        With "slide": a mesh, or a PyVista or VTK data set, on whose boundary points move instead of on the boundary
        itself; its surface cells if it has no solid ones.
    feature_angle
        Degrees between two faces of the boundary, or two cells of a surface in space, from which on their edge is a
        feature that is kept; and of the turn of a curve from which on a point of it is a corner that stays.
    tolerance
        With "slide": where cells stay bad, points of the boundary may leave it, so that the surfaces before and after
        are nowhere further apart than this share of the diagonal of the mesh. None: points stay on the surface.
    progress
        Called with a `Progress` several times a second.
    should_stop
        Asked often; True ends the improvement with the best so far.
    threads
        At most this many; None: one for each processor. It has no influence on the result.
    keep_bricks
        Take cells with repeated nodes as they are, see `meshgauge.measure`: they are degenerate, and stay so.
    poor_below
        Below which J_ENS valid cells are called poor in the report, see `meshgauge.measure`; what is mended is said by
        ``target``.
    rounding
        Makes of ids of points and their new coordinates ``(n, 3)`` those that a file will hold, such as
        `meshgauge.io.patching.Patch.rounded`: what is accepted and checked is what they give. Of several, such as
        `meshgauge.io.patching.Patch.roundings`, the next is for points for which a cell would pay with the one before.

    Returns
    -------
    Improvement
        The new mesh, the repair report and the history.

    Raises
    ------
    MeshError
        If there is nothing to improve: no solid cell that can be measured; if cells are numbered in reverse, which
        moving points would ruin; if a parameter is out of its range.
    ResourceError
        If less memory is left than so many points take.
    """
    mesh = expect(mesh, Mesh)
    options = Options(
        boundary=boundary,
        target=target,
        floor=FLOOR if floor is None else floor,
        strict=strict,
        seconds=seconds,
        surface=surface,
        feature_angle=feature_angle,
        tolerance=tolerance,
        threads=threads,
        everywhere=everywhere,
        size_change=size_change,
        topology=topology,
        objective=objective,
        split_hopeless=split_hopeless,
        keep=(keep,) if isinstance(keep, str) else tuple(keep),
        rounding=() if rounding is None else (rounding,) if callable(rounding) else tuple(rounding),
    )
    check_options(options, floor)
    held = fixed_mask(fixed, mesh.n_points)
    power = power_of(mesh)
    if power:
        options = replace(options, rounding=tuple(_in_another_unit(one, power) for one in options.rounding))
    if power and surface is not None:
        options = replace(options, surface=scaled_surface(surface, power))
    with numpy_up_to(FEW):
        here = scaled(mesh, power) if power else mesh
        result = _improve(here, held, options, progress, should_stop, keep_bricks=keep_bricks, poor_below=poor_below)
    if not power and min(mesh.type_counts().values(), default=NUMPY_UP_TO) > NUMPY_UP_TO:
        return result
    # Few cells of a type are measured as anybody else would measure them, to the last bit.
    moved, report = result.mesh, result.report
    if power:
        moved, report = restored(mesh, moved, power), rescaled(report, power)
    before = measure(mesh, threads=threads, keep_bricks=keep_bricks, poor_below=poor_below)
    if result.mesh is result.before.source:
        return Improvement(mesh, before, before, report)
    after = measure(moved, threads=threads, keep_bricks=keep_bricks, poor_below=poor_below)
    return Improvement(moved, before, after, report)


def _improve(
    mesh: Mesh,
    held: Mask,
    options: Options,
    progress: Callable[[Progress], object] | None,
    should_stop: Callable[[], bool] | None,
    *,
    keep_bricks: bool,
    poor_below: float | Mapping[str, float] | PoorBelow | None,
) -> Improvement:
    """`improve` a mesh of usual size."""
    start, threads = time.monotonic(), options.threads
    before = measure(mesh, threads=threads, keep_bricks=keep_bricks, poor_below=poor_below)
    if mesh.dimension == 2:
        return Improvement(*improve_shells(before, held, options, progress, should_stop))
    if options.changes_cells:

        def move(mesh: Mesh, fixed: Mask, own: Options) -> Improvement:
            return _improve(
                mesh, fixed, own, progress, should_stop, keep_bricks=keep_bricks, poor_below=before.poor_below
            )

        way = Way(move, options, progress, should_stop)
        return Improvement(*alternate(before, held, way))
    whole = whole_patch(before, options.keep, held)
    with workers(threads) as team:
        attempt = Attempting(team, start, progress, should_stop)
        bad, source = np.flatnonzero(is_to_mend(before, options.target)), WholeMesh(whole, threads)
        if options.everywhere:
            reached = repair_everywhere(source, attempt, whole, bad, options)
        else:
            reached = repair_near_bad(source, attempt, bad, options)
    return _result(reached, whole, options)


def _ceiling(patch: PatchOfMesh, whole: PatchOfMesh, worst: float) -> float:
    """The most that the worst cell could have with the points that must stay: of the whole mesh, unless it is large,
    where it is that of the patch."""
    if patch.cells is None or whole.quality.n_cells > WHOLE_UP_TO:
        return worst
    quality = whole.quality
    constraints = constraints_of(quality.mesh, quality, whole.held, (whole.region_ids, whole.region_names))
    corners = corners_of(quality)
    part = problem(
        quality.mesh, constraints.cells, (corners.cells, corners.points, corners.constants), constraints.pinned
    )
    points = np.asarray(quality.mesh.points, np.float64)[part.point_ids]
    return min(worst, ceiling(part, points, constraints.fixed[part.point_ids]).worst)


def _in_another_unit(rounding: Rounding, power: int) -> Rounding:
    """The same for coordinates that are multiplied by 2 to a power."""

    def scaled_rounding(ids: Ids, points: Points) -> Points:
        return np.ldexp(rounding(ids, np.ldexp(points, -power)), power)

    return scaled_rounding


def check_options(options: Options, floor: float | None) -> None:
    """Raise `MeshError` if an option is out of its range; ``floor`` as the user gave it."""
    if options.boundary not in BOUNDARIES:
        raise MeshError(f"boundary is {options.boundary!r}, expected one of {', '.join(BOUNDARIES)}")
    if not 0.0 <= options.target < 1.0:
        raise MeshError(f"target is {options.target}, expected a quality from 0 to below 1")
    if not 0.0 <= options.floor <= 1.0:
        raise MeshError(f"floor is {options.floor}, expected a share from 0 to 1")
    if floor is not None and not options.everywhere:
        raise MeshError("a floor is for raising the mean of all cells: it needs everywhere=True (--everywhere)")
    if not 0.0 <= options.size_change < np.inf:
        raise MeshError(f"size_change is {options.size_change}, expected a share of 0 or more")
    if options.seconds is not None and not options.seconds > 0.0:
        raise MeshError(f"seconds is {options.seconds}, expected a time above 0")
    if options.objective not in OBJECTIVES:
        raise MeshError(f"objective is {options.objective!r}, expected one of {', '.join(OBJECTIVES)}")
    if options.surface is not None and not options.slides:
        raise MeshError("a surface to slide on needs boundary='slide' (--boundary slide)")
    if options.changes_cells and options.rounding:
        raise MeshError("a rounding does not go with other cells: it is that of the places of points in a file")
    if options.tolerance is None:
        return
    if not 0.0 < options.tolerance < 1.0:
        raise MeshError(f"tolerance is {options.tolerance}, expected a share of the diagonal above 0 and below 1")
    if not options.slides:
        raise MeshError("points may leave their surface only where they slide: boundary='slide' (--boundary slide)")


def _result(reached: Reached[PatchOfMesh], whole: PatchOfMesh, options: Options) -> Improvement:
    """What was reached, with its report."""
    patch, before = reached.patch, whole.quality
    after = patch.merge(reached.quality, threads=options.threads)
    known = Known(
        patch.summaries(reached.quality, after, threads=options.threads),
        (status_counts(before), status_counts(after)),
        before.mesh.n_points,
        extent(before.mesh.points)[1],
        patch.claims(after),
        (hardness(before.mesh), hardness(after.mesh)),
    )
    report = patch_report(reached, known, options, _ceiling(patch, whole, reached.facts.limit.worst))
    given = before.source
    result = after.mesh if given is before.mesh else given.replace(points=after.mesh.points)
    return Improvement(result, before, after, report)
