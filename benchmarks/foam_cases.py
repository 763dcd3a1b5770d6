"""Cases of OpenFOAM, made by its own tools and by Gmsh, and what checkMesh says of them."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

import meshgauge

HEAD = "FoamFile {{ version 2.0; format ascii; class {}; object {}; }}\n"
CONTROL = """application none; startFrom startTime; startTime 0; stopAt endTime; endTime 1; deltaT 1;
    writeControl timeStep; writeInterval 1; writeFormat {}; writePrecision 16; writeCompression off;"""
SETTINGS = {
    "fvSchemes": "".join(
        f"{name}Schemes {{ }}\n" for name in ("ddt", "grad", "div", "laplacian", "interpolation", "snGrad")
    ),
    "fvSolution": "",
    "meshQualityDict": """maxNonOrtho 65; maxBoundarySkewness 20; maxInternalSkewness 4; maxConcave 80;
        minVol 1e-13; minTetQuality 1e-15; minArea -1; minTwist 0.02; minDeterminant 0.001; minFaceWeight 0.05;
        minVolRatio 0.01; minTriangleTwist -1; nSmoothScale 4; errorReduction 0.75;""",
}
BOX = "vertices ((0 0 0)(2 0 0)(2 1 0)(0 1 0)(0 0 1)(2 0 1)(2 1 1)(0 1 1));"
SHEARED = "vertices ((0 0 0)(2 0 0)(2 1 0)(0 1 0)(0 0 1)(2.5 0 1)(2.5 1 1.2)(0.4 1 1));"
SIDES = {"low": "(0 3 2 1)", "high": "(4 5 6 7)", "front": "(0 1 5 4)", "right": "(1 2 6 5)", "back": "(2 3 7 6)",
         "left": "(3 0 4 7)"}  # fmt: skip
THIN, CYCLIC = "wall wall empty wall empty wall", "wall wall cyclic wall cyclic wall"
SNAPPY = """castellatedMesh true; snap true; addLayers false;
    geometry {{ ball {{ type searchableSphere; centre {}; radius {}; }} }}
    castellatedMeshControls {{ maxLocalCells 4000000; maxGlobalCells 9000000; minRefinementCells 0;
        nCellsBetweenLevels 2; maxLoadUnbalance 0.1; resolveFeatureAngle 30; features ();
        refinementSurfaces {{ ball {{ level (1 2); }} }} refinementRegions {{ }}
        locationInMesh (0.0101 0.0102 0.0103); allowFreeStandingZoneFaces true; }}
    snapControls {{ nSmoothPatch 3; tolerance 2.0; nSolveIter 30; nRelaxIter 5; }}
    addLayersControls {{ relativeSizes true; layers {{ }} expansionRatio 1.0; finalLayerThickness 0.3;
        minThickness 0.25; nGrow 0; featureAngle 30; nRelaxIter 5; nSmoothSurfaceNormals 1; nSmoothNormals 3;
        nSmoothThickness 10; maxFaceThicknessRatio 0.5; maxThicknessToMedialRatio 0.3; minMedianAxisAngle 90;
        nBufferCellsNoExtrude 0; nLayerIter 50; }}
    meshQualityControls {{ #include "meshQualityDict" }} mergeTolerance 1e-6;"""


def run(case: Path, *command: str) -> str:
    """What a tool of OpenFOAM prints, called in the folder of a case."""
    settings = {"WM_PROJECT_DIR": "/usr/share/openfoam", **os.environ}  # as Debian installs it
    done = subprocess.run(command, cwd=case, capture_output=True, text=True, check=False, env=settings)
    if done.returncode or "FOAM FATAL" in done.stdout + done.stderr:
        raise RuntimeError(f"{' '.join(command)}: {(done.stdout + done.stderr)[-2000:]}")
    return done.stdout


def dictionary(case: Path, name: str, text: str) -> None:
    (case / "system").mkdir(parents=True, exist_ok=True)
    (case / "system" / name).write_text(HEAD.format("dictionary", name) + text)


def empty_case(case: Path, *, binary: bool = False) -> Path:
    """A case without a mesh."""
    for name, text in SETTINGS.items():
        dictionary(case, name, text)
    dictionary(case, "controlDict", CONTROL.format("binary" if binary else "ascii"))
    return case


def block(
    case: Path,
    cells: tuple[int, int, int],
    vertices: str = SHEARED,
    *,
    grading: str = "3 1 0.5",
    kinds: str = "wall wall wall wall wall wall",
    binary: bool = False,
) -> Path:
    """A block of hexahedra of blockMesh; ``kinds``: the types of the patches, see `SIDES`."""
    empty_case(case, binary=binary)
    pairs = (("low", "high"), ("front", "back"), ("left", "right"))
    partner = {a: b for pair in pairs for a, b in (pair, pair[::-1])}
    patches = "".join(
        f"{name} {{ type {kind}; {f'neighbourPatch {partner[name]};' if kind == 'cyclic' else ''} faces ({face}); }}\n"
        for (name, face), kind in zip(SIDES.items(), kinds.split(), strict=True)
    )
    sizes = " ".join(map(str, cells))
    dictionary(
        case,
        "blockMeshDict",
        f"convertToMeters 1; {vertices}\nblocks (hex (0 1 2 3 4 5 6 7) ({sizes}) simpleGrading ({grading}));\n"
        f"edges (); boundary ({patches}); mergePatchPairs ();",
    )
    run(case, "blockMesh")
    return case


def snappy(case: Path, n: int = 8, *, binary: bool = False) -> Path:
    """Cells of snappyHexMesh around a ball: hexahedra, prisms and polyhedra with hanging points."""
    block(case, (2 * n, n, n), BOX, grading="1 1 1", binary=binary)
    dictionary(case, "snappyHexMeshDict", SNAPPY.format("(1.03 0.52 0.54)", 0.3))
    run(case, "snappyHexMesh", "-overwrite")
    return case


def dual(case: Path, size: float = 0.15, *, binary: bool = False) -> Path:
    """The polyhedra of polyDualMesh around the points of tetrahedra of Gmsh."""
    from_gmsh(case, size, layers=False, binary=binary)
    run(case, "polyDualMesh", "60", "-overwrite")
    return case


def from_gmsh(case: Path, size: float = 0.2, *, layers: bool = True, binary: bool = False) -> Path:
    """Tetrahedra of Gmsh around a ball, with layers of wedges on a side, by gmshToFoam; ``mesh.msh`` stays there."""
    gmsh = __import__("gmsh")
    empty_case(case, binary=binary)
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("Mesh.MshFileVersion", 2.2)
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    occ = gmsh.model.occ
    solid, _ = occ.cut([(3, occ.addBox(0, 0, 0, 1, 1, 1))], [(3, occ.addSphere(0.5, 0.5, 0.5, 0.3))])
    occ.synchronize()
    if layers:
        sides = gmsh.model.getBoundary(solid, oriented=False)
        top = max(sides, key=lambda side: occ.getCenterOfMass(*side)[2])
        occ.extrude([top], 0, 0, 0.3, [2, 2], [0.3, 1.0], recombine=True)
        occ.synchronize()
    gmsh.model.addPhysicalGroup(3, [tag for _, tag in gmsh.model.getEntities(3)], 1, "inside")
    outside = gmsh.model.getBoundary(gmsh.model.getEntities(3), combined=True, oriented=False)
    gmsh.model.addPhysicalGroup(2, [tag for _, tag in outside], 2, "outside")
    gmsh.model.mesh.generate(3)
    gmsh.write(str(case / "mesh.msh"))
    gmsh.finalize()
    run(case, "gmshToFoam", "mesh.msh")
    return case


def shaken(case: Path, make: Callable[[Path], Path], share: float) -> Path:
    """A case whose points then moved at random by a share of the cubic root of its mean cell."""
    make(case)
    mesh = meshgauge.read(case)
    path = case / "constant" / "polyMesh" / "points"
    head, _, rest = path.read_text().partition(f"\n{mesh.n_points}\n")
    size = np.cbrt(np.prod(np.ptp(mesh.points, axis=0)) / mesh.n_points)
    moved = mesh.points + np.random.default_rng(0).uniform(-share * size, share * size, mesh.points.shape)
    rows = "\n".join(f"({x!r} {y!r} {z!r})" for x, y, z in moved.tolist())
    path.write_text(f"{head}\n{mesh.n_points}\n(\n{rows}\n){rest.rpartition(')')[2]}")
    return case


def cases(folder: Path) -> Iterator[tuple[str, Path, Path]]:
    """Small cases of every kind: name, folder, and the file to read, the folder again if it is OpenFOAM's."""
    made = {
        "blockMesh, sheared": block(folder / "block", (12, 10, 8)),
        "blockMesh, one cell thick": block(folder / "empty", (16, 1, 12), BOX, grading="4 1 1", kinds=THIN),
        "snappyHexMesh": snappy(folder / "snappy"),
        "snappyHexMesh, points moved": shaken(folder / "snappy_moved", snappy, 0.15),
        "polyDualMesh": dual(folder / "dual"),
        "polyDualMesh, points moved": shaken(folder / "dual_moved", dual, 0.3),
        "Gmsh, by gmshToFoam": from_gmsh(folder / "gmsh"),
    }
    for name, case in made.items():
        yield name, case, case
    yield "the same, its .msh", folder / "gmsh", folder / "gmsh" / "mesh.msh"
    cyclic = block(folder / "cyclic", (12, 10, 8), BOX, grading="1 1 1", kinds=CYCLIC)
    yield "blockMesh, `cyclic` patches", cyclic, cyclic
