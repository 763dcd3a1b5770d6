"""Which points of a mesh of surface cells must stay where they are, and why."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...cells import CELL_TYPES
from ...doctor import shells
from ...look.style import number_of
from ...mesh import Mesh
from ...mesh.connectivity import pick
from ...quality.measure import Quality
from ...status import is_measured
from ..constraints import Mask, coincident
from ..curved import can_follow, node_between
from ..faces import mask_of
from ..kept import kept_regions
from ..problem import Ids
from ..whole import Options

IS_LINE = np.array([t in CELL_TYPES and CELL_TYPES[t].dimension == 1 for t in range(256)])
"""Whether a VTK id is that of a line cell, ``(256,)``."""


@dataclass(frozen=True, eq=False)
class Held:
    """Which points stay, and why.

    Attributes
    ----------
    boundary, interface
        ``(n_points,)`` those of edges that not two cells have, and of edges between regions.
    lines
        Those of line cells.
    pinned
        Those that stay wherever points slide: asked for, coinciding, of vertex cells and of cells that take no part.
    features
        In space those of sharp edges; none in a plane.
    """

    boundary: Mask
    interface: Mask
    lines: Mask
    pinned: Mask
    features: Mask
    edges: shells.Edges
    region_ids: Ids
    region_names: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def fixed(self) -> Mask:
        """``(n_points,)`` those that stay as long as the boundary is fixed."""
        return self.boundary | self.interface | self.lines | self.pinned | self.features


def held_of(before: Quality, fixed: Mask, options: Options) -> tuple[Held, Mask]:
    """What stays in a mesh of surfaces, and ``(n_cells,)`` which cells take part."""
    mesh, notes = before.mesh, []
    n = mesh.n_points
    takes_part, is_cell = np.zeros(mesh.n_cells, bool), np.zeros(mesh.n_cells, bool)
    for row, _, some in mesh.groups():
        if row is not None and row.dimension == 2:
            is_cell[some] = True
            takes_part[some] = row.shape is not None and can_follow(row)
    takes_part &= is_measured(before.status)
    owner = np.repeat(np.arange(mesh.n_cells), np.diff(mesh.offsets))
    is_line = IS_LINE[mesh.types]
    lines = mask_of(n, mesh.connectivity[is_line[owner]])
    pinned = fixed | mask_of(n, mesh.connectivity[~(is_cell | is_line)[owner]])
    aside = is_cell & ~takes_part
    if aside.any():
        pinned |= mask_of(n, mesh.connectivity[aside[owner]])
        what = number_of(int(aside.sum()), "surface cell takes", "surface cells take")
        notes.append(f"{what} no part (of high order, ghosts or not measured): their points stay.")
    used = mask_of(n, mesh.connectivity[takes_part[owner]])
    together, n_together = coincident(mesh, used)
    if n_together:
        pinned |= together
        notes.append(f"{number_of(n_together, 'point coincides', 'points coincide')} with another, and stays.")
    edges = shells.edges_of(mesh)
    ids, names = kept_regions(mesh, options.keep)
    is_alone = edges.mates == np.arange(len(edges.mates))
    boundary = mask_of(n, edges.ends[is_alone])
    between = ids[edges.cells] != ids[edges.cells[edges.mates]]
    interface = mask_of(n, edges.ends[between]) & ~boundary
    boundary |= _between(mesh, boundary)
    interface |= _between(mesh, interface) & ~boundary
    if between.any():
        count = number_of(int(np.count_nonzero(between)) // 2, "edge between regions is", "edges between regions are")
        notes.append(f"{count} kept{'' if options.slides else ' where they are'}.")
    if edges.multiple:
        notes.append(f"Edges of three cells or more {'are kept' if options.slides else 'stay like the boundary'}.")
    none = np.zeros(n, bool)
    return Held(boundary, interface, lines, pinned, none, edges, ids, names, tuple(notes)), takes_part


def _between(mesh: Mesh, ends: Mask) -> Mask:
    """``(n_points,)`` nodes of curved cells on edges whose ends are both marked; an edge inside may be among them."""
    mark = np.zeros(mesh.n_points, bool)
    for row, _, some in mesh.groups():
        if row is None or row.shape is None or not row.is_curved or not can_follow(row):
            continue
        nodes = pick(mesh, row, np.arange(mesh.n_cells)[some], tuple(range(row.n_nodes or 0)))
        for a, b in row.shape.edges:
            middle = node_between(row, a, b)
            if middle is not None:
                held = ends[nodes[:, row.corners[a]]] & ends[nodes[:, row.corners[b]]]
                mark[nodes[held, middle]] = True
    return mark
