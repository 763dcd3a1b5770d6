"""Measuring polyhedral cells: J_ENS of every node and cell, and what else there is to say of a polyhedron.

The reference of a cell is the polyhedron of the same form with regular faces where there is one, else a model of each
corner from the sizes of the faces around it; `ReferenceKind` says which.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from enum import IntEnum, IntFlag
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..kernels.arrays import read_only
from ..kernels.polyhedra import codes, driver
from ..kernels.polyhedra.driver import Faces, Links, Solids
from ..kernels.threads import run
from ..mesh import CellIds
from ..mesh.mesh import Precision
from ..mesh.polyhedra import Polyhedra, ragged_positions
from ..status import Status
from .reference import corner_model, solids

Values = NDArray[np.float64]

CHUNK = 1 << 12
"""Cells handed to a thread at a time; the arrays of a chunk stay in the processor's cache."""

LONG = 64
"""Corners of more faces than this are not looked up by the least form of their faces."""

SINGLE = 2.0**-24
"""The relative rounding of coordinates in single precision."""

BROKEN = int(Status.BROKEN)
"""Status of a cell whose faces make no solid: it has no value. `Fault` says why."""


class ReferenceKind(IntEnum):
    """Where the constants k of a cell come from."""

    NONE = 0  #: the cell is broken
    REGULAR_FACED = 1  #: the polyhedron of the cell's form whose faces are all regular
    CORNER_MODEL = 2  #: `meshgauge.quality.reference.corner_model`, corner by corner: there is no such polyhedron


class Fault(IntFlag):
    """What was noticed about a cell. Those up to PINCHED leave it without a value."""

    NO_FACES = codes.NO_FACES
    SMALL_FACE = codes.SMALL_FACE  #: a face of fewer than three points
    REPEATED_POINT = codes.REPEATED_POINT  #: a face that names a point twice
    OPEN = codes.OPEN  #: an edge of one face only
    NON_MANIFOLD = codes.NON_MANIFOLD  #: an edge of three faces or more
    NON_ORIENTABLE = codes.NON_ORIENTABLE  #: faces that cannot all be turned outward
    SEVERAL_SHELLS = codes.SEVERAL_SHELLS  #: faces that are not connected
    PINCHED = codes.PINCHED  #: a node at which the surface touches itself: its faces make several rings
    REORIENTED = codes.REORIENTED  #: some faces pointed inward; measured with all turned outward
    HANDLE = codes.HANDLE  #: the surface is no sphere (Euler's number is not 2)
    HANGING = codes.HANGING  #: has hanging nodes, which were taken out
    WARPED_FACE = 2048  #: a face whose projected area is below 0.8 of its area
    ZERO_EDGE = 4096  #: an edge of length zero


UNSOLID = Fault(codes.BROKEN)
"""The faults that leave a cell without a value."""


