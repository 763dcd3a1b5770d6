"""Polyhedral cells from faces to values: drives the kernels of `links`, `nodes`, `match` and `shape` over a chunk of
cells, and resolves what they leave with `robust`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray

from ...cells import TETRA, WEDGE
from ..arrays import read_only
from ..cells import flat, robust
from . import codes
from .bend import bends

Values = NDArray[np.float64]
Ids = NDArray[np.int64]
Points = NDArray[np.float64]  # read-only
Bools = NDArray[np.bool_]


FLATTEST = 0.35
"""Above the greatest |J_S| of a node within 20° of what is flat, sin 20°."""


N_FORMS = 1 << 13
"""Different corners of a chunk that are numbered by a kernel: a table of them stays in the processor's cache."""


@dataclass(frozen=True, slots=True)
class Faces:
    """Cells as kernels take them: int64, contiguous."""

    points: Ids  #: point ids of all faces
    sizes: Ids  #: a face
    flips: NDArray[np.uint8]  #: a face; 1 if seen from inside
    counts: Ids  #: faces of each cell

    @property
    def room(self) -> int:
        """The most points that the faces of a cell have together; faces, if some cell has more of these."""
        ends = np.concatenate([[0], np.cumsum(self.sizes)])[np.concatenate([[0], np.cumsum(self.counts)])]
        return int(max(np.diff(ends).max(initial=1), self.counts.max(initial=1)))

    def of(self, cells: NDArray[np.bool_]) -> Faces:
        """Those of some cells."""
        faces = np.repeat(cells, self.counts)
        return Faces(
            self.points[np.repeat(faces, self.sizes)], self.sizes[faces], self.flips[faces], self.counts[cells]
        )


@dataclass(frozen=True)
class Links:
    """Vertex links of cells, see `links.links` and `hanging.remove`."""

    faults: Ids
    node_counts: Ids
    node_ids: Ids
    points: Points  #: of the nodes
    valences: Ids
    is_hanging: NDArray[np.uint8]
    of_faces: Ids  #: the node for each point of the faces
    nodes: Ids  #: a dart; the neighbour
    sizes: Ids
    twins: Ids
    faces: Ids  #: a dart; empty once hanging nodes were taken out

    @cached_property
    def starts(self) -> Ids:
        """First dart of each node."""
        return np.cumsum(self.valences) - self.valences

    @cached_property
    def cells(self) -> Ids:
        """The cell of each node."""
        return np.repeat(np.arange(len(self.node_counts)), self.node_counts)

    def outward(self, faces: Faces) -> Faces:
        """The faces that these are the links of, by nodes and as they are seen from outside."""
        return Faces(self.of_faces, faces.sizes, np.zeros(len(faces.sizes), np.uint8), faces.counts)


@dataclass(frozen=True, slots=True)
class Candidates:
    """Where nodes hang if cells lie beyond faces, which only the mesh knows."""

    cells: NDArray[np.bool_]  #: a cell; more nodes hang in it if cells lie beyond its faces
    faces: NDArray[np.bool_]  #: a face; whether a cell lies beyond it decides that

    def __or__(self, other: Candidates) -> Candidates:
        return Candidates(self.cells | other.cells, self.faces | other.faces)


@dataclass(frozen=True, slots=True)
class Solids:
    """Regular-faced solids as `match.match` takes them."""

    keys: NDArray[np.uint64]
    order: Ids
    darts: Ids
    nodes: Ids
    k: Values
    diagonals: Values  #: a dart; cosine of the angle between it and the next but one
    links: Links
    node: Ids


def links(points: Points, faces: Faces) -> Links:
    """Links of each cell, hanging nodes among them. Flips of faces that a cell has in mixed orientation are changed."""
    from .links import orient

    whole = _links(points, faces)
    unoriented = (whole.faults & codes.NON_ORIENTABLE) != 0
    if unoriented.any():
        orient(points, faces.points, faces.sizes, faces.flips, faces.counts, faces.room, unoriented)
        whole = _links(points, faces)
        oriented = unoriented & ((whole.faults & codes.NON_ORIENTABLE) == 0)
        whole.faults[oriented] |= codes.REORIENTED
    return whole


