"""The diagnosis of a mesh that passes by is that of the whole mesh: every finding, count, example and sentence."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from surface_meshes import SURFACES

import meshgauge
from meshgauge import Mesh
from meshgauge.doctor import Diagnosis, diagnosis
from meshgauge.doctor.reversal import reversal
from meshgauge.doctor.streamed import doubles, faces
from meshgauge.doctor.streamed.diagnose import diagnosis_of
from meshgauge.doctor.streamed.marks import marks_of
from meshgauge.mesh.ghosts import without_ghosts
from meshgauge.mesh.labels import cell_labels, point_labels
from meshgauge.mesh.topology import topology
from meshgauge.quality.measure import Quality

Ids = np.ndarray
REVERSED = list(reversal(12, 8) or ())


class InMemory:
    """A mesh in memory that passes by, some cells at a time."""

    def __init__(self, quality: Quality, size: int) -> None:
        self.mesh, self.size = without_ghosts(quality.mesh), size
        self.n_cells, self.n_points = self.mesh.n_cells, self.mesh.n_points
        self.stored, self.purpose, self.blocks = self.mesh.stored or "double", self.mesh.purpose, self.mesh.blocks
        self.joined = None
        self.dimension, self.up = self.mesh.dimension or 3, self.mesh.up or 0

    def cells(self) -> Iterator[tuple[int, int, Mesh]]:
        mesh = self.mesh
        for first in range(0, mesh.n_cells, self.size):
            stop = min(first + self.size, mesh.n_cells)
            offsets = mesh.offsets[first : stop + 1].astype(np.int64)
            yield (
                first,
                0,
                Mesh(
                    points=np.zeros((mesh.n_points, 3), np.float32),
                    types=mesh.types[first:stop],
                    offsets=offsets - offsets[0],
                    connectivity=mesh.connectivity[offsets[0] : offsets[-1]],
                    cell_data={name: values[first:stop] for name, values in mesh.cell_data.items()},
                    dimension=self.dimension,
                    up=self.up,
                ),
            )

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

WAYS = ("plain", "in parts", "with a filter that forgets nothing", "few cells at a time")


def assert_same(made: Diagnosis, expected: Diagnosis) -> None:
    assert made.to_dict() == expected.to_dict()
    assert np.array_equal(made.repeated_points, expected.repeated_points)
    if made.orientation is None or expected.orientation is None:  # that of surfaces says no more than its findings
        assert made.orientation is expected.orientation
        return
    assert np.array_equal(made.orientation.numbering, expected.orientation.numbering)


@cache
def whole(name: str) -> tuple[Quality, Diagnosis]:
    quality = meshgauge.measure(MESHES[name]())
    return quality, diagnosis(quality.mesh, quality)


@pytest.mark.filterwarnings("ignore:overflow encountered")
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", MESHES)
def test_it_is_that_of_the_whole(name: str, way: str, monkeypatch: pytest.MonkeyPatch) -> None:
    quality, expected = whole(name)
    if way == "in parts":
        monkeypatch.setattr(faces, "most_in", lambda room: 200)
    if way == "with a filter that forgets nothing":  # all faces seem to have been met
        monkeypatch.setattr(faces, "filter_of", lambda n: np.full(2, 2**64 - 1, np.uint64))
        monkeypatch.setattr(doubles, "PER_POINT", 0.01)
    made = diagnosis_of(InMemory(quality, 17 if way == "few cells at a time" else 61), marks_of(quality))
    assert_same(made, expected)


@pytest.mark.filterwarnings("ignore:overflow encountered")
def test_the_meshes_have_all_that_is_looked_for() -> None:
    names = {finding.name for name in MESHES for finding in whole(name)[1].findings}
    assert names >= {
        "orientation",
        "repeated_points",
        "duplicate_cells",
        "covering_cells",
        "multiple_faces",
        "hanging_points",
        "hinges",
        "parts",
        "duplicate_points",
        "interface_cells",
        "unused_points",
        "surface_cells",
        "points_of_no_solid",
        "turned_cells",
        "not_orientable",
        "multiple_edges",
    }


REAL = (
    "GEOS-DEV+GEOS/src/coreComponents/unitTests/meshTests/box_hybrid_mesh.vtu",
    "SteveDoyle2+pyNastran/models/nx/contact_model.bdf",
    "libMesh+libmesh/examples/miscellaneous/miscellaneous_ex9/miscellaneous_ex9.exo",
    "mfem+mfem/miniapps/contact/meshes/beam-sphere.mesh",
    "polyfem+polyfem-data/contact/meshes/3D/microstructure/P1.msh",
    "pyvista+vtk-data/Data/can.vtu",
    "sandialabs+sibl/geo/data/mesh/cube_minus_sphere_projected.mesh",
    "sfepy+sfepy/meshes/3d/matrix_fiber_rand.vtk",
    "trilinos+mesquite/meshFiles/3D/vtk/mixed/tangled/mixed-hex-pyr-tet.vtk",
)


@pytest.mark.parametrize("file", REAL)
def test_real_meshes(file: str, shared: Path) -> None:
    quality = meshgauge.measure(meshgauge.read(shared / "meshes" / file))
    assert_same(diagnosis_of(InMemory(quality, 1000), marks_of(quality)), diagnosis(quality.mesh, quality))


@pytest.mark.long
def test_all_real_meshes(shared: Path) -> None:
    """Every mesh that is there, but for polyhedra, which are not diagnosed in slices."""
    rows = (shared / "meshes" / "MANIFEST.tsv").read_text().splitlines()[1:]
    asked = 0
    for row in rows:
        mesh = meshgauge.read(shared / "meshes" / row.split("\t")[0])
        if mesh.polyhedra is None:
            quality = meshgauge.measure(mesh)
            assert_same(diagnosis_of(InMemory(quality, 20_000), marks_of(quality)), diagnosis(quality.mesh, quality))
            asked += 1
    assert asked >= 25


def test_few_faces_are_open_where_cells_follow_one_another() -> None:
    """A layer of cells and what it takes to make the next."""
    mesh = hexahedra(*grid(12))
    table = faces._Open(3 * mesh.n_cells, mesh.n_points)
    half, marks, parent = faces.HalfFaces.of(mesh, 0, 0), np.full(mesh.n_cells, 2, np.uint8), np.arange(mesh.n_cells)
    most = 0
    for start in range(0, len(half.keys), 6):
        here = slice(start, start + 6)
        table.feed(half, here, faces.NONE, marks, parent, is_strict=False)
        most = max(most, table.n_open)
    assert table.n_open == topology(mesh).n_boundary == 6 * 144
    assert most <= 6 * 144 + 2 * 144
    assert len(table.open_keys) == table.n_open
