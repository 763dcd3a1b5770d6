"""Which of the two node orders the wedges of a file are in, and turning them into ours.

Ours (also of Gmsh, Exodus and VTK since 9.7) has the normal of (0, 1, 2) pointing to (3, 4, 5); VTK's older
documentation has it pointing away. Files carry no mark and exist in both orders. Read in the wrong one, every wedge is
inverted; so *auto* looks at the sign of the volumes, block by block.
"""

from __future__ import annotations

from functools import cache
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from ...cells import CELL_TYPES, WEDGE
from ...errors import ReadError
from ...mesh import Mesh

WedgeOrder = Literal["auto", "gmsh", "vtk-legacy"]
WEDGE_ORDERS: tuple[str, ...] = get_args(WedgeOrder)

CHUNK = 1 << 16
"""Wedges treated at a time: their corners take 9 MB."""

_IS_WEDGE = np.array([t in CELL_TYPES and CELL_TYPES[t].shape is WEDGE for t in range(256)])

# Old position of each new node when the triangles are turned round (1 <-> 2, 4 <-> 5).
_CORNERS = (0, 2, 1, 3, 5, 4)
_TURNED = {
    13: _CORNERS,
    26: (*_CORNERS, 8, 7, 6, 11, 10, 9, 12, 14, 13),
    31: (*_CORNERS, 8, 7, 6, 11, 10, 9),
    32: (*_CORNERS, 8, 7, 6, 11, 10, 9, 12, 14, 13, 17, 16, 15),
}


def settled(mesh: Mesh, order: str) -> Mesh:
    """The mesh with its wedges in our order.

    Parameters
    ----------
    mesh
        With wedges in the order of its file.
    order
        "gmsh": the file is in our order, nothing changes. "vtk-legacy": the file is in the other, all wedges are
        turned. "auto": those blocks are turned (blocks of one name together) in which more wedges have a negative
        volume than a positive one; where as many are negative as positive, nothing changes.

    Returns
    -------
    Mesh
        The same object if nothing changed; else with a note that says what was done. Wedges that are inverted in a
        block that is mostly right stay inverted. Other cells are never touched.
    """
    check_order(order)
    if order == "gmsh":
        return mesh
    wedges = np.flatnonzero(_IS_WEDGE[mesh.types])
    if len(wedges) == 0:
        return mesh
    if order == "vtk-legacy":
        return _turned(mesh, wedges, "as asked (vtk-legacy)")
    chosen, notes = [], []
    for name, ids in _by_block(mesh, wedges).items():
        negative, positive = _signs(mesh, ids)
        if negative > positive:
            chosen.append(ids)
        elif negative and negative == positive:
            where = f"block {name!r}" if name else "the mesh"
            notes.append(f"As many wedges of {where} have a negative volume as a positive one: left as they are.")
    if notes:
        mesh = mesh.replace(notes=(*mesh.notes, *notes))
    if not chosen:
        return mesh
    return _turned(mesh, np.concatenate(chosen), "because most have a negative volume as read")


def _by_block(mesh: Mesh, wedges: NDArray[np.int64]) -> dict[str, NDArray[np.int64]]:
    """Wedges by the name of their block.

    Blocks of one name are decided together: some readers make a block of every run of cells of one type, and a run may
    be as short as one wedge, whose sign must stay what it is.
    """
    found: dict[str, list[NDArray[np.int64]]] = {}
    for block in mesh.blocks:
        first, last = np.searchsorted(wedges, (block.start, block.stop))
        if last > first:
            found.setdefault(block.name, []).append(wedges[first:last])
    return {name: np.concatenate(ids) for name, ids in found.items()}


def check_order(order: str) -> None:
    """Raise `ReadError` unless this is the name of a wedge order."""
    if order not in WEDGE_ORDERS:
        raise ReadError(f"wedge order {order!r} is unknown; expected one of {', '.join(WEDGE_ORDERS)}")


def _signs(mesh: Mesh, cells: NDArray[np.int64]) -> tuple[int, int]:
    """Number of wedges of negative and of positive volume; those that are flat or not finite count in neither."""
    negative = positive = 0
    for start in range(0, len(cells), CHUNK):
        first = mesh.offsets[cells[start : start + CHUNK]]
        corners = mesh.points[mesh.connectivity[first[:, None] + np.arange(6)]].astype(np.float64, copy=False)
        volume = volumes(corners)
        negative += int(np.count_nonzero(volume < 0))
        positive += int(np.count_nonzero(volume > 0))
    return negative, positive


def volumes(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Signed volumes of wedges ``(n, 6, 3)``, each in units of its own size cubed; positive in our order.

    Exact for straight edges and bilinear sides: the area vector of the triangle is quadratic from bottom to top, the
    mean of the upright edges constant. Scaled, so that no coordinate from 1e-200 to 1e300 loses the sign. NaN where a
    coordinate is not finite.
    """
    with np.errstate(all="ignore"):
        largest = np.abs(corners).max(axis=(1, 2), keepdims=True)
        d = corners / np.where(largest > 0, largest, 1.0)
        d = d - d[:, :1]
        size = np.abs(d).max(axis=(1, 2), keepdims=True)
        d = d / np.where(size > 0, size, 1.0)
        e1, e2 = d[:, 1] - d[:, 0], d[:, 2] - d[:, 0]
        f1, f2 = d[:, 4] - d[:, 3], d[:, 5] - d[:, 3]
        area = np.cross(e1, e2) + np.cross(f1, f2) + 0.5 * (np.cross(e1, f2) + np.cross(f1, e2))
        upright = (d[:, 3:] - d[:, :3]).mean(axis=1)
        return np.asarray(np.einsum("ij,ij->i", area, upright) / 6.0)


def _turned(mesh: Mesh, cells: NDArray[np.int64], why: str) -> Mesh:
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
    n_wedges = int(np.count_nonzero(_IS_WEDGE[mesh.types]))
    note = f"{len(cells)} of {n_wedges} wedges were turned from VTK's documented order into ours, {why}."
    if corners_only:
        note += f" Of {corners_only} curved ones only the corners were turned."
    return mesh.replace(connectivity=connectivity, notes=(*mesh.notes, note))


@cache
def permutation(vtk_id: int, n_nodes: int) -> tuple[int, ...]:
    """Old position of each node when the triangles of a wedge of this type are turned round. Its own inverse."""
    if vtk_id in _TURNED:
        return _TURNED[vtk_id]
    if n_nodes == 21 or any((p + 1) ** 2 * (p + 2) // 2 == n_nodes for p in range(1, 50)):
        return _turned_by_coordinates(n_nodes)
    return (*_CORNERS, *range(6, n_nodes))  # of different orders along and across, which the number does not tell


def _turned_by_coordinates(n_nodes: int) -> tuple[int, ...]:
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
