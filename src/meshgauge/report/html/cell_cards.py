"""The worst cells one by one: each with its worst node, its neighbours, and where it is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...cells import type_name
from ...look.colours import shade
from ...look.names import cell_entry
from ...look.style import coordinates
from ...mesh.high_order import row_of
from ...mesh.labels import cell_label, point_label
from ...quality.worst import spacing
from ...status import STATUSES, Status
from .frame import ABOVE
from .page_cells import Ids, drawable, drawing_code, faces_of, nodes_of
from .picture import Picture
from .sketch import side

if TYPE_CHECKING:
    from ...quality.measure import Quality

MOST = 24
"""Cards at most: the table beside lists them all."""

INSIDE = 4
"""Cards of cells that are turned inside out between good corners, which the worst by value are not."""

AROUND = 24
"""Neighbours drawn of one cell at most, for polyhedra of many faces."""


class Card(NamedTuple):
    """One cell to look at."""

    cell: int
    type: str
    quality: float
    status: str
    node: int  #: of the cell's corners, the worst
    node_quality: float
    point: int
    coordinates: tuple[float, float, float]
    region: str
    cell_label: int | None
    point_label: int | None
    place: tuple[str, ...]  #: the coordinates as text
    model: dict[str, Any]  #: points, faces of the cell, faces of its neighbours, all in a frame of their own


def cards(picture: Picture, worst: Ids, inside: Ids) -> list[Card]:
    """Cards of the worst cells, and of some of those that are inverted ``inside``; those that cannot be drawn are left
    out. Ids are those of the mesh."""
    quality, can_be_drawn = picture.quality, drawable(picture.quality)
    extra = inside[~np.isin(inside, worst)][:INSIDE]
    cells = picture.at(np.concatenate([worst[:MOST], extra]).astype(np.int64))
    cells = cells[can_be_drawn[cells] & ~np.isnan(quality.values[cells])]
    around = neighbours(quality, cells, can_be_drawn)
    return [_card(picture, cell, near) for cell, near in zip(cells.tolist(), around, strict=True)]


def inverted_inside(status: NDArray[np.uint8], n_worst: int) -> Ids:
    """The first cells that are inverted inside, as many as have a place beside so many of the worst."""
    return np.flatnonzero(status == Status.INVERTED_INSIDE)[: INSIDE + n_worst]


def neighbours(quality: Quality, cells: Ids, can_be_drawn: NDArray[np.bool_]) -> list[list[int]]:
    """The cells that share a face with each of these, three corners or more; of surface cells an edge."""
    mesh = quality.mesh
    if not len(cells):
        return []
    own = [set(_corners(quality, cell)) for cell in cells.tolist()]
    marked = np.zeros(mesh.n_points, np.bool_)
    marked[list(set().union(*own))] = True
    at = np.flatnonzero(marked[mesh.connectivity])
    near = np.unique(np.searchsorted(mesh.offsets, at, side="right") - 1)
    corners = {cell: set(_corners(quality, cell)) for cell in near[can_be_drawn[near]].tolist()}
    least = mesh.dimension
    return [
        [other for other, theirs in corners.items() if other != cell and len(theirs & mine) >= least][:AROUND]
        for cell, mine in zip(cells.tolist(), own, strict=True)
    ]


def _corners(quality: Quality, cell: int) -> list[int]:
    row, nodes = row_of(quality.mesh, cell), quality.mesh.nodes(cell)
    return [int(nodes[m]) for m in row.corners] if row is not None and row.shape is not None else nodes.tolist()


def _card(picture: Picture, cell: int, around: list[int]) -> Card:
    quality = picture.quality
    mesh = quality.mesh
    nodes = nodes_of(quality, np.array([cell]))
    node = int(np.nanargmin(nodes.values))
    point = int(nodes.points[node])
    faces = {at: faces_of(quality, at) for at in (cell, *around)}
    used = sorted({p for of_cell in faces.values() for face in of_cell for p in face} | set(nodes.points.tolist()))
    place = {p: n for n, p in enumerate(used)}
    own = [place[p] for p in nodes.points.tolist()]
    row = row_of(mesh, cell)
    x, y, z = (float(v) for v in mesh.points[point])
    fitted = _fit(mesh.points[used], own)
    eye = ABOVE if mesh.up else side(fitted, [[place[p] for p in face] for face in faces[cell]], place[point]).round(4)
    return Card(
        cell=picture.cell(cell),
        type=type_name(int(mesh.types[cell])),
        quality=float(quality.values[cell]),
        status=STATUSES[Status(int(quality.status[cell]))].name,
        node=row.corners[node] if row is not None and row.shape is not None else node,
        node_quality=float(nodes.values[node]),
        point=picture.point(point),
        coordinates=(x, y, z),
        region=picture.names[picture.regions[cell]] if len(picture.names) > 1 else "",
        cell_label=cell_label(mesh, cell),
        point_label=point_label(mesh, point),
        place=tuple(coordinates((x, y, z), spacing(mesh.points[mesh.nodes(cell)]), digits=5)),
        model={
            "points": fitted.round(5).tolist(),
            "from": [float(x) for x in eye],
            "bad": place[point],
            "cells": [
                {
                    "faces": [[place[p] for p in face] for face in of_cell],
                    "value": float(quality.values[at]),
                    "shade": float(shade(quality.values[at : at + 1], quality.poor_limits(np.array([at])))[0]),
                    "class": drawing_code(int(quality.status[at]), mesh.purpose),
                    "name": f"{type_name(int(mesh.types[at]))} {cell_entry(picture.cell(at), cell_label(mesh, at))}",
                }
                for at, of_cell in faces.items()
            ],
        },
    )


def _fit(points: NDArray[Any], own: list[int]) -> NDArray[np.float64]:
    """Points moved and scaled so that the cell itself, of these points, fills the ball of radius 1 about the origin."""
    exact = points.astype(np.float64)
    exact = exact / (float(np.abs(exact).max()) or 1.0)
    exact = exact - exact[own].mean(axis=0)
    radius = float(np.linalg.norm(exact[own], axis=1).max()) or float(np.linalg.norm(exact, axis=1).max()) or 1.0
    fitted: NDArray[np.float64] = exact / radius
    # A neighbour that reaches a million times further is cut off by the picture anyway.
    return np.clip(fitted, -1e4, 1e4)
