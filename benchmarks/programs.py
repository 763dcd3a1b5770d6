"""Files that other programs write, read by meshgauge and compared with what the program itself says of its mesh.

    python benchmarks/programs.py [FOLDER]

Each program that is at hand (Gmsh, Netgen, Mmg, VTK, medcoupling, PyMFEM, CalculiX's cgx, OpenFOAM's blockMesh and its
converters) makes a mesh and writes it; a line a file says whether meshgauge has the same cells by type and the same
volumes, cell by cell, or in sum where the program gives no more. Files stay in FOLDER if one is given.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import meshgauge

TOLERANCE = 1e-9
HEADER = f"{'program':14}{'file':26}{'cells':>7}  {'by type':12}{'volumes':34}{'worst':>8}"


class Written(NamedTuple):
    """A file, and what its program says: cells by type, and the volume of each, or of all."""

    program: str
    path: Path
    counts: dict[str, int]
    volumes: Any
    tolerance: float = TOLERANCE


def by_gmsh(folder: Path) -> Iterator[Written]:
    """A box of hexahedra on which tetrahedra and pyramids stand, in seven formats, of first and second order."""
    gmsh = __import__("gmsh")
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
    gmsh.model.occ.addSphere(2, 2, 2, 0.7)
    gmsh.model.occ.synchronize()
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.3)
    for edge in gmsh.model.getBoundary([(3, 1)], recursive=False, combined=False, oriented=False):
        gmsh.model.mesh.setTransfiniteSurface(edge[1])
        gmsh.model.mesh.setRecombine(2, edge[1])
    gmsh.model.mesh.setTransfiniteVolume(1)
    gmsh.model.addPhysicalGroup(3, [1], 1, "box")
    gmsh.model.addPhysicalGroup(3, [2], 2, "ball")
    gmsh.model.mesh.generate(3)
    made = []
    names = {4: "tetra", 5: "hexahedron", 11: "tetra10", 12: "hexahedron27"}
    for order, suffixes in ((1, ("msh", "med", "cgns", "bdf", "unv", "inp", "vtk")), (2, ("msh", "med"))):
        gmsh.model.mesh.setOrder(order)
        counts, volumes = {}, []
        for kind, tags, _ in zip(*gmsh.model.mesh.getElements(3), strict=True):
            counts[names[kind]] = len(tags)
            volumes.append(gmsh.model.mesh.getElementQualities(tags, "volume"))
        for suffix in suffixes:
            path = folder / f"gmsh_{order}.{suffix}"
            gmsh.write(str(path))
            rough = 1e-4 if suffix == "bdf" else TOLERANCE  # fields of eight columns
            made.append(Written("Gmsh", path, counts, np.concatenate(volumes) if order == 1 else None, rough))
    gmsh.finalize()
    yield from made


def by_netgen(folder: Path) -> Iterator[Written]:
    """A ball in a cube; Netgen ends its process when it exports twice, so each file has its own."""
    text = (
        "import sys, numpy as np; from netgen.csg import *; name, form = sys.argv[1:]\n"
        "geo = CSGeometry(); cube = OrthoBrick(Pnt(0,0,0), Pnt(1,1,1)); ball = Sphere(Pnt(.5,.5,.5), .3)\n"
        "geo.Add(cube-ball); geo.Add(cube*ball) if form in ('vol', 'second') else None\n"
        "m = geo.GenerateMesh(maxh=.25)\n"
        "E = [[v.nr - 1 for v in e.vertices] for e in m.Elements3D()]\n"
        "np.savez(name + '.npz', P=[p.p for p in m.Points()], E=E)\n"
        "m.SecondOrder() if form == 'second' else None\n"
        "m.Save(name) if form in ('vol', 'second') else m.Export(name, form)\n"
    )
    forms = {
        "netgen.vol": "vol", "netgen_2.vol": "second", "netgen.msh": "Gmsh2 Format", "netgen.inp": "Abaqus Format",
        "netgen_fluent.msh": "Fluent Format", "netgen_foam": "OpenFOAM 1.5+ Format",
    }  # fmt: skip
    for name, form in forms.items():
        path = folder / name
        subprocess.run([sys.executable, "-c", text, str(path), form], capture_output=True, check=False)
        with np.load(f"{path}.npz") as data:
            corners = data["P"][data["E"]]
        volumes = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6
        kind = "tetra10" if form == "second" else "tetra"
        yield Written("Netgen", path, {kind: len(volumes)}, None if form == "second" else volumes, 1e-5)


def by_mmg(folder: Path) -> Iterator[Written]:
    """Tetrahedra that it makes finer."""
    mmgpy = __import__("mmgpy")
    grid = __import__("pyvista").ImageData(dimensions=(4, 4, 4)).to_tetrahedra()
    tetrahedra = grid.cells.reshape(-1, 5)[:, 1:].astype(np.int32)
    for suffix in ("mesh", "meshb"):
        mesh = mmgpy.MmgMesh3D(np.asarray(grid.points, np.float64), tetrahedra)
        mesh.remesh(hmax=0.7, verbose=-1)
        path = folder / f"mmg.{suffix}"
        mesh.save(str(path))
        corners = np.asarray(mesh.get_vertices())[np.asarray(mesh.get_tetrahedra())]
        volumes = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6
        yield Written("Mmg", path, {"tetra": len(volumes)}, volumes)


def by_vtk(folder: Path) -> Iterator[Written]:
    """A grid of which some cells became tetrahedra, in VTK's own writers."""
    pv = __import__("pyvista")
    box = pv.ImageData(dimensions=(5, 4, 3)).cast_to_unstructured_grid()
    wedge = pv.UnstructuredGrid(
        np.array([6, 0, 1, 2, 3, 4, 5]),
        [13],
        np.array([(9, 0, 0), (9, 1, 0), (10, 0, 0), (9, 0, 1), (9, 1, 1), (10, 0, 1.0)]),
    )
    pyramid = pv.UnstructuredGrid(
        np.array([5, 0, 1, 2, 3, 4]), [14], np.array([(9, 5, 0), (10, 5, 0), (10, 6, 0), (9, 6, 0), (9.5, 5.5, 1.0)])
    )
    grid = box.extract_cells(range(12)).merge(box.extract_cells(range(12, 24)).triangulate())
    grid = grid.merge(wedge).merge(pyramid)
    names = {10: "tetra", 11: "voxel", 12: "hexahedron", 13: "wedge", 14: "pyramid"}
    counts = {names[k]: n for k, n in Counter(grid.celltypes.tolist()).items()}
    volumes = np.abs(grid.compute_cell_sizes()["Volume"])
    for suffix, binary in (("vtu", True), ("vtk", False), ("vtkhdf", True)):
        path = folder / f"vtk.{suffix}"
        grid.save(path, binary=binary)
        yield Written("VTK", path, counts, volumes, 1e-6)