def inward(points: Points, faces: Faces) -> NDArray[np.bool_]:
    """``(n_faces,)`` True for a face of a closed cell that points into it, as it is given.

    Faces of a cell are turned so that neighbours agree, and then all so that the cell has a positive volume; those that
    were turned pointed inward. False for every face of a cell whose faces make no closed surface.
    """
    from .links import orient

    oriented = Faces(faces.points, faces.sizes, faces.flips.copy(), faces.counts)
    others = codes.BROKEN & ~codes.NON_ORIENTABLE
    closed = np.asarray((_links(points, faces).faults & others) == 0)
    orient(points, oriented.points, oriented.sizes, oriented.flips, oriented.counts, oriented.room, closed)
    closed &= (_links(points, oriented).faults & codes.BROKEN) == 0
    return np.asarray((oriented.flips != faces.flips) & np.repeat(closed, faces.counts))


def _links(points: Points, faces: Faces) -> Links:
    from .links import links as kernel

    n_cells, n = len(faces.counts), len(faces.points)
    faults, node_counts = np.zeros(n_cells, np.int64), np.zeros(n_cells, np.int64)
    node_ids, valences = np.empty(n, np.int64), np.empty(n, np.int64)
    node_points, face_nodes, link_nodes = np.empty((n, 3)), np.empty(n, np.int64), np.empty(n, np.int64)
    link_faces, link_sizes, link_twins = np.empty(n, np.int64), np.empty(n, np.int64), np.empty(n, np.int64)
    n_nodes, n_darts = kernel(
        points,
        faces.points,
        faces.sizes,
        faces.flips,
        faces.counts,
        faces.room,
        faults,
        node_counts,
        node_ids,
        node_points,
        valences,
        face_nodes,
        link_nodes,
        link_faces,
        link_sizes,
        link_twins,
    )
    nodes, darts = slice(0, int(n_nodes)), slice(0, int(n_darts))
    return Links(
        faults=faults,
        node_counts=node_counts,
        node_ids=node_ids[nodes],
        points=read_only(node_points[nodes]),
        valences=valences[nodes],
        is_hanging=np.zeros(int(n_nodes), np.uint8),
        of_faces=face_nodes,
        nodes=link_nodes[darts],
        sizes=link_sizes[darts],
        twins=link_twins[darts],
        faces=link_faces[darts],
    )


def without_hanging(faces: Faces, whole: Links, beyond: Ids | None = None) -> tuple[Links, Candidates]:
    """The links without hanging nodes, and the candidates for more.

    ``beyond`` says what lies beyond each face, see `codes`; None if that is not known. Without it only what a
    cell's own faces tell is taken out.
    """
    if beyond is not None:
        return _without(whole, np.ones(len(whole.node_counts), np.bool_), beyond, True)
    may = np.asarray(whole.valences == 2)
    four = np.flatnonzero(whole.valences == 4)
    may[four] = (whole.sizes[whole.starts[four][:, None] + np.arange(4)] == 4).all(axis=1)
    suspects, unknown = _any(may, whole), np.zeros(len(faces.sizes), np.int64)
    if not suspects.any():
        return whole, Candidates(suspects, unknown == 1)
    return _without(whole, suspects, unknown, False)


def candidates(faces: Faces, whole: Links, scaled_jacobian: Values) -> Candidates:
    """Cells in which more nodes might hang, by the J_S of their nodes."""
    suspects, unknown = _any(np.abs(scaled_jacobian) < FLATTEST, whole, 2), np.zeros(len(faces.sizes), np.int64)
    return _without(whole, suspects, unknown, False, 0)[1] if suspects.any() else Candidates(suspects, unknown == 1)


def _any(of_nodes: NDArray[np.bool_], of: Links, at_least: int = 1) -> NDArray[np.bool_]:
    """True for each cell that has so many nodes for which it is True."""
    return np.asarray(np.bincount(of.cells[of_nodes], minlength=len(of.node_counts)) >= at_least)


