"""Polyhedra of CGNS that are read some cells at a time: faces by points (NGON_n), cells by faces (NFACE_n)."""

from __future__ import annotations

import uuid
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....errors import ReadError
from ....kernels.polyhedra.codes import INNER, PATCH
from ....mesh.polyhedra import Polyhedra
from ...plumbing import face_based, made_cells
from ...plumbing.face_based import coincide, face_keys
from ...plumbing.made_cells import MadeCells
from ...plumbing.pieces import Rows
from ...plumbing.some_rows import WINDOW, some_lists

Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Lists:
    """A section of faces or of cells: their first number, and the items of each."""

    name: str
    first: int
    offsets: Rows
    items: Rows
    is_of_cells: bool

    @property
    def n(self) -> int:
        return self.offsets.shape[0] - 1


@dataclass(frozen=True)
class ZoneFaces:
    """The faces of a zone.

    Attributes
    ----------
    sections
        All, in the order of their numbers.
    cells
        All sections of cells by faces.
    patch_numbers, patch_codes
        Those that are of a boundary or group, by ascending numbers, and which.
    """

    sections: tuple[Lists, ...]
    cells: tuple[Lists, ...]
    patch_numbers: Ints
    patch_codes: Ints

    def points_of(self, numbers: Ints, where: str) -> tuple[Ints, Ints]:
        """How many points each of some faces has, by ascending numbers, and these; ``where`` they are named."""
        sizes, points, n_found = [np.empty(0, np.int64)], [np.empty(0, np.int64)], 0
        for section in self.sections:
            begin, end = np.searchsorted(numbers, (section.first, section.first + section.n)).tolist()
            if begin > n_found:
                break
            try:
                own, of_own = some_lists(section.offsets, section.items, numbers[begin:end] - section.first)
            except IndexError:
                raise ReadError(f"{section.name}: has offsets that do not fit its elements") from None
            sizes.append(own)
            points.append(of_own - 1)
            n_found = end
        if n_found < len(numbers):
            raise ReadError(f"{where}: a polyhedron refers to face {numbers[n_found]}, which does not exist")
        return np.concatenate(sizes), np.concatenate(points)

    @cached_property
    def once(self) -> Ints:
        """Numbers, ascending, of the faces at the boundary: of one cell, and at no others of which there is one with
        the same points. Small, as what is kept of all faces."""
        last = self.sections[-1].first + self.sections[-1].n
        counts = np.zeros(last, np.uint8)
        for section in self.cells:
            for start in range(0, section.items.shape[0], WINDOW):
                numbers = np.abs(section.items.read(start, min(start + WINDOW, section.items.shape[0])))
                own, n = np.unique(numbers[(numbers > 0) & (numbers < last)], return_counts=True)
                counts[own] = np.minimum(counts[own] + n, 2)
        once = np.flatnonzero(counts == 1)
        keys = [np.empty(0, np.uint64)]
        for start in range(0, len(once), WINDOW):
            some = once[start : start + WINDOW]
            keys.append(face_keys(*self.points_of(some, self.cells[0].name)))
        return once[~coincide(np.concatenate(keys))]

    def beyond(self, numbers: Ints) -> Ints:
        """What lies beyond some faces, see `meshgauge.mesh.beyond`."""
        once, patches = self.once, self.patch_numbers
        is_once = among(once, numbers)
        codes = np.zeros(len(numbers), np.int64)
        is_named = among(patches, numbers)
        codes[is_named] = self.patch_codes[np.searchsorted(patches, numbers[is_named])]
        return np.where(is_once, PATCH + codes, INNER)


def among(known: Ints, ids: Ints) -> NDArray[np.bool_]:
    """Which ids are among others, ascending."""
    if not len(known):
        return np.zeros(len(ids), np.bool_)
    return np.asarray(known[np.minimum(np.searchsorted(known, ids), len(known) - 1)] == ids)


@dataclass(frozen=True)
class OfFaces:
    """A `made_cells.Maker` of cells of which some faces may run the other way (of negative number).

    Attributes
    ----------
    cells
        Numbers of the faces of each.
    faces
        What is known of all faces of the zone.
    n_points
        Of the zone.
    """

    cells: Lists
    faces: ZoneFaces
    n_points: int

    @property
    def n_cells(self) -> int:
        return self.cells.n

    def make(self, start: int, stop: int) -> dict[str, NDArray[Any]]:
        """See `made_cells.Maker`. Raises `ReadError` if something refers to what does not exist."""
        offsets = self.cells.offsets.read(start, stop + 1).astype(np.int64)
        if (np.diff(offsets) < 0).any() or offsets[0] < 0 or offsets[-1] > self.cells.items.shape[0]:
            raise ReadError(f"{self.cells.name}: has offsets that do not fit its elements")
        items = self.cells.items.read(int(offsets[0]), int(offsets[-1])).astype(np.int64)
        numbers, of_cells = np.unique(np.abs(items), return_inverse=True)
        sizes, points = self.faces.points_of(numbers, self.cells.name)
        if (sizes < 3).any():
            raise ReadError(f"{self.cells.name}: a face has less than three points")
        wrong = (points < 0) | (points >= self.n_points)
        if wrong.any():
            bad = int(points[np.argmax(wrong)]) + 1
            raise ReadError(f"{self.cells.name}: a face refers to point {bad}, which does not exist")
        faces = face_based.Faces(
            offsets - offsets[0], of_cells.reshape(-1), face_based.offsets_of(sizes), points, items < 0, numbers
        )
        nowhere = np.broadcast_to(np.zeros(3), (self.n_points, 3))
        solids = face_based.solids(faces, nowhere, n_deciding=self.n_cells)
        made: dict[str, NDArray[Any]] = {
            "types": solids.types,
            "offsets": solids.offsets,
            "connectivity": solids.connectivity,
        }
        none, poly = np.empty(0, np.int64), solids.polyhedra
        if poly is None:
            no_faces = np.zeros(stop - start + 1, np.int64)
            poly = Polyhedra(no_faces, none, no_faces[:1], none, labels=none)
        assert poly.labels is not None  # as `face_based.solids` makes them
        labels = np.asarray(poly.labels, np.int64)
        made |= {"cell_offsets": poly.cell_offsets, "face_offsets": poly.face_offsets, "face_points": poly.face_points}
        return {**made, "labels": labels, "beyond": self.faces.beyond(labels)}


def made_of(cells: Lists, faces: ZoneFaces, n_points: int) -> MadeCells:
    """The cells of a section, and what they are known by."""
    return MadeCells(OfFaces(cells, faces, n_points), uuid.uuid4().hex, made_cells.BLOCK)
