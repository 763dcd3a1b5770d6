"""Hanging points: in the middle of an edge or a face of another cell, which does not know of them.

Cells refined beside coarser ones leave such points. Both sides of the place are boundary by the faces, so only faces
that one cell has are looked at; the sides hang together at the ends of the edge::

    a-------+          a-p and a-b leave a in one direction: the end of the shorter edge hangs in the longer,
    |       |          and so does what follows from p towards b
    p---+   |
    |   |   |          a point from which two edges or more lead to hanging points and corners of one face, and which is
    b-------+          inside of it, hangs in that face

Points that only coincide with the place, such as those of a body in contact, hang nowhere: no edge leads to them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..cells import CELL_TYPES
from ..look.records import brief
from ..mesh.ghosts import without_ghosts
from ..mesh.polyhedra import ragged_positions
from ..mesh.topology import BOUNDARY, Topology, topology
from ..quality.measure import Quality
from ..status import is_usable
from .points import LAST_PLACES, last_place

Ids = NDArray[np.int64]
Values = NDArray[np.float64]

TOLERANCE = 1e-4
"""Of the length of an edge (of the size of a face): how far a point that hangs may be out of it; at least as far as two
units in the last place of the stored coordinates."""


CHUNK = 1 << 14
"""Edges, or faces, looked at together: some 10 MB of coordinates."""


@dataclass(frozen=True, eq=False)
class Hanging:
    """What hangs in a mesh.

    Attributes
    ----------
    points
        ``(n,)`` ids, ascending.
    n_edges, n_faces
        Edges in which a point hangs, and faces in the inside of which one does.
    cells
        ``(m,)`` ids, ascending, of the cells with such an edge or face: the coarser ones.
    holders
        ``(k,)`` ids, ascending, of the ends of these edges and the corners of these faces.
    """

    points: Ids
    n_edges: int
    n_faces: int
    cells: Ids
    holders: Ids

    __repr__ = brief


WithEdges = Callable[[Topology, Ids], Ids]


def hanging(quality: Quality, faces: Topology | None = None) -> Hanging:
    """The hanging points of a mesh, by the faces of its solid cells that no other cell has.

    Parameters
    ----------
    quality
        Of the mesh. The faces of cells that are inverted or flat are left out: they lie over others by their shape.
    faces
        Its topology, if it is at hand.

    Notes
    -----
    Time and memory are linear in the number of these faces, but for sorting.
    """
    faces = faces if faces is not None else topology(without_ghosts(quality.mesh))
    return hanging_of(faces, is_usable(quality.status, "fv"), shared_points(faces), with_edges)


def hanging_of(
    faces: Topology,
    is_wanted: NDArray[np.bool_],
    is_shared: NDArray[np.bool_],
    cells_with: WithEdges,
    cell_ids: Ids | None = None,
) -> Hanging:
    """`hanging` of cells ``(n_cells,)`` that are wanted.

    Parameters
    ----------
    faces
        Of all cells that have such a face.
    is_wanted
        ``(n_cells,)`` cells that are not inverted or flat.
    is_shared
        ``(n_points,)`` points of two cells or more.
    cells_with
        `with_edges`, of all cells there are.
    cell_ids
        ``(n_cells,)`` what the cells are called in the result; None: by their position.
    """
    points = faces.mesh.points
    slots = _boundary(faces, is_wanted, is_shared)
    if len(slots) == 0:
        return Hanging(slots, 0, 0, slots, slots)
    is_seam = _seam(faces, slots)
    if not is_seam.any():
        return Hanging(slots[:0], 0, 0, slots[:0], slots[:0])
    ids, offsets = _rings(faces, slots)
    owner = np.repeat(np.arange(len(slots)), np.diff(offsets))
    after = ids[_following(offsets[1:])]
    codes, edge_of = np.unique(
        np.minimum(ids, after) * len(points) + np.maximum(ids, after, out=after), return_inverse=True
    )
    del after
    edges = np.stack(np.divmod(codes, len(points)), axis=1)
    del codes
    fans = _fans(edges, len(points))
    slack = LAST_PLACES * last_place(points, faces.mesh.stored)
    in_edges = _on_edges(points, edges, fans, is_seam, slack)
    at_seam = np.zeros(len(slots), np.bool_)
    at_seam[owner[is_seam[ids]]] = True
    some = at_seam[owner]
    rims = _rims(ids[some], owner[some], edge_of.reshape(-1)[some], in_edges)
    in_faces = _in_faces(points, fans, ids, offsets, rims, slack)
    broken = np.unique(in_edges[:, 0])
    split = np.unique(in_faces[:, 0])
    of_faces = faces.cells[slots[split]].astype(np.int64)
    of_faces = of_faces if cell_ids is None else cell_ids[of_faces]
    return Hanging(
        points=np.unique(np.concatenate([in_edges[:, 1], in_faces[:, 1]])),
        n_edges=len(broken),
        n_faces=len(split),
        cells=np.unique(np.concatenate([cells_with(faces, edges[broken]), of_faces])),
        holders=np.unique(np.concatenate([edges[broken].reshape(-1), ids[np.isin(owner, split)]])),
    )


def with_edges(faces: Topology, edges: Ids) -> Ids:
    """The solid cells that have some of the edges."""
    mesh = faces.mesh
    if len(edges) == 0:
        return np.empty(0, np.int64)
    is_end = np.zeros(mesh.n_points, np.bool_)
    is_end[edges] = True
    ends = np.concatenate([[0], np.cumsum(is_end[mesh.connectivity])])[mesh.offsets]
    near = np.flatnonzero((np.diff(ends) >= 2) & (np.diff(faces.starts) > 0))
    if len(near) == 0:
        return near
    slots = ragged_positions(faces.starts[near], np.diff(faces.starts)[near])
    ids, offsets = _rings(faces, slots)
    codes = _codes(np.sort(np.stack([ids, ids[_following(offsets[1:])]], axis=1), axis=1), mesh.n_points)
    owner = np.repeat(faces.cells[slots].astype(np.int64), np.diff(offsets))
    return np.asarray(owner[np.isin(codes, _codes(edges, mesh.n_points))])


def shared_points(faces: Topology) -> NDArray[np.bool_]:
    """``(n_points,)`` points of two cells with faces or more."""
    mesh = faces.mesh
    has_faces = np.diff(faces.starts) > 0
    nodes = mesh.connectivity
    if not has_faces.all():
        nodes = nodes[np.repeat(has_faces, np.diff(mesh.offsets))]
    return np.asarray(np.bincount(nodes, minlength=mesh.n_points) > 1)


def _boundary(faces: Topology, wanted: NDArray[np.bool_], is_shared: NDArray[np.bool_]) -> Ids:
    """The half-faces that no other cell has, of wanted cells that share a point with another."""
    mesh = faces.mesh
    slots = np.flatnonzero(faces.mates == BOUNDARY)
    slots = slots[wanted[faces.cells[slots]]]
    cells = faces.cells[slots].astype(np.int64)  # few, as a rule; in ascending order
    each = cells[np.diff(cells, prepend=-1) > 0]
    has_shared = np.empty(len(each), np.bool_)
    for start in range(0, len(each), CHUNK):
        some = each[start : start + CHUNK]
        firsts = mesh.offsets[some].astype(np.int64)
        sizes = mesh.offsets[some + 1] - firsts
        shares = is_shared[mesh.connectivity[ragged_positions(firsts, sizes)]]
        before = np.concatenate([[0], np.cumsum(shares, dtype=np.int32)])
        ends = np.cumsum(sizes)
        has_shared[start : start + CHUNK] = before[ends] > before[ends - sizes]
    return np.asarray(slots[has_shared[np.searchsorted(each, cells)]])


def _rings(faces: Topology, slots: Ids) -> tuple[Ids, Ids]:
    """The corners of some half-faces, and where those of each start."""
    mesh = faces.mesh
    cells = faces.cells[slots].astype(np.int64)
    local, types = slots - faces.starts[cells], mesh.types[cells]
    sizes = np.zeros(len(slots), np.int64)
    rings: list[tuple[Ids, Ids]] = []
    for vtk_id in np.flatnonzero(np.bincount(types)).tolist():
        row = CELL_TYPES[vtk_id]
        if row.shape is not None:
            for f, face in enumerate(row.shape.faces):
                at = np.flatnonzero((types == vtk_id) & (local == f))
                first = mesh.offsets[cells[at]].astype(np.int64)
                sizes[at] = len(face)
                rings.append((at, mesh.connectivity[first[:, None] + [row.corners[m] for m in face]].astype(np.int64)))
        elif mesh.polyhedra is not None:
            poly = mesh.polyhedra
            at = np.flatnonzero(types == vtk_id)
            own = poly.cell_faces[poly.cell_offsets[cells[at]] + local[at]]
            sizes[at] = poly.face_offsets[own + 1] - poly.face_offsets[own]
            for size in np.unique(sizes[at]).tolist():
                some = sizes[at] == size
                starts = poly.face_offsets[own[some]].astype(np.int64)
                rings.append((at[some], poly.face_points[starts[:, None] + np.arange(size)].astype(np.int64)))
    offsets = np.concatenate([[0], np.cumsum(sizes)])
    ids = np.empty(int(offsets[-1]), np.int64)
    for at, ring in rings:
        ids[offsets[at][:, None] + np.arange(ring.shape[1])] = ring
    return ids, offsets


def _following(ends: Ids) -> Ids:
    """For each place in rings, of which the ends are given, that of the next point around."""
    following = np.arange(1, int(ends[-1]) + 1)
    following[ends - 1] = np.concatenate([[0], ends[:-1]])
    return following


def _seam(faces: Topology, slots: Ids) -> NDArray[np.bool_]:
    """``(n_points,)`` True for points where two of some half-faces may stand back to back, as on both sides of a seam.

    Their normals are opposite, so that one of the three components is above 0.5 for one and below -0.5 for the other.
    """
    points = faces.mesh.points
    sides = np.zeros(len(points), np.uint8)  # a bit for each component and sign
    for first in range(0, len(slots), CHUNK):
        ring, own = _rings(faces, slots[first : first + CHUNK])
        with np.errstate(all="ignore"):
            x = points[ring].astype(np.float64)
            x -= np.repeat(x[own[:-1]], np.diff(own), axis=0)
            terms = np.cross(x, x[_following(own[1:])])
            normals = np.add.reduceat(terms, own[:-1], axis=0)
            normals /= np.sqrt((normals * normals).sum(axis=1, keepdims=True))
        far = np.packbits(np.concatenate([normals > 0.5, normals < -0.5], axis=1), axis=1)[:, 0]
        np.bitwise_or.at(sides, ring, np.repeat(far, np.diff(own)))
    return np.asarray(sides & (sides << 3) & 0b11100000, np.bool_)


def _fans(edges: Ids, n_points: int) -> tuple[Ids, Ids]:
    """Where the edges that leave each point start, and their other ends."""
    near = np.concatenate([edges[:, 0], edges[:, 1]])
    starts = np.concatenate([[0], np.cumsum(np.bincount(near, minlength=n_points))])
    order = np.argsort(near, kind="stable")
    del near
    return starts, np.concatenate([edges[:, 1], edges[:, 0]])[order]


def _next(fans: tuple[Ids, Ids], points: Ids) -> tuple[Ids, Ids]:
    """All points to which an edge leads from some, and from which of these."""
    starts, far = fans
    n = starts[points + 1] - starts[points]
    return np.repeat(np.arange(len(points)), n), far[ragged_positions(starts[points], n)]


def _on_edges(
    points: NDArray[np.floating], edges: Ids, fans: tuple[Ids, Ids], is_seam: NDArray[np.bool_], slack: float
) -> Ids:
    """``(n, 2)`` an edge and a point that hangs in it.

    Of all edges that leave an end of an edge, those along it are taken; then those that leave the point where such a
    one ends, and so on.
    """
    pairs = [np.empty((0, 2), np.int64)]
    for start in range(0, len(edges), CHUNK):
        some = edges[start : start + CHUNK]
        which = np.tile(np.arange(start, start + len(some)), 2)
        whole = np.concatenate([some, some[:, ::-1]])  # from, to
        may = is_seam[whole[:, 0]]
        which, whole = which[may], whole[may]
        at = whole[:, 0]
        while len(at):
            row, end = _next(fans, at)
            row, end = (
                column[_between(points, whole[row, 0], whole[row, 1], at[row], end, slack)] for column in (row, end)
            )
            whole, which, at = whole[row], which[row], end
            pairs.append(np.stack([which, at], axis=1))
    return np.unique(np.concatenate(pairs), axis=0)


def _between(points: NDArray[np.floating], a: Ids, b: Ids, after: Ids, p: Ids, slack: float) -> NDArray[np.bool_]:
    """Whether a point is on the straight line from a to b, behind the point ``after`` on it and before b."""
    with np.errstate(all="ignore"):
        origin = points[a].astype(np.float64)
        line, to_p = points[b] - origin, points[p] - origin
        square = (line * line).sum(axis=1)
        along = (line * to_p).sum(axis=1) / square
        start = (line * (points[after] - origin)).sum(axis=1) / square
        off = to_p - along[:, None] * line
        margin = np.maximum(TOLERANCE, slack / np.sqrt(square))
        is_near = (off * off).sum(axis=1) <= margin * margin * square
        return np.asarray(is_near & (along > start + margin) & (along < 1.0 - margin) & (p != b))


def _rims(ids: Ids, owner: Ids, edge_of: Ids, in_edges: Ids) -> Ids:
    """``(n, 2)`` a face, and a corner of it or a point that hangs in one of its edges."""
    starts = np.searchsorted(in_edges[:, 0], np.arange(int(edge_of.max(initial=-1)) + 2))
    n = starts[edge_of + 1] - starts[edge_of]
    hangs = np.stack([np.repeat(owner, n), in_edges[ragged_positions(starts[edge_of], n), 1]], axis=1)
    return np.concatenate([np.stack([owner, ids], axis=1), hangs])


def _in_faces(
    points: NDArray[np.floating], fans: tuple[Ids, Ids], ids: Ids, offsets: Ids, rims: Ids, slack: float
) -> Ids:
    """``(n, 2)`` a face and a point that hangs inside of it: from the rim inward, as far as edges lead."""
    rims = rims[np.argsort(rims[:, 0], kind="stable")]
    pairs = [np.empty((0, 2), np.int64)]
    n_faces = len(offsets) - 1
    bounds = np.searchsorted(rims[:, 0], np.arange(0, n_faces + CHUNK, CHUNK))
    for first, last in pairwise(bounds.tolist()):
        front = rims[first:last]
        known = _codes(front, len(points))
        while len(front):
            row, end = _next(fans, front[:, 1])
            codes = np.unique(front[row, 0] * len(points) + end)
            codes = codes[~np.isin(codes, known)]
            inner = np.stack(np.divmod(codes, len(points)), axis=1)
            front = inner[_is_inside(points, ids, offsets, inner[:, 0], inner[:, 1], slack)]
            known = np.concatenate([known, _codes(front, len(points))])
            pairs.append(front)
    return np.concatenate(pairs)


def _codes(pairs: Ids, n_points: int) -> Ids:
    return pairs[:, 0] * n_points + pairs[:, 1]


def _is_inside(
    points: NDArray[np.floating], ids: Ids, offsets: Ids, face: Ids, p: Ids, slack: float
) -> NDArray[np.bool_]:
    """Whether points are inside of faces, as far as triangles from the middle of their corners tell."""
    inside = np.zeros(len(face), np.bool_)
    sizes = np.diff(offsets)[face]
    with np.errstate(all="ignore"):
        for size in np.unique(sizes).tolist():
            at = np.flatnonzero(sizes == size)
            ring = points[ids[offsets[face[at]][:, None] + np.arange(size)]].astype(np.float64)
            middle = ring.mean(axis=1, keepdims=True)
            spokes = ring - middle
            to_p = points[p[at]] - middle[:, 0]
            after = np.roll(spokes, -1, axis=1)
            normals = np.cross(spokes, after)
            square = (normals * normals).sum(axis=2)
            scale = np.sqrt((spokes * spokes).sum(axis=2).max(axis=1))
            height = np.abs((normals * to_p[:, None]).sum(axis=2)) / np.sqrt(square)
            # Barycentric coordinates in each triangle, of the corners and the middle.
            one = (np.cross(to_p[:, None], after) * normals).sum(axis=2) / square
            two = (np.cross(spokes, to_p[:, None]) * normals).sum(axis=2) / square
            margin = np.maximum(TOLERANCE, slack / scale)[:, None]
            is_within = (one >= -margin) & (two >= -margin) & (one + two < 1.0 - margin)
            inside[at] = (is_within & (height <= margin * scale[:, None])).any(axis=1)
    return inside
