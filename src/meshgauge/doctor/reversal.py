"""How the nodes of a cell are put in order when it is numbered the wrong way round: one permutation a type.

All exchange the first two reference coordinates, so that node 0 stays where it is and the bottom stays the bottom;
a voxel, whose axes are those of space, has its bottom and top exchanged.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from itertools import count
from typing import Any

from ..cells import CELL_TYPES, CellType
from ..kernels.certificate.types import ROWS

Permutation = tuple[int, ...]

_VOXEL = (4, 5, 6, 7, 0, 1, 2, 3)

_VTK_CLASSES = {
    "pyramid19": "vtkTriQuadraticPyramid",
    "lagrange_tetra": "vtkLagrangeTetra",
    "lagrange_hexahedron": "vtkLagrangeHexahedron",
    "lagrange_wedge": "vtkLagrangeWedge",
    "bezier_tetra": "vtkBezierTetra",
    "bezier_hexahedron": "vtkBezierHexahedron",
    "bezier_wedge": "vtkBezierWedge",
}
"""Where VTK is asked for the places of the nodes."""


@cache
def reversal(vtk_id: int, n_nodes: int) -> Permutation | None:
    """For each node of the right-handed cell, its position in the reversed one; its own inverse.

    None where it is not known: a cell that is not solid, a Lagrange cell with orders that differ by direction, a
    Lagrange pyramid of order above 1 (VTK has no places of its nodes).
    """
    row = CELL_TYPES.get(vtk_id)
    if row is None or row.shape is None:
        return None
    if row.name == "voxel":
        return _VOXEL
    if row.name in ROWS:
        return _exchanged(ROWS[row.name].nodes[:n_nodes])
    if n_nodes == row.shape.n_nodes:
        return _of_corners(row)
    places = _places(row.name, n_nodes)
    return _exchanged(places) if places is not None else None


def _exchanged(places: Sequence[Sequence[float]]) -> Permutation:
    """The node at (s, r, t) for each node at (r, s, t)."""
    at = {tuple(round(x, 6) for x in place): node for node, place in enumerate(places)}
    return tuple(at[s, r, t] for r, s, t in at)


def _of_corners(row: CellType) -> Permutation:
    """Of a linear cell: the base is gone round the other way, and so is the top, where there is one."""
    assert row.shape is not None
    below = len(row.shape.faces[0])
    turned = (0, *range(below - 1, 0, -1))
    above = row.shape.n_nodes - below
    return (*turned, *(below + m for m in (turned if above == below else range(above))))


def _places(name: str, n_nodes: int) -> list[tuple[float, float, float]] | None:
    """Reference coordinates of the nodes, from VTK; None where the number does not tell the order."""
    base = name.partition("_")[2]
    if base in _NUMBERS and n_nodes not in _uniform(base, n_nodes):
        return None
    if name not in _VTK_CLASSES:
        return None
    from vtkmodules import vtkCommonDataModel

    cell: Any = getattr(vtkCommonDataModel, _VTK_CLASSES[name])()
    if base in _NUMBERS:
        cell.GetPointIds().SetNumberOfIds(n_nodes)
        cell.GetPoints().SetNumberOfPoints(n_nodes)
        if base != "tetra":
            cell.SetUniformOrderFromNumPoints(n_nodes)
        cell.Initialize()
    flat = cell.GetParametricCoords()
    return [(flat[3 * i], flat[3 * i + 1], flat[3 * i + 2]) for i in range(n_nodes)]


_NUMBERS = {
    "tetra": lambda p: (p + 1) * (p + 2) * (p + 3) // 6,
    "hexahedron": lambda p: (p + 1) ** 3,
    "wedge": lambda p: (p + 1) ** 2 * (p + 2) // 2,
}
"""Nodes of a Lagrange cell of order p in every direction."""


def _uniform(base: str, n_nodes: int) -> set[int]:
    """Numbers of nodes that a cell of one order in every direction may have, as far as ``n_nodes``."""
    found: set[int] = {21} if base == "wedge" else {15} if base == "tetra" else set()
    for p in count(1):
        n = _NUMBERS[base](p)
        if n > n_nodes:
            return found
        found.add(n)
    raise AssertionError("count never ends")
