"""Cases of OpenFOAM as folders: decomposed, of several regions, with time steps; and real ones, where it is installed.

The real ones are made here by blockMesh, snappyHexMesh and polyDualMesh, and checkMesh is the oracle.
"""

from __future__ import annotations

import gzip
import os
import re
import shutil
import subprocess
from pathlib import Path

import command_line
import numpy as np
import pytest

import meshgauge
from meshgauge.errors import ReadError

pytestmark = pytest.mark.usefixtures("readers_here")

HEAD = "FoamFile\n{{\n    version 2.0;\n    format ascii;\n    class {};\n    object {};\n}}\n"
CUBE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
FACES = [(4, 5, 6, 7), (0, 3, 2, 1), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]


def poly_mesh(folder: Path, low: int = 0, *, kind: str = "wall", addressing: list[int] | None = None) -> Path:
    """A cube from z = low on, whose last face is a patch of a kind."""
    folder.mkdir(parents=True)
    lists = {
        "points": ("vectorField", [f"({x} {y} {z + low})" for x, y, z in CUBE]),
        "faces": ("faceList", [f"4({' '.join(map(str, face))})" for face in FACES]),
        "owner": ("labelList", ["0"] * 6),
        "neighbour": ("labelList", []),
    }
    if addressing is not None:
        lists["pointProcAddressing"] = ("labelList", [str(i) for i in addressing])
    for name, (of, items) in lists.items():
        text = HEAD.format(of, name) + f"{len(items)}\n(\n" + "\n".join(items) + "\n)\n"
        (folder / name).write_text(text)
    patches = (
        f"2\n(\nfirst {{ type {kind}; nFaces 1; startFace 0; }}\nrest {{ type wall; nFaces 5; startFace 1; }}\n)\n"
    )
    (folder / "boundary").write_text(HEAD.format("polyBoundaryMesh", "boundary") + patches)
    return folder


def test_a_decomposed_case_is_one_mesh(tmp_path: Path) -> None:
    upper = [4, 5, 6, 7, 8, 9, 10, 11]
    for i in range(2):
        ids = upper if i else list(range(8))
        poly_mesh(tmp_path / f"processor{i}" / "constant" / "polyMesh", i, kind="processor", addressing=ids)
    mesh = meshgauge.read(tmp_path)
    assert mesh.type_counts() == {"hexahedron": 2, "quad": 10}
    assert mesh.n_points == 12
    assert [block.name for block in mesh.blocks] == ["processor0", "processor1", "rest"]
    assert meshgauge.measure(mesh).values[:2].tolist() == [1.0, 1.0]
    assert not mesh.notes


def test_pieces_that_do_not_say_what_they_share_stay_apart(tmp_path: Path) -> None:
    for i in (10, 9):
        poly_mesh(tmp_path / f"processor{i}" / "constant" / "polyMesh", i, kind="processor")
    mesh = meshgauge.read(tmp_path)
    assert mesh.n_points == 16
    assert [block.name for block in mesh.blocks] == ["processor9", "processor10", "rest"]
    assert "pointProcAddressing" in mesh.notes[0]


def test_addresses_that_do_not_fit_are_an_error(tmp_path: Path) -> None:
    poly_mesh(tmp_path / "processor0" / "constant" / "polyMesh", addressing=[1, 2, 3])
    with pytest.raises(ReadError, match="pointProcAddressing: does not fit the 8 points"):
        meshgauge.read(tmp_path)


def test_collated_pieces_are_named(tmp_path: Path) -> None:
    (tmp_path / "processors2" / "constant" / "polyMesh").mkdir(parents=True)
    (tmp_path / "constant").mkdir()
    with pytest.raises(ReadError, match="collated files; run reconstructParMesh"):
        meshgauge.read(tmp_path)


def test_regions_are_blocks(tmp_path: Path) -> None:
    for i, name in enumerate(("solid", "air")):
        poly_mesh(tmp_path / "constant" / name / "polyMesh", 3 * i)
    mesh = meshgauge.read(tmp_path)
    assert [block.name for block in mesh.blocks] == ["air", "solid", "first", "rest"]
    assert meshgauge.measure(mesh).values[:2].tolist() == [1.0, 1.0]


def test_meshes_of_time_steps_are_told_and_can_be_named(tmp_path: Path) -> None:
    poly_mesh(tmp_path / "constant" / "polyMesh")
    moved = tmp_path / "0.5" / "polyMesh"
    moved.mkdir(parents=True)
    points = (tmp_path / "constant" / "polyMesh" / "points").read_text().replace("(1 1 1)", "(0 0 -1)")
    (moved / "points.gz").write_bytes(gzip.compress(points.encode()))
    mesh = meshgauge.read(tmp_path)
    assert mesh.notes == ("The file holds 2 time steps; the first (constant) was read.",)
    assert [(step.time, step.name) for step in meshgauge.io.steps(tmp_path)] == [(None, "constant"), (0.5, "0.5")]
    assert meshgauge.measure(mesh).values[0] == 1.0
    later = meshgauge.read(tmp_path / "0.5")
    assert meshgauge.measure(later).values[0] < 0.0


