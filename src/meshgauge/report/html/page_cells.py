"""The cells that the page holds whole: all of a small mesh, the worst of a large one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...cells import POLYHEDRON, CellType
from ...kernels import path
from ...kernels.cells import aggregate, driver
from ...look.bands import USUAL, PoorBelow
from ...mesh import Mesh, connectivity
from ...mesh.high_order import row_of
from ...mesh.labels import labels_of
from ...mesh.polyhedra import ragged_positions
from ...quality.poor import limit_of
from ...quality.summary.scale import HALF, Scale
from ...status import WORST_FIRST, Category, Purpose, category, rank
from ...surface_cells import POLYGON, row_of_nodes, rows_of
from .frame import Frame

if TYPE_CHECKING:
    from ...quality.measure import Quality

Ids = NDArray[np.int64]
Values = NDArray[np.float64]

WHOLE, WORST = 50_000, 30_000
"""A mesh of up to `WHOLE` cells is shown whole, of a larger one the `WORST` worst cells."""

NO_BIN = 0xFFFF
"""Instead of the bin of a cell that has no value."""


DRAWN_AS = {
    Category.VALID: 0,
    Category.UNDECIDED: 0,
    Category.INVALID: 1,
    Category.DEGENERATE: 2,
    Category.UNMEASURED: 3,
    Category.APART: 3,
}
"""The class of a cell for the shaders."""


class Nodes(NamedTuple):
    """Nodes of some cells: those of the first, then those of the second, and so on."""

    sizes: Ids
    points: Ids
    values: Values  #: J_ENS of each as a node of its cell


def drawable(quality: Quality) -> NDArray[np.bool_]:
    """True for the cells that are measured, have faces to draw and no coordinate that is not finite."""
    mesh = quality.mesh
    mask = np.zeros(mesh.n_cells, np.bool_)
    for row, _, cells in mesh.groups():
        mask[cells] = row is not None and row.shape is not None
    if quality.polyhedra is not None:
        with_nodes = np.diff(quality.polyhedra.node_offsets) > 0
        mask[quality.polyhedra.cells[with_nodes]] = True
    lost = ~np.isfinite(mesh.points).all(axis=1)
    if lost.any():
        at = np.flatnonzero(lost[mesh.connectivity])
        mask[np.searchsorted(mesh.offsets, at, side="right") - 1] = False
    return mask


def cells_to_show(quality: Quality, can_be_drawn: NDArray[np.bool_], most: int) -> Ids:
    """At most so many cells that can be drawn, ascending: the worst, by status first, by quality among those alike, the
    first of equal ones."""
    cells = np.flatnonzero(can_be_drawn)
    return cells if len(cells) <= most else cells[lowest(order_to_show(quality, cells), most)]


def order_to_show(quality: Quality, cells: Ids) -> Values:
    """What some cells are ordered by where not all are shown: the lowest come first."""
    values = np.nan_to_num(quality.values[cells], nan=-2.0)
    ranks = rank(quality.status[cells], quality.mesh.purpose).astype(np.float64) - WORST_FIRST.index(Category.VALID)
    return np.asarray(values + 10.0 * np.minimum(ranks, 0.0))


def lowest(keys: Values, most: int) -> Ids:
    """Positions, ascending, of the ``most`` lowest keys; of equal ones the first."""
    if len(keys) <= most:
        return np.arange(len(keys))
    last = np.partition(keys, most - 1)[most - 1]
    is_among = keys < last
    is_among[np.flatnonzero(keys == last)[: most - int(np.count_nonzero(is_among))]] = True
    return np.flatnonzero(is_among)


def drawing_code(status: int, purpose: Purpose) -> int:
    """How the script draws a cell of a status: 0 by its value, 1 invalid, 2 degenerate, 3 as one without a value."""
    return DRAWN_AS[Category(int(category(np.array(status, np.uint8), purpose)))]


def nodes_of(quality: Quality, cells: Ids) -> Nodes:
    """Corners of some cells and their J_ENS; of a polyhedron all its nodes, NaN at those that are no corners."""
    mesh = quality.mesh
    sizes = np.zeros(len(cells), np.int64)
    types = mesh.types[cells]
    parts: list[tuple[Ids, Ids, Values]] = []
    for vtk_id in np.unique(types).tolist():
        at = np.flatnonzero(types == vtk_id)
        if vtk_id == POLYHEDRON.vtk_id:
            poly = quality.polyhedra
            assert poly is not None
            of = np.searchsorted(poly.cells, cells[at])
            starts, own = poly.node_offsets[of], poly.node_offsets[of + 1] - poly.node_offsets[of]
            where = ragged_positions(starts, own)
            sizes[at] = own
            parts.append((at, poly.node_points[where], poly.node_jens[where]))
            continue
        for row, of_row in _rows(mesh, vtk_id, cells, at):
            assert row.shape is not None
            ids = connectivity.pick(mesh, row, cells[of_row], driver.columns(row))
            scaled, up = np.empty((len(ids), row.shape.n_nodes)), mesh.up
            driver.node_scaled_jacobian(mesh.points, ids, row, scaled, up, compiled=path.is_compiled(len(ids)))
            corners = connectivity.pick(mesh, row, cells[of_row], row.corners)
            sizes[of_row] = row.shape.n_nodes
            parts.append((of_row, corners.reshape(-1), aggregate.jens(scaled, row.shape.k).reshape(-1)))
    starts = np.cumsum(sizes) - sizes
    points, values = np.empty(int(sizes.sum()), np.int64), np.empty(int(sizes.sum()))
    for at, of_part, values_of_part in parts:
        where = ragged_positions(starts[at], sizes[at])
        points[where], values[where] = of_part, values_of_part
    return Nodes(sizes, points, values)


def _rows(mesh: Mesh, vtk_id: int, cells: Ids, at: Ids) -> list[tuple[CellType, Ids]]:
    """The rows of the cells of one type, each with the positions of its own."""
    row = rows_of(mesh.dimension)[vtk_id]
    if row.shape is not None:
        return [(row, at)]
    sizes = np.diff(mesh.offsets)[cells[at]]
    known = ((row_of_nodes(row, n), at[sizes == n]) for n in np.unique(sizes).tolist())
    return [(own, of_row) for own, of_row in known if own is not None]


def faces_of(quality: Quality, cell: int) -> list[list[int]]:
    """Point ids of each face of one cell."""
    mesh = quality.mesh
    row = row_of(mesh, cell)
    if row is not None and row.shape is not None:
        nodes = mesh.nodes(cell)
        return [[int(nodes[row.corners[m]]) for m in face] for face in row.shape.faces]
    poly = mesh.polyhedra
    assert poly is not None
    ids = poly.cell_faces[poly.cell_offsets[cell] : poly.cell_offsets[cell + 1]].tolist()
    return [poly.face_points[poly.face_offsets[f] : poly.face_offsets[f + 1]].tolist() for f in ids]


def kinds(types: NDArray[np.uint8], dimension: int, poor_below: PoorBelow = USUAL) -> list[dict[str, Any]]:
    """The types among some cells: name, number of corners and faces, below what they are poor; of polyhedra and
    polygons no faces, each has its own."""
    rows = [rows_of(dimension)[t] for t in np.unique(types).tolist()]
    return [
        {
            "type": row.name,
            "n": 0 if row.shape is None else row.shape.n_nodes,
            "faces": None if row.shape is None else [list(face) for face in row.shape.faces],
            "poorBelow": limit_of(poor_below, row.name),
        }
        for row in rows
    ]


def bins_of(values: Values, bins: int) -> NDArray[np.uint16]:
    """The display bin of each value, as `Tally.histogram` counts it; `NO_BIN` for NaN."""
    scale = Scale.of("jens")
    at_bin = np.full(len(values), NO_BIN, np.uint16)
    measured = ~np.isnan(values)
    edges = scale.display(bins)
    at_bin[measured] = np.clip(np.searchsorted(edges, scale.bins(values[measured]), side="right") - 1, 0, bins - 1)
    return at_bin


def arrays_of(
    quality: Quality, cells: Ids, regions: Ids, bins: int, frame: Frame, *, n_regions: int
) -> dict[str, NDArray[Any]]:
    """What the page needs to know of some cells, ready to be packed."""
    mesh = quality.mesh
    nodes = nodes_of(quality, cells)
    points, local = np.unique(nodes.points, return_inverse=True)
    _, kind = np.unique(mesh.types[cells], return_inverse=True)
    return {
        "id": cells.astype(np.uint32),
        "kind": kind.astype(np.uint8),
        "status": quality.status[cells],
        "bin": bins_of(quality.values[cells], bins),
        "region": regions[cells].astype(np.min_scalar_type(n_regions - 1)),
        "value": quality.values[cells],
        "nodes": local.reshape(-1).astype(np.uint32),
        "nodeValue": nodes.values.astype(np.float32),
        "point": points.astype(np.uint32),
        "xyz": frame.shown(mesh.points[points]).astype(np.float32),
        **_numbers(mesh, cells, points),
        **_own_faces(quality, cells, points),
    }


def _numbers(mesh: Mesh, cells: Ids, points: Ids) -> dict[str, NDArray[np.float64]]:
    """The file's own numbers, if it has any; floats, which hold them up to 2^53."""
    of_cells, of_points = labels_of(mesh, "cell"), labels_of(mesh, "point")
    return {
        **({} if of_cells is None else {"label": of_cells[cells].astype(np.float64)}),
        **({} if of_points is None else {"pointLabel": of_points[points].astype(np.float64)}),
    }


