"""What points of surface cells slide on: the surface that the mesh was, its features, and the curves of its edges."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...cells import CellType
from ...doctor import shells
from ...mesh import Mesh
from ...mesh.connectivity import pick
from ...quality.measure import Quality
from ..acceptance import Limits
from ..constraints import Mask
from ..curved import between, can_follow, ring_of
from ..deviation import deviation, faces_of_triangles, furthest_of_faces
from ..features import kept_points, line_cells
from ..problem import Ids, Points
from ..projection import Projection, unit
from ..surface import CORNER, EDGE, FACE, INSIDE, Faces, Surface, assemble, faces_of, parted
from .cells import Part
from .held import Held

APART = 0.2
"""How far a cell may be from the surface that was, and that from the cells, in mean edges of the cell."""

THIN = 0.3
"""Height over longest edge below which a cell is too thin for its normal to say where a sharp edge is."""

EMPTY = (
    np.empty((0, 3)), np.empty((0, 3), np.int64), np.empty(0, np.int64), np.empty((0, 3, 3)), np.empty(0, np.int64),
    np.empty(0, np.int64),
)  # fmt: skip
"""What kernels take where nothing slides."""


@dataclass(frozen=True, eq=False)
class Track:
    """What there is to slide on.

    Attributes
    ----------
    part
        The cells that take part.
    surface
        Made of all surface cells as they were. In a plane only its curves are slid on.
    kind
        ``(n_points,)``: `CORNER` for points that stay, `EDGE`, `FACE`; `INSIDE` for those that are free in their plane.
    faces, flips
        ``(n,)`` of the cells that take part: the face that each was, and -1 where that runs the other way round.
    size
        ``(n,)`` mean edges of these cells.
    """

    part: Part
    surface: Surface
    kind: NDArray[np.uint8]
    faces: Ids
    flips: Points
    size: Points
    _known: dict[str, tuple[Points, Mask]] = field(default_factory=dict)

    @property
    def arrays(self) -> tuple[Points, Ids, Ids, Points, Ids, Ids]:
        """As the kernels take it."""
        return self.surface.projection.arrays

    def items(self, free: Mask) -> Ids:
        """``(n_points,)`` the item that each free point slides on, -1: it moves in its plane, or not at all."""
        slides = free & ((self.kind == EDGE) | (self.kind == FACE))
        return np.where(slides, self.surface.item, -1)

    def projected(self, points: Points, ids: Ids) -> Points:
        """Points with some of them put where they belong on what they slide on."""
        out = points.copy()
        if len(ids):
            out[ids], _ = self.surface.projection.nearest(points[ids], self.surface.item[ids].copy())
        if self.part.up:
            out[:, 2] = points[:, 2]
        return out

    def axes(self, points: Points, items: Ids) -> Points:
        """``(n_points, 2, 3)`` the directions in which each point may move; the second is 0 along a curve."""
        out = np.zeros((len(points), 2, 3))
        out[:, 0, 0] = out[:, 1, 1] = 1.0
        ids = np.flatnonzero(items >= 0)
        _, along = self.surface.projection.nearest(points[ids], items[ids].copy())
        is_edge = self.kind[ids] == EDGE
        out[ids[is_edge]] = np.stack([along[is_edge], np.zeros_like(along[is_edge])], axis=1)
        normal = along[~is_edge]
        # Two directions at right angles to the normal, from the axis that is furthest from it.
        aside = np.eye(3)[np.abs(normal).argmin(axis=1)]
        one = np.cross(normal, aside)
        one /= np.maximum(np.linalg.norm(one, axis=1, keepdims=True), 1e-300)
        out[ids[~is_edge]] = np.stack([one, np.cross(normal, one)], axis=1)
        return out

    def normals(self, points: Points) -> Points:
        """``(n, 3)`` of the surface that was under the middle of each cell, on the side of its own normal; in space."""
        part, starts = self.part, self.part.cells[:-1]
        middles = np.add.reduceat(points[part.ring], starts) / np.diff(part.cells)[:, None]
        _, normals = self.surface.facets.nearest(middles, self.under)
        return np.asarray(normals * self.flips[:, None])

    def has_turned(self, points: Points) -> Mask:
        """``(n,)`` True for cells that have turned away from the surface under them."""
        if self.part.up:
            return np.zeros(len(self.faces), bool)
        return np.asarray(np.einsum("nx,nx->n", self.part.normals(points), self.normals(points)) <= 0.0) & ~self.turned

    @cached_property
    def under(self) -> Ids:
        """``(n,)`` the item under the middle of each cell, where it was last looked for."""
        return np.array(self.surface.face_items[self.faces])

    @cached_property
    def turned(self) -> Mask:
        """``(n,)`` True for cells that were so from the beginning, or have no normal."""
        facets = self.surface.facets
        given = facets.points[: len(self.kind)]
        return np.asarray(np.einsum("nx,nx->n", self.part.normals(given), self.normals(given)) <= 0.0)

    def is_apart(self, points: Points) -> Mask:
        """``(n,)`` True for cells that are too far from the surface that was, or that from them; in a plane none is."""
        if self.part.up:
            return np.zeros(len(self.faces), bool)
        known = self._known.get("points")
        if known is None or not np.array_equal(known[0], points):  # asked for twice of what is accepted
            far = furthest_of_faces(self.surface, points)[self.faces] > APART * self.size
            known = self._known["points"] = points.copy(), far
        return known[1].copy()

    def deviation(self, points: Points) -> tuple[float, float]:
        """The largest and the mean distance of the surfaces; in a plane that of the curves."""
        largest, mean = _between_curves(self.surface, points)
        if self.part.up:
            return largest, mean
        found = deviation(self.surface, points, is_given=False)
        return max(largest, found.largest), found.mean


@dataclass(frozen=True, eq=False)
class OnTrack:
    """Sizes that good cells keep, and the surface that all do: see `acceptance.Limits`."""

    sizes: Limits
    track: Track

    def passed(self, points: Points) -> Mask:
        """``(n_cells,)`` of the mesh."""
        out, part = self.sizes.passed(points), self.track.part
        if not part.up:
            far = self.track.is_apart(points)
            # The surface that was may be far from what cells beside have become.
            far |= part.grow(far, 1, len(points)) & self._has_moved(points)
            out[part.cell_ids[far | self.track.has_turned(points)]] = True
        return out

    def _has_moved(self, points: Points) -> Mask:
        part = self.track.part
        moved = (points != self.track.surface.facets.points[: len(points)]).any(axis=1)
        return np.asarray(np.logical_or.reduceat(moved[part.ring], part.cells[:-1]))


def track_of(before: Quality, held: Held, part: Part, feature_angle: float, around: Mask | None = None) -> Track:
    """What there is to slide on in a mesh of surface cells; ``around``: made of these alone, ``(n_cells,)``.

    Features are the edges that not two cells have, those between regions and between line cells of different ones, in
    space also those at which cells meet at more than the angle, or that have no two sides. A point where features meet
    or turn stays, and so does what hangs on an edge, with the ends of that.
    """
    mesh, points = before.mesh, np.ascontiguousarray(before.mesh.points, np.float64)
    turned = shells.orientation(held.edges, before).cells
    cells, ids, offsets, inside = _rings(mesh, np.empty(0, np.int64) if mesh.up else turned, around)
    faces = faces_of(ids, offsets, inside, points)
    if mesh.up:  # there are no sharp edges in a plane, whichever way a cell runs
        faces = replace(faces, normals=np.tile([0.0, 0.0, 1.0], (len(cells), 1)))
    else:
        limit = float(np.cos(np.radians(feature_angle)))
        faces = replace(faces, normals=_steadied(faces, cells, held.edges, points, limit))
    label = held.region_ids[cells]
    lines, of_lines = line_cells(mesh)

    def of_edges(edges: Ids) -> Ids:
        rows = np.sort(np.concatenate([lines, edges]), axis=1)
        group = np.unique(rows, axis=0, return_inverse=True)[1].reshape(-1)
        region = np.full(int(group.max(initial=-1)) + 1, -1)
        region[group[: len(lines)]] = held.region_ids[of_lines]
        return np.asarray(region[group[len(lines) :]], np.int64)

    parts = parted(points, faces, label, lines, feature_angle, of_edges)
    hanging, holders = shells.joints(mesh, held.edges)
    parts.kind[np.concatenate([hanging, holders.reshape(-1)])] = CORNER
    parts.kind[kept_points(mesh) | held.pinned] = CORNER
    surface = assemble(points, faces, parts, np.stack([label, np.full(len(label), -1)], axis=1), label)
    surface = _facing(surface, faces)
    kind = surface.kind.copy()
    if mesh.up:
        kind[kind == FACE] = INSIDE
    face_of = np.full(mesh.n_cells, -1)
    face_of[cells] = np.arange(len(cells))
    flips = np.ones(mesh.n_cells)
    flips[turned] = -1.0
    sizes = np.diff(part.cells)
    mean = np.add.reduceat(part.edge_lengths(points), part.cells[:-1]) / sizes
    return Track(part, surface, kind, face_of[part.cell_ids], flips[part.cell_ids], mean)


def _facing(surface: Surface, faces: Faces) -> Surface:
    """The same with the normals at all triangles of a face on its own side: of a quad that is re-entrant, or warped,
    the triangles from its middle may lie the other way round."""
    axes = surface.facets.axes.copy()
    own = faces.normals[faces_of_triangles(surface)]
    backwards = np.einsum("imx,ix->im", axes[: len(own)], own) < 0.0
    axes[: len(own)][backwards] *= -1.0
    return replace(
        surface, facets=replace(surface.facets, axes=axes), projection=replace(surface.projection, axes=axes)
    )


def _rings(mesh: Mesh, turned: Ids, around: Mask | None) -> tuple[Ids, Ids, Ids, Ids]:
    """Surface cells; points around each, one after another, of the turned ones backwards; where each begins, and
    the node inside it."""
    cells, rings, sizes, inside = [], [], [], []
    for row, _, some in mesh.groups():
        if row is None or row.shape is None or row.dimension != 2:
            continue
        ids = np.arange(mesh.n_cells)[some]
        ids = ids if around is None else ids[around[ids]]
        ring = _ring(row)
        cells.append(ids)
        rings.append(pick(mesh, row, ids, ring).reshape(-1))
        sizes.append(np.full(len(ids), len(ring)))
        own = [node for node in between(row) if node not in ring] if can_follow(row) else []
        inside.append(pick(mesh, row, ids, (own[0],))[:, 0] if len(own) == 1 else np.full(len(ids), -1))
    of_cells = np.concatenate(cells)
    offsets = np.concatenate([[0], np.cumsum(np.concatenate(sizes))])
    ids = np.concatenate(rings).astype(np.int64)
    owner, place = np.repeat(np.arange(len(of_cells)), np.diff(offsets)), np.arange(len(ids))
    is_turned = np.isin(of_cells, turned)[owner]
    ids = ids[np.where(is_turned, offsets[owner] + offsets[owner + 1] - 1 - place, place)]
    return of_cells, ids, offsets, np.concatenate(inside).astype(np.int64)


def _steadied(faces: Faces, cells: Ids, edges: shells.Edges, points: Points, limit: float) -> Points:
    """``(n, 3)`` normals of the faces; of thin ones that of what they lie in, where those beside them agree on it."""
    x, y = points[faces.ids], points[faces.ids[faces.following]]
    longest = np.maximum.reduceat(np.linalg.norm(y - x, axis=1), faces.offsets[:-1])
    origin = np.repeat(x[faces.offsets[:-1]], np.diff(faces.offsets), axis=0)
    twice = np.linalg.norm(np.add.reduceat(np.cross(x - origin, y - origin), faces.offsets[:-1]), axis=1)
    thin = twice < THIN * longest**2
    face_of = np.full(int(edges.cells.max(initial=0)) + 1, -1)
    face_of[cells] = np.arange(len(cells))
    half = np.flatnonzero(edges.windings != 0)
    own, other = face_of[edges.cells[half]], face_of[edges.cells[edges.mates[half]]]
    some = (own >= 0) & (other >= 0) & thin[own] & ~thin[other]
    own, beside, weights = own[some], faces.normals[other[some]], twice[other[some]]
    mean = np.zeros_like(faces.normals)
    np.add.at(mean, own, beside * weights[:, None])
    mean = unit(mean)
    agrees = np.bincount(own, minlength=len(cells)) > 1
    agrees[own[np.einsum("nx,nx->n", mean[own], beside) < np.sqrt(0.5 * (1.0 + limit))]] = False
    return np.where(agrees[:, None], mean, faces.normals)


def _ring(row: CellType) -> tuple[int, ...]:
    assert row.shape is not None
    if not row.is_curved or not can_follow(row):
        return tuple(row.corners)
    return ring_of(row, tuple(range(row.shape.n_nodes)))


def _between_curves(surface: Surface, points: Points) -> tuple[float, float]:
    """The largest and the mean distance between curves that were and those that are, of those with points that moved,
    from either side."""
    facets = surface.facets
    segments = np.flatnonzero(facets.is_segment)
    ends = facets.items[segments][:, :2]
    old = facets.points
    n = len(points)
    moved = (points[ends] != old[ends]).any(axis=(1, 2))
    moved = np.isin(facets.groups[segments], facets.groups[segments[moved]])
    segments, ends = segments[moved], ends[moved]
    if not len(segments):
        return 0.0, 0.0
    vertices = old.copy()
    vertices[:n] = points
    largest, mean = 0.0, 0.0
    for source, target in ((points, facets), (old, replace(facets, points=vertices))):
        far, length = _distances(source[ends], segments, target)
        largest, mean = max(largest, float(far.max())), max(mean, float(np.average(far.mean(axis=0), weights=length)))
    return largest, mean


def _distances(ends: Points, segments: Ids, target: Projection) -> tuple[Points, Points]:
    """``(17, n)`` of places along some segments from a projection; and ``(n,)`` how long they are."""
    shares = np.linspace(0.0, 1.0, 17)[:, None, None]
    places = ((1.0 - shares) * ends[:, 0] + shares * ends[:, 1]).reshape(-1, 3)
    near, _ = target.nearest(places, np.tile(segments, len(shares)))
    return np.linalg.norm(near - places, axis=1).reshape(len(shares), -1), np.linalg.norm(
        ends[:, 1] - ends[:, 0], axis=1
    )