@dataclass(frozen=True, eq=False, repr=False)
class PolyhedralQuality:
    """What was measured on polyhedral cells. Arrays are read-only; NaN means undefined and nothing else does.

    Attributes
    ----------
    cells
        ``(n,)`` ids of the cells, ascending.
    values
        ``(n,)`` J_ENS in [-1, 1], 1 is best; NaN for a broken cell or a coordinate that is not finite.
    status
        ``(n,)`` uint8: codes of `meshgauge.Status`, or `BROKEN`.
    faults
        ``(n,)`` uint16, bits of `Fault`.
    reference_kind
        ``(n,)`` uint8, codes of `ReferenceKind`.
    is_star_shaped
        ``(n,)`` True if some point sees every face from inside, each cut into triangles from the mean of its points.
        Such a cell is of use to finite-volume and virtual-element methods although a corner be concave.
    has_plane_faces
        ``(n,)`` True if every face is plane, to 1e-9 of its size or the stored precision, and does not cross itself.
    node_offsets
        ``(n + 1,)`` where the nodes of each cell start in the arrays below.
    node_points
        Point ids, in the order in which the faces first name them.
    node_scaled_jacobian, node_k, node_jens
        J_S, the J_S of the ideal cell, and J_ENS of each node; NaN at hanging nodes and nodes of broken cells.
    node_is_hanging
        True for a node that is no corner of its cell: it stands on an edge, between two faces, or inside of a face that
        neighbours split. The cell is measured without them.
    node_hanging_quality
        1 for a hanging node that stands straight on its edge or flat in its face, less the more it is moved out:
        ``1 - |J_S|`` of the corner that it would be; NaN at other nodes.
    """

    cells: NDArray[np.int64]
    values: Values
    status: NDArray[np.uint8]
    faults: NDArray[np.uint16]
    reference_kind: NDArray[np.uint8]
    is_star_shaped: NDArray[np.bool_]
    has_plane_faces: NDArray[np.bool_]
    node_offsets: NDArray[np.int64]
    node_points: NDArray[np.int64]
    node_scaled_jacobian: Values
    node_k: Values
    node_jens: Values
    node_is_hanging: NDArray[np.bool_]
    node_hanging_quality: Values

    @property
    def is_convex(self) -> NDArray[np.bool_]:
        """``(n,)`` True if all corners are convex, all faces plane and the surface a sphere: the cell is convex."""
        return np.asarray((self.values > 0.0) & ((self.faults & Fault.HANDLE) == 0) & self.has_plane_faces)

    @property
    def has_hanging(self) -> NDArray[np.bool_]:
        """``(n,)`` True for cells with a hanging node."""
        owner = np.repeat(np.arange(len(self.cells)), np.diff(self.node_offsets))
        return np.asarray(np.bincount(owner[self.node_is_hanging], minlength=len(self.cells)) > 0)

    def fault_counts(self) -> dict[str, int]:
        """Number of cells by name of the fault, those that occur."""
        counts = {str(fault.name): int(np.count_nonzero(self.faults & fault)) for fault in Fault}
        return {name: n for name, n in counts.items() if n}

    def part(self, cells: slice) -> PolyhedralQuality:
        """That of some of the cells, which follow one another."""
        first, last, _ = cells.indices(len(self.cells))
        nodes = slice(int(self.node_offsets[first]), int(self.node_offsets[last]))
        arrays = {f.name: getattr(self, f.name) for f in fields(self)}
        parts = {name: array[nodes if name.startswith("node_") else cells] for name, array in arrays.items()}
        parts["node_offsets"] = self.node_offsets[first : last + 1] - self.node_offsets[first]
        return PolyhedralQuality(**parts)

    def along(self, offsets: NDArray[np.integer], connectivity: NDArray[np.integer], values: Values) -> Values:
        """Node values in the order of a mesh's connectivity: one for each of its entries, NaN where there is none.

        Parameters
        ----------
        offsets, connectivity
            Of the mesh that was measured, all cells.
        values
            One of the node arrays of this record, float64.
        """
        out = np.full(len(connectivity), np.nan)
        cells = np.asarray(self.cells, np.int64)
        starts, sizes = np.asarray(offsets[:-1], np.int64)[cells], np.diff(offsets).astype(np.int64)[cells]
        at = ragged_positions(starts, sizes)
        wanted = _keys(np.repeat(np.arange(len(cells)), sizes), np.asarray(connectivity, np.int64)[at])
        have = _keys(np.repeat(np.arange(len(cells)), np.diff(self.node_offsets)), self.node_points)
        order = np.argsort(have)
        if len(order) == 0:
            return out
        index = order[np.minimum(np.searchsorted(have, wanted, sorter=order), len(order) - 1)]
        out[at] = np.where(have[index] == wanted, values[index], np.nan)
        return out

    def __repr__(self) -> str:
        counts_text = ", ".join(f"{n} {name.lower()}" for name, n in self.fault_counts().items()) or "none with a fault"
        return f"<PolyhedralQuality of {len(self.values)} cells: {counts_text}>"


def _keys(cells: NDArray[np.int64], points: NDArray[np.int64]) -> NDArray[np.int64]:
    return cells << 40 | points


