"""Improving a mesh of surface cells in a plane: points move in x and y, one at a time, until their cells are better."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial

import numpy as np

from ..errors import MeshError
from ..look.style import number_of
from ..mesh import Mesh
from ..quality.measure import Quality
from ..status import is_usable
from .acceptance import accept, is_below, is_better
from .claims import SAME_CELLS, UNCHANGED, held_text
from .constraints import Mask
from .flat_ascent import Ascent
from .flat_cells import Part, part_of
from .flat_held import Held, held_of
from .flat_report import points_of, region_areas, report_of
from .problem import Ids, Points
from .report import Claim, RepairReport
from .rounding import Rounding, accept_rounded
from .run import Progress
from .whole import Options


def improve_flat(
    before: Quality,
    fixed: Mask,
    options: Options,
    progress: Callable[[Progress], object] | None,
    should_stop: Callable[[], bool] | None,
) -> tuple[Mesh, Quality, Quality, RepairReport]:
    """The mesh that was reached, what was measured before and after, and the report.

    Raises `MeshError` for what does not go with surface cells, and if there is none in a plane that could be improved.
    """
    start, mesh = time.monotonic(), before.mesh
    where = mesh.path or "the mesh"
    _check(mesh, options)
    held, takes_part = held_of(before, fixed, options)
    if not takes_part.any():
        raise MeshError(f"{where}: no surface cell with straight edges that could be improved")
    given = np.asarray(mesh.points, np.float64)
    part = part_of(mesh, takes_part)
    ascent = Ascent(part, ~held.fixed, options, given, start, progress, should_stop)
    ascent.record("start", given)
    points = np.ascontiguousarray(given).copy()
    bad = is_below(before, options.target)
    if options.everywhere:
        ascent.all_of(points, np.ones(len(part.cell_ids), bool))
    elif bad.any():
        ascent.near_bad(points)
    notes, broken = [*held.notes], list[str]()
    target = None if options.everywhere else options.target
    if options.rounding:
        after, of_rounding = accept_rounded(
            before,
            points,
            [partial(_in_plane, one) for one in options.rounding],
            lambda after: is_better(after, before, target),
            strict=options.strict,
            threads=options.threads,
            sizes=ascent.sizes,
        )
        notes += of_rounding
    else:
        after, n_back = accept(before, points, strict=options.strict, threads=options.threads, sizes=ascent.sizes)
        if n_back:
            notes.append(f"{number_of(n_back, 'point was', 'points were')} put back: a cell would have paid.")
    if not is_better(after, before, target):
        after = before
    claims = _claims(before, after, held, part, options)
    if not all(one.holds for one in claims):
        broken = [one.text for one in claims if not one.holds]
        notes += [f"A step was taken back; else this would not hold: {text}." for text in broken]
        after = before
        claims = _claims(before, after, held, part, options)
    if after is before:
        notes.append("No better mesh was found: the mesh is as it was.")
    new = np.asarray(after.mesh.points, np.float64)
    ascent.record("end", np.ascontiguousarray(new))
    report = report_of(before, after, held, ascent, claims, tuple(notes), broken, takes_part)
    source = before.source
    moved_mesh = after.mesh if source is mesh or after is before else source.replace(points=after.mesh.points)
    return (source if after is before else moved_mesh), before, after, report


def _in_plane(rounding: Rounding, ids: Ids, points: Points) -> Points:
    """Rounded, but where they were in z."""
    rounded = rounding(ids, points)
    rounded[:, 2] = points[:, 2]
    return rounded


def _check(mesh: Mesh, options: Options) -> None:
    where = mesh.path or "the mesh"
    if not mesh.up:
        raise MeshError(f"{where}: surface cells in space are not improved, only those in a plane of constant z")
    for is_given, name in (
        (options.topology, "--topology"),
        (options.split_hopeless, "--split-hopeless"),
        (options.slides, "--boundary slide"),
        (mesh.purpose == "fv", "--for fv"),
    ):
        if is_given:
            raise MeshError(f"{where}: {name} is for solid cells, and the cells here are surface cells")


def _claims(before: Quality, after: Quality, held: Held, part: Part, options: Options) -> tuple[Claim, ...]:
    old, new = points_of(before), points_of(after)
    lost = _n_lost(before, after)
    worst = float(np.nanmin(before.values)), float(np.nanmin(after.values))
    areas = region_areas(held, part, old), region_areas(held, part, new)
    total = float(np.abs(part.sizes(old)[0]).sum())
    claims = [
        Claim(
            "fixed",
            old[held.fixed].tobytes() == new[held.fixed].tobytes(),
            held_text(int(np.count_nonzero(held.fixed))),
        ),
        Claim("plane", old[:, 2].tobytes() == new[:, 2].tobytes(), "z of all points is what it was, to the last bit"),
        Claim("valid", not lost, "no cell that was valid is invalid, inside too"),
        Claim("worst", worst[1] >= worst[0] - 1e-12, "the worst quality has not fallen"),
        Claim("topology", np.array_equal(before.mesh.connectivity, after.mesh.connectivity), SAME_CELLS),
        Claim(
            "area",
            bool((np.abs(areas[1] - areas[0]) <= UNCHANGED * total).all()),
            "the area of each region is unchanged",
        ),
    ]
    if options.strict:
        with np.errstate(invalid="ignore"):
            fell = after.values < before.values - 1e-12
        claims.append(Claim("strict", not fell.any(), "no cell has less than it began with"))
    return tuple(claims)


def _n_lost(before: Quality, after: Quality) -> int:
    """Cells that were of use and are not."""
    return int(np.count_nonzero(is_usable(before.status) & ~is_usable(after.status)))
