"""A decomposed case, or one of several regions, a piece at a time.

A polyMesh lists faces, not cells: to have some of its cells all of it is read. So each is read when some of it is asked
for, and forgotten when others are; what is small (types of cells, faces of patches) is kept in each process.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....kernels.polyhedra.codes import INNER, PATCH
from ....mesh.polyhedra import Polyhedra
from ...plumbing import face_based
from ...plumbing.made_rows import INT, RaisedRows, SameRows
from ...plumbing.merge import starts
from ...plumbing.pieces import ArrayRows, Piece, Pieces, Rows, Stamp, stamp
from .read import PolyMesh, folders, has_ids, notes_on, path_of, poly_mesh, steps

KEPT = 2
"""Meshes that are kept at a time: slices at the end of one and at the start of the next are worked on at once."""

MOST = 10_000
"""Meshes of which what is small is kept at a time."""

Arrays = Mapping[str, NDArray[Any]]

_POLYHEDRA = ("cell_offsets", "cell_faces", "face_offsets", "face_points", "labels", "beyond")
_BIG = ("points", "numbers", "offsets", "connectivity", *_POLYHEDRA)
"""Arrays that are forgotten."""


@dataclass(frozen=True)
class Source:
    """One polyMesh of several.

    Attributes
    ----------
    name, folder
        Of the processor or region.
    state
        Of its files: others of the same names hold others.
    is_sorted
        Points have numbers of the whole mesh, and are in their order.
    is_alone
        It is read without the others: it is one piece with its patches, and ends where the next processor begins.
    """

    name: str
    folder: str
    state: tuple[Stamp, ...]
    is_sorted: bool
    is_alone: bool


@dataclass(frozen=True)
class _Listed:
    """What is known of a polyMesh when it was read once: all but the arrays. The ``first_face`` and ``first_point`` are
    those that it would have behind the others."""

    source: Source
    n_cells: int
    n_faces: int
    n_points: int
    first_face: int
    first_point: int
    is_single: bool
    patches: tuple[tuple[str, int], ...]  #: name and faces
    kinds: Mapping[str, tuple[np.dtype[Any], tuple[int, ...]]]  #: dtype and shape of each array


def pieces(path: Path, at: int) -> Pieces | None:
    """A piece for the cells of each processor, or region, then one for the faces of each patch in each; of a single
    processor one for all.

    None of a case that is neither: to have some of its cells all of it would be read.
    """
    states = steps(path)
    read_from = folders(path, states[at].name if states else "constant")
    if len(read_from) < 2 and not read_from[0][0].startswith("processor"):
        return None
    is_sorted = all(name.startswith("processor") and has_ids(own) for name, own in read_from)
    listed: list[_Listed] = []
    for name, folder in read_from:
        files = (path_of(folder, file) for file in ("points", "faces", "owner", "boundary"))
        state = tuple(stamp(str(file)) for file in files if file.is_file())
        listed.append(_list(Source(name, str(folder), state, is_sorted, len(read_from) == 1), listed[-1:]))
    own = [_cells(one) for one in listed]
    for patch in dict.fromkeys(patch for one in listed for patch, _ in one.patches if not one.source.is_alone):
        own += [_faces(one, patch) for one in listed if patch in dict(one.patches)]
    own = [one for one in own if one[0].n_cells]
    if not own:
        return None
    return Pieces(
        str(path),
        tuple(piece for piece, _ in own),
        {},
        notes_on(read_from, is_joined=is_sorted),
        stored="single" if any(one.is_single for one in listed) else None,
        parts=starts(piece.n_points for piece, _ in own),
        purpose="fv",
        point_numbers=tuple(numbers for _, numbers in own) if len(own) > 1 else (),
        in_one_go=True,
    )


TAKES = 12
"""Times the bytes of a binary polyMesh that reading and measuring it as a whole takes, with what finite volumes ask."""

PACKED = 4
"""Times the bytes of a file packed by gzip that it has unpacked, about."""


def takes(path: Path) -> int:
    """See `Format`; of ``constant``, which other times are like."""
    total = 0
    for _, folder in folders(path, "constant"):
        for name in ("points", "faces", "owner", "neighbour"):
            file = path_of(folder, name)
            total += file.stat().st_size * (PACKED if file.suffix == ".gz" else 1) if file.is_file() else 0
    return TAKES * total


def _list(source: Source, before: list[_Listed]) -> _Listed:
    mesh, arrays = _load(source)
    return _Listed(
        source,
        mesh.n_cells,
        len(mesh.owner),
        len(mesh.points),
        sum(one.first_face + one.n_faces for one in before),
        sum(one.first_point + one.n_points for one in before),
        mesh.is_single,
        tuple((patch, len(own)) for patch, own in mesh.patches if len(own)),
        {key: (values.dtype, values.shape) for key, values in arrays.items()},
    )


def _rows(one: _Listed, key: str) -> Rows:
    dtype, shape = one.kinds[key]
    return _OfMesh(one.source, key, dtype, shape)


def _cells(one: _Listed) -> tuple[Piece, Rows]:
    """The cells of a polyMesh, with the faces of patches if it is alone, and the numbers of their points."""
    blocks, at = [(one.source.name, 0, one.n_cells)], one.n_cells
    for patch, n in one.patches:
        blocks.append((patch, at, at + n))
        at += n
    polyhedra = {key: _rows(one, key) for key in _POLYHEDRA}
    polyhedra["labels"] = RaisedRows(polyhedra["labels"], one.first_face)
    piece = Piece(
        one.source.name,
        _rows(one, "points"),
        _rows(one, "types"),
        _rows(one, "offsets"),
        _rows(one, "connectivity"),
        polyhedra,
        {},
        {},
        tuple(blocks) if one.source.is_alone else (),
    )
    return piece, _numbers(one, "numbers")


def _numbers(one: _Listed, key: str) -> Rows:
    """Those of the whole mesh, or those that the points have one behind the other."""
    return _rows(one, key) if one.source.is_sorted else RaisedRows(_rows(one, key), one.first_point)


def _faces(one: _Listed, patch: str) -> tuple[Piece, Rows]:
    """The faces of a patch as surface cells, and the numbers of their points."""
    n = one.kinds[f"{patch}/types"][1][0]
    none = ArrayRows(np.empty(0, np.int64))
    polyhedra: dict[str, Rows] = dict.fromkeys(("cell_faces", "face_points", "labels", "beyond"), none)
    polyhedra |= {"cell_offsets": SameRows(0, INT, (n + 1,)), "face_offsets": SameRows(0, INT, (1,))}
    points, types, offsets, connectivity = (
        _rows(one, f"{patch}/{key}") for key in ("points", "types", "offsets", "connectivity")
    )
    return Piece(patch, points, types, offsets, connectivity, polyhedra, {}, {}), _numbers(one, f"{patch}/numbers")


def _arrays_of(mesh: PolyMesh, source: Source) -> dict[str, NDArray[Any]]:
    """All arrays of the pieces of a polyMesh, points in the order of their numbers, as in the whole mesh."""
    points, face_points = mesh.points, mesh.face_points
    numbers = mesh.point_ids if source.is_sorted and mesh.point_ids is not None else np.arange(len(points))
    if (np.diff(numbers) < 0).any():
        order = np.argsort(numbers, kind="stable")
        rank = np.empty(len(order), np.int64)
        rank[order] = np.arange(len(order))
        points, numbers, face_points = points[order], numbers[order], rank[face_points]
    offsets, faces, is_neighbour = face_based.of_cells(mesh.n_cells, mesh.owner, mesh.neighbour)
    solids = face_based.solids(face_based.Faces(offsets, faces, mesh.face_offsets, face_points, is_neighbour), points)
    none = np.empty(0, np.int64)
    poly = solids.polyhedra
    if poly is None:
        poly = Polyhedra(np.zeros(mesh.n_cells + 1, np.int64), none, np.zeros(1, np.int64), none, labels=none)
    beyond = np.where(mesh.neighbour >= 0, INNER, PATCH)
    if source.is_sorted and not source.is_alone:
        beyond[mesh.between] = INNER
    arrays: dict[str, NDArray[Any]] = {
        "points": points,
        "types": solids.types,
        "offsets": solids.offsets,
        "connectivity": solids.connectivity,
    }
    for number, (patch, own) in enumerate(mesh.patches, PATCH + 1):
        beyond[own] = number
        if source.is_alone:
            continue
        sizes = np.diff(mesh.face_offsets)[own]
        used, local = np.unique(face_points[face_based.spans(mesh.face_offsets[own], sizes)], return_inverse=True)
        arrays |= {
            f"{patch}/points": points[used],
            f"{patch}/types": face_based.surface_types(sizes),
            f"{patch}/offsets": face_based.offsets_of(sizes),
            f"{patch}/connectivity": local.reshape(-1).astype(np.int64),
            f"{patch}/numbers": numbers[used],
        }
    if source.is_alone:
        own = np.concatenate([none, *(faces for _, faces in mesh.patches)])
        sizes = np.diff(mesh.face_offsets)[own]
        arrays["types"] = np.concatenate([solids.types, face_based.surface_types(sizes)])
        arrays["offsets"] = np.concatenate([solids.offsets, solids.offsets[-1] + np.cumsum(sizes)])
        nodes = face_points[face_based.spans(mesh.face_offsets[own], sizes)]
        arrays["connectivity"] = np.concatenate([solids.connectivity, nodes])
        ends = np.full(len(own), poly.cell_offsets[-1])
        poly = replace(poly, cell_offsets=np.concatenate([poly.cell_offsets, ends]))
    assert poly.labels is not None
    arrays |= {key: np.asarray(getattr(poly, key), np.int64) for key in _POLYHEDRA if key not in ("labels", "beyond")}
    return {**arrays, "labels": poly.labels, "beyond": beyond[poly.labels], "numbers": numbers}


@dataclass(frozen=True)
class _OfMesh:
    """Rows of an array of a polyMesh."""

    source: Source
    key: str
    dtype: np.dtype[Any]
    shape: tuple[int, ...]

    def read(self, start: int, stop: int) -> NDArray[Any]:
        return _array(self.source, self.key)[start:stop]


_lock = threading.RLock()
_held: OrderedDict[Source, Arrays] = OrderedDict()
_small: OrderedDict[Source, Arrays] = OrderedDict()


def _array(source: Source, key: str) -> NDArray[Any]:
    """One of a polyMesh, which is read unless it is kept."""
    known = _small.get(source)
    if known is not None and key in known:
        return known[key]
    with _lock:
        held = _held.get(source)
        return (_load(source)[1] if held is None else held)[key]


def _load(source: Source) -> tuple[PolyMesh, Arrays]:
    """Read a polyMesh and keep its arrays; of those before all of the last, of others what is small."""
    with _lock:
        while len(_held) >= KEPT:  # before the next takes memory
            _held.popitem(last=False)
        while len(_small) >= MOST:
            _small.popitem(last=False)
        mesh = poly_mesh(source.name, Path(source.folder))
        arrays = _arrays_of(mesh, source)
        _held[source] = arrays
        _small[source] = {key: values for key, values in arrays.items() if key not in _BIG}
        return mesh, arrays