# --- Real cases ------------------------------------------------------------------------------------------------------

DICTIONARIES = {
    "controlDict": """application none; startFrom startTime; startTime 0; stopAt endTime; endTime 1; deltaT 1;
        writeControl timeStep; writeInterval 1; writeFormat ascii; writePrecision 12; writeCompression off;""",
    "fvSchemes": """ddtSchemes { default Euler; } gradSchemes { default Gauss linear; }
        divSchemes { default none; } laplacianSchemes { default Gauss linear corrected; }
        interpolationSchemes { default linear; } snGradSchemes { default corrected; }""",
    "fvSolution": "solvers { }",
    "decomposeParDict": "numberOfSubdomains 3; method simple; simpleCoeffs { n (3 1 1); delta 0.001; }",
    "blockMeshDict": """convertToMeters 1;
        vertices ((0 0 0) (8 0 0) (8 8 0) (0 8 0) (0 0 8) (8 0 8) (8 8 8) (0 8 8));
        blocks (hex (0 1 2 3 4 5 6 7) (8 8 8) simpleGrading (1 1 1)); edges ();
        boundary (walls { type wall; faces
            ((0 3 2 1) (4 5 6 7) (0 1 5 4) (1 2 6 5) (2 3 7 6) (3 0 4 7)); });""",
    "meshQualityDict": """maxNonOrtho 65; maxBoundarySkewness 20; maxInternalSkewness 4; maxConcave 80;
        minVol 1e-13; minTetQuality 1e-15; minArea -1; minTwist 0.02; minDeterminant 0.001; minFaceWeight 0.05;
        minVolRatio 0.01; minTriangleTwist -1; nSmoothScale 4; errorReduction 0.75;""",
    "snappyHexMeshDict": """castellatedMesh true; snap SNAP; addLayers false;
        geometry { ball { type searchableSphere; centre (4.1 4.2 4.3); radius 2.3; } }
        castellatedMeshControls { maxLocalCells 100000; maxGlobalCells 200000; minRefinementCells 0;
            nCellsBetweenLevels 2; maxLoadUnbalance 0.1; resolveFeatureAngle 30; features (); SURFACES
            refinementRegions { ball { mode inside; levels ((1e15 2)); } }
            locationInMesh (0.51 0.52 0.53); allowFreeStandingZoneFaces true; }
        snapControls { nSmoothPatch 3; tolerance 2.0; nSolveIter 30; nRelaxIter 5; }
        addLayersControls { relativeSizes true; layers { } expansionRatio 1.0; finalLayerThickness 0.3;
            minThickness 0.25; nGrow 0; featureAngle 30; nRelaxIter 5; nSmoothSurfaceNormals 1;
            nSmoothNormals 3; nSmoothThickness 10; maxFaceThicknessRatio 0.5;
            maxThicknessToMedialRatio 0.3; minMedianAxisAngle 90; nBufferCellsNoExtrude 0; nLayerIter 50; }
        meshQualityControls { #include "meshQualityDict" } mergeTolerance 1e-6;""",
}
SURFACE = "refinementSurfaces { ball { level (1 2); } }"


def run(case: Path, *command: str) -> str:
    etc = Path("/usr/share/openfoam")
    environment = {**os.environ, **({"WM_PROJECT_DIR": str(etc)} if etc.is_dir() else {})}
    done = subprocess.run(command, cwd=case, capture_output=True, text=True, timeout=120, env=environment, check=False)
    assert "FOAM FATAL" not in done.stdout + done.stderr, done.stdout[-2000:] + done.stderr[-2000:]
    return done.stdout


def regular_faced_solids(case: Path, *, with_surface: bool) -> Path:
    """The case with a mesh of cubes, finer in a ball; or around a ball, whose surface the cells are moved to."""
    if shutil.which("snappyHexMesh") is None:
        pytest.skip("OpenFOAM is not installed")
    (case / "system").mkdir(parents=True)
    for name, text in DICTIONARIES.items():
        given = text.replace("SNAP", str(with_surface).lower())
        given = given.replace("SURFACES", SURFACE if with_surface else "refinementSurfaces { }")
        if with_surface:
            given = given.replace(
                "refinementRegions { ball { mode inside; levels ((1e15 2)); } }", "refinementRegions { }"
            )
        (case / "system" / name).write_text(HEAD.format("dictionary", name) + given)
    run(case, "blockMesh")
    run(case, "snappyHexMesh", "-overwrite")
    return case


def counted_by_check_mesh(case: Path) -> dict[str, int]:
    """Numbers of cells by type; OpenFOAM's wedges and tet wedges are special polyhedra."""
    said = dict(re.findall(r"^ +(\w[\w ]*): +(\d+)$", run(case, "checkMesh", "-constant"), re.MULTILINE))
    names = {"tetrahedra": "tetra", "pyramids": "pyramid", "prisms": "wedge", "hexahedra": "hexahedron"}
    counts = {own: int(said[name]) for name, own in names.items()}
    counts["polyhedron"] = sum(int(said[name]) for name in ("polyhedra", "wedges", "tet wedges"))
    return {name: n for name, n in counts.items() if n}


