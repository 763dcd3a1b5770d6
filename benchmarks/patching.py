"""Every real mesh that points can improve: how many bytes of its file differ once it is repaired.

    python benchmarks/patching.py [--cells N] [FOLDER]

Each mesh of at most N cells (12,000 unless given) is improved as `meshgauge improve` does, its file patched where the
format is, and read back by meshgauge and by another library where one reads it. The folder has a MANIFEST.tsv with a
column path; it is that of the real meshes beside a checkout, or MESHGAUGE_SHARED, unless given.
"""

from __future__ import annotations

import argparse
import csv
import os
import tempfile
import time
from pathlib import Path

import numpy as np

import meshgauge
from meshgauge import Mesh
from meshgauge.errors import MeshgaugeError
from meshgauge.io.patching import patch_of
from meshgauge.repair import improve

ROOT = Path(__file__).resolve().parents[1]
HEADER = (
    f"{'file':36}{'cells':>8}{'moved':>7}{'bytes':>11}{'differ':>9}  {'worst':>15}  {'read':>6} {'patch':>6}  others"
)


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


def by_others(path: Path, mesh: Mesh) -> str:
    """The libraries that read as many points, each once at its place."""
    names = []
    for name in ("pyvista", "meshio"):
        try:
            library = __import__(name)
            read = library.read(path)
            read = read.combine() if hasattr(read, "combine") else read
            points = np.asarray(read.points, np.float64)
        except (Exception, SystemExit):
            continue
        same = points.shape == mesh.points.shape and np.array_equal(points, np.asarray(mesh.points, np.float64))
        names.append(name if same else f"{name} (other points)")
    return ", ".join(names) or "-"


def row(path: Path, most: int) -> str | None:
    """A line on one file; None if it is too large, not patched, or not improved."""
    begin = time.perf_counter()
    try:
        mesh = meshgauge.read(path, step="first")
    except MeshgaugeError:
        return None
    t_read = time.perf_counter() - begin
    if not 0 < mesh.n_cells <= most:
        return None
    with tempfile.TemporaryDirectory() as folder:
        target, undo = Path(folder) / path.name, Path(folder) / "undo.npz"
        try:
            patch = patch_of(mesh, target, step="first")
            if patch is None:
                return None
            result = improve(mesh, fixed=patch.is_fixed, rounding=patch.rounded)
        except MeshgaugeError as error:
            return f"{path.name:36}{mesh.n_cells:8,}  {error}"[:150]
        n_moved = int(np.count_nonzero((np.asarray(result.mesh.points) != mesh.points).any(axis=1)))
        if not n_moved or result.report.outcome == "refused":
            return None
        begin = time.perf_counter()
        patch.write(result.mesh, undo_file=undo)
        t_patch = time.perf_counter() - begin
        n = differing(undo)
        worst = [float(np.nanmin(one.values)) for one in (result.before, result.after)]
        return (
            f"{path.name[-35:]:36}{mesh.n_cells:8,}{n_moved:7,}{path.stat().st_size:11,}"
            f"{'packed' if n is None else format(n, ','):>9}  {worst[0]:6.3f} → {worst[1]:6.3f}  "
            f"{t_read:6.2f} {t_patch:6.2f}  {by_others(target, result.mesh)}"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--cells", type=int, default=12_000)
    parser.add_argument("folder", nargs="?", type=Path)
    given = parser.parse_args()
    folder = given.folder or Path(os.environ.get("MESHGAUGE_SHARED", ROOT.parent / "shared")) / "meshes"
    with (folder / "MANIFEST.tsv").open() as file:
        paths = [folder / one["path"] for one in csv.DictReader(file, delimiter="\t")]
    print(HEADER)
    for path in paths:
        line = row(path, given.cells)
        if line is not None:
            print(line, flush=True)


if __name__ == "__main__":
    main()