def _without(
    of: Links,
    suspects: NDArray[np.bool_],
    beyond: Ids,
    is_known: bool,
    room: int | None = None,
) -> tuple[Links, Candidates]:
    """As `without_hanging`; only suspects are looked at. If there is room for no links, there are none."""
    from .hanging import remove

    n_nodes, n = len(of.node_ids), len(of.nodes) if room is None else room
    outcome, is_hanging, valences = np.empty_like(of.faults), np.empty(n_nodes, np.uint8), np.empty(n_nodes, np.int64)
    link_nodes, link_sizes, link_twins = np.empty(n, np.int64), np.empty(n, np.int64), np.empty(n, np.int64)
    unknown_faces = np.zeros(len(beyond), np.uint8)
    darts = remove(
        of.points,
        suspects,
        beyond,
        is_known,
        unknown_faces,
        of.node_counts,
        of.valences,
        of.nodes,
        of.faces,
        of.sizes,
        of.twins,
        outcome,
        is_hanging,
        valences,
        link_nodes,
        link_sizes,
        link_twins,
    )
    links_left = Links(
        faults=of.faults | np.where(outcome & codes.REDUCED, codes.HANGING, 0),
        node_counts=of.node_counts,
        node_ids=of.node_ids,
        points=of.points,
        valences=valences,
        is_hanging=is_hanging,
        of_faces=of.of_faces,
        nodes=link_nodes[:darts],
        sizes=link_sizes[:darts],
        twins=link_twins[:darts],
        faces=of.faces[:0],
    )
    return links_left, Candidates((outcome & codes.CANDIDATE) != 0, unknown_faces == 1)


def families(of: Links, k: Values) -> tuple[Ids, NDArray[np.uint64]]:
    """Which cells are prisms and antiprisms, whose constants are written to ``k``; and one number a cell, the same for
    cells of one form."""
    from .match import families as kernel

    which, keys = np.empty(len(of.node_counts), np.int64), np.empty(len(of.node_counts), np.uint64)
    kernel(of.node_counts, of.valences, of.is_hanging, of.sizes, which, k, keys)
    return which, keys


def three_faced(of: Links, cells: Bools) -> tuple[Ids, Ids]:
    """``(n, 4)`` the different corners of three faces of some cells: the sizes of the faces, ascending, and the number
    of corners of the cell; and for each node which of them it is, -1 for one that is to be looked at otherwise."""
    from .match import three_faced as kernel

    forms, form_of = np.empty(N_FORMS, np.uint64), np.empty(len(of.valences), np.int64)
    n = kernel(of.node_counts, of.valences, of.is_hanging, of.sizes, cells, forms, form_of)
    return (forms[:n, None] >> np.array([48, 32, 16, 0], np.uint64) & np.uint64(0xFFFF)).astype(np.int64), form_of


def joined(items: NDArray[np.signedinteger], starts: Ids, sizes: Ids) -> Ids:
    """``items[start : start + size]`` of each run, one after another."""
    from .links import join

    out = np.empty(int(sizes.sum()), np.int64)
    join(items, starts, sizes, out)
    return out


def solids(points: Points, faces: Faces, k: Values) -> Solids:
    """Solids to match, from their faces and their J_S at each point; every point is a node of one solid."""
    of = links(points, faces)
    _, keys = families(of, np.empty(len(of.node_ids)))
    order = np.argsort(keys, kind="stable")
    nodes = np.concatenate([[0], np.cumsum(of.node_counts)])
    return Solids(
        keys=keys[order],
        order=order,
        darts=np.concatenate([of.starts, [len(of.nodes)]])[nodes],
        nodes=nodes,
        k=k[of.node_ids],
        diagonals=_diagonals(of),
        links=of,
        node=np.repeat(np.arange(len(of.valences)), of.valences),
    )


def _diagonals(of: Links) -> Values:
    node = np.repeat(np.arange(len(of.valences)), of.valences)
    start, valence = of.starts[node], of.valences[node]
    edges = of.points[of.nodes] - of.points[node]
    edges = edges / np.linalg.norm(edges, axis=1)[:, None]
    next_but_one = start + (np.arange(len(node)) - start + 2) % valence
    return np.asarray((edges * edges[next_but_one]).sum(axis=1))


