"""Which of two node orders the wedges of a file are in, and turning them into ours.

Ours (also of Gmsh, Exodus and VTK since 9.7) has the normal of (0, 1, 2) pointing to (3, 4, 5); VTK's older
documentation has it pointing away. Files of VTK and SU2 exist in both and carry no mark. Every other format has one
order, so that a negative wedge in it is an inverted one, and stays.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from ...cells import CELL_TYPES, IS_SOLID, WEDGE, CellType
from ...errors import ReadError
from ...look.style import plural
from ...mesh import Mesh
from ...mesh.cast import frozen

WedgeOrder = Literal["auto", "gmsh", "vtk-legacy"]
WEDGE_ORDERS: tuple[str, ...] = get_args(WedgeOrder)

CHUNK = 1 << 16
"""Cells treated at a time: the corners of wedges take 9 MB."""
SAMPLE = 1 << 18
"""Cells that are enough to know the sign of the others, or of neighbours; of more, as many spread evenly."""
UNANIMOUS = 0.9
"""Share of the other solids of one sign from which on it is the sign of the mesh; below, neighbours are asked."""

_IS_WEDGE = np.zeros(256, np.bool_)
_IS_WEDGE[[t for t, row in CELL_TYPES.items() if row.shape is not None and row.shape.other_order]] = True

_IS_OTHER = IS_SOLID & ~_IS_WEDGE

# Old position of each new node when the triangles are turned round (1 <-> 2, 4 <-> 5).
_CORNERS = (0, 2, 1, 3, 5, 4)
_TURNED = {
    13: _CORNERS,
    26: (*_CORNERS, 8, 7, 6, 11, 10, 9, 12, 14, 13),
    31: (*_CORNERS, 8, 7, 6, 11, 10, 9),
    32: (*_CORNERS, 8, 7, 6, 11, 10, 9, 12, 14, 13, 17, 16, 15),
}

_OF_ANY_ORDER = (73, 80)
"""VTK's Lagrange and Bézier wedges."""

Ids = NDArray[np.int64]


def normalise(mesh: Mesh, order: str, *, has_both: bool = True) -> Mesh:
    """The mesh with its wedges in our order.

    Parameters
    ----------
    mesh
        With wedges in the order of its file.
    order
        "gmsh": the file is in our order, nothing changes. "vtk-legacy": the file is in the other, all wedges are
        turned. "auto": all wedges are turned if they are of the other order by the solid cells around them: most wedges
        have another sign than the other solids have or, where those are of both signs, run against their neighbours
        over faces. Without other solids they are turned if all are negative.
    has_both
        Whether the format exists in both orders; in one that does not, "auto" changes nothing.

    Returns
    -------
    Mesh
        The same object if nothing was to decide; else with a note that says what was done. Other cells are never
        touched. A file is of one order: wedges are turned all or none.
    """
    check_order(order)
    if order == "gmsh" or (order == "auto" and not has_both):
        return mesh
    wedges = np.flatnonzero(_IS_WEDGE[mesh.types])
    if len(wedges) == 0:
        return mesh
    if order == "vtk-legacy":
        return apply(mesh, AS_ASKED)
    signs = signs_of(mesh)
    decision = decide(signs)
    if decision is None:
        against, along = _against_neighbours(mesh, wedges)
        if against == along:
            decision = _by_signs(signs) if along == 0 else Decision(doubt="their neighbours over faces disagree")
        else:
            decision = Decision(turn="because they run against their neighbours" if against > along else "")
    return apply(mesh, decision)


class Signs(NamedTuple):
    """Wedges, and other solid cells of a sample, of negative and of positive volume. Add up over parts of a mesh."""

    negative: int
    positive: int
    below: int
    above: int


class Decision(NamedTuple):
    """What becomes of the wedges: turned, for a reason, or left, for one or none."""

    turn: str = ""  #: why all are turned; empty: they are not
    doubt: str = ""  #: why it could not be decided


AS_ASKED = Decision(turn="as asked (vtk-legacy)")


