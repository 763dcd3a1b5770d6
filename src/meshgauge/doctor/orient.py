"""Renumbering the cells that are numbered in reverse."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..cells import type_name
from ..kernels.arrays import read_only
from ..look.names import listed
from ..look.records import brief
from ..look.style import plural
from ..mesh import Mesh
from ..mesh.cast import frozen
from ..mesh.ghosts import without_ghosts
from ..mesh.high_order import DEGREES
from ..mesh.labels import cell_labels
from ..quality.measure import Quality, measure
from ..status import Status
from . import shells
from .orientation import EXAMPLES, Orientation, orientation
from .points import duplicates, representatives
from .reversal import reversal


@dataclass(frozen=True, eq=False)
class Changes:
    """What `orient` did.

    Attributes
    ----------
    cells
        Ids of the renumbered cells, ascending.
    left
        Ids of cells that are numbered in reverse and were left so, because the order of their nodes is not known.
    orientation
        Of the mesh before.
    texts
        A sentence for each type that was renumbered or left, and for each block and type that stays inverted.
    labels
        The file's own numbers of the first few renumbered cells; empty if it numbers none.
    """

    cells: NDArray[np.int64]
    left: NDArray[np.int64]
    orientation: Orientation
    texts: tuple[str, ...]
    labels: tuple[int | None, ...] = ()

    __repr__ = brief

    def to_dict(self) -> dict[str, Any]:
        """Plain data, for JSON."""
        return {
            "n_renumbered": len(self.cells),
            "n_left": len(self.left),
            "cells": self.cells[:EXAMPLES].tolist(),
            "labels": list(self.labels),
            "texts": list(self.texts),
            "before": self.orientation.to_dict(),
        }


def orient(mesh: Mesh, quality: Quality | None = None) -> tuple[Mesh, Changes]:
    """The mesh with every cell numbered right-handed that was numbered in reverse, and what was done.

    Points, point data and cell data stay as they are; only the order of nodes within cells changes. Cells that are
    really inverted (tangled) are not touched. The mesh itself is returned if there is nothing to do.

    Parameters
    ----------
    mesh
        Any mesh.
    quality
        What was measured on it; measured here if None.
    """
    quality = quality if quality is not None else measure(mesh)
    real = without_ghosts(quality.mesh)  # ghosts stay as the piece that owns them has them
    before = _orientation(real, replace(quality, mesh=real))
    ids = before.reversed_cells
    connectivity = mesh.connectivity.copy() if len(ids) else mesh.connectivity
    done, left, texts = [np.empty(0, np.int64)], [np.empty(0, np.int64)], []
    sizes = mesh.offsets[ids + 1] - mesh.offsets[ids]
    types = mesh.types[ids]
    for vtk_id in np.unique(types):
        of_type = types == vtk_id
        n_done = n_left = 0
        for n_nodes in np.unique(sizes[of_type]):
            cells = ids[of_type & (sizes == n_nodes)]
            order = reversal(int(vtk_id), int(n_nodes))
            known = _has_one_order(mesh, cells) if order is not None else np.zeros(len(cells), bool)
            if order is not None and known.any():
                first = np.asarray(mesh.offsets[cells[known]], np.int64)[:, None]
                connectivity[first + np.arange(n_nodes)] = mesh.connectivity[first + np.array(order)]
            done.append(cells[known])
            left.append(cells[~known])
            n_done += int(known.sum())
            n_left += int((~known).sum())
        texts.extend(_texts(mesh, int(vtk_id), n_done, n_left))
    renumbered, remaining = np.sort(np.concatenate(done)), np.sort(np.concatenate(left))
    texts.extend(f"Left as they are: {b.left}." for b in before.blocks if b.left)
    first = renumbered[:EXAMPLES].tolist()
    labels = cell_labels(mesh, first)
    if labels and first:
        texts.append(f"Renumbered: {listed('cell', first, labels, more=len(renumbered) > len(first))}.")
    changes = Changes(read_only(renumbered), read_only(remaining), before, tuple(texts), labels)
    if len(renumbered) == 0:
        return mesh, changes
    return mesh.replace(connectivity=frozen(connectivity), notes=(*mesh.notes, *texts)), changes


def _orientation(mesh: Mesh, quality: Quality) -> Orientation:
    if mesh.dimension == 2:
        return shells.orientation(shells.edges_of(mesh), quality).as_numbering(mesh)
    if not (quality.status == Status.INVERTED).any():
        return orientation(quality)
    representative = representatives(mesh.points, stored=mesh.stored)
    used = np.zeros(mesh.n_points, bool)
    used[mesh.connectivity] = True
    return orientation(quality, points=representative if len(duplicates(representative, used)) else None)


def _has_one_order(mesh: Mesh, cells: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether the orders that the file states, if it does, are one in the two directions that are exchanged."""
    degrees = mesh.cell_data.get(DEGREES)
    if degrees is None or degrees.ndim != 2 or degrees.shape[1] < 2:
        return np.ones(len(cells), bool)
    return np.asarray(degrees[cells, 0] == degrees[cells, 1])


def _texts(mesh: Mesh, vtk_id: int, n_done: int, n_left: int) -> list[str]:
    n_type, name = int(np.count_nonzero(mesh.types == vtk_id)), type_name(vtk_id)
    texts = []
    of_all = f"of {plural(n_type, f'{name} cell')}"
    if n_done:
        were, are = ("was", "is") if n_done == 1 else ("were", "are")
        texts.append(f"{n_done:,} {of_all} {were} numbered in reverse and {are} renumbered.")
    if n_left:
        are = "is" if n_left == 1 else "are"
        texts.append(
            f"{n_left:,} {of_all} {are} numbered in reverse and left so: the places of their nodes are not known."
        )
    return texts