def by_medcoupling(folder: Path) -> Iterator[Written]:
    """Half of a box of hexahedra split into tetrahedra; the same of second order."""
    mc = __import__("medcoupling")
    ticks = mc.DataArrayDouble(np.linspace(0, 1, 5))
    grid = mc.MEDCouplingCMesh()
    grid.setCoords(ticks, ticks, ticks)
    box = grid.buildUnstructured()
    split = box[:32].deepCopy()
    split.simplexize(mc.PLANAR_FACE_6)
    mesh = mc.MEDCouplingUMesh.MergeUMeshes([split, box[32:]])
    mesh.mergeNodes(1e-9)
    mesh.sortCellsInMEDFileFrmt()
    for name, is_quadratic in (("medcoupling.med", False), ("medcoupling_2.med", True)):
        one = mesh.deepCopy()
        if is_quadratic:
            one.convertLinearCellsToQuadratic(0)
        one.setName("mix")
        file = mc.MEDFileUMesh()
        file.setMeshAtLevel(0, one)
        file.write(str(folder / name), 2)
        kinds = ("tetra10", "hexahedron20") if is_quadratic else ("tetra", "hexahedron")
        volumes = np.abs(mesh.getMeasureField(False).getArray().toNumPyArray())
        yield Written(
            "medcoupling", folder / name, dict(zip(kinds, (192, 32), strict=True)), None if is_quadratic else volumes
        )