def signs_of(mesh: Mesh, *, step: int | None = None, first: int = 0) -> Signs:
    """The signs of a mesh, or of a part of one.

    Of the other solids of a whole each ``step``-th counts, see `sample_step`, from ``first`` on in this part.
    """
    wedges = np.flatnonzero(_IS_WEDGE[mesh.types])
    return Signs(*_signs(mesh, wedges), *_signs_of_others(mesh, step, first))


def sample_step(n_others: int) -> int:
    """How many of so many solid cells other than wedges one stands for."""
    return n_others // SAMPLE + 1


def count(by_type: NDArray[np.int64]) -> tuple[int, int]:
    """Wedges, and other solid cells, of the numbers ``(256,)`` of cells of each type."""
    return int(by_type[_IS_WEDGE].sum()), int(by_type[_IS_OTHER].sum())


def has_wedges(types: NDArray[np.uint8]) -> bool:
    """Whether some of the cells are wedges, of any order."""
    return bool(_IS_WEDGE[types].any())


def decide(signs: Signs) -> Decision | None:
    """What the signs say; None if the neighbours of the wedges are to be asked."""
    below, above = signs.below, signs.above
    if below + above == 0:
        return _alone(signs)
    return None if max(below, above) < UNANIMOUS * (below + above) else _by_signs(signs)


def _by_signs(signs: Signs) -> Decision:
    if signs.below == signs.above:
        return Decision(doubt="as many of the other solid cells are negative as positive")
    is_mirrored = signs.below > signs.above
    opposite, same = (signs.positive, signs.negative) if is_mirrored else (signs.negative, signs.positive)
    if opposite > same:
        names = ("positive", "negative") if is_mirrored else ("negative", "positive")
        return Decision(turn=f"because most are {names[0]} as read and the other solid cells {names[1]}")
    return Decision(doubt="half of them have the sign of the other solid cells" if opposite == same > 0 else "")


def _alone(signs: Signs) -> Decision:
    """Of a mesh without other solids: nothing but zero to compare with."""
    if signs.negative and not signs.positive:
        why = "because all are negative as read; with no other solid cells to compare, they may be inverted instead"
        return Decision(turn=f"{why} (--wedge-order gmsh)")
    if signs.negative:
        counts = f"{signs.negative:,} are negative, {signs.positive:,} positive"
        return Decision(doubt=f"{counts}, and there are no other solid cells")
    return Decision()


def apply(mesh: Mesh, decision: Decision) -> Mesh:
    """The mesh with its wedges as decided, and a note if they are turned or it could not be decided."""
    if decision.turn:
        return _turn(mesh, np.flatnonzero(_IS_WEDGE[mesh.types]), decision.turn)
    if not decision.doubt:
        return mesh
    return mesh.replace(notes=(*mesh.notes, undecided(decision.doubt)))


def check_order(order: str) -> None:
    """Raise `ReadError` unless this is the name of a wedge order."""
    if order not in WEDGE_ORDERS:
        raise ReadError(f"wedge order {order!r} is unknown; expected one of {', '.join(WEDGE_ORDERS)}")


def _signs(mesh: Mesh, cells: Ids) -> tuple[int, int]:
    """Number of wedges of negative and of positive volume; those that are flat or not finite count in neither."""
    negative = positive = 0
    for start in range(0, len(cells), CHUNK):
        first = mesh.offsets[cells[start : start + CHUNK]]
        corners = mesh.points[mesh.connectivity[first[:, None] + np.arange(6)]].astype(np.float64, copy=False)
        volume = volumes(corners)
        negative += int(np.count_nonzero(volume < 0))
        positive += int(np.count_nonzero(volume > 0))
    return negative, positive


def _others(mesh: Mesh, ids: Ids) -> list[tuple[CellType, Ids]]:
    """Solid cells other than wedges that have a shape, by type."""
    types = mesh.types[ids]
    rows = (CELL_TYPES[int(t)] for t in np.unique(types) if IS_SOLID[t] and not _IS_WEDGE[t] and int(t) in CELL_TYPES)
    return [(row, ids[types == row.vtk_id]) for row in rows if row.shape is not None]


