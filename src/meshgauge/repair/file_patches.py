"""Patches of a mesh in a file: cells near some are found by passes over its slices, and they alone are read."""

from __future__ import annotations

import itertools
import weakref
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from tempfile import TemporaryFile
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..doctor.points import extent
from ..errors import MeshError, ReadError
from ..files.resources import free_memory
from ..io.plumbing.pieces import ReadWhole
from ..io.plumbing.wedge_order import apply, has_wedges
from ..kernels.arrays import read_only
from ..kernels.repair.corners import at_marked
from ..mesh import Mesh
from ..mesh.high_order import WEIGHTS
from ..mesh.interface import INTERFACE
from ..mesh.labels import LABEL
from ..mesh.polyhedra import ragged_positions
from ..quality.measure import JENS, measure
from ..quality.summary import Summary, summarise, summarise_nothing
from ..slices import Job, Partial
from ..slices.job import points_of
from ..slices.partial import CellRows
from ..slices.points import WINDOW
from ..slices.read import Place, places
from ..status import Status
from .acceptance import bad_among, counts_of
from .attempt import POINT_BYTES
from .constraints import Mask
from .faces import mask_of
from .patch import CHUNK, Patch
from .problem import Ids
from .remeasure import LARGE
from .scale import SAMPLE, power_of_sample

PATCH_BYTES = 400
"""Of memory that a point of a patch takes with its cells, before and after."""

NOT_SLICED = {INTERFACE: "it has cohesive cells", WEIGHTS: "it has rational cells"}
"""Data with which a mesh is read whole, and why."""


