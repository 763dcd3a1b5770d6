"""What writers of our own share: cells by the types of a format, and sentences on what it cannot hold."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from ...cells import BY_NAME, CELL_TYPES, type_name
from ...errors import WriteError
from ...mesh import CellBlock, Mesh
from ...mesh.cast import frozen
from ...mesh.labels import LABEL
from ...mesh.regions import named_blocks

Ints = NDArray[np.int64]

REGION = "region"
"""Cell data that `meshgauge.io.write` adds to tell the block of a cell; ``region:names`` are its names."""

_PIXEL, _VOXEL = BY_NAME["pixel"].vtk_id, BY_NAME["voxel"].vtk_id
_PLAIN = {_PIXEL: ("quad", (0, 1, 3, 2)), _VOXEL: ("hexahedron", (0, 1, 3, 2, 4, 5, 7, 6))}
"""Types that most formats do not have: what they are written as, and which node stands where."""


def plain(mesh: Mesh) -> Mesh:
    """Pixels and voxels as quads and hexahedra, in their order of nodes."""
    if not np.isin(mesh.types, list(_PLAIN)).any():
        return mesh
    types, connectivity = mesh.types.copy(), mesh.connectivity.copy()
    for vtk_id, (name, order) in _PLAIN.items():
        cells = np.flatnonzero(mesh.types == vtk_id)
        at = mesh.offsets[cells][:, None]
        connectivity[at + np.arange(len(order))] = mesh.connectivity[at + np.array(order)]
        types[cells] = BY_NAME[name].vtk_id
    return mesh.replace(types=frozen(types), connectivity=frozen(connectivity))


def type_counts(types: NDArray[np.uint8]) -> dict[int, int]:
    """Number of cells by VTK id, pixels and voxels counted as what `plain` makes of them."""
    counts: dict[int, int] = {}
    for vtk_id, n in zip(*np.unique(types, return_counts=True), strict=True):
        key = BY_NAME[_PLAIN[vtk_id][0]].vtk_id if vtk_id in _PLAIN else int(vtk_id)
        counts[key] = counts.get(key, 0) + int(n)
    return counts


def with_regions(mesh: Mesh) -> Mesh:
    """Blocks with names of their own also as cell data, which more formats hold: numbers from 1 and their names."""
    blocks = named_blocks(mesh)
    if blocks is None or REGION in mesh.cell_data:
        return mesh
    ids, names = blocks
    return mesh.replace(
        cell_data={**mesh.cell_data, REGION: (ids + 1).astype(np.int32)},
        field_data={**mesh.field_data, f"{REGION}:names": np.array(names)},
    )


def check_types(mesh: Mesh, known: Iterable[str]) -> None:
    """Raise `WriteError` for cells of any other type, with how many there are."""
    ids = [BY_NAME[name].vtk_id for name in known]
    others, counts = np.unique(mesh.types[~np.isin(mesh.types, ids)], return_counts=True)
    if len(others):
        what = ", ".join(f"{n} {type_name(t)}" for t, n in zip(others, counts, strict=True))
        raise WriteError(f"the format cannot hold these cells: {what}")


def without_lesser(mesh: Mesh, known: Iterable[str], kept_dimension: int | None = None) -> tuple[Mesh, tuple[str, ...]]:
    """The mesh without cells of lower dimension than its highest of types that are not known; a note counts them.

    With ``kept_dimension`` also without those of a known type below it. All points stay.
    """
    dimension = np.array([CELL_TYPES[t].dimension if t in CELL_TYPES else -1 for t in range(256)])[mesh.types]
    highest = int(dimension.max(initial=0))
    ids = {BY_NAME[name].vtk_id for name in (*known, *(name for name, _ in _PLAIN.values()), "pixel", "voxel")}
    is_lesser = dimension < highest
    gone = is_lesser & ~np.isin(mesh.types, list(ids))
    if kept_dimension is not None:
        gone |= is_lesser & (dimension < kept_dimension)
    if not gone.any():
        return mesh, ()
    what = [f"{n:,} {type_name(t)}" for t, n in zip(*np.unique(mesh.types[gone], return_counts=True), strict=True)]
    kept = np.flatnonzero(~gone)
    sizes = np.diff(mesh.offsets)
    bounds = np.searchsorted(kept, [block.stop for block in mesh.blocks]).tolist()
    blocks = zip(mesh.blocks, [0, *bounds], bounds, strict=False)
    reduced = mesh.replace(
        types=frozen(mesh.types[kept]),
        offsets=frozen(np.concatenate([[0], np.cumsum(sizes[kept])]).astype(np.int64)),
        connectivity=frozen(mesh.connectivity[np.repeat(~gone, sizes)]),
        cell_data={name: values[kept] for name, values in mesh.cell_data.items()},
        blocks=tuple(CellBlock(block.name, start, stop) for block, start, stop in blocks if stop > start),
        counted=tuple(noun for noun in mesh.counted if noun != "cells"),
    )
    return reduced, (f"The format could not hold cells of lower dimension: {', '.join(what)} left out.",)


def named_by(mesh: Mesh, names: Iterable[str]) -> set[str]:
    """Field data that hold names of regions and no others than these, with their numbers."""
    known = set(names)
    found = {
        key
        for key, values in mesh.field_data.items()
        if key.endswith(":names") and values.dtype.kind == "U" and known.issuperset(values.ravel().tolist())
    }
    return found | {f"{key.removesuffix(':names')}:numbers" for key in found}


def nodes_of(mesh: Mesh, cells: Ints) -> Ints:
    """``(n, k)`` nodes of cells of one type."""
    if not len(cells):
        return np.empty((0, 0), np.int64)
    k = int(mesh.offsets[cells[0] + 1] - mesh.offsets[cells[0]])
    return np.asarray(mesh.connectivity[mesh.offsets[cells][:, None] + np.arange(k)], np.int64)


def loss_notes(
    mesh: Mesh, *, point: Iterable[str] = (), cell: Iterable[str] = (), field: Iterable[str] = ()
) -> tuple[str, ...]:
    """A sentence for each kind of data that is not all among the names that were kept."""
    kept: Mapping[str, set[str]] = {
        "point": set(point),
        "cell": {REGION, *cell},
        "field": {f"{REGION}:names", *field},
    }
    sentences = []
    for what, data in (("point", mesh.point_data), ("cell", mesh.cell_data), ("field", mesh.field_data)):
        gone = [name for name in data if name not in kept[what] and not (name == LABEL and _are_positions(data[name]))]
        if gone:
            sentences.append(f"The format could not hold the {what} data {', '.join(map(repr, gone))}.")
    return tuple(sentences)


def _are_positions(labels: NDArray[np.generic]) -> bool:
    """True for 1, 2, 3, ...: nothing is lost without them."""
    return np.array_equal(labels, np.arange(1, len(labels) + 1))


def numbers(data: Mapping[str, NDArray[np.generic]], n: int, largest: int) -> Ints:
    """The labels of cells or points where a format can hold them (positive, each once), else 1 to ``n``."""
    labels = data.get(LABEL)
    if labels is not None and labels.ndim == 1 and labels.dtype.kind in "iu" and n:
        whole = labels.astype(np.int64)
        if int(whole.min()) > 0 and int(whole.max()) <= largest and len(np.unique(whole)) == n:
            return whole
    return np.arange(1, n + 1)


def rows(table: NDArray[np.generic], separator: str = " ") -> str:
    """A line for each row of numbers, floats so that they come back exactly."""
    return "".join(separator.join(map(repr, row)) + "\n" for row in table.tolist())