def by_mfem(folder: Path) -> Iterator[Written]:
    """Grids of each shape, straight and curved, and one that does not conform."""
    mfem = __import__("mfem.ser", fromlist=["Mesh"])
    for kind, curved in (
        ("hexahedron", "hexahedron27"),
        ("tetrahedron", "tetra10"),
        ("wedge", "wedge18"),
        ("pyramid", "lagrange_pyramid"),
    ):
        for order in (1, 2):
            mesh = mfem.Mesh.MakeCartesian3D(2, 3, 2, getattr(mfem.Element, kind.upper()))
            mesh.SetCurvature(2) if order == 2 else None
            path = folder / f"mfem_{kind}_{order}.mesh"
            mesh.Print(str(path))
            volumes = [mesh.GetElementVolume(n) for n in range(mesh.GetNE())]
            name = curved if order == 2 else "tetra" if kind == "tetrahedron" else kind
            yield Written("PyMFEM", path, {name: len(volumes)}, np.array(volumes) if order == 1 else None)
    mesh = mfem.Mesh.MakeCartesian3D(2, 2, 2, mfem.Element.HEXAHEDRON)
    mesh.EnsureNCMesh(True)
    mesh.RandomRefinement(0.4)
    mesh.Print(str(folder / "mfem_nc.mesh"))
    volumes = [mesh.GetElementVolume(n) for n in range(mesh.GetNE())]
    yield Written("PyMFEM", folder / "mfem_nc.mesh", {"hexahedron": len(volumes)}, np.array(volumes))


def by_cgx(folder: Path) -> Iterator[Written]:
    """A box of bricks of 8 and of 20 nodes, as CalculiX's preprocessor sends it."""
    for kind, name in (("he8", "hexahedron"), ("he20", "hexahedron20")):
        sweeps = ("0 0 4 4", "0 2 0 4", "1 0 0 4")
        lines = ["seto all", "pnt p1 0 0 0", "seta all p p1", *(f"swep all new tra {one}" for one in sweeps)]
        (folder / "box.fbl").write_text("\n".join([*lines, f"elty all {kind}", "mesh all", "send all abq", ""]))
        subprocess.run(["cgx", "-bg", "box.fbl"], cwd=folder, capture_output=True, check=False)
        path = folder / f"cgx_{kind}.inp"
        (folder / "all.msh").rename(path)
        divisions = 4 if kind == "he8" else 2
        yield Written("cgx", path, {name: divisions**3}, np.array(8.0) if kind == "he8" else None, 1e-6)


def by_openfoam(folder: Path) -> Iterator[Written]:
    """A block of hexahedra, halves of it and files of its converters; volumes as checkMesh adds them up."""
    case = folder / "foam"
    (case / "system").mkdir(parents=True)
    head = "FoamFile {{ version 2.0; format ascii; class dictionary; object {}; }}\n"
    blocks = (
        "convertToMeters 1; vertices ((0 0 0)(2 0 0)(2 1 0)(0 1 0)(0 0 1)(2.5 0 1)(2.5 1 1.2)(0 1 1));\n"
        "blocks (hex (0 1 2 3 4 5 6 7) (6 5 4) simpleGrading (3 1 1)); edges (); boundary (); mergePatchPairs ();\n"
    )
    control = (
        "application none; startFrom startTime; startTime 0; endTime 1; deltaT 1; writeInterval 1; writeFormat ascii;\n"
    )
    (case / "system" / "blockMeshDict").write_text(head.format("blockMeshDict") + blocks)
    (case / "system" / "controlDict").write_text(head.format("controlDict") + control)
    schemes = ("ddt", "grad", "div", "laplacian", "interpolation", "snGrad")
    (case / "system" / "fvSchemes").write_text(
        head.format("fvSchemes") + "".join(f"{k}Schemes {{}}\n" for k in schemes)
    )
    (case / "system" / "fvSolution").write_text(head.format("fvSolution"))

    def run(*command: str) -> str:
        settings = {"WM_PROJECT_DIR": "/usr/share/openfoam", **os.environ}  # as Debian installs it
        done = subprocess.run(
            [*command, "-case", str(case)], cwd=case, capture_output=True, text=True, check=False, env=settings
        )
        return done.stdout

    run("blockMesh")
    total = float(re.search(r"Total volume = ([\d.eE+-]*\d)", run("checkMesh"))[1])  # type: ignore[index]
    yield Written("OpenFOAM", case, {"hexahedron": 120}, np.array(total), 1e-5)
    run("foamMeshToFluent")
    yield Written(
        "OpenFOAM", next((case / "fluentInterface").glob("*.msh")), {"hexahedron": 120}, np.array(total), 1e-4
    )
    run("foamToVTK", "-ascii")
    vtu = next((case / "VTK").rglob("internal.vtu"))
    yield Written("OpenFOAM", vtu, {"hexahedron": 120}, np.array(total), 1e-5)
    run("foamToEnsight")
    yield Written("OpenFOAM", next((case / "EnSight").glob("*.case")), {"hexahedron": 120}, np.array(total), 1e-4)
    run("polyDualMesh", "60", "-overwrite")
    match = re.search(r"Total volume = ([\d.eE+-]*\d)", text := run("checkMesh"))
    n = int(re.search(r"cells:\s+(\d+)", text)[1]) if match else 0  # type: ignore[index]
    if match:
        # Faces of the dual are not flat: what is VTK's volume of such a cell is not quite OpenFOAM's.
        yield Written("OpenFOAM", case, {"": n}, np.array(float(match[1])), 2e-3)


