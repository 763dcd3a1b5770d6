"""One cell: its values, its nodes and the value at each, its names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..cells import POLYHEDRON, type_name
from ..errors import OptionError
from ..look.records import brief
from ..mesh.labels import cell_label, point_label
from ..mesh.regions import regions
from ..status import STATUSES, Status
from .worst import spacing

if TYPE_CHECKING:
    from .measure import Quality


@dataclass(frozen=True, slots=True)
class CellNode:
    """A node of a cell."""

    node: int  #: position in the cell, from 0
    point: int  #: its point id
    point_label: int | None  #: the file's own number of the point; None if it gives none
    coordinates: tuple[float, float, float]
    quality: float  #: its J_ENS; NaN at a node that is no corner


@dataclass(frozen=True, slots=True)
class OneCell:
    """A cell."""

    cell: int  #: position in the file, from 0
    cell_label: int | None  #: the file's own number of the cell; None if it gives none
    type: str
    status: str
    text: str  #: what the status means
    region: str | None  #: None if the mesh is of one region
    metrics: Mapping[str, float]  #: the value of each metric that was measured, J_ENS first; NaN where it has none
    nodes: tuple[CellNode, ...]
    spacing: float  #: least distance of two nodes that are apart; 0 if none are

    __repr__ = brief

    @property
    def worst(self) -> CellNode | None:
        """The node with the lowest J_ENS, the first of equal ones; None if none has a value."""
        measured = [one for one in self.nodes if not np.isnan(one.quality)]
        return min(measured, key=lambda one: one.quality, default=None)


def one_cell(quality: Quality, cell: int) -> OneCell:
    """What was measured of one cell. Raises `OptionError` if there is no such cell."""
    mesh = quality.mesh
    if not 0 <= cell < mesh.n_cells:
        raise OptionError(f"no cell {cell}: the mesh has cells 0 to {mesh.n_cells - 1}")
    row = STATUSES[Status(int(quality.status[cell]))]
    ids, names = regions(mesh)
    points = mesh.nodes(cell).tolist()
    nodes = []
    for node, (point, value) in enumerate(zip(points, node_values(quality, cell).tolist(), strict=True)):
        x, y, z = (float(v) for v in mesh.points[point])
        nodes.append(CellNode(node, point, point_label(mesh, point), (x, y, z), value))
    return OneCell(
        cell=cell,
        cell_label=cell_label(mesh, cell),
        type=type_name(int(mesh.types[cell])),
        status=row.name,
        text=row.text,
        region=names[int(ids[cell])] if len(names) > 1 else None,
        metrics={name: float(values[cell]) for name, values in quality.metrics.items()},
        nodes=tuple(nodes),
        spacing=spacing(mesh.points[points]),
    )


def node_values(quality: Quality, cell: int) -> NDArray[np.float64]:
    """J_ENS of the nodes of one cell, in their order, without measuring those of all; NaN at one that is no corner."""
    from .measure import measure

    mesh, polyhedra = quality.mesh, quality.polyhedra
    nodes = mesh.nodes(cell)
    if polyhedra is not None and int(mesh.types[cell]) == POLYHEDRON.vtk_id:
        at = int(np.searchsorted(polyhedra.cells, cell))
        mine = slice(int(polyhedra.node_offsets[at]), int(polyhedra.node_offsets[at + 1]))
        of_point = dict(zip(polyhedra.node_points[mine].tolist(), polyhedra.node_jens[mine].tolist(), strict=True))
        return np.array([of_point.get(point, np.nan) for point in nodes.tolist()], np.float64)
    alone = type(mesh)(
        points=mesh.points[nodes],
        types=mesh.types[cell : cell + 1],
        offsets=np.array([0, len(nodes)]),
        connectivity=np.arange(len(nodes)),
        copy=False,
    )
    return measure(alone).node_jens
