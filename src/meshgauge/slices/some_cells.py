"""Some cells of a mesh in pieces as a mesh: the same as ``mesh[ids]`` of the whole."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ReadError
from ..io.plumbing import ghosts, some_rows
from ..io.plumbing.pieces import Pieces, Rows
from ..io.plumbing.some_rows import runs, some, some_lists, windows
from ..io.plumbing.wedge_order import apply, has_wedges
from ..mesh import CellBlock, Mesh
from ..mesh.high_order import WEIGHTS
from ..mesh.labels import LABEL
from ..mesh.mesh import DECIDED
from ..mesh.polyhedra import Polyhedra, ragged_positions
from ..quality.measure import JENS, Quality, measure_part
from ..quality.poor import rows_of
from ..status import Purpose
from .facts import Facts, Labels
from .job import Job, unknown
from .read import is_needed

Ids = NDArray[np.int64]


def gathered(parts: Sequence[Rows], starts: Sequence[int], ids: Ids) -> NDArray[Any]:
    """Some rows of arrays that stand one after another, ``starts`` as of `Pieces.cell_starts`; ids ascend."""
    first = parts[0]
    out = np.empty((len(ids), *first.shape[1:]), first.dtype.newbyteorder("="))
    for rows, start in zip(parts, starts, strict=False):
        for own, at in windows(ids - start, rows.shape[0]):
            low = int(at[0])
            out[own] = rows.read(low, int(at[-1]) + 1)[at - low]
    return out


def some_cells(pieces: Pieces, facts: Facts, ids: Ids, purpose: Purpose, *, with_data: bool = True) -> tuple[Mesh, Ids]:
    """Some cells, ascending, with their data, and the ids of their points in the whole; ``with_data`` false: no data
    but those on which something depends. Raises `ReadError` if the file is broken."""
    sizes, nodes = _nodes(pieces, ids)
    poly = _polyhedra(pieces, ids)
    named = nodes if poly is None else np.concatenate([nodes, np.asarray(poly.face_points, np.int64)])
    used, local = np.unique(named, return_inverse=True)
    local = local.reshape(-1)
    data = []
    for kind, starts, rows, labels, needed in (
        ("cell_data", pieces.cell_starts, ids, facts.cell_labels, is_needed),
        ("point_data", pieces.point_starts, used, facts.point_labels, WEIGHTS.__eq__),
    ):
        parts = [getattr(piece, kind) for piece in pieces.pieces]
        names = [name for name in parts[0] if name != LABEL and (with_data or needed(name))]
        own = {name: gathered([part[name] for part in parts], starts, rows) for name in names}
        data.append(own | _labels(labels, [part.get(LABEL) for part in parts], starts, rows))
    mesh = Mesh(
        points=gathered([piece.points for piece in pieces.pieces], pieces.point_starts, used),
        types=gathered([piece.types for piece in pieces.pieces], pieces.cell_starts, ids),
        offsets=np.concatenate([[0], np.cumsum(sizes)]),
        connectivity=local[: len(nodes)],
        polyhedra=None if poly is None else replace(poly, face_points=local[len(nodes) :]),
        blocks=_blocks(pieces, ids),
        cell_data=data[0],
        point_data=data[1],
        field_data=pieces.field_data,
        path=pieces.path,
        notes=facts.notes,
        purpose=purpose,
        stored=pieces.precision,
        dimension=facts.view.dimension if facts.view.dimension == 2 else DECIDED,
        up=facts.view.up if facts.view.dimension == 2 else DECIDED,
        copy=False,
    )
    return (apply(mesh, facts.decision) if facts.decision.turn and has_wedges(mesh.types) else mesh), used


def _labels(how: Labels, parts: Sequence[Rows | None], starts: Sequence[int], ids: Ids) -> dict[str, NDArray[Any]]:
    if how == "counted":
        return {LABEL: ids + 1}
    known = [rows for rows in parts if rows is not None]
    return {LABEL: gathered(known, starts, ids).astype(np.int64)} if how == "stored" else {}


def _blocks(pieces: Pieces, ids: Ids) -> tuple[CellBlock, ...]:
    made = []
    for block in pieces.blocks:
        start, stop = np.searchsorted(ids, (block.start, block.stop)).tolist()
        if stop > start:
            made.append(CellBlock(block.name, start, stop))
    return tuple(made)


def _nodes(pieces: Pieces, ids: Ids) -> tuple[Ids, Ids]:
    """How many nodes each of some cells has, ascending, and these, one after another."""
    sizes, nodes = [np.empty(0, np.int64)], [np.empty(0, np.int64)]
    for piece, start, first_point in zip(pieces.pieces, pieces.cell_starts, pieces.point_starts, strict=False):
        for _, at in windows(ids - start, piece.n_cells):
            low = int(at[0])
            offsets = piece.offsets.read(low, int(at[-1]) + 2).astype(np.int64)
            begin, end = offsets[at - low] - offsets[0], offsets[at - low + 1] - offsets[0]
            held = piece.connectivity.read(int(offsets[0]), int(offsets[-1])).astype(np.int64)
            sizes.append(end - begin)
            nodes.append(held[ragged_positions(begin, end - begin)] + first_point)
    return np.concatenate(sizes), np.concatenate(nodes)


def _polyhedra(pieces: Pieces, ids: Ids) -> Polyhedra | None:
    """The faces of some cells, ascending, each with its own, with points of the whole; None if none has any."""
    numbers, sizes, points, labels = ([np.empty(0, np.int64)] for _ in range(4))
    for number, (_, cells, faces) in enumerate(_own_faces(pieces, ids)):
        piece, first_face = pieces.pieces[number], pieces.face_starts[number]
        numbers.append(cells)
        if not len(faces):
            continue
        assert piece.polyhedra is not None  # which has these faces
        rows, (known, which) = piece.polyhedra, np.unique(faces, return_inverse=True)
        try:
            own, held = some_lists(rows["face_offsets"], rows["face_points"], known)
        except IndexError:
            raise ReadError(f"{pieces.path}: offsets of points of faces lie outside of the points") from None
        which, starts = which.reshape(-1), np.cumsum(own) - own
        sizes.append(own[which])
        points.append(held[ragged_positions(starts[which], own[which])] + pieces.point_starts[number])
        labels.append((some(rows["labels"], known) if "labels" in rows else known + first_face)[which])
    n_faces, of_faces = np.concatenate(numbers), np.concatenate(sizes)
    if not len(of_faces):
        return None
    return Polyhedra(
        np.concatenate([[0], np.cumsum(n_faces)]),
        np.arange(len(of_faces)),
        np.concatenate([[0], np.cumsum(of_faces)]),
        np.concatenate(points),
        labels=np.concatenate(labels),
    )


def _own_faces(pieces: Pieces, ids: Ids) -> Iterator[tuple[Ids, Ids, Ids]]:
    """For each piece of some cells, ascending, where they stand in ``cell_faces``, how many faces each has, and these
    faces."""
    for piece, start in zip(pieces.pieces, pieces.cell_starts, strict=False):
        begin, end = np.searchsorted(ids, (start, start + piece.n_cells)).tolist()
        at, n_faces, faces = ([np.empty(0, np.int64)] for _ in range(3))
        if piece.polyhedra is None:
            n_faces.append(np.zeros(end - begin, np.int64))
        else:
            for run in runs(ids[begin:end] - start):
                own = ids[begin:end][run] - start
                low = int(own[0])
                offsets = piece.polyhedra["cell_offsets"].read(low, int(own[-1]) + 2).astype(np.int64)
                first, n = offsets[own - low], offsets[own - low + 1] - offsets[own - low]
                held = piece.polyhedra["cell_faces"].read(int(offsets[0]), int(offsets[-1])).astype(np.int64)
                places = ragged_positions(first, n)
                at.append(places)
                n_faces.append(n)
                faces.append(held[places - int(offsets[0])])
        yield np.concatenate(at), np.concatenate(n_faces), np.concatenate(faces)


def _beyond(pieces: Pieces, ids: Ids) -> Ids | None:
    """What lies beyond the faces of some cells, ascending; None if the file does not say so."""
    known = [np.empty(0, np.int64)]
    for piece, (at, _, _) in zip(pieces.pieces, _own_faces(pieces, ids), strict=True):
        if len(at):
            rows = piece.polyhedra or {}
            if "beyond" not in rows:
                return None
            known.append(some(rows["beyond"], at))
    return np.concatenate(known)


def points_of_cells(pieces: Pieces, ids: Ids) -> Ids:
    """Ids of the points of some cells, both ascending."""
    return np.unique(_nodes(pieces, ids)[1])


def touching(pieces: Pieces, points: Ids) -> Ids:
    """Ids, ascending, of the cells that have some of the points: all are looked through."""
    found = [np.empty(0, np.int64)]
    is_wanted = np.zeros(pieces.n_points, np.bool_)
    is_wanted[points] = True
    for piece, start, first in zip(pieces.pieces, pieces.cell_starts, pieces.point_starts, strict=False):
        own = is_wanted[first : first + piece.n_points]
        for at in range(0, piece.n_cells if own.any() else 0, some_rows.WINDOW):
            offsets = piece.offsets.read(at, min(at + some_rows.WINDOW, piece.n_cells) + 1)
            places = np.flatnonzero(own[piece.connectivity.read(int(offsets[0]), int(offsets[-1]))])
            cells = np.searchsorted(offsets, places + int(offsets[0]), side="right") - 1
            found.append(np.unique(cells).astype(np.int64) + (start + at))
    return np.concatenate(found)


def measured(job: Job, ids: Ids) -> tuple[Quality, Ids]:
    """J_ENS and status of some cells, ascending, to the last bit as in the whole; and the ids of their points there.

    Errors as of `some_cells`.
    """
    facts = job.facts
    mesh, points = some_cells(job.pieces, facts, ids, job.purpose, with_data=False)
    mesh = ghosts.note_ghosts(mesh.replace(dimension=facts.view.dimension, up=facts.view.up))
    rows = rows_of((JENS,), job.ask.poor_below)
    bricks = job.ask.keep_bricks
    known = _beyond(job.pieces, ids)
    beyond = unknown if known is None else known.__getitem__
    quality = measure_part(mesh, rows, keep_bricks=bricks, n_deciding=facts.n_deciding, beyond=beyond)
    return quality, points