def solid_counts(mesh: meshgauge.Mesh) -> dict[str, int]:
    return {k: n for k, n in mesh.type_counts().items() if k not in ("triangle", "quad", "polygon")}


def test_an_octree_of_snappy_hex_mesh_scores_one(tmp_path: Path) -> None:
    case = regular_faced_solids(tmp_path / "case", with_surface=False)
    mesh = meshgauge.read(case)
    assert solid_counts(mesh) == counted_by_check_mesh(case)
    assert mesh.type_counts()["polyhedron"] > 100
    quality = meshgauge.measure(mesh)
    values = quality.values[np.isfinite(quality.values)]
    np.testing.assert_allclose(values, 1.0, rtol=1e-12)
    assert quality.polyhedra is not None
    assert quality.polyhedra.fault_counts() == {"HANGING": mesh.type_counts()["polyhedron"]}


def test_cells_moved_to_a_surface_in_every_form_of_the_files(tmp_path: Path) -> None:
    case = regular_faced_solids(tmp_path / "case", with_surface=True)
    mesh = meshgauge.read(case)
    assert solid_counts(mesh) == counted_by_check_mesh(case)
    values = meshgauge.measure(mesh).values
    assert 0.99 < np.nanmedian(values) <= 1.0
    assert f"{sum(solid_counts(mesh).values()):,} cells" in command_line.run("report", case, "-q").stdout

    packed = shutil.copytree(case, tmp_path / "packed")
    control = packed / "system" / "controlDict"
    control.write_text(control.read_text().replace("ascii; writePrecision", "binary; writePrecision"))
    run(packed, "foamFormatConvert", "-constant")
    assert b"format      binary" in (packed / "constant" / "polyMesh" / "points").read_bytes()
    binary = meshgauge.read(packed)
    for file in ("points", "faces", "owner"):
        path = packed / "constant" / "polyMesh" / file
        path.with_name(f"{file}.gz").write_bytes(gzip.compress(path.read_bytes()))
        path.unlink()
    for other in (binary, meshgauge.read(packed)):
        np.testing.assert_allclose(other.points, mesh.points, rtol=1e-14)
        np.testing.assert_array_equal(other.connectivity, mesh.connectivity)

    run(case, "decomposePar")
    shutil.rmtree(case / "constant" / "polyMesh")
    pieces = meshgauge.read(case)
    assert pieces.type_counts() == mesh.type_counts()
    assert [block.name for block in pieces.blocks][:3] == ["processor0", "processor1", "processor2"]
    np.testing.assert_allclose(np.sort(meshgauge.measure(pieces).values), np.sort(values), rtol=1e-9, atol=1e-12)


def test_the_dual_of_a_mesh(tmp_path: Path) -> None:
    case = regular_faced_solids(tmp_path / "case", with_surface=False)
    run(case, "polyDualMesh", "60", "-overwrite")
    mesh = meshgauge.read(case / "0" if (case / "0" / "polyMesh").is_dir() else case)
    quality = meshgauge.measure(mesh)
    solid = np.isin(quality.mesh.types, [10, 12, 13, 14, 42])
    assert quality.polyhedra is not None
    assert np.isfinite(quality.values[solid]).all()
    assert np.median(quality.values[solid]) > 0.7


def test_a_case_of_the_plane_has_the_numbers_of_check_mesh(tmp_path: Path) -> None:
    """One cell thick, ``empty`` in front and behind."""
    if shutil.which("checkMesh") is None:
        pytest.skip("OpenFOAM is not installed")
    case = tmp_path / "case"
    (case / "system").mkdir(parents=True)
    for name in ("controlDict", "fvSchemes", "fvSolution", "blockMeshDict"):
        text = DICTIONARIES[name].replace("(8 8 8) simpleGrading (1 1 1)", "(8 6 1) simpleGrading (5 1 1)")
        sides = "(0 3 2 1) (4 5 6 7) "
        text = text.replace(sides, "")
        text = text.replace("(walls", f"(sides {{ type empty; faces ({sides}); }} walls")
        (case / "system" / name).write_text(HEAD.format("dictionary", name) + text)
    run(case, "blockMesh")
    said = run(case, "checkMesh", "-constant", "-allGeometry")
    assert "Mesh has 2 geometric" in said
    faces = meshgauge.measure(meshgauge.read(case), metrics=["aspect_ratio", "determinant"]).faces
    assert faces is not None
    aspect = re.search(r"Max aspect ratio = (\S+)", said)
    determinant = re.search(r"wellposedness\) : minimum: (\S+) average: (\S+)", said)
    assert aspect is not None
    assert determinant is not None
    cells = faces.volumes > 0.0
    assert faces.aspect_ratio[cells].max() == pytest.approx(float(aspect[1]), rel=1e-10)
    assert faces.determinant[cells].min() == pytest.approx(float(determinant[1]), rel=1e-10)
    assert faces.determinant[cells].mean() == pytest.approx(float(determinant[2]), rel=1e-10)
