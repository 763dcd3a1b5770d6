"""What is promised of a repair that makes other cells, checked on the mesh given and on the one reached."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..doctor.points import extent
from ..mesh import Mesh
from ..mesh.topology import OPPOSITE, Topology, topology
from ..quality.measure import Quality
from ..status import is_usable
from .acceptance import SAME, n_unusable
from .claims import UNCHANGED, held_text, within
from .constraints import Constraints
from .deviation import deviation
from .faces import face_points
from .kept import kept_regions
from .report import Claim
from .surface import surface_of
from .target import target_surface
from .volumes import KEPT, cone_volumes
from .whole import Options

Ids = NDArray[np.int64]


def claims(
    before: Quality, constraints: Constraints, after: Quality, old_points: Ids, old_cells: Ids, options: Options
) -> tuple[Claim, ...]:
    """What is promised of a mesh with other cells, each with whether it holds.

    Parameters
    ----------
    before, constraints
        Of the mesh given.
    after
        Of the other.
    old_points, old_cells
        Which of the first each point and cell of the other is, -1 if it is new.
    options
        With which it was made.
    """
    old, new = before.mesh, after.mesh
    held = np.flatnonzero(constraints.pinned if options.slides else constraints.fixed)
    place = np.full(old.n_points, -1, np.int64)
    place[old_points[old_points >= 0]] = np.flatnonzero(old_points >= 0)
    was = np.asarray(old.points, np.float64)[held]
    now = np.where((place[held] >= 0)[:, None], np.asarray(new.points, np.float64)[place[held]], np.inf)
    stays = old_cells >= 0
    of_old = old_cells[stays]
    usable = is_usable(before.status, old.purpose), is_usable(after.status, new.purpose)
    lost = bool((usable[0][of_old] & ~usable[1][stays]).any())
    worst = standing(before)[0], standing(after)[0]
    faces = constraints.topology, topology(new)
    regions_of = constraints.region_ids, kept_regions(new, options.keep)[0]
    names = np.arange(old.n_points), np.where(old_points < 0, old.n_points + np.arange(new.n_points), old_points)
    volumes, volumes_now = (_volumes(*one) for one in zip(faces, regions_of, (old.points, new.points), strict=True))
    most = _most_change(volumes, constraints, options)
    is_same = len(volumes) == len(volumes_now) and bool((np.abs(volumes - volumes_now) <= most).all())
    faults = [_n_faults(one) for one in faces]
    kept = [
        _equal(*(_faces(*one, between_regions=between) for one in zip(faces, names, regions_of, strict=True)))
        for between in (False, True)
    ]
    changed = f"has changed by at most {100 * KEPT:g} %" if options.slides else "is unchanged"
    result = [
        Claim("fixed", was.tobytes() == now.tobytes(), held_text(len(held))),
        Claim(
            "valid",
            not lost and n_unusable(after) <= n_unusable(before),
            "no cell that was valid is invalid, inside too, nor are there more invalid cells than before",
        ),
        Claim("worst", worst[1] >= worst[0] - SAME, "the worst quality has not fallen"),
        Claim("boundary", kept[0], "the faces of the boundary are the same"),
        Claim(
            "conformity",
            faults[1] <= faults[0],
            "no more faces than before are of three cells, or have two on one side",
        ),
    ]
    # Cells that overlap have no volume that stays, nor have regions that are moved onto another surface.
    if not faults[0] and np.isfinite(most).any():
        result.append(Claim("volume", is_same, f"the volume, also of each region, {changed}"))
    if len(volumes) > 1:
        result.append(Claim("interfaces", kept[1], "the faces between regions are the same"))
    if options.tolerance is not None:
        points = points_now(old, new, old_points)
        result += within(deviation_from(constraints, old, points, options)[0], options.tolerance, extent(old.points)[1])
    if options.strict:
        with np.errstate(invalid="ignore"):
            fell = bool((after.values[stays] < before.values[of_old] - SAME).any())
        result.append(Claim("strict", not fell, "no cell that stays has less than it began with"))
    return tuple(result)


def _most_change(volumes: NDArray[np.float64], constraints: Constraints, options: Options) -> NDArray[np.float64]:
    """``(n_regions,)`` by how much the volume of each may change; infinite if a surface that is given decides that."""
    most = np.full(len(volumes), UNCHANGED * float(np.abs(volumes).sum()))
    if options.slides:
        most += KEPT * np.abs(volumes)
    if options.surface is not None:
        faces = constraints.topology
        most[constraints.region_ids[faces.cells[faces.mates < 0]]] = np.inf
    return most


def points_now(old: Mesh, new: Mesh, old_points: Ids) -> NDArray[np.float64]:
    """``(n_points, 3)`` of the mesh given: where its points are now; where they were, if they are gone."""
    points, same = np.array(old.points, np.float64), old_points >= 0
    points[old_points[same]] = np.asarray(new.points, np.float64)[same]
    return points


def deviation_from(
    constraints: Constraints, old: Mesh, points: NDArray[np.float64], options: Options
) -> tuple[float, float]:
    """The largest and the mean distance of the boundary of the mesh given from the same faces, points elsewhere."""
    if not options.slides or np.array_equal(points, old.points):
        return 0.0, 0.0
    was = np.asarray(old.points, np.float64)
    surface = surface_of(constraints, was, options.feature_angle)
    if options.surface is not None:
        surface = target_surface(surface, options.surface, was)
    apart = deviation(surface, points, is_given=options.surface is not None)
    return apart.largest, apart.mean


def _n_faults(faces: Topology) -> int:
    """Faces of three cells or more, and those of two cells that lie on the same side of it."""
    return faces.n_multiple + len(faces.pairs()) - len(faces.pairs(OPPOSITE))


def _volumes(faces: Topology, region_ids: Ids, points: NDArray[np.floating]) -> NDArray[np.float64]:
    """``(n_regions,)`` the sum of the signed volumes of the cells of each region, not of what its boundary encloses."""
    volumes = cone_volumes(faces, np.arange(len(faces.cells)), points)
    out = np.zeros(int(region_ids.max(initial=-1)) + 1)
    np.add.at(out, region_ids[faces.cells], volumes)
    return out


def _faces(faces: Topology, names: Ids, region_ids: Ids, *, between_regions: bool) -> Ids:
    """Faces of the boundary or between regions: their points by the names given, ascending, filled up with -1."""
    if between_regions:
        pairs, region = faces.pairs(), region_ids[faces.cells]
        slots = pairs[region[pairs[:, 0]] != region[pairs[:, 1]], 0]
    else:
        slots = np.flatnonzero(faces.mates < 0)
    points, offsets = face_points(faces, slots)
    sizes = np.diff(offsets)
    rows = np.full((len(slots), int(sizes.max(initial=3))), -1, np.int64)
    owner = np.repeat(np.arange(len(slots)), sizes)
    rows[owner, np.arange(len(points)) - offsets[owner]] = names[points]
    return np.sort(rows, axis=1)


def _equal(a: Ids, b: Ids) -> bool:
    """True if two tables have the same rows, in whatever order."""
    if a.shape != b.shape:
        return False
    tables = (np.unique(table, axis=0, return_counts=True) for table in (a, b))
    return all(np.array_equal(x, y) for x, y in zip(*tables, strict=True))


def standing(quality: Quality) -> tuple[float, float]:
    """The worst and the mean."""
    return float(np.nanmin(quality.values)), float(np.nanmean(quality.values))