@dataclass(frozen=True, slots=True)
class _Part:
    """What was measured on a chunk of cells: fields of `PolyhedralQuality`, and what leads to them."""

    values: Values
    faults: NDArray[np.int64]
    reference_kind: NDArray[np.uint8]
    is_star_shaped: NDArray[np.bool_]
    has_plane_faces: NDArray[np.bool_]
    node_counts: NDArray[np.int64]
    node_points: NDArray[np.int64]
    node_scaled_jacobian: Values
    node_k: Values
    node_jens: Values
    node_is_hanging: NDArray[np.bool_]
    node_hanging_quality: Values
    is_negative: NDArray[np.bool_]  #: a cell with a corner that is negative beyond rounding
    is_flat: NDArray[np.bool_]  #: a cell with a corner whose sign rounding could have turned
    is_candidate: NDArray[np.bool_]  #: a cell, see `driver.Candidates`
    unknown_entries: NDArray[np.int64]  #: in ``cell_faces``


def _join(parts: list[_Part]) -> dict[str, NDArray[Any]]:
    names = [field.name for field in fields(_Part)]
    return {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}


def measure_polyhedra(
    points: NDArray[np.floating],
    polyhedra: Polyhedra,
    cells: CellIds,
    *,
    threads: int | None = None,
    stored: Precision | None = None,
    beyond: Callable[[NDArray[np.int64]], NDArray[np.int64]] | None = None,
) -> PolyhedralQuality:
    """Measure polyhedral cells.

    Parameters
    ----------
    points
        ``(n_points, 3)`` float32 or float64, C-contiguous; any unit.
    polyhedra
        Faces of the cells, ids in range (see `meshgauge.mesh.cast.check_polyhedra`).
    cells
        Which cells of ``polyhedra`` to measure, ascending.
    threads
        At most this many; None: one for each processor. It has no influence on the values.
    stored
        How exactly the coordinates were stored, which says what a plane face is; None: by their dtype.
    beyond
        Tells, for entries of ``polyhedra.cell_faces``, what lies beyond that face, a cell or which patch of the
        boundary, as `meshgauge.mesh.beyond.beyond` does; called at most once, if hanging nodes depend on it. None:
        nodes hang by what their own cell tells.
    """
    n_all = len(polyhedra.cell_offsets) - 1
    ids = np.arange(*cells.indices(n_all)) if isinstance(cells, slice) else np.asarray(cells, np.int64)
    single = points.dtype == np.float32 if stored is None else stored == "single"
    double = _double(points)
    driver.prepare()
    table = solids_table()
    unit = SINGLE if single else 2.0**-53

    def chunks(some: NDArray[np.int64]) -> list[NDArray[np.int64]]:
        return [some[start : start + CHUNK] for start in range(0, max(len(some), 1), CHUNK)]

    def work(part: NDArray[np.int64]) -> _Part:
        return _measure_chunk(double, polyhedra, part, table, unit=unit, finds_candidates=beyond is not None)

    columns = _join(run(work, chunks(ids), threads))
    again, entries = columns["is_candidate"], columns["unknown_entries"]
    if again.any() and beyond is not None:
        known = np.zeros(len(polyhedra.cell_faces), np.int64)
        known[entries] = beyond(entries)

        def work_again(part: NDArray[np.int64]) -> _Part:
            return _measure_chunk(double, polyhedra, part, table, unit=unit, beyond=known)

        of_nodes = np.repeat(again, columns["node_counts"])
        for name, column in _join(run(work_again, chunks(ids[again]), threads)).items():
            if name != "unknown_entries":
                is_of_nodes = name.startswith("node_") and name != "node_counts"
                columns[name][of_nodes if is_of_nodes else again] = column
    offsets = np.zeros(len(ids) + 1, np.int64)
    np.cumsum(columns["node_counts"], out=offsets[1:])
    arrays = {
        **columns,
        "cells": ids,
        "status": _status(columns),
        "faults": columns["faults"].astype(np.uint16),
        "node_offsets": offsets,
    }
    return PolyhedralQuality(**{f.name: read_only(arrays[f.name]) for f in fields(PolyhedralQuality)})