def _signs_of_others(mesh: Mesh, step: int | None, first: int) -> tuple[int, int]:
    """Number of other solids whose corners have a negative and a positive sum of determinants, of a sample."""
    solids = np.flatnonzero(_IS_OTHER[mesh.types])
    negative = positive = 0
    for row, cells in _others(mesh, solids[first :: step or sample_step(len(solids))]):
        assert row.shape is not None
        a, i, j, k = np.array(row.shape.triples).T
        for start in range(0, len(cells), CHUNK):
            at = mesh.offsets[cells[start : start + CHUNK], None] + np.array(row.corners)
            with np.errstate(all="ignore"):
                x = _scale(mesh.points[mesh.connectivity[at]].astype(np.float64, copy=False))
                edges = (x[:, other] - x[:, a] for other in (i, j, k))
                u, v, w = edges
                total = np.einsum("nij,nij->n", u, np.cross(v, w))
            negative += int(np.count_nonzero(total < 0))
            positive += int(np.count_nonzero(total > 0))
    return negative, positive


def _against_neighbours(mesh: Mesh, wedges: Ids) -> tuple[int, int]:
    """Number of faces between a wedge and another solid that both have run in one direction, and in opposite ones.

    Two cells of one handedness run round their common face in opposite directions, wherever the points are.
    """
    wedges = wedges[:: len(wedges) // SAMPLE + 1]
    touched = np.zeros(mesh.n_points, bool)
    corners = mesh.connectivity[mesh.offsets[wedges][:, None] + np.arange(6)]
    touched[corners] = True
    solids = np.flatnonzero(_IS_OTHER[mesh.types])
    against = along = 0
    for size in (3, 4):
        mine = np.concatenate([corners[:, face] for face in WEDGE.faces if len(face) == size])
        theirs = [np.empty((0, size), np.int64)]
        for row, cells in _others(mesh, solids):
            assert row.shape is not None
            for start in range(0, len(cells), CHUNK):
                first = mesh.offsets[cells[start : start + CHUNK], None]
                for face in row.shape.faces:
                    if len(face) == size:
                        nodes = mesh.connectivity[first + np.array([row.corners[node] for node in face])]
                        theirs.append(nodes[touched[nodes].all(axis=1)].astype(np.int64))
        rings, is_mine = np.concatenate([mine, *theirs]), np.arange(len(mine) + sum(map(len, theirs))) < len(mine)
        first = np.argmin(rings, axis=1)[:, None]
        rings = np.take_along_axis(rings, (first + np.arange(size)) % size, axis=1)  # begin at the lowest point
        forward = rings[:, 1] < rings[:, -1]
        rings[~forward, 1:] = rings[~forward, :0:-1]
        order = np.lexsort(rings.T[::-1])
        a, b = order[:-1], order[1:]
        pair = (rings[a] == rings[b]).all(axis=1) & (is_mine[a] != is_mine[b])
        same = forward[a[pair]] == forward[b[pair]]
        against, along = against + int(same.sum()), along + int((~same).sum())
    return against, along


def _scale(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Corners ``(n, k, 3)`` of cells from their first, in units of their own size: no coordinate from 1e-200 to 1e300
    loses the sign of a volume. NaN where a coordinate is not finite."""
    largest = np.abs(corners).max(axis=(1, 2), keepdims=True)
    d = corners / np.where(largest > 0, largest, 1.0)
    d = d - d[:, :1]
    size = np.abs(d).max(axis=(1, 2), keepdims=True)
    return np.asarray(d / np.where(size > 0, size, 1.0))


def volumes(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Signed volumes of wedges ``(n, 6, 3)``, each in units of its own size cubed; positive in our order.

    Exact for straight edges and bilinear sides: the area vector of the triangle is quadratic from bottom to top, the
    mean of the upright edges constant. NaN where a coordinate is not finite.
    """
    with np.errstate(all="ignore"):
        d = _scale(corners)
        e1, e2 = d[:, 1] - d[:, 0], d[:, 2] - d[:, 0]
        f1, f2 = d[:, 4] - d[:, 3], d[:, 5] - d[:, 3]
        area = np.cross(e1, e2) + np.cross(f1, f2) + 0.5 * (np.cross(e1, f2) + np.cross(f1, e2))
        upright = (d[:, 3:] - d[:, :3]).mean(axis=1)
        return np.asarray(np.einsum("ij,ij->i", area, upright) / 6.0)


def _turn(mesh: Mesh, cells: Ids, why: str) -> Mesh:
    """The mesh with these wedges, all there are, turned; a note says so and why."""
    connectivity = mesh.connectivity.copy()
    sizes = mesh.offsets[cells + 1] - mesh.offsets[cells]
    types = mesh.types[cells]
    corners_only = 0
    for vtk_id in np.unique(types):
        of_type = types == vtk_id
        for n_nodes in np.unique(sizes[of_type]):
            order = np.array(permutation(int(vtk_id), int(n_nodes)))
            first = mesh.offsets[cells[of_type & (sizes == n_nodes)]]
            if n_nodes > 6 and np.array_equal(order[6:], np.arange(6, n_nodes)):
                corners_only += len(first)
            for start in range(0, len(first), CHUNK):
                at = first[start : start + CHUNK, None]
                connectivity[at + np.arange(n_nodes)] = mesh.connectivity[at + order]
    note = turned(len(cells), why)
    if corners_only:
        note += f" Of {corners_only} curved ones only the corners were turned."
    return mesh.replace(connectivity=frozen(connectivity), notes=(*mesh.notes, note))


def turned(n: int, why: str) -> str:
    """The note on so many wedges that were turned."""
    return f"{plural(n, WEDGE.name)} {'was' if n == 1 else 'were'} {_TURNED_TEXT}, {why}."


def undecided(doubt: str) -> str:
    """The note on wedges whose order could not be decided."""
    return f"{_UNDECIDED_TEXT}: {doubt}. They are left as they are."


_TURNED_TEXT = "turned from the order that VTK documented before 9.7 into ours"
_UNDECIDED_TEXT = "The order of the wedges could not be decided"

Outcome = Literal["as stored", "turned", "undecided"]


def outcome(notes: Iterable[str]) -> Outcome:
    """What became of the wedges of a mesh, by its notes."""
    notes = tuple(notes)
    if any(_TURNED_TEXT in note for note in notes):
        return "turned"
    return "undecided" if any(note.startswith(_UNDECIDED_TEXT) for note in notes) else "as stored"


@cache
def permutation(vtk_id: int, n_nodes: int) -> tuple[int, ...]:
    """Old position of each node when the triangles of a wedge of this type are turned round. Its own inverse."""
    if vtk_id in _TURNED:
        return _TURNED[vtk_id]
    if vtk_id not in _OF_ANY_ORDER:
        return (*_CORNERS, *range(6, n_nodes))  # in no order that is known
    if n_nodes == 15:
        return _TURNED[26]
    if n_nodes == 21 or any((p + 1) ** 2 * (p + 2) // 2 == n_nodes for p in range(1, 50)):
        return _turn_by_coordinates(n_nodes)
    return (*_CORNERS, *range(6, n_nodes))  # of different orders along and across, which the number does not tell


def _turn_by_coordinates(n_nodes: int) -> tuple[int, ...]:
    """For a Lagrange or Bézier wedge of any order: exchange the two coordinates of the triangle, match the nodes."""
    from vtkmodules.vtkCommonDataModel import vtkLagrangeWedge

    cell: Any = vtkLagrangeWedge()
    cell.GetPointIds().SetNumberOfIds(n_nodes)
    cell.GetPoints().SetNumberOfPoints(n_nodes)
    cell.SetUniformOrderFromNumPoints(n_nodes)
    cell.Initialize()
    flat = cell.GetParametricCoords()
    places = {(round(flat[3 * i], 9), round(flat[3 * i + 1], 9), round(flat[3 * i + 2], 9)): i for i in range(n_nodes)}
    return tuple(places[s, r, t] for r, s, t in places)
