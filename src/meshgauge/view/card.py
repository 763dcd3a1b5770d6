"""What is known of one cell, as data for a page: its values, its nodes, its worst node marked."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..cells import POLYHEDRON
from ..mesh import Mesh
from ..quality.measure import measure
from ..status import STATUSES, Status
from .filters import ViewError
from .model import Model


@dataclass(frozen=True, slots=True)
class NodeRow:
    """A node of the cell."""

    node: int  #: position in the cell, from 0
    point: int  #: its point id
    coordinates: tuple[float, float, float]
    quality: float  #: its J_ENS; NaN at a node that is no corner
    is_worst: bool


@dataclass(frozen=True, slots=True)
class Card:
    """A cell."""

    cell: int  #: position in the file, from 0
    type: str
    quality: float  #: J_ENS; NaN if it has none
    status: str
    text: str  #: what the status means
    region: str
    layer: int  #: number of cells between it and the boundary
    nodes: tuple[NodeRow, ...]

    @property
    def worst(self) -> NodeRow | None:
        """The node with the lowest J_ENS, the first of equal ones; None if none has a value."""
        return next((row for row in self.nodes if row.is_worst), None)


def card(model: Model, cell: int) -> Card:
    """What is known of a cell. Raises `ViewError` if there is no such cell."""
    mesh = model.mesh
    if not 0 <= cell < mesh.n_cells:
        raise ViewError(f"no cell {cell}: the mesh has cells 0 to {mesh.n_cells - 1}")
    values = _node_values(model, cell)
    lowest = -1 if np.isnan(values).all() else int(np.nanargmin(values))
    rows = []
    for node, (point, value) in enumerate(zip(mesh.nodes(cell), values, strict=True)):
        x, y, z = (float(v) for v in mesh.points[point])
        rows.append(NodeRow(node, int(point), (x, y, z), float(value), node == lowest))
    row = STATUSES[Status(int(model.quality.status[cell]))]
    return Card(
        cell=cell,
        type=model.type_names[int(mesh.types[cell])],
        quality=float(model.values[cell]),
        status=row.name,
        text=row.text,
        region=model.region_names[int(model.region_ids[cell])],
        layer=int(model.layers[cell]),
        nodes=tuple(rows),
    )


def _node_values(model: Model, cell: int) -> NDArray[np.float64]:
    """J_ENS of the nodes of one cell, without measuring those of all."""
    mesh, polyhedra = model.mesh, model.quality.polyhedra
    nodes = mesh.nodes(cell)
    if polyhedra is not None and int(mesh.types[cell]) == POLYHEDRON.vtk_id:
        at = int(np.searchsorted(polyhedra.cells, cell))
        mine = slice(int(polyhedra.node_offsets[at]), int(polyhedra.node_offsets[at + 1]))
        of_point = dict(zip(polyhedra.node_points[mine].tolist(), polyhedra.node_jens[mine].tolist(), strict=True))
        return np.array([of_point.get(point, np.nan) for point in nodes.tolist()], np.float64)
    alone = Mesh(
        points=mesh.points[nodes],
        types=mesh.types[cell : cell + 1],
        offsets=np.array([0, len(nodes)]),
        connectivity=np.arange(len(nodes)),
        copy=False,
    )
    return measure(alone).node_jens


def number(value: float) -> str:
    """A value of J_ENS for a page: three decimals, a true minus; small ones never look like 0, NaN is a dash."""
    if math.isnan(value):
        return "–"
    text = f"{value:.3f}" if value == 0 or abs(value) >= 5e-4 else f"{value:.0e}"
    return text.replace("-", "−")


def coordinate(value: float) -> str:
    """A coordinate in five digits, for a narrow column."""
    return f"{value:.5g}".replace("-", "−")
