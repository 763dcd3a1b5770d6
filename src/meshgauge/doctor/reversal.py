"""How the nodes of a cell are put in order when it is numbered in reverse: one permutation a type.

All exchange the first two reference coordinates, so that node 0 stays where it is and the bottom stays the bottom::

    3-----2         1-----2
    |     |   -->   |     |         a quadrilateral face: 0 1 2 3 becomes 0 3 2 1
    0-----1         0-----3
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from itertools import count
from math import comb, prod
from typing import Any

from ..cells import CELL_TYPES, CellType, Shape
from ..surface_cells import SURFACE_TYPES, row_of_nodes, varies

Permutation = tuple[int, ...]


@cache
def reversal(vtk_id: int, n_nodes: int) -> Permutation | None:
    """For each node of the right-handed cell, its position in the reversed one; its own inverse.

    None where it is not known: a line or vertex, a Lagrange cell with orders that differ by direction, a
    Lagrange pyramid of order above 1 (VTK has no places of its nodes).
    """
    row = CELL_TYPES.get(vtk_id)
    if row is not None and row.dimension == 2:
        of_surface = SURFACE_TYPES[vtk_id]
        row = (row_of_nodes(of_surface, n_nodes) if varies(of_surface) else of_surface) or row
    if row is None or row.shape is None:
        return None
    if row.reversal:
        return row.reversal
    if row.places:
        return _transpose_nodes(row.places[:n_nodes])
    if n_nodes == row.shape.n_nodes:
        return row.shape.reversal
    places = _places(row, row.shape, n_nodes)
    return _transpose_nodes(places) if places is not None else None


def _transpose_nodes(places: Sequence[Sequence[float]]) -> Permutation:
    """The node at (s, r, t) for each node at (r, s, t)."""
    at = {tuple(round(x, 6) for x in place): node for node, place in enumerate(places)}
    return tuple(at[s, r, t] for r, s, t in at)


def _places(row: CellType, shape: Shape, n_nodes: int) -> list[tuple[float, float, float]] | None:
    """Reference coordinates of the nodes, from VTK; None where the number does not tell the order."""
    if not row.vtk_class or (row.n_nodes is None and not _is_known(row, shape, n_nodes)):
        return None
    from vtkmodules import vtkCommonDataModel

    cell: Any = getattr(vtkCommonDataModel, row.vtk_class)()
    if row.n_nodes is None:
        cell.GetPointIds().SetNumberOfIds(n_nodes)
        cell.GetPoints().SetNumberOfPoints(n_nodes)
        if hasattr(cell, "SetUniformOrderFromNumPoints"):
            cell.SetUniformOrderFromNumPoints(n_nodes)
        cell.Initialize()
    flat = cell.GetParametricCoords()
    return [(flat[3 * i], flat[3 * i + 1], flat[3 * i + 2]) for i in range(n_nodes)]


def _is_known(row: CellType, shape: Shape, n_nodes: int) -> bool:
    """Whether so many nodes are those of one order in every direction, or else known to VTK."""
    if n_nodes in row.n_nodes_beside:
        return True
    for order in count(1):
        full = prod(comb(order + size - 1, size - 1) for size in shape.simplices)
        if full >= n_nodes:
            return full == n_nodes
    raise AssertionError("count never ends")