@cache
def solids_table() -> Solids:
    """The solids of `meshgauge.quality.reference`, as the kernels take them."""
    known = solids()
    starts = np.cumsum([0] + [len(one.points) for one in known])
    faces = [(face, int(start)) for one, start in zip(known, starts, strict=False) for face in one.faces]
    return driver.solids(
        np.concatenate([one.points for one in known]),
        Faces(
            points=np.array([node + start for face, start in faces for node in face], np.int64),
            sizes=np.array([len(face) for face, _ in faces], np.int64),
            flips=np.zeros(len(faces), np.uint8),
            counts=np.array([len(one.faces) for one in known], np.int64),
        ),
        np.concatenate([one.k for one in known]),
    )


def _double(points: NDArray[np.floating]) -> NDArray[np.float64]:
    """The points as kernels take them: of one dtype, since these take half a minute to compile for each."""
    return read_only(np.asarray(points, np.float64))


def _face_entries(polyhedra: Polyhedra, cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """Where the faces of some cells are in ``polyhedra.cell_faces``."""
    starts = polyhedra.cell_offsets[cells].astype(np.int64)
    return ragged_positions(starts, polyhedra.cell_offsets[cells + 1].astype(np.int64) - starts)


def faces_of(polyhedra: Polyhedra, cells: NDArray[np.int64]) -> Faces:
    """The faces of some cells, cell after cell."""
    at = _face_entries(polyhedra, cells)
    faces = polyhedra.cell_faces[at]
    first = polyhedra.face_offsets[faces].astype(np.int64)
    sizes = polyhedra.face_offsets[faces + 1].astype(np.int64) - first
    flips = np.zeros(len(at), np.uint8) if polyhedra.flipped is None else polyhedra.flipped[at].astype(np.uint8)
    return Faces(
        points=driver.joined(polyhedra.face_points, first, sizes),
        sizes=sizes,
        flips=flips,
        counts=(polyhedra.cell_offsets[cells + 1] - polyhedra.cell_offsets[cells]).astype(np.int64),
    )


def inward_faces(points: NDArray[np.floating], polyhedra: Polyhedra, cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """Entries of ``polyhedra.cell_faces`` whose face points into its cell, of some cells, ascending.

    Parameters
    ----------
    points, polyhedra
        As for `measure_polyhedra`.
    cells
        Ids, ascending; a cell whose faces make no closed surface has none.
    """
    double = _double(points)
    driver.prepare()
    parts = [np.empty(0, np.int64)]
    for start in range(0, len(cells), CHUNK):
        part = cells[start : start + CHUNK]
        parts.append(_face_entries(polyhedra, part)[driver.inward(double, faces_of(polyhedra, part))])
    return np.concatenate(parts)


def _measure_chunk(
    points: NDArray[np.float64],
    polyhedra: Polyhedra,
    cells: NDArray[np.int64],
    table: Solids,
    *,
    unit: float,
    finds_candidates: bool = False,
    beyond: NDArray[np.int64] | None = None,
) -> _Part:
    """Measure cells; ``beyond`` says what lies beyond each entry of ``cell_faces``, if known, ``unit`` is the relative
    rounding of the stored coordinates."""
    faces, entries = faces_of(polyhedra, cells), _face_entries(polyhedra, cells)
    whole = driver.links(points, faces)
    links, candidates = driver.without_hanging(faces, whole, None if beyond is None else beyond[entries])
    k = np.full(len(links.node_ids), np.nan)
    which = driver.match(links, table, k)
    is_broken = (links.faults & codes.BROKEN) != 0
    _model_corners(links, (which == codes.NO_SOLID) & ~is_broken, k)
    js = driver.node_scaled_jacobian(links)
    if finds_candidates:
        candidates |= driver.candidates(faces, whole, js)
    values, jens = driver.cell_jens(js, k, links)
    hanging = links.is_hanging == 1
    shape = driver.shapes(whole.points, whole.outward(faces), links.faults, unit)
    is_negative, is_flat = driver.corner_signs(links, js, single=unit == SINGLE)
    warped, zero = (shape & codes.WARPED) != 0, (shape & codes.ZERO_EDGE) != 0
    known = np.where(which == codes.NO_SOLID, ReferenceKind.CORNER_MODEL, ReferenceKind.REGULAR_FACED)
    return _Part(
        values=values,
        faults=links.faults | np.where(warped, Fault.WARPED_FACE, 0) | np.where(zero, Fault.ZERO_EDGE, 0),
        reference_kind=np.where(is_broken, ReferenceKind.NONE, known).astype(np.uint8),
        is_star_shaped=(shape & codes.STAR_SHAPED) != 0,
        has_plane_faces=(shape & codes.NOT_PLANE) == 0,
        node_counts=links.node_counts,
        node_points=links.node_ids,
        node_scaled_jacobian=np.where(hanging, np.nan, js),
        node_k=np.where(hanging, np.nan, k),
        node_jens=jens,
        node_is_hanging=hanging,
        node_hanging_quality=np.where(hanging, 1.0 - np.abs(js), np.nan),
        is_negative=is_negative,
        is_flat=is_flat,
        is_candidate=candidates.cells,
        unknown_entries=entries[candidates.faces],
    )


def _model_corners(links: Links, wanted: NDArray[np.bool_], k: Values) -> None:
    """Constants by the corner model of the cells that are wanted, each different corner once."""
    if not wanted.any():
        return
    forms, form_of = driver.three_faced(links, wanted)
    known = np.flatnonzero(form_of >= 0)
    k[known] = corner_model(forms[:, :-1], forms[:, -1])[form_of[known]]
    others = np.flatnonzero((form_of < 0) & wanted[links.cells] & (links.is_hanging == 0) & (links.valences > 1))
    if len(others) == 0:
        return
    is_corner = (links.is_hanging == 0) & (links.valences > 0)
    n_corners = np.bincount(links.cells[is_corner], minlength=len(links.node_counts))
    for valence in np.unique(links.valences[others]):
        here = others[links.valences[others] == valence]
        if valence == 2:
            k[here] = 1.0  # no corner: J_S is 0 whatever k
            continue
        sizes = _least_form(links.sizes[links.starts[here][:, None] + np.arange(valence)])
        rows, inverse = _unique_rows(np.concatenate([sizes, n_corners[links.cells[here]][:, None]], axis=1))
        k[here] = corner_model(rows[:, :-1], rows[:, -1])[inverse]


def _unique_rows(rows: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Different rows, and for each row which of them it is."""
    base = int(rows.max(initial=0)) + 1
    if rows.shape[1] * np.log2(base) < 62:
        packed = rows @ base ** np.arange(rows.shape[1], dtype=np.int64)
        _, first, inverse = np.unique(packed, return_index=True, return_inverse=True)
        return rows[first], inverse
    unique, inverse = np.unique(rows, axis=0, return_inverse=True)
    return unique, inverse.reshape(-1)


def _least_form(sizes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Each row turned or mirrored into the least of its forms, so that rounding does not depend on the numbering.

    Rows beyond `LONG` stay as they are: the cost is that of their length squared.
    """
    if sizes.shape[1] > LONG:
        return sizes
    if sizes.shape[1] == 3:
        return np.sort(sizes, axis=1)
    best = sizes
    for form in (sizes, sizes[:, ::-1]):
        for turn in range(sizes.shape[1]):
            other = np.roll(form, turn, axis=1)
            different = other != best
            first = different.argmax(axis=1)
            rows = np.arange(len(best))
            less = different.any(axis=1) & (other[rows, first] < best[rows, first])
            best = np.where(less[:, None], other, best)
    return best


def _status(columns: dict[str, NDArray[Any]]) -> NDArray[np.uint8]:
    """Positive corners certify a cell whose faces are plane; one with warped faces must be star-shaped as well."""
    is_star_shaped, is_negative = columns["is_star_shaped"], columns["is_negative"]
    cases = {
        Status.BROKEN: (columns["faults"] & codes.BROKEN) != 0,
        Status.NON_FINITE: np.isnan(columns["values"]),
        Status.CONCAVE: is_negative & is_star_shaped,
        Status.INVERTED: is_negative,
        Status.DEGENERATE: columns["is_flat"],
        Status.INVERTED_INSIDE: ~columns["has_plane_faces"] & ~is_star_shaped,
    }
    return np.select(list(cases.values()), [np.uint8(status) for status in cases], np.uint8(Status.OK))
