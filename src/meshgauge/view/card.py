"""What is known of one cell, as data for a page: its values, its nodes, its worst node marked."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..look import style
from ..mesh.labels import cell_label, point_label
from ..quality.one_cell import node_values
from ..quality.worst import spacing
from ..status import STATUSES, Status
from .filters import ViewError
from .model import Model


@dataclass(frozen=True, slots=True)
class NodeRow:
    """A node of the cell."""

    node: int  #: position in the cell, from 0
    point: int  #: its point id
    label: int | None  #: the file's own number of the point; None if it gives none
    coordinates: tuple[float, float, float]
    quality: float  #: its J_ENS; NaN at a node that is no corner
    is_worst: bool


@dataclass(frozen=True, slots=True)
class Card:
    """A cell."""

    cell: int  #: position in the file, from 0
    label: int | None  #: the file's own number; None if it gives none
    type: str
    quality: float  #: J_ENS; NaN if it has none
    status: str
    text: str  #: what the status means
    region: str
    layer: int  #: number of cells between it and the boundary
    nodes: tuple[NodeRow, ...]
    spacing: float  #: least distance of two nodes that are apart; 0 if none are

    @property
    def worst(self) -> NodeRow | None:
        """The node with the lowest J_ENS, the first of equal ones; None if none has a value."""
        return next((row for row in self.nodes if row.is_worst), None)


def card(model: Model, cell: int) -> Card:
    """What is known of a cell. Raises `ViewError` if there is no such cell."""
    mesh = model.mesh
    if not 0 <= cell < mesh.n_cells:
        raise ViewError(f"no cell {cell}: the mesh has cells 0 to {mesh.n_cells - 1}")
    values = node_values(model.quality, cell)
    lowest = -1 if np.isnan(values).all() else int(np.nanargmin(values))
    rows = []
    for node, (point, value) in enumerate(zip(mesh.nodes(cell), values, strict=True)):
        x, y, z = (float(v) for v in mesh.points[point])
        label = point_label(mesh, int(point))
        rows.append(NodeRow(node, int(point), label, (x, y, z), float(value), node == lowest))
    row = STATUSES[Status(int(model.quality.status[cell]))]
    return Card(
        cell=cell,
        label=cell_label(mesh, cell),
        spacing=spacing(mesh.points[mesh.nodes(cell)]),
        type=model.type_names[int(mesh.types[cell])],
        quality=float(model.values[cell]),
        status=row.name,
        text=row.text,
        region=model.region_names[int(model.region_ids[cell])],
        layer=int(model.layers[cell]),
        nodes=tuple(rows),
    )


def number(value: float) -> str:
    """A value of J_ENS for a page: three decimals, a true minus; small ones never look like 0, NaN is a dash."""
    if math.isnan(value):
        return "–"
    text = f"{value:.3f}" if value == 0 or abs(value) >= 5e-4 else f"{value:.0e}"
    return text.replace("-", "−")


def coordinates(place: tuple[float, float, float], spacing: float) -> list[str]:
    """Coordinates in five digits, for narrow columns, or as many as tell nodes apart."""
    return [text.replace("-", "−") for text in style.coordinates(place, spacing, digits=5)]