def match(of: Links, table: Solids, k: Values, diagonals: Values | None = None) -> Ids:
    """Which solid each cell has the form of (see `match`); its constants are written to ``k``, and if wanted to
    ``diagonals``, a dart each."""
    from .match import match as kernel

    which, keys = families(of, k)
    rows = np.searchsorted(table.keys, keys)
    is_alike = table.keys[np.minimum(rows, len(table.keys) - 1)] == keys
    if not (is_alike & (which == codes.NO_SOLID)).any():
        return which  # no form of a solid: spares compiling what compares the two
    kernel(
        of.node_counts,
        of.valences,
        of.is_hanging,
        of.sizes,
        of.twins,
        keys,
        rows,
        table.keys,
        table.order,
        table.darts,
        table.nodes,
        table.links.starts,
        table.links.valences,
        table.links.sizes,
        table.links.twins,
        table.node,
        table.k,
        table.diagonals,
        which,
        k,
        np.empty(0) if diagonals is None else diagonals,
    )
    return which


def node_scaled_jacobian(of: Links) -> Values:
    """J_S at each node, sign exact; NaN at a node of a broken cell and where a coordinate is NaN or infinite.

    At a hanging node it is that of its links before it was taken out; at one of two neighbours, see `nodes`.
    """
    from .nodes import scaled_jacobian as kernel

    out = np.empty(len(of.node_ids))
    left = kernel(of.points, of.valences, of.is_hanging, of.nodes, out)
    if left:
        _resolve(of, out, np.flatnonzero(np.isnan(out) & (of.valences >= 3)))
        _resolve_on_edges(of, out, np.flatnonzero(np.isnan(out) & (of.valences == 2)))
    out[(of.valences == 2) & (of.is_hanging == 0) & ~np.isnan(out)] = 0.0
    _negate_multiple_windings(of, out)
    return out


def _resolve(of: Links, out: Values, nodes: Ids) -> None:
    """The nodes that the kernel left, by the path that is right whatever the coordinates."""
    if len(nodes) == 0:
        return
    corners, ends = triples(of, nodes)
    values = robust.node_scaled_jacobian(of.points[corners], TETRA)[:, 0]
    out[nodes] = fold(values, ends) + 0.0


def corner_signs(of: Links, scaled_jacobian: Values, *, single: bool) -> tuple[Bools, Bools]:
    """``(n_cells,)`` whether a corner is negative beyond rounding, and whether one is flat as far as can be told.

    Parameters
    ----------
    of
        As for `node_scaled_jacobian`.
    scaled_jacobian
        What that gave for the nodes.
    single
        The coordinates are stored in single precision.
    """
    is_corner = (of.is_hanging == 0) & ~np.isnan(scaled_jacobian)
    is_negative, is_flat = is_corner & (scaled_jacobian < 0.0), is_corner & (scaled_jacobian == 0.0)
    near = np.flatnonzero(is_corner & ~is_flat & (np.abs(scaled_jacobian) <= flat.LIMIT) & (of.valences >= 3))
    if len(near):
        corners, first = triples(of, near)
        signs = flat.of_corners(of.points[corners], single=single)
        has_flat = np.maximum.reduceat(signs == 0, first)
        is_negative[near[has_flat]] = np.minimum.reduceat(signs, first)[has_flat] < 0
        is_flat[near[has_flat]] = True
    return _any(is_negative, of), _any(is_flat, of)


def triples(of: Links, nodes: Ids) -> tuple[Ids, Ids]:
    """``(n, 4)`` some nodes of the links, each with three neighbours that follow one another; and their starts."""
    n_triples = np.where(of.valences[nodes] == 3, 1, of.valences[nodes])
    owner = np.repeat(np.arange(len(nodes)), n_triples)
    starts = np.cumsum(n_triples) - n_triples
    first = np.arange(len(owner)) - np.repeat(starts, n_triples)
    valence, start = of.valences[nodes][owner], of.starts[nodes][owner]
    corners = np.empty((len(owner), 4), np.int64)
    corners[:, 0] = nodes[owner]
    for turn in range(3):
        corners[:, 1 + turn] = of.nodes[start + (first + turn) % valence]
    return corners, starts


