"""Every real file that points can improve: how many of its bytes differ once it is repaired, and who reads it still.

    python benchmarks/patching.py [--cells N] [--target Q] [FOLDER ...]

Each mesh of at most N cells (all unless given) is improved as `meshgauge improve --everywhere` does, its file patched
where the format is, and read back by meshgauge and by every library at hand that reads the format: pyvista, meshio,
meshio++, gmsh, netCDF4, pyNastran, mapdl-archive, medcoupling, PyMFEM, and checkMesh of OpenFOAM. A library counts as
equal if it reads the same points of the new file; where it does not, but read others of the old file than meshgauge
too, it is named as before. Folders are searched for files; those of real meshes and of cases beside a checkout, or in
MESHGAUGE_SHARED, unless given. Bytes that differ are those that were replaced; a packed array counts as one.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import shutil
import subprocess
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

import meshgauge
from meshgauge import Mesh
from meshgauge.errors import MeshgaugeError
from meshgauge.files.undo import restored
from meshgauge.io.patching import patch_of
from meshgauge.repair import improve

ROOT = Path(__file__).resolve().parents[1]
HEADER = (
    f"{'file':42}{'cells':>8}{'moved':>7}{'bytes':>11}{'differ':>10}  {'worst':>15}  {'read':>6} {'patch':>6}  others"
)


def _pyvista(path: Path) -> Any:
    read = __import__("pyvista").read(path)
    return (read.combine() if hasattr(read, "combine") else read).points


def _meshio(path: Path) -> Any:
    return __import__("meshio").read(path).points


def _plusplus(path: Path) -> Any:
    return __import__("meshioplusplus").read(path).points


def _gmsh(path: Path) -> Any:
    gmsh = __import__("gmsh")
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(path))
        return gmsh.model.mesh.getNodes()[1].reshape(-1, 3)
    finally:
        gmsh.finalize()


def _netcdf(path: Path) -> Any:
    with __import__("netCDF4").Dataset(path) as file:
        axes = [file[name][:] for name in ("coordx", "coordy", "coordz") if name in file.variables]
        return np.stack(axes, axis=1) if axes else file["coord"][:].T


def _nastran(path: Path) -> Any:
    from pyNastran.bdf.bdf import read_bdf

    nodes = read_bdf(path, debug=None, punch="BEGIN BULK" not in path.read_text(errors="replace").upper(), xref=False)
    return [node.xyz for _, node in sorted(nodes.nodes.items())]


def _mapdl(path: Path) -> Any:
    return __import__("mapdl_archive").Archive(path).nodes[:, :3]


def _medcoupling(path: Path) -> Any:
    return __import__("medcoupling").MEDFileMesh.New(str(path)).getCoords().toNumPyArray()


def _mfem(path: Path) -> Any:
    mesh = __import__("mfem.ser", fromlist=["Mesh"]).Mesh(str(path))
    return np.array([mesh.GetVertexArray(n) for n in range(mesh.GetNV())])


EXODUS = (".exo", ".e", ".ex2", ".gen", ".g")
READERS: dict[str, tuple[Callable[[Path], Any], tuple[str, ...]]] = {
    "pyvista": (_pyvista, (".vtu", ".vtk", ".vtkhdf", ".pvtu", ".pvd", ".vtm", ".xdmf", ".cgns", *EXODUS)),
    "meshio": (
        _meshio,
        (".vtu", ".vtk", ".inp", ".msh", ".mesh", ".meshb", ".su2", ".xdmf", ".med", ".bdf", ".vol", *EXODUS),
    ),
    "meshio++": (
        _plusplus,
        (".inp", ".msh", ".mesh", ".meshb", ".su2", ".unv", ".bdf", ".cdb", ".k", ".vol", ".node", ".ele"),
    ),
    "gmsh": (_gmsh, (".msh", ".mesh", ".med", ".cgns", ".bdf", ".unv", ".su2")),
    "netCDF4": (_netcdf, EXODUS),
    "pyNastran": (_nastran, (".bdf", ".nas", ".dat")),
    "mapdl-archive": (_mapdl, (".cdb",)),
    "medcoupling": (_medcoupling, (".med",)),
    "PyMFEM": (_mfem, (".mesh",)),
}
"""Libraries, and extensions of files that they are asked to read."""


def _points(read: Callable[[Path], Any], path: Path) -> np.ndarray | None:
    """What a library reads: points in any order; None if it does not."""
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        try:
            points = np.asarray(read(path), np.float64)
            points = np.pad(points, ((0, 0), (0, 3 - points.shape[1])))
            return points[np.lexsort(points.T)] if len(points) else None
        except (Exception, SystemExit):
            return None


def by_others(old: Path, new: Path, before: Mesh, after: Mesh) -> str:
    """The libraries that read the points of the new file, and those that read it as they read the old one."""
    if new.is_dir():
        if shutil.which("checkMesh") is None:
            return "-"
        settings = {"WM_PROJECT_DIR": "/usr/share/openfoam", **os.environ}  # as Debian installs it
        texts = [
            subprocess.run(
                ["checkMesh", "-case", one], capture_output=True, text=True, check=False, env=settings
            ).stdout
            for one in (str(old), str(new))
        ]
        ends = ["Mesh OK" if "Mesh OK" in text else "Failed" if "Failed" in text else "no" for text in texts]
        return "-" if "no" in ends else f"checkMesh ({ends[0]} -> {ends[1]})"  # no: it has no settings for it
    names = []
    sorted_points = [
        np.asarray(mesh.points, np.float64)[np.lexsort(np.asarray(mesh.points).T)] for mesh in (before, after)
    ]
    for name, (read, extensions) in READERS.items():
        there = _points(read, old) if old.suffix.lower() in extensions else None
        if there is None:
            continue
        is_equal = there.shape == sorted_points[0].shape and np.allclose(there, sorted_points[0], rtol=1e-6, atol=1e-12)
        here = _points(read, new)
        if here is None:
            names.append(f"{name} FAILS")
        elif not is_equal:
            names.append(f"{name} (reads {len(there):,} points)" if here.shape == there.shape else f"{name} OTHER")
        else:
            same = here.shape == there.shape and np.allclose(here, sorted_points[1], rtol=1e-6, atol=1e-12)
            names.append(name if same else f"{name} OTHER POINTS")
    return ", ".join(names) or "-"


def size_of(path: Path) -> int:
    """Bytes of a file, or of all in a folder."""
    return sum(one.stat().st_size for one in path.rglob("*") if one.is_file()) if path.is_dir() else path.stat().st_size


def differing(undo: Path) -> int | None:
    """Bytes that were replaced, in all files; None where a library put them, and blocks around are packed anew."""
    with np.load(undo) as data:
        n = 0
        for at in range(len(data["names"])):
            if f"{at}.hunks" not in data:
                return None
            hunks = data[f"{at}.hunks"]
            n += int((hunks[:, 1] - hunks[:, 0]).sum())
        return n


def row(path: Path, most: int | None, target: float, counts: Counter[str]) -> str | None:
    """A line on one file; None if it is too large, not patched, or not improved."""
    begin = time.process_time()
    try:
        mesh = meshgauge.read(path, step="first")
    except MeshgaugeError:
        return None
    t_read = time.process_time() - begin
    if not mesh.n_cells or (most is not None and mesh.n_cells > most):
        counts["empty or larger"] += 1
        return None
    name = "/".join(path.parts[-2:])[-41:]
    with tempfile.TemporaryDirectory() as folder:
        there, undo = Path(folder) / path.name, Path(folder) / "undo.npz"
        try:
            patch = patch_of(mesh, there, step="first")
            if patch is None:
                counts["written anew, or not at all"] += 1
                return None
            result = improve(mesh, everywhere=True, target=target, fixed=patch.is_fixed, rounding=patch.roundings)
        except MeshgaugeError as error:
            counts["nothing to improve, or refused"] += 1
            return f"{name:42}{mesh.n_cells:8,}  {str(error).removeprefix(f'{path}: ')}"[:150]
        n_moved = int(np.count_nonzero((np.asarray(result.mesh.points) != mesh.points).any(axis=1)))
        if not n_moved or result.report.outcome == "refused":
            counts["no better mesh"] += 1
            return None
        begin = time.process_time()
        patch.write(result.mesh, undo_file=undo)
        t_patch = time.process_time() - begin
        old = restored(undo, there)
        main = Path(path)
        if not path.is_dir() and old.get("") is not None and old[""] != main.read_bytes():
            counts["NOT UNDONE"] += 1
        counts["patched"] += 1
        n = differing(undo)
        worst = [float(np.nanmin(one.values)) for one in (result.before, result.after)]
        others = by_others(path, there, mesh, result.mesh)
        counts["read by another"] += others != "-"
        counts["READ OTHERWISE OR NOT"] += any(word in others for word in ("FAILS", "OTHER"))
        return (
            f"{name:42}{mesh.n_cells:8,}{n_moved:7,}{size_of(path):11,}"
            f"{'packed' if n is None else format(n, ','):>10}  {worst[0]:6.3f} → {worst[1]:6.3f}  "
            f"{t_read:6.2f} {t_patch:6.2f}  {others}"
        )


def files_in(folder: Path) -> Iterator[Path]:
    """Files, and folders that are cases of OpenFOAM, each once."""
    for path in sorted(folder.rglob("*")):
        if path.is_dir():
            if (path / "constant" / "polyMesh").is_dir() or (path / "processor0").is_dir():
                yield path
        elif not any((one / "constant" / "polyMesh").is_dir() for one in path.parents):
            yield path


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--cells", type=int)
    parser.add_argument("--target", type=float, default=0.2)
    parser.add_argument("folders", nargs="*", type=Path)
    given = parser.parse_args()
    shared = Path(os.environ.get("MESHGAUGE_SHARED", ROOT.parent / "shared"))
    print(HEADER)
    counts: Counter[str] = Counter()
    for folder in given.folders or (shared / "meshes", shared / "cases", shared / "repair"):
        for path in files_in(folder):
            line = row(path, given.cells, given.target, counts)
            if line is not None:
                print(line, flush=True)
    print("; ".join(f"{n} {what}" for what, n in counts.items() if n))


if __name__ == "__main__":
    main()