@dataclass(eq=False)
class FileMesh:
    """A mesh in a file of which patches are taken, once its slices were measured: a `near_bad.Source`.

    Attributes
    ----------
    job
        How slices are read and measured.
    target
        Cells below it are bad.
    counts
        ``(n_statuses,)`` cells of each status.
    summary
        Of the mesh.
    """

    job: Job
    target: float
    threads: int | None
    summary: Summary = field(init=False)
    counts: Ids = field(default_factory=lambda: np.zeros(len(Status), np.int64))
    _bad: list[Ids] = field(default_factory=list)

    def __post_init__(self) -> None:
        for piece in self.job.pieces.pieces:
            for name in (*piece.cell_data, *piece.point_data):
                if name in NOT_SLICED:
                    raise ReadWhole(NOT_SLICED[name])
        n = self.n_cells
        self._status, self._types = np.empty(n, np.uint8), np.empty(n, np.uint8)
        # In memory the values of a hundred million cells were as much as a quarter of all the rest.
        self._values = TemporaryFile()  # noqa: SIM115  closed with this record
        weakref.finalize(self, self._values.close)
        self._places = places(self.job.pieces)
        self._starts = np.array([self.job.pieces.cell_starts[one.piece] + one.start for one in self._places])
        self._spans: dict[int, tuple[int, int]] = {}  # the least and the largest point of each slice, once it was read

    @property
    def n_cells(self) -> int:
        return self.job.pieces.n_cells

    @property
    def n_points(self) -> int:
        return self.job.pieces.n_points

    @property
    def bad(self) -> Ids:
        """Cells that are invalid or below the target."""
        return np.concatenate([np.empty(0, np.int64), *self._bad])

    def take(self, first: int, rows: CellRows) -> None:
        """What was measured of a slice."""
        some, values = slice(first, first + len(rows.types)), rows.values[JENS]
        self._status[some], self._types[some] = rows.status, rows.types
        self._values.seek(8 * first)
        self._values.write(np.ascontiguousarray(values, np.float64).data)
        self._bad.append(first + np.flatnonzero(bad_among(values, rows.status, self.job.purpose, self.target)))
        self.counts += counts_of(rows.status)

    def finish(self, partial: Partial) -> None:
        """Take what was measured of all slices. Raises `ReadWhole` if patches are not enough for it."""
        self.summary = partial.summaries[JENS]
        if partial.n_ghosts:
            raise ReadWhole("it has ghost cells")
        if partial.collapsed:
            raise ReadWhole("it has cells with repeated nodes")
        if power_of_sample(self._ends_and_sample[1]):
            raise ReadWhole("it is very small or very large")

    @cached_property
    def diagonal(self) -> float:
        """Of the box around all points."""
        return extent(self._ends_and_sample[0])[1]

    @cached_property
    def _ends_and_sample(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """``(2, 3)`` the corners of the box around the finite points, and points evenly spread over all."""
        ends, sample = [], []
        step, begin = max(self.n_points // SAMPLE, 1), 0
        for piece in self.job.pieces.pieces:
            for start in range(0, piece.n_points, WINDOW):
                points = np.asarray(piece.points.read(start, min(start + WINDOW, piece.n_points)), np.float64)
                sample.append(points[-(begin + start) % step :: step])
                points = points[np.isfinite(points).all(axis=1)]
                if len(points):
                    ends += [points.min(axis=0), points.max(axis=0)]
            begin += piece.n_points
        if not ends:
            return np.zeros((2, 3)), np.zeros((1, 3))
        return np.stack([np.min(ends, axis=0), np.max(ends, axis=0)]), np.concatenate(sample)

    def near(self, cells: Ids, rings: int) -> Mask:
        """``(n_points,)`` those of some cells, and of so many rings around them but the outermost."""
        return self._around(cells, rings)[1]

    def patch(self, bad: Ids, rings: int, *, is_whole: bool = False, beside: Patch | None = None) -> Patch | None:
        """The cells near some bad ones, as `patch_around` finds them; None if there is no memory for so many."""
        cells, touched = self._around(bad, rings + 1)
        if beside is not None:
            assert beside.cells is not None
            touched[beside.free] = True
            cells = np.union1d(cells, beside.cells)
        if is_whole or len(cells) > LARGE * self.n_cells:
            cells = np.arange(self.n_cells)
        if not self._has_room(len(cells), PATCH_BYTES):
            return None
        mesh, points, region_ids = self._read(cells)
        poor_below = self.job.ask.poor_below
        measured = measure(mesh, metrics=(), threads=self.threads, keep_bricks=True, poor_below=poor_below)
        held = np.zeros(len(points), bool)
        return Patch(measured, cells, points, ~touched[points], held, region_ids, self.job.facts.regions.names)

    def has_room(self, n_cells: int) -> bool:
        """True if there is memory to repair so many cells at a time."""
        return self._has_room(n_cells, POINT_BYTES)

    def _has_room(self, n_cells: int, n_bytes: int) -> bool:
        left = free_memory()  # of so many bytes for a point: there are about as many as cells
        return left is None or n_bytes * self.n_points * (n_cells / self.n_cells) <= left

    def summary_of_others(self, patch: Patch) -> Summary:
        """That of the cells that are not in a patch."""
        assert patch.cells is not None
        there = ~mask_of(self.n_cells, patch.cells)
        total = summarise_nothing(patch.quality.summary())
        for start in range(0, self.n_cells, CHUNK):
            part = slice(start, start + CHUNK)
            here = there[part]
            self._values.seek(8 * start)
            values = np.frombuffer(self._values.read(8 * len(here)), np.float64)
            total += summarise(
                values[here],
                self._status[part][here],
                self._types[part][here],
                patch.quality.rows[JENS],
                purpose=self.job.purpose,
            )
        return total

    def _around(self, cells: Ids, rings: int) -> tuple[Ids, Mask]:
        """As `patch.cells_around`."""
        touched = np.zeros(self.n_points, bool)
        for number, own in self._of_places(cells):
            offsets, nodes = self._nodes(number)
            touched[self._first_point(number) + _nodes_of(offsets, nodes, own)] = True
        for ring in range(rings):
            is_last, found, later = ring == rings - 1, [np.empty(0, np.int64)], []
            for number in range(len(self._places)):
                first = self._first_point(number)
                if number in self._spans:
                    low, high = self._spans[number]
                    if not touched[first + low : first + high + 1].any():
                        continue
                offsets, nodes = self._nodes(number)
                is_at = np.zeros(len(offsets) - 1, bool)
                at_marked(read_only(offsets), read_only(nodes), touched[first:], is_at)
                own = np.flatnonzero(is_at)
                found.append(self._starts[number] + own)
                if not is_last:
                    later.append(first + np.unique(_nodes_of(offsets, nodes, own)))
            for points in later:
                touched[points] = True
            cells = np.concatenate(found)
        return cells, touched

    def _of_places(self, cells: Ids) -> Iterator[tuple[int, Ids]]:
        """Of some cells, ascending, those of each slice that has any: its number, and which of its cells they are."""
        bounds = np.append(np.searchsorted(cells, self._starts), len(cells)).tolist()
        for number, (begin, end) in enumerate(itertools.pairwise(bounds)):
            if end > begin:
                yield number, cells[begin:end] - self._starts[number]

    def _first_point(self, number: int) -> int:
        return self.job.pieces.point_starts[self._places[number].piece]

    def _nodes(self, number: int) -> tuple[Ids, Ids]:
        """Offsets of the cells of a slice, from 0, and the points that they name, as their piece counts them."""
        place = self._places[number]
        piece = self.job.pieces.pieces[place.piece]
        offsets = piece.offsets.read(place.start, place.stop + 1).astype(np.int64, copy=False)
        nodes = piece.connectivity.read(int(offsets[0]), int(offsets[-1])).astype(np.int64, copy=False)
        if len(nodes) and number not in self._spans:
            self._spans[number] = int(nodes.min()), int(nodes.max())
        return offsets - offsets[0], nodes

    def _read(self, cells: Ids) -> tuple[Mesh, Ids, Ids]:
        """Some cells as a mesh, with the points of the whole that its points are, and the region of each cell."""
        facts, pieces = self.job.facts, self.job.pieces
        none = np.empty(0, np.int64)
        sizes, named, regions, ids = [none], [none], [none], [none]
        types = [np.empty(0, np.uint8)]
        points: list[NDArray[np.floating]] = [np.empty((0, 3), pieces.pieces[0].points.dtype.newbyteorder("="))]
        data: dict[str, list[NDArray[Any]]] = {}
        for number, own in self._of_places(cells):
            place = self._places[number]
            piece, first = pieces.pieces[place.piece], self._first_point(number)
            offsets, nodes = self._nodes(number)
            nodes = _nodes_of(offsets, nodes, own)
            sizes.append(np.diff(offsets)[own])
            named.append(first + nodes)
            types.append(piece.types.read(place.start, place.stop)[own])
            columns = _columns(piece.cell_data, place, own, with_labels=facts.cell_labels != "none")
            regions.append(facts.regions.ids_of_cells(own + self._starts[number], columns))
            for name, values in columns.items():
                data.setdefault(name, []).append(values)
            used = np.unique(nodes)
            xyz, local, _ = points_of(self.job, place.piece).of(used)
            points.append(xyz[local])
            ids.append(first + used)
        every, which = np.unique(np.concatenate(ids), return_index=True)
        try:
            mesh = Mesh(
                points=np.concatenate(points)[which],
                types=np.concatenate(types),
                offsets=np.concatenate([[0], np.cumsum(np.concatenate(sizes))]),
                connectivity=np.searchsorted(every, np.concatenate(named)),
                cell_data={name: np.concatenate(values) for name, values in data.items()},
                path=pieces.path,
                purpose=self.job.purpose,
                dimension=3,
                copy=False,
            )
        except MeshError as error:
            raise ReadError(f"{pieces.path}: {error}") from error
        if facts.decision.turn and has_wedges(mesh.types):
            mesh = apply(mesh, facts.decision)
        return mesh, every, np.concatenate(regions)


def _nodes_of(offsets: Ids, nodes: Ids, cells: Ids) -> Ids:
    """Points of some cells, as often as they are named."""
    starts = offsets[cells]
    named: Ids = nodes[ragged_positions(starts, offsets[cells + 1] - starts)]
    return named


def _columns(cell_data: Any, place: Place, own: Ids, *, with_labels: bool) -> dict[str, NDArray[Any]]:
    """Cell data of some cells of a slice."""
    return {
        name: (values.astype(np.int64) if name == LABEL else values)
        for name, rows in cell_data.items()
        if name != LABEL or with_labels
        for values in [rows.read(place.start, place.stop)[own]]
    }
