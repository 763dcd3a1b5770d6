"""The cells around bad ones as a mesh of their own, so that a repair costs what is bad, not what is there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..mesh import Mesh
from ..mesh.cast import frozen
from ..mesh.interface import is_interface
from ..quality.measure import JENS, Quality
from ..quality.summary import Summary, summarise, summarise_nothing
from .components import components
from .constraints import Mask, shared_with_pieces
from .faces import mask_of
from .kept import kept_regions
from .problem import Ids, Points
from .remeasure import LARGE, cells_at, measured_alike, merged, nodes_of, remeasured
from .report import Claim
from .rounding import Rounding

CHUNK = 1 << 20
"""Cells that are summarised at a time."""

RINGS = (0, 5)
"""Cells around bad ones whose points may move, at first and at last; a patch has those around them, too, which stay."""


@dataclass(frozen=True, eq=False)
class Patch:
    """Some cells of a mesh with all that is at the points that may move.

    Attributes
    ----------
    quality
        What was measured on the patch; on the mesh itself if all cells are in it.
    cells, points
        ``(n_cells,)`` and ``(n_points,)`` of the patch: which of the mesh they are; None if it is the mesh itself.
    pinned
        ``(n_points,)`` of the patch, points that stay: those at cells that are not near bad ones.
    held
        ``(n_points,)`` of the patch, points that the user wants to stay.
    region_ids, region_names
        ``(n_cells,)`` the region of each cell as the mesh has it, and the names of all.
    """

    quality: Quality
    cells: Ids | None
    points: Ids | None
    pinned: Mask
    held: Mask
    region_ids: Ids
    region_names: tuple[str, ...]

    @property
    def free(self) -> Ids:
        """Points of the mesh that are not pinned."""
        free = np.flatnonzero(~self.pinned)
        return free if self.points is None else self.points[free]

    def taking(self, other: Patch, reached: Quality, *, threads: int | None) -> Quality:
        """What would be measured of this patch with its points where another has them by then."""
        if other is self or reached is other.quality:
            return reached if other is self else self.quality
        mesh = self.quality.mesh
        places = np.asarray(reached.mesh.points, np.float64)
        if other.points is None:
            points = places if self.points is None else places[self.points]
        else:
            points = np.array(mesh.points, np.float64)
            here, there = self._places_of(other.points)
            points[here] = places[there]
        return remeasured(self.quality, points, threads=threads)

    def _places_of(self, points: Ids) -> tuple[Ids, Ids]:
        """Of some points of the mesh, ascending, those that are in the patch: which of it, and which of them."""
        if self.points is None:
            return points, np.arange(len(points))
        at = np.minimum(np.searchsorted(self.points, points), len(self.points) - 1)
        known = np.flatnonzero(self.points[at] == points)
        return at[known], known

    def part(self, cells: Ids) -> Patch:
        """Some cells of it, ascending, as a patch of the mesh."""
        quality = self.quality
        mesh = quality.mesh[cells]
        points = np.unique(nodes_of(quality.mesh, cells)).astype(np.int64)
        return Patch(
            measured_alike(quality, mesh, threads=1),
            cells if self.cells is None else self.cells[cells],
            points if self.points is None else self.points[points],
            self.pinned[points],
            self.held[points],
            self.region_ids[cells],
            self.region_names,
        )

    def of_points(self, values: Mask) -> Mask:
        """``(n_points,)`` of the mesh for the points of the patch."""
        return values if self.points is None else values[self.points]

    def rounding(self, whole: tuple[Rounding, ...]) -> tuple[Rounding, ...]:
        """Those of the mesh for ids of points of the patch."""
        points = self.points
        return whole if points is None else tuple(partial(_of_part, one, points) for one in whole)

    def ids(self, chosen: Mask) -> Ids:
        """The cells of the mesh that some of the patch are; ``chosen`` is ``(n_cells,)`` of the patch."""
        return np.flatnonzero(chosen) if self.cells is None else self.cells[chosen]

    def cell(self, cell: int) -> int:
        """The cell of the mesh that one of the patch is."""
        return cell if self.cells is None else int(self.cells[cell])


@dataclass(frozen=True, eq=False)
class PatchOfMesh(Patch):
    """A patch of a mesh that is there as a whole; ``whole`` is what was measured on the mesh given."""

    whole: Quality

    def merge(self, quality: Quality, *, threads: int | None) -> Quality:
        """The quality of the mesh with the patch as it was measured after a repair."""
        if quality is self.quality:
            return self.whole
        if self.cells is None or self.points is None:
            return quality
        whole = self.whole
        points = np.array(whole.mesh.points, np.float64)
        points[self.points] = quality.mesh.points
        mesh = whole.mesh.replace(points=frozen(points))
        if whole.polyhedra is not None:
            return measured_alike(whole, mesh, threads=threads)
        return merged(whole, mesh, self.cells, quality)

    def summaries(self, part: Quality, after: Quality, *, threads: int | None) -> tuple[Summary, Summary]:
        """Those of the mesh before and after a repair; ``part`` is the patch as it was measured then."""
        whole = self.whole
        if self.cells is None or whole.polyhedra is not None:
            return whole.summary(threads=threads), after.summary(threads=threads)
        others = self._summary_of_others(self.cells)
        return others + self.quality.summary(threads=threads), others + part.summary(threads=threads)

    def _summary_of_others(self, cells: Ids) -> Summary:
        """That of the cells that are not in the patch."""
        whole = self.whole
        there = ~mask_of(whole.n_cells, cells)
        if (interface := is_interface(whole.mesh)) is not None:
            there &= ~interface
        total = summarise_nothing(self.quality.summary())
        for start in range(0, whole.n_cells, CHUNK):
            part = slice(start, start + CHUNK)
            here = there[part]
            total += summarise(
                whole.values[part][here],
                whole.status[part][here],
                whole.mesh.types[part][here],
                whole.rows[JENS],
                purpose=whole.mesh.purpose,
            )
        return total

    def claims(self, after: Quality) -> tuple[Claim, ...]:
        """What is promised of the mesh outside the patch, and whether it holds of the mesh after a repair."""
        if self.points is None:
            return ()
        old, new = (np.asarray(one.mesh.points, np.float64).view(np.int64) for one in (self.whole, after))
        changed = np.flatnonzero((old != new).reshape(-1)) // 3
        holds = bool(np.isin(changed, self.points).all())
        n = len(old) - len(self.points)
        return (
            Claim("elsewhere", holds, f"all {n:,} points away from bad cells are where they were, to the last bit"),
        )


def places_among(some: Ids | None, ids: Ids) -> Ids:
    """Where ids stand among some, ascending, that have them all; None: among all of the mesh."""
    return ids if some is None else np.searchsorted(some, ids)


def _of_part(rounding: Rounding, points: Ids, ids: Ids, coordinates: Points) -> Points:
    return rounding(points[ids], coordinates)


def whole_patch(quality: Quality, keep: Sequence[str] = (), held: Mask | None = None) -> PatchOfMesh:
    """All of a mesh, no point pinned; ``keep`` as for `kept_regions`, ``held`` points that the user wants to stay."""
    ids, names = kept_regions(quality.mesh, keep)
    none = np.zeros(quality.mesh.n_points, bool)
    return PatchOfMesh(quality, None, None, none, none if held is None else held, ids, names, quality)


def patch_around(
    whole: PatchOfMesh,
    bad: Mask,
    *,
    is_whole: bool,
    threads: int | None,
    rings: int = RINGS[-1],
    beside: Patch | None = None,
) -> PatchOfMesh:
    """The cells near some bad ones.

    Parameters
    ----------
    whole
        All of the mesh.
    bad
        ``(n_cells,)``.
    is_whole
        True if the patch is to be the whole mesh, with all points pinned that are not near bad cells.
    threads
        As for `measure`.
    rings
        Of cells around them whose points may move.
    beside
        Another patch, whose cells and points are in this one too.
    """
    quality, mesh = whole.whole, whole.whole.mesh
    cells, touched = cells_around(mesh, bad, rings + 1)
    if beside is not None:
        touched[beside.free] = True
        cells = np.arange(mesh.n_cells) if beside.cells is None else np.union1d(cells, beside.cells)
    if mesh.purpose == "fv":  # faces of all cells whose points move, with the cells beyond them
        cells = cells_at(mesh, mask_of(mesh.n_points, nodes_of(mesh, cells)))
    if is_whole or len(cells) > LARGE * mesh.n_cells:
        return replace(whole, pinned=~touched)
    used = mask_of(mesh.n_points, nodes_of(mesh, cells))
    if mesh.is_ghost is not None:
        touched &= ~shared_with_pieces(mesh, mesh.is_ghost)
    part, points = mesh[cells], np.flatnonzero(used)
    measured = measured_alike(quality, part, threads=threads)
    pinned, held, region_ids = ~touched[points], whole.held[points], whole.region_ids[cells]
    return PatchOfMesh(measured, cells, points, pinned, held, region_ids, whole.region_names, quality)


def back_near(before: Quality, reached: Quality, near: Mask, *, threads: int | None) -> Quality:
    """What was reached, without what was done near some points: groups of points that moved go back as a whole.

    Parameters
    ----------
    before, reached
        Of the mesh given, and with points moved.
    near
        ``(n_points,)``.
    threads
        As for `measure`.
    """
    mesh = before.mesh
    old, points = (np.array(one.mesh.points, np.float64) for one in (before, reached))
    moved = np.flatnonzero((old != points).any(axis=1))
    cells = cells_at(mesh, mask_of(mesh.n_points, moved))
    nodes, owner = nodes_of(mesh, cells), np.repeat(np.arange(len(cells)), np.diff(mesh.offsets)[cells])
    place = np.searchsorted(moved, nodes)
    has_moved = np.append(moved, -1)[place] == nodes
    group = components(len(moved) + len(cells), place[has_moved], len(moved) + owner[has_moved])[: len(moved)]
    back = moved[np.isin(group, group[near[moved]])]
    points[back] = old[back]
    return remeasured(reached, points, threads=threads)


def cells_around(mesh: Mesh, some: Mask, rings: int) -> tuple[Ids, Mask]:
    """Some cells and those in rings around them, and ``(n_points,)`` the points of all but the outermost ring."""
    cells, touched = np.flatnonzero(some), np.zeros(mesh.n_points, bool)
    for _ in range(rings):
        touched[nodes_of(mesh, cells)] = True
        cells = cells_at(mesh, touched)
    return cells, touched


@dataclass(frozen=True, eq=False)
class WholeMesh:
    """A mesh of which patches are taken: a `near_bad.Source`."""

    everything: PatchOfMesh
    threads: int | None

    @property
    def n_cells(self) -> int:
        return self.everything.quality.n_cells

    def patch(self, bad: Ids, rings: int, *, is_whole: bool = False, beside: PatchOfMesh | None = None) -> PatchOfMesh:
        """See `patch_around`; ``bad`` are ids of cells."""
        mask = mask_of(self.n_cells, bad)
        return patch_around(self.everything, mask, is_whole=is_whole, threads=self.threads, rings=rings, beside=beside)

    def near(self, cells: Ids, rings: int) -> Mask:
        """``(n_points,)`` those of some cells, and of so many rings around them but the outermost."""
        return cells_around(self.everything.quality.mesh, mask_of(self.n_cells, cells), rings)[1]

    def has_room(self, n_cells: int) -> bool:
        """True: it is asked where they are repaired."""
        return True