PROGRAMS: dict[str, tuple[str, Callable[[Path], Iterator[Written]]]] = {
    "Gmsh": ("gmsh", by_gmsh),
    "Netgen": ("netgen", by_netgen),
    "Mmg": ("mmgpy", by_mmg),
    "VTK": ("pyvista", by_vtk),
    "medcoupling": ("medcoupling", by_medcoupling),
    "PyMFEM": ("mfem", by_mfem),
    "cgx": ("/cgx", by_cgx),
    "OpenFOAM": ("/blockMesh", by_openfoam),
}
"""The module of each, or its command behind a slash."""


def solid_volumes(mesh: meshgauge.Mesh) -> np.ndarray:
    """Of each solid cell, by VTK."""
    grid = mesh.to_pyvista()
    sizes = np.asarray(grid.compute_cell_sizes(length=False, area=False)["Volume"])
    return sizes[np.array([grid.GetCell(n).GetCellDimension() == 3 for n in range(grid.n_cells)])]


def row(one: Written) -> str:
    """A line on one file."""
    name = one.path.name
    try:
        mesh = meshgauge.read(one.path, step="last")
    except meshgauge.MeshgaugeError as error:
        return f"{one.program:14}{name:26}{'':7}  REFUSED: {str(error).partition(': ')[2][:100]}"
    counts = {key.replace("voxel", "hexahedron"): n for key, n in mesh.type_counts().items()}
    quality = meshgauge.measure(mesh)
    is_solid = ~np.isnan(quality.values)
    wanted: Counter[str] = Counter()
    for key, n in one.counts.items():
        wanted[key.replace("voxel", "hexahedron")] += n
    if "" in wanted:
        same = (
            mesh.n_cells - sum(n for key, n in counts.items() if key in ("quad", "triangle", "polygon")) == wanted[""]
        )
    else:
        same = all(counts.get(key) == n for key, n in wanted.items())
    volumes = solid_volumes(mesh)
    if one.volumes is None:
        text = "not compared"
    elif np.ndim(one.volumes) == 0:
        error = abs(np.abs(volumes).sum() / float(one.volumes) - 1)
        text = f"{'sum equal' if error < one.tolerance else 'SUM DIFFERS'} ({error:.0e})"
    else:
        ours, theirs = (np.sort(np.abs(x)) for x in (volumes, one.volumes))
        error = float(np.abs(ours - theirs).max() / theirs.max()) if ours.shape == theirs.shape else np.inf
        text = f"{'each equal' if error < one.tolerance else 'DIFFER'} ({error:.0e})"
    worst = float(np.nanmin(quality.values)) if is_solid.any() else np.nan
    return f"{one.program:14}{name:26}{mesh.n_cells:7,}  {'equal' if same else 'OTHER':12}{text:34}{worst:8.3f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", nargs="?", type=Path)
    given = parser.parse_args()
    print(HEADER)
    with tempfile.TemporaryDirectory() as scratch:
        folder = given.folder or Path(scratch)
        folder.mkdir(exist_ok=True)
        os.chdir(folder)
        for name, (module, make) in PROGRAMS.items():
            begin = time.perf_counter()
            try:
                if module.startswith("/"):
                    if shutil.which(module[1:]) is None:
                        raise ModuleNotFoundError
                else:
                    __import__(module)
            except ImportError:
                print(f"{name:14}is not installed")
                continue
            for one in make(folder):
                print(row(one), flush=True)
            print(f"{name:14}{time.perf_counter() - begin:.1f} s", flush=True)


if __name__ == "__main__":
    main()