def _resolve_on_edges(of: Links, out: Values, nodes: Ids) -> None:
    """Nodes of two neighbours that the kernel left: the same with the edges scaled first."""
    if len(nodes) == 0:
        return
    here = of.points[nodes]
    ends = np.stack([of.points[of.nodes[of.starts[nodes] + i]] for i in (0, 1)], axis=1)
    out[nodes] = bends(here, ends)


def _negate_multiple_windings(of: Links, out: Values) -> None:
    """Turn the sign of nodes of five neighbours or more whose link goes around more than once."""
    nodes = np.flatnonzero((of.valences >= 5) & (out > 0.0))
    if len(nodes):
        from .nodes import winds_once

        once = np.empty(len(nodes), np.uint8)
        winds_once(of.points, nodes, of.starts[nodes], of.valences[nodes], once, of.nodes)
        out[nodes] = np.where(once == 1, out[nodes], -out[nodes])


def shapes(points: Points, faces: Faces, faults: Ids, unit: float = 2.0**-53) -> Ids:
    """Bits of `shape` for each cell; ``unit`` is the relative rounding of the stored coordinates."""
    from .shape import shapes as kernel
    from .shape import star_shaped

    out = np.empty(len(faces.counts), np.int64)
    kernel(points, faces.points, faces.sizes, faces.flips, faces.counts, faces.room, unit, out)
    is_broken = (faults & codes.BROKEN) != 0
    unseen = ((out & codes.UNSEEN) != 0) & ~is_broken
    if unseen.any():
        some = faces.of(unseen)
        is_star_shaped = np.empty(len(some.counts), np.bool_)
        star_shaped(points, some.points, some.sizes, some.flips, some.counts, some.room, is_star_shaped)
        out[unseen] |= np.where(is_star_shaped, codes.STAR_SHAPED, 0)
    return np.where(is_broken, out & ~codes.STAR_SHAPED, out)


def cell_jens(scaled_jacobian: Values, k: Values, of: Links) -> tuple[Values, Values]:
    """J_ENS of each cell, NaN where it has no corner or one is NaN, and of each node, NaN at hanging ones."""
    nodes = np.where(of.is_hanging == 1, np.nan, _jens(scaled_jacobian, k))
    n_cells = len(of.node_counts)
    cells = np.full(n_cells, np.nan)
    filled = np.flatnonzero(of.node_counts > 0)
    starts = (np.cumsum(of.node_counts) - of.node_counts)[filled]
    if len(filled):
        # A hanging node has no say, unless it is nowhere.
        corners = np.where((of.is_hanging == 1) & ~np.isnan(scaled_jacobian), np.inf, nodes)
        cells[filled] = fold(corners, starts)
    return cells, nodes


def fold(values: Values, starts: Ids) -> Values:
    """`aggregate.fold` of each run of values, none of which is empty; NaN if any is."""
    least: Values = np.minimum.reduceat(values, starts)
    if not (least < 0.0).any():
        return least
    nearest = np.maximum.reduceat(np.where(values < 0.0, values, -np.inf), starts)
    return np.where(least < 0.0, nearest, least)


def _jens(scaled_jacobian: Values, k: Values) -> Values:
    size = np.abs(scaled_jacobian)
    values: Values = np.copysign(np.minimum(size * (1.0 / k), 1.0 + k - size), scaled_jacobian)
    return values + 0.0


@cache
def prepare() -> None:
    """Compile the kernels that every mesh needs, or load them from the cache.

    The others are compiled when the first cell needs them: `links.orient`, `hanging.remove`, `match.match`,
    `nodes.winds_once`, `shape.star_shaped`.
    """
    points = np.array(WEDGE.points, np.float64)
    points.flags.writeable = False  # as those of a mesh: others are another type, to be compiled for anew
    sizes = np.array([len(face) for face in WEDGE.faces])
    ids = np.array([i for face in WEDGE.faces for i in face], np.int64)
    faces = Faces(
        joined(ids, np.zeros(1, np.int64), sizes.sum(keepdims=True)), sizes, np.zeros(5, np.uint8), np.full(1, 5)
    )
    table = solids(points, faces, np.full(6, WEDGE.k))
    match(table.links, table, np.empty(6))
    three_faced(table.links, np.ones(1, np.bool_))
    node_scaled_jacobian(table.links)
    shapes(points, faces, table.links.faults)
