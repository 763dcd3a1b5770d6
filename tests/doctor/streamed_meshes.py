"""Meshes with all that a diagnosis looks for, and a mesh in memory that passes by."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Iterator, Sequence

import numpy as np
import pytest
from surface_meshes import SURFACES

from meshgauge import Mesh
from meshgauge.doctor import Diagnosis
from meshgauge.doctor.inward import InwardEntries
from meshgauge.doctor.reversal import reversal
from meshgauge.doctor.streamed import doubles, faces
from meshgauge.doctor.streamed.diagnose import diagnosis_of
from meshgauge.doctor.streamed.marks import marks_of
from meshgauge.doctor.streamed.of_parts import Placed, diagnosis_of_parts
from meshgauge.doctor.streamed.open_cells import OpenCells, PartOf
from meshgauge.doctor.streamed.opening import open_cells_of
from meshgauge.doctor.streamed.passes import Passes
from meshgauge.files.plain_records import plain, record
from meshgauge.mesh import CellBlock
from meshgauge.mesh.ghosts import without_ghosts
from meshgauge.mesh.labels import cell_labels, point_labels
from meshgauge.mesh.polyhedra import Polyhedra
from meshgauge.quality.measure import Quality

Ids = np.ndarray
REVERSED = list(reversal(12, 8) or ())


class InMemory:
    """A mesh in memory that passes by, some cells at a time; or those of its cells from ``begin`` up to ``end``."""

    def __init__(self, quality: Quality, size: int, begin: int = 0, end: int | None = None) -> None:
        self.mesh, self.size = without_ghosts(quality.mesh), size
        self.begin, self.end = begin, self.mesh.n_cells if end is None else end
        self.n_cells, self.n_points = self.end - self.begin, self.mesh.n_points
        self.stored, self.purpose = self.mesh.stored or "double", self.mesh.purpose
        inside = [(one.name, max(one.start, begin), min(one.stop, self.end)) for one in self.mesh.blocks]
        self.blocks = tuple(CellBlock(name, a - begin, b - begin) for name, a, b in inside if a < b)
        self.joined = self.silent = self.known = None
        self.passes = Passes()
        self.dimension, self.up = self.mesh.dimension or 3, self.mesh.up or 0

    def cells(self) -> Iterator[tuple[int, int, Mesh]]:
        mesh = self.mesh
        for first in range(self.begin, self.end, self.size):
            stop = min(first + self.size, self.end)
            offsets = mesh.offsets[first : stop + 1].astype(np.int64)
            yield (
                first - self.begin,
                0,
                Mesh(
                    points=np.zeros((mesh.n_points, 3), np.float32),
                    types=mesh.types[first:stop],
                    offsets=offsets - offsets[0],
                    connectivity=mesh.connectivity[offsets[0] : offsets[-1]],
                    cell_data={name: values[first:stop] for name, values in mesh.cell_data.items()},
                    polyhedra=self.polyhedra(first, stop),
                    dimension=self.dimension,
                    up=self.up,
                ),
            )

    def polyhedra(self, first: int, stop: int) -> Polyhedra | None:
        if self.mesh.polyhedra is None:
            return None
        poly = self.mesh.polyhedra.with_own_faces()
        offsets = poly.cell_offsets[first : stop + 1].astype(np.int64)
        faces = poly.cell_faces[offsets[0] : offsets[-1]]
        return Polyhedra(offsets - offsets[0], faces, poly.face_offsets, poly.face_points)

    def points(self) -> Iterator[np.ndarray]:
        for start in range(0, self.n_points, 111):
            yield self.mesh.points[start : start + 111]

    def points_of(self, ids: Ids) -> np.ndarray:
        return self.mesh.points[ids]

    def cell_labels(self, ids: Sequence[int]) -> tuple[int | None, ...]:
        return cell_labels(self.mesh, ids)

    def point_labels(self, ids: Sequence[int]) -> tuple[int | None, ...]:
        return point_labels(self.mesh, ids)


def grid(n: int) -> tuple[np.ndarray, np.ndarray]:
    i = np.arange((n + 1) ** 3).reshape(n + 1, n + 1, n + 1)
    bottom = [i[:-1, :-1, :-1], i[1:, :-1, :-1], i[1:, 1:, :-1], i[:-1, 1:, :-1]]
    top = [i[:-1, :-1, 1:], i[1:, :-1, 1:], i[1:, 1:, 1:], i[:-1, 1:, 1:]]
    points = np.stack(np.meshgrid(*[np.arange(n + 1.0)] * 3, indexing="ij"), -1).reshape(-1, 3)
    return points, np.stack(bottom + top, -1).reshape(-1, 8)


POINTS, CELLS = grid(8)
RANDOM = np.random.default_rng(0)
SHAKEN = POINTS + RANDOM.normal(size=POINTS.shape) * 0.35
SOME = RANDOM.random(len(CELLS)) < 0.2
ORDER = RANDOM.permutation(len(CELLS))


def hexahedra(points: np.ndarray, cells: np.ndarray, **data: np.ndarray) -> Mesh:
    return Mesh.from_arrays(points, {"hexahedron": cells}, cell_data=data)


def turned(which: np.ndarray | slice) -> np.ndarray:
    cells = CELLS.copy()
    cells[which] = cells[which][:, REVERSED]
    return cells


def refined() -> Mesh:
    """A coarse block beside one of half the size of cells, twice, in any order."""
    (points, cells), (fine_points, fine_cells) = grid(4), grid(8)
    points, at = np.unique(np.vstack([points, fine_points * 0.5 + [4, 0, 0]]), axis=0, return_inverse=True)
    both = np.vstack([at.reshape(-1)[cells], at.reshape(-1)[fine_cells + 125]])
    both = np.vstack([both, both + len(points)])
    return hexahedra(np.vstack([points, np.add(points, [30, 0, 0])]), both[RANDOM.permutation(len(both))])


def with_surfaces() -> Mesh:
    quads = [("quad", CELLS[200:330, :4]), ("quad", [[729, 730, 731, 732]]), ("line", [[0, 1]])]
    return Mesh.from_arrays(np.vstack([POINTS, RANDOM.random((4, 3))]), [("hexahedron", CELLS), *quads])


def four_at_a_face() -> Mesh:
    """Two grids that have one face inside of both in common: its cells look like a pair in each."""
    cells = np.vstack([CELLS, CELLS + 729])
    for point in CELLS[292][:4].tolist():
        cells[cells == point + 729] = point
    return hexahedra(np.vstack([POINTS, np.add(POINTS, [0.1, 0.1, 0.1])]), cells)


def four_at_one_face() -> Mesh:
    """Two pairs of cells at one face, of which one cell each is folded onto the other: a face of four holds none."""
    face = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    tops = [np.add(face, [0, 0, z]) for z in (1.0, 2.0, 3.0, 4.0)]
    below = [3, 2, 1, 0]  # the other way around
    cells = [[*range(4), *range(4 * k + 4, 4 * k + 8)] for k in range(4)]
    for cell in cells[1::2]:
        cell[:] = [cell[m] for m in below] + [cell[4 + m] for m in below]
    return hexahedra(np.vstack([face, *tops]), np.array(cells))


def collapsed(every: int, ends: list[int], onto: list[int]) -> np.ndarray:
    cells = CELLS.copy()
    cells[::every, ends] = cells[::every][:, onto]
    return cells


def at(point: int, value: float) -> np.ndarray:
    points = POINTS.copy()
    points[point] = value
    return points


MESHES: dict[str, Callable[[], Mesh]] = {
    "a grid": lambda: hexahedra(POINTS, CELLS),
    "in any order": lambda: hexahedra(POINTS, CELLS[ORDER]),
    "shaken": lambda: hexahedra(SHAKEN, CELLS[ORDER]),
    "some reversed": lambda: hexahedra(POINTS, turned(SOME)),
    "some reversed, shaken": lambda: hexahedra(SHAKEN, turned(SOME)[ORDER]),
    "all reversed": lambda: hexahedra(POINTS, turned(slice(None))),
    "mirrored": lambda: hexahedra(POINTS * [-1, 1, 1], CELLS),
    "some twice": lambda: hexahedra(POINTS, np.vstack([CELLS, CELLS[10:30]])),
    "all twice": lambda: hexahedra(SHAKEN, np.vstack([CELLS, CELLS])),
    "all three times": lambda: hexahedra(POINTS, np.vstack([CELLS, CELLS, CELLS])),
    "some twice, reversed": lambda: hexahedra(POINTS, np.vstack([CELLS, CELLS[5:9][:, REVERSED]])),
    "a twisted face": lambda: hexahedra(POINTS, np.where(SOME[:, None], CELLS[:, [1, 0, 2, 3, 4, 5, 6, 7]], CELLS)),
    "four at a face": four_at_a_face,
    "four at one face": four_at_one_face,
    "two touch": lambda: hexahedra(np.vstack([POINTS, np.add(POINTS, [8, 0, 0])]), np.vstack([CELLS, CELLS + 729])),
    "some cover": lambda: hexahedra(np.vstack([POINTS, POINTS]), np.vstack([CELLS, CELLS[270:300][:, REVERSED] + 729])),
    "hinges": lambda: hexahedra(np.vstack([POINTS, [[99, 99, 99]]]), CELLS[::7]),
    "hanging": refined,
    "surfaces": with_surfaces,
    "no solids": lambda: Mesh.from_arrays(POINTS, {"line": CELLS[:, :2]}),
    "collapsed": lambda: hexahedra(POINTS, collapsed(5, [3, 7], [2, 6])),
    "repeated": lambda: hexahedra(POINTS, collapsed(3, [1], [0])),
    "flat": lambda: hexahedra(POINTS * [1, 1, 0], CELLS),
    "not finite": lambda: hexahedra(at(5, np.nan), CELLS),
    "astray": lambda: hexahedra(at(3, 1e30), CELLS),
    "huge": lambda: hexahedra(POINTS * 1e200, CELLS),
    "tiny": lambda: hexahedra(POINTS * 1e-200, CELLS),
    "single precision": lambda: hexahedra((POINTS + 1e4).astype(np.float32), CELLS),
    "ghosts": lambda: hexahedra(SHAKEN, CELLS, vtkGhostType=SOME.astype(np.uint8)),
    "interface": lambda: hexahedra(POINTS * [1, 1, 0], CELLS, interface=(np.arange(512) % 40 == 3).astype(np.uint8)),
}

MESHES |= SURFACES


def assert_same(made: Diagnosis, expected: Diagnosis) -> None:
    assert made.to_dict() == expected.to_dict()
    assert np.array_equal(made.repeated_points, expected.repeated_points)
    if made.orientation is None or expected.orientation is None:  # that of surfaces says no more than its findings
        assert made.orientation is expected.orientation
        return
    assert np.array_equal(made.orientation.numbering, expected.orientation.numbering)


def of_shares(quality: Quality, n: int) -> Diagnosis:
    """The diagnosis of a mesh of which so many shares were looked at apart, with what is kept written and read."""
    marks, inward = marks_of(quality), InwardEntries.of(without_ghosts(quality.mesh))
    ends = np.linspace(0, quality.mesh.n_cells, n + 1).astype(int).tolist()
    placed = []
    for a, b in itertools.pairwise(ends):
        here = (inward.cells >= a) & (inward.cells < b)
        own = InwardEntries(inward.numbers[here], inward.leasts[here], inward.cells[here] - a)
        part = PartOf(first_cell=a, has_all_points=n == 1)
        made = open_cells_of(InMemory(quality, 61, a, b), marks[a:b], own, part, tolerance=1e-9)
        placed.append(Placed(record(json.loads(json.dumps(plain(made))), OpenCells), 0, 0, 0, 0))
    mesh = quality.mesh
    return diagnosis_of_parts(placed, n_points=mesh.n_points, purpose=mesh.purpose, up=mesh.up or 0)


WAYS = ("plain", "in parts", "with a filter that forgets nothing", "few cells at a time")
"""In which a diagnosis that passes by is to come out the same."""


def size_of(way: str, monkeypatch: pytest.MonkeyPatch) -> int:
    """How many cells are to pass by at a time, with all else that a way asks for."""
    if way == "in parts":
        monkeypatch.setattr(faces, "most_in", lambda room: 200)
    if way == "with a filter that forgets nothing":  # all faces seem to have been met
        monkeypatch.setattr(faces, "filter_of", lambda n: np.full(2, 2**64 - 1, np.uint64))
        monkeypatch.setattr(doubles, "PER_POINT", 0.01)
    return 17 if way == "few cells at a time" else 61


def streamed(quality: Quality, size: int) -> Diagnosis:
    """The diagnosis of a mesh that passes by, so many cells at a time."""
    inward = InwardEntries.of(without_ghosts(quality.mesh))
    return diagnosis_of(InMemory(quality, size), marks_of(quality), inward)
