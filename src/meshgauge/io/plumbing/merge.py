"""Parts of a mesh (pieces, zones, blocks) put one after another."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...mesh import CellBlock, Mesh
from ...mesh.labels import LABEL, NO_LABEL, labels_of
from ...mesh.mesh import GHOST_TYPE
from ...mesh.plane import seen_from
from ...mesh.polyhedra import IndexArray, Polyhedra


def join_pieces(meshes: Sequence[Mesh], names: Sequence[str], *, path: Path, names_blocks: bool) -> Mesh:
    """Pieces of one mesh put one after another; notes name arrays that some of them lack.

    Points are not merged. ``names`` call the pieces in notes, and with ``names_blocks`` those of the blocks begin with
    them.
    """
    parts = [part(mesh, name) for mesh, name in zip(meshes, names, strict=True)]
    whole = merge_parts(parts, path=path)
    blocks, start = [], 0
    for mesh, name in zip(meshes, names, strict=True):
        for block in mesh.blocks:
            if block.stop > block.start:
                called = ": ".join(filter(None, (name, block.name))) if names_blocks else block.name
                blocks.append(CellBlock(called, start + block.start, start + block.stop))
        start += mesh.n_cells
    seen = {mesh.up for mesh in meshes if mesh.n_cells}
    # A format may say that all is in a plane seen from +z, which points of three coordinates do not.
    is_said = whole.dimension == 2 and len(seen) == 1 and (len(meshes) == 1 or whole.up != 0)
    whole = seen_from(whole, seen.pop()) if is_said else whole
    return whole.replace(
        blocks=tuple(blocks) if any(block.name for block in blocks) else (),
        notes=(*whole.notes, *_lacking(meshes, names)),
        purpose="fv" if any(mesh.purpose == "fv" for mesh in meshes) else "fem",
        stored="single" if any(mesh.stored == "single" for mesh in meshes if mesh.n_points) else "double",
    )


def part(mesh: Mesh, name: str = "") -> Part:
    """A mesh as a part of another."""
    point_data, cell_data = dict(mesh.point_data), dict(mesh.cell_data)
    for data, labels in ((point_data, labels_of(mesh, "point")), (cell_data, labels_of(mesh, "cell"))):
        if labels is not None:
            data[LABEL] = labels
    return Part(
        name,
        mesh.points,
        mesh.types,
        mesh.offsets,
        mesh.connectivity,
        mesh.polyhedra,
        point_data,
        cell_data,
        dict(mesh.field_data),
        list(mesh.notes),
    )


def _lacking(meshes: Sequence[Mesh], names: Sequence[str]) -> list[str]:
    """A sentence for each array that some of the pieces lack and others have; pieces without cells lack nothing."""
    there = [(mesh, name) for mesh, name in zip(meshes, names, strict=True) if mesh.n_cells]
    notes = []
    for what, kind in (("point", "point_data"), ("cell", "cell_data")):
        arrays = dict.fromkeys(key for mesh, _ in there for key in getattr(mesh, kind))
        for array in arrays:
            without = [name for mesh, name in there if array not in getattr(mesh, kind)]
            if without and array != GHOST_TYPE:  # where it is missing, nothing is a ghost
                more = f" and {len(without) - _NAMED} more" if len(without) > _NAMED else ""
                notes.append(f"The {what} data {array!r} are missing in {', '.join(without[:_NAMED])}{more}.")
    return notes


_NAMED = 3
"""Pieces that a note names."""


def starts(sizes: Iterable[int], own: Iterable[tuple[int, ...]] = ()) -> tuple[int, ...]:
    """The first point of each of several parts of so many, as `Mesh.parts` has them; of one part none.

    ``own``: those of each part that consists of parts.
    """
    ends = np.cumsum([0, *sizes]).tolist()
    of_parts = list(own) or [()] * (len(ends) - 1)
    firsts = tuple(end + first for end, some in zip(ends, of_parts, strict=False) for first in some or (0,))
    return firsts if len(firsts) > 1 else ()


@dataclass(slots=True)
class Part:
    """One part: arrays as in `Mesh`, with point ids of its own."""

    name: str
    points: NDArray[Any]
    types: NDArray[Any]
    offsets: IndexArray
    connectivity: IndexArray
    polyhedra: Polyhedra | None = None
    point_data: dict[str, NDArray[Any]] = field(default_factory=dict)
    cell_data: dict[str, NDArray[Any]] = field(default_factory=dict)
    field_data: dict[str, NDArray[Any]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def merge_parts(
    parts: Sequence[Part],
    *,
    path: Path | None = None,
    field_data: Mapping[str, NDArray[Any]] | None = None,
    points: NDArray[Any] | None = None,
) -> Mesh:
    """One mesh of all parts, a block each, in their order. Points are not merged.

    With ``points`` all parts refer to these, and must have none of their own.

    Data that some parts lack are filled: numbers with NaN, strings with the empty string. A single part keeps its
    arrays as they are.
    """
    parts = [p for p in parts if len(p.types) or len(p.points)]
    fields = {**(field_data or {})}
    for part in parts:
        for name, values in part.field_data.items():
            fields.setdefault(name, values)
    if len(parts) == 1:
        own_points, types, offsets = parts[0].points, parts[0].types, parts[0].offsets
        connectivity, polyhedra = parts[0].connectivity, parts[0].polyhedra
    else:
        own_points = _stack([p.points for p in parts], np.empty((0, 3)))
        types = _stack([p.types for p in parts], np.empty(0, np.uint8))
        offsets = _joined_offsets([p.offsets for p in parts])
        starts = _starts([len(p.points) for p in parts])
        connectivity = _shift([p.connectivity for p in parts], starts)
        polyhedra = _joined_polyhedra(parts, starts)
    n_points, n_cells = [len(p.points) for p in parts], [len(p.types) for p in parts]
    cell_starts = _starts(n_cells)
    return Mesh(
        points=own_points if points is None else points,
        types=types,
        offsets=offsets,
        connectivity=connectivity,
        polyhedra=polyhedra,
        blocks=tuple(
            CellBlock(p.name, start, start + n) for p, start, n in zip(parts, cell_starts, n_cells, strict=True) if n
        ),
        point_data=_joined_data([p.point_data for p in parts], n_points),
        cell_data=_joined_data([p.cell_data for p in parts], n_cells),
        field_data=fields,
        path=str(path) if path is not None else None,
        notes=tuple(dict.fromkeys(note for p in parts for note in p.notes)),
        copy=False,
    )


def _starts(sizes: Sequence[int]) -> list[int]:
    return [0, *np.cumsum(sizes, dtype=np.int64).tolist()][: len(sizes)]


def _stack(arrays: list[NDArray[Any]], empty: NDArray[Any]) -> NDArray[Any]:
    return np.concatenate(arrays) if arrays else empty


def _shift(arrays: Sequence[IndexArray], starts: Sequence[int]) -> IndexArray:
    """Ids of all parts, each increased by the start of its part; int64, as the sum may not fit int32."""
    joined = np.empty(sum(len(a) for a in arrays), np.int64)
    at = 0
    for array, start in zip(arrays, starts, strict=True):
        # A bad id must stay bad: shifted, a negative one could fall into an earlier part.
        np.add(array, start, out=joined[at : at + len(array)], where=array >= 0)
        joined[at : at + len(array)][array < 0] = -1
        at += len(array)
    return joined


def _joined_offsets(arrays: Sequence[IndexArray]) -> IndexArray:
    joined = np.zeros(sum(len(a) - 1 for a in arrays) + 1, np.int64)
    at, shift = 0, 0
    for array in arrays:
        n = len(array) - 1
        np.add(array[1:], shift, out=joined[at + 1 : at + 1 + n])
        at, shift = at + n, shift + (int(array[-1]) if n else 0)
    return joined


def _joined_polyhedra(parts: Sequence[Part], point_starts: Sequence[int]) -> Polyhedra | None:
    if all(p.polyhedra is None for p in parts):
        return None
    none = np.zeros(0, np.int64)
    polys = [
        p.polyhedra.with_own_faces()
        if p.polyhedra is not None
        else Polyhedra(np.zeros(len(p.types) + 1, np.int64), none, np.zeros(1, np.int64), none)
        for p in parts
    ]
    return Polyhedra(
        cell_offsets=_joined_offsets([p.cell_offsets for p in polys]),
        cell_faces=_shift([p.cell_faces for p in polys], _starts([p.n_faces for p in polys])),
        face_offsets=_joined_offsets([p.face_offsets for p in polys]),
        face_points=_shift([p.face_points for p in polys], point_starts),
        labels=_joined_labels(polys),
    )


def _joined_labels(polys: Sequence[Polyhedra]) -> IndexArray | None:
    """Numbers of faces, where every part with faces has them; those of several parts may be the same."""
    labels = [p.labels for p in polys if p.n_faces]
    known = [one for one in labels if one is not None]
    return np.concatenate(known) if known and len(known) == len(labels) else None


def _joined_data(data: Sequence[dict[str, NDArray[Any]]], sizes: Sequence[int]) -> dict[str, NDArray[Any]]:
    if len(data) == 1:
        return data[0]
    joined = {}
    for name in dict.fromkeys(key for d in data for key in d):
        arrays = [d[name] for d in data if name in d]
        shape = arrays[0].shape[1:]
        if any(a.shape[1:] != shape for a in arrays):
            # Parts may use one name for a scalar here and a vector there; neither can hold the other.
            for index, d in enumerate(data):
                if name in d:
                    only = [{f"{name} ({index})": d[name]} if k == index else {} for k in range(len(data))]
                    joined.update(_joined_data(only, sizes))
            continue
        rows = [d[name] if name in d else _filler(arrays[0], n, name) for d, n in zip(data, sizes, strict=True)]
        joined[name] = np.concatenate(rows)
    return joined


def _filler(like: NDArray[Any], n: int, name: str) -> NDArray[Any]:
    """``n`` rows that say "nothing here"; none leaves the type of the others as it is."""
    shape = (n, *like.shape[1:])
    if n == 0:
        return np.empty(shape, like.dtype)
    if like.dtype.kind in "US" or name == GHOST_TYPE:  # where a piece says nothing, nothing is a ghost
        return np.zeros(shape, like.dtype)
    if name == LABEL and like.dtype == np.int64:
        return np.full(shape, NO_LABEL, np.int64)
    return np.full(shape, np.nan, like.dtype if like.dtype.kind == "f" else np.float64)