def _own_faces(quality: Quality, cells: Ids, points: Ids) -> dict[str, NDArray[Any]]:
    """For polyhedra and polygons: nodes and faces of each, nodes of each face, and the points of the faces."""
    mesh = quality.mesh
    polygons = cells[mesh.types[cells] == POLYGON.vtk_id]
    if mesh.dimension == 2 and len(polygons):
        n = np.diff(mesh.offsets)[polygons].astype(np.int64)
        nodes = mesh.connectivity[ragged_positions(np.asarray(mesh.offsets, np.int64)[:-1][polygons], n)]
        return {
            "polyNodes": n.astype(np.uint16),
            "polyFaces": np.ones(len(polygons), np.uint16),
            "faceSize": n.astype(np.uint16),
            "facePoint": np.searchsorted(points, nodes).astype(np.uint32),
        }
    poly, own = quality.mesh.polyhedra, cells[quality.mesh.types[cells] == POLYHEDRON.vtk_id]
    if poly is None or not len(own):
        return {}
    assert quality.polyhedra is not None
    counts = np.diff(poly.cell_offsets)[own].astype(np.int64)
    faces = np.asarray(poly.cell_faces, np.int64)[
        ragged_positions(np.asarray(poly.cell_offsets, np.int64)[:-1][own], counts)
    ]
    sizes = np.diff(poly.face_offsets)[faces].astype(np.int64)
    of_faces = poly.face_points[ragged_positions(np.asarray(poly.face_offsets, np.int64)[:-1][faces], sizes)]
    at = np.searchsorted(quality.polyhedra.cells, own)
    n_nodes = np.diff(quality.polyhedra.node_offsets)[at]
    return {
        "polyNodes": n_nodes.astype(np.uint16),
        "polyFaces": counts.astype(np.uint16),
        "faceSize": sizes.astype(np.uint16),
        "facePoint": np.searchsorted(points, of_faces).astype(np.uint32),
    }


assert HALF < NO_BIN
