"""A mesh of what most formats of finite elements hold: nodes and elements by numbers, and a type for each element."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...cells import BY_NAME
from ...errors import ReadError
from ...mesh import Mesh
from ...mesh.labels import LABEL
from . import budget
from .build import Ints, Kind, gather
from .ids import Index, drop_counts, pad_labels
from .nodes import fill_middles


def assemble(
    path: Path,
    node_labels: Ints,
    points: NDArray[np.float64],
    labels: Ints,
    codes: Ints,
    nodes: Ints,
    first: Ints,
    kinds: Mapping[int, Kind],
    *,
    cell_data: Mapping[str, NDArray[Any]],
    field_data: Mapping[str, NDArray[Any]] | None = None,
    notes: tuple[str, ...] = (),
) -> Mesh:
    """Elements in the order of the file, with the numbers of elements and nodes as labels.

    Parameters
    ----------
    path
        Of the file, for errors.
    node_labels, points
        ``(n,)`` and ``(n, 3)``. Of nodes of one number the first counts.
    labels, codes, first
        ``(n,)`` number and type of each element, and where its nodes start in ``nodes``.
    nodes
        Numbers of the nodes of all elements; 0 is one that the file leaves out at the middle of an edge.
    kinds
        Element types by their codes; of one whose order lists less nodes than it has the others are left out.
    cell_data, field_data, notes
        As in `Mesh`.

    Raises
    ------
    ReadError
        If there are no elements, or one refers to a node that does not exist, or lacks a corner.
    """
    if not len(codes):
        raise ReadError(f"{path}: no elements were found in it")
    budget.draw("made", 8 * (len(nodes) + len(node_labels)), "the elements")
    cells = gather(nodes, first, codes, kinds)
    places = Index(node_labels).of(cells.connectivity)
    is_wrong = (places < 0) & (cells.connectivity != 0)
    if is_wrong.any():
        at = int(np.argmax(is_wrong))
        element = int(labels[np.searchsorted(cells.offsets, at, side="right") - 1])
        raise ReadError(f"{path}: element {element} refers to node {int(cells.connectivity[at])}, which does not exist")
    cells.connectivity[:] = places
    points, filled = fill_middles(points, cells)
    if cells.connectivity.min() < 0:
        element = int(labels[np.searchsorted(cells.offsets, int(np.argmin(cells.connectivity)), side="right") - 1])
        raise ReadError(f"{path}: element {element} lacks a node that is no middle of an edge")
    mesh = Mesh(
        points,
        cells.types,
        cells.offsets,
        cells.connectivity,
        point_data={LABEL: pad_labels(node_labels, len(points))},
        cell_data={LABEL: labels, **cell_data},
        field_data=dict(field_data or {}),
        path=str(path),
        notes=(*notes, *_reduced(codes, kinds), *filled),
        copy=False,
    )
    return drop_counts(mesh)


def _reduced(codes: Ints, kinds: Mapping[int, Kind]) -> tuple[str, ...]:
    """A note for each type of which nodes are left out."""
    present, counts = np.unique(codes, return_counts=True)
    return tuple(
        f"{int(n):,} cells of {kinds[code].n_nodes} nodes became {kinds[code].name} cells of "
        f"{BY_NAME[kinds[code].name].n_nodes}: the other nodes were left out."
        for code, n in zip(present.tolist(), counts, strict=True)
        if 0 < len(kinds[code].order) < kinds[code].n_nodes
    )


def named_numbers(key: str, names: Mapping[int, str]) -> dict[str, NDArray[Any]]:
    """Field data that name the values of the cell data ``key``: a name of several numbers has each behind it."""
    if not names:
        return {}
    taken: dict[str, int] = {}
    for name in names.values():
        taken[name] = taken.get(name, 0) + 1
    titles = [name if taken[name] == 1 else f"{name} ({number})" for number, name in names.items()]
    budget.draw_names(titles, f"the names of {key}")
    return {f"{key}:names": np.array(titles), f"{key}:numbers": np.array(list(names), np.int64)}
