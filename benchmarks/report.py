"""The whole program against a process that only reads the file with PyVista: time and memory.

    python benchmarks/report.py [--cells 10000000] [--rounds 5] [--folder DIR]

Writes a raw VTU and a VTKHDF file of hexahedra into the folder, then runs `meshgauge report --no-diagnosis FILE`
and `python -c "import pyvista; pyvista.read(FILE)"` in turn, each as a process of its own. Memory is the peak of the
process less that of an interpreter that has loaded nothing, over the size of the file's arrays. Beside other work the
processor time says more than the time that passes.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from statistics import median

import numpy as np
from grids import cells_of
from versions import versions

READ = "import sys, pyvista; pyvista.read(sys.argv[1])"
MiB = 1024.0  # ru_maxrss is in KiB


def write(folder: Path, least: int) -> tuple[int, int, list[Path]]:
    """The two files; number of cells and bytes of the arrays."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkUnstructuredGrid
    from vtkmodules.vtkIOHDF import vtkHDFWriter
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    points, cells = cells_of("hexahedron", least)
    offsets = np.arange(len(cells) + 1) * 8
    place, array, grid = vtkPoints(), vtkCellArray(), vtkUnstructuredGrid()
    place.SetData(numpy_to_vtk(points))
    array.SetData(numpy_to_vtkIdTypeArray(offsets), numpy_to_vtkIdTypeArray(cells.reshape(-1)))
    grid.SetPoints(place)
    grid.SetCells(12, array)
    raw, hdf = folder / "hexahedra.vtu", folder / "hexahedra.vtkhdf"
    xml = vtkXMLUnstructuredGridWriter()
    xml.SetDataModeToAppended()
    xml.EncodeAppendedDataOff()
    xml.SetCompressorTypeToNone()
    xml.SetHeaderTypeToUInt64()
    for writer, path in ((xml, raw), (vtkHDFWriter(), hdf)):
        writer.SetFileName(str(path))
        writer.SetInputData(grid)
        writer.Write()
    return len(cells), points.nbytes + cells.nbytes + offsets.nbytes + len(cells), [raw, hdf]


def run(command: list[str]) -> tuple[float, float, float]:
    """Wall seconds, peak memory in MiB, seconds of processor time."""
    start = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"{command} ended with {process.returncode}")
    return time.perf_counter() - start, usage.ru_maxrss / MiB, usage.ru_utime + usage.ru_stime


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, default=10_000_000)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--folder", type=Path, help="for the files, about 2 GB; a temporary one if not given")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=asked.folder) as folder:
        # In a process of its own: the peak memory of a child counts what its parent held when it forked.
        with ProcessPoolExecutor(1) as pool:
            n, size, paths = pool.submit(write, Path(folder), asked.cells).result()
        arrays = size / 2**20
        print(versions("vtk", "pyvista", "h5py"))
        print(f"{n:,} hexahedra, arrays of {arrays:.0f} MiB, median of {asked.rounds} rounds\n")
        columns = (
            "file",
            "report s",
            "pyvista.read s",
            "time ratio",
            "processor s",
            "ratio",
            "report MiB",
            "pyvista MiB",
        )
        print("| " + " | ".join((*columns, "above idle / arrays")) + " |")
        print("|---|---|---|---|---|---|---|---|---|")
        idle = run([sys.executable, "-c", "pass"])[1]
        for path in paths:
            report = [sys.executable, "-m", "meshgauge", "report", "--no-diagnosis", str(path)]
            run(report)  # compile, and fill the page cache
            pairs = [(run(report), run([sys.executable, "-c", READ, str(path)])) for _ in range(asked.rounds)]
            ours, theirs = (median(pair[k][0] for pair in pairs) for k in (0, 1))
            ratio = median(a[0] / b[0] for a, b in pairs)
            own = median(pair[0][2] for pair in pairs)
            processor = median(a[2] / b[2] for a, b in pairs)
            memory, read = (max(pair[k][1] for pair in pairs) for k in (0, 1))
            print(
                f"| {path.suffix[1:]} | {ours:.2f} | {theirs:.2f} | {ratio:.2f} (<= .7) | {own:.2f} | "
                f"{processor:.2f} | {memory:.0f} | {read:.0f} | "
                f"{(memory - idle) / arrays:.2f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
