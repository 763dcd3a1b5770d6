"""Which points of a mesh of surface cells must stay where they are, and why."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..doctor import shells
from ..look.style import number_of
from ..quality.measure import Quality
from ..status import is_measured
from .constraints import Mask, coincident
from .faces import mask_of
from .kept import kept_regions
from .problem import Ids
from .whole import Options


@dataclass(frozen=True, eq=False)
class Held:
    """Which points stay, and why."""

    boundary: Mask
    interface: Mask
    pinned: Mask
    region_ids: Ids
    region_names: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def fixed(self) -> Mask:
        return self.boundary | self.interface | self.pinned


def held_of(before: Quality, fixed: Mask, options: Options) -> tuple[Held, Mask]:
    """What stays in a mesh of surfaces, and ``(n_cells,)`` which cells take part."""
    mesh, notes = before.mesh, []
    n = mesh.n_points
    takes_part, is_cell = np.zeros(mesh.n_cells, bool), np.zeros(mesh.n_cells, bool)
    for row, _, some in mesh.groups():
        if row is not None and row.dimension == 2:
            is_cell[some] = True
            takes_part[some] = row.shape is not None and not row.is_curved
    takes_part &= is_measured(before.status)
    owner = np.repeat(np.arange(mesh.n_cells), np.diff(mesh.offsets))
    pinned = fixed | mask_of(n, mesh.connectivity[~is_cell[owner]])
    aside = is_cell & ~takes_part
    if aside.any():
        pinned |= mask_of(n, mesh.connectivity[aside[owner]])
        what = number_of(int(aside.sum()), "surface cell takes", "surface cells take")
        notes.append(f"{what} no part (curved, ghosts or not measured): their points stay.")
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
    if between.any():
        count = number_of(int(np.count_nonzero(between)) // 2, "edge between regions is", "edges between regions are")
        notes.append(f"{count} kept where they are.")
    if edges.multiple:
        notes.append("Edges of three cells or more stay like the boundary.")
    return Held(boundary, interface, pinned, ids, names, tuple(notes)), takes_part
