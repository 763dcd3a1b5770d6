"""The diagnosis of a mesh that passes by is that of the whole mesh: every finding, count, example and sentence."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from streamed_meshes import MESHES, WAYS, assert_same, grid, hexahedra, size_of, streamed
from surface_meshes import SURFACES

import meshgauge
from meshgauge import io
from meshgauge.doctor import Diagnosis, diagnosis
from meshgauge.doctor.streamed import MarkCounter, faces
from meshgauge.mesh.topology import topology
from meshgauge.quality.measure import Quality
from meshgauge.report import diagnosis as report_diagnosis
from meshgauge.report.diagnosis import streamed_diagnosis
from meshgauge.report.stream import job_of
from meshgauge.slices import Ask, measure_pieces


@cache
def whole(name: str) -> tuple[Quality, Diagnosis]:
    quality = meshgauge.measure(MESHES[name]())
    return quality, diagnosis(quality.mesh, quality)


@pytest.mark.filterwarnings("ignore:overflow encountered")
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", MESHES)
def test_it_is_that_of_the_whole(name: str, way: str, monkeypatch: pytest.MonkeyPatch) -> None:
    quality, expected = whole(name)
    assert_same(streamed(quality, size_of(way, monkeypatch)), expected)


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
    "GEOS-DEV+GEOS/inputFiles/singlePhaseFlow/pebi3d_with_properties.vtu",
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
    assert_same(streamed(quality, 1000), diagnosis(quality.mesh, quality))


@pytest.mark.long
def test_all_real_meshes(shared: Path) -> None:
    """Every mesh that is there."""
    rows = (shared / "meshes" / "MANIFEST.tsv").read_text().splitlines()[1:]
    polyhedra = 0
    for row in rows:
        quality = meshgauge.measure(meshgauge.read(shared / "meshes" / row.split("\t")[0]))
        assert_same(streamed(quality, 20_000), diagnosis(quality.mesh, quality))
        polyhedra += quality.mesh.polyhedra is not None
    assert len(rows) >= 30
    assert polyhedra >= 4


@pytest.mark.parametrize("name", ["a grid", "in any order", "a surface"])
def test_it_tells_how_far_it_is(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(report_diagnosis, "CELLS", 50)
    if name == "in any order":
        monkeypatch.setattr(faces, "most_in", lambda room: 200)
    mesh = MESHES[name]() if name in MESHES else MESHES[next(iter(SURFACES))]()
    path = tmp_path / "a.vtu"
    io.write(path, mesh)
    listed, shares = io.pieces(path), list[float]()
    assert listed is not None
    job = job_of(listed, Ask(counter=MarkCounter()))
    streamed_diagnosis(job, measure_pieces(job), None, tell=shares.append)
    assert 0.0 < shares[0] < 0.1
    assert 0.8 < shares[-2] < shares[-1] == 1.0
    falls = int((np.diff(shares) < 0.0).sum())
    assert falls == 0 if name != "in any order" else 1 <= falls <= 3  # it is found out how many passes there are


def test_few_faces_are_open_where_cells_follow_one_another() -> None:
    """A layer of cells and what it takes to make the next."""
    mesh = hexahedra(*grid(12))
    table = faces._Open(3 * mesh.n_cells, mesh.n_points)
    half, marks, parent = faces.HalfFaces.of(mesh, 0, 0), np.full(mesh.n_cells, 2, np.uint8), np.arange(mesh.n_cells)
    suspected = np.zeros(mesh.n_cells, np.uint8)
    most = 0
    for start in range(0, len(half.keys), 6):
        here = slice(start, start + 6)
        table.feed(half, here, faces.NONE, marks, parent, suspected, is_strict=False)
        most = max(most, table.n_open)
    assert table.n_open == topology(mesh).n_boundary == 6 * 144
    assert most <= 6 * 144 + 2 * 144
    assert len(table.open_keys) == table.n_open
