"""Every real mesh read: cells by type beside those that the list of the meshes states, time, and which reader it was.

    python benchmarks/formats.py [--beside] [FOLDER]

With --beside also what meshio, meshio++, VTK (by PyVista) and Gmsh make of each file, in processes of their own: some
minutes. Without a folder the small files of the cases are read as well, which were once refused or read wrongly.
The folder has a MANIFEST.tsv with columns path, tet, hex, prism, pyr, poly; it is that of the real meshes beside a
checkout, or MESHGAUGE_SHARED, unless given. Ends with 1 if a count differs or a file cannot be read. Times are of the
second read of a file; readers of others start a process each.
"""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from meshgauge import io
from meshgauge.errors import ReadError
from meshgauge.io import registry
from meshgauge.io.plumbing import isolate
from meshgauge.mesh import Mesh

ROOT = Path(__file__).resolve().parents[1]
COLUMNS = {
    "tet": ("tetra", "tetra10"),
    "hex": ("hexahedron", "voxel", "hexahedron20", "hexahedron27"),
    "prism": ("wedge", "wedge15", "penta_prism", "hexa_prism"),
    "pyr": ("pyramid", "pyramid13", "lagrange_pyramid"),
    "poly": ("polyhedron",),
}
OTHER_COLUMNS = {"supportedElements.vtk": {"prism": ("wedge",), "poly": ("polyhedron", "penta_prism", "hexa_prism")}}
"""Of a mesh whose penta- and hexaprism the list counts as polyhedra."""


@dataclass(frozen=True, slots=True)
class Row:
    """What became of one file."""

    path: Path
    format: str
    reader: str
    seconds: float
    cells: dict[str, int]
    wrong: dict[str, int]  #: column of the list → what was read instead
    error: str = ""


def rows(folder: Path, times: int = 2) -> Iterator[Row]:
    """One row for each mesh of the list, with the last time of so many."""
    used: list[str] = []
    chosen, in_child = registry.read, isolate.read

    def recorded(fmt: io.Format, *arguments: Any) -> Mesh:
        used[:] = [fmt.name, "own"]
        return chosen(fmt, *arguments)

    def isolated(path: Path, name: str, *arguments: Any) -> Mesh:
        used[:] = [name, "other"]
        return in_child(path, name, *arguments)

    registry.read, isolate.read = recorded, isolated
    try:
        with (folder / "MANIFEST.tsv").open(newline="") as file:
            for line in csv.DictReader(file, delimiter="\t"):
                used[:] = ["", ""]
                yield _row(folder / line["path"], {column: int(line[column]) for column in COLUMNS}, used, times)
    finally:
        registry.read, isolate.read = chosen, in_child


def _row(path: Path, stated: dict[str, int], used: list[str], times: int) -> Row:
    try:
        for _ in range(times - 1):
            io.read(path)
        start = time.perf_counter()
        counts = io.read(path).type_counts()
        seconds = time.perf_counter() - start
    except ReadError as error:
        return Row(path, used[0], used[1], 0.0, stated, stated, str(error))
    columns = COLUMNS | OTHER_COLUMNS.get(path.name, {})
    read = {column: sum(n for name, n in counts.items() if name in names) for column, names in columns.items()}
    wrong = {column: n for column, n in read.items() if n != stated[column]}
    return Row(path, used[0], used[1], seconds, stated, wrong)


LIBRARIES = ("meshio", "meshioplusplus", "vtk", "gmsh")
_SECONDS = 20
"""That a library may take for a file, in a process of its own: some hang, and some end it."""

_CHILD = """
import contextlib, json, sys, time
from pathlib import Path
library, path, ours = sys.argv[1], Path(sys.argv[2]), sys.argv[3]
start = time.perf_counter()
if library == "gmsh":
    import gmsh
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    start = time.perf_counter()
    gmsh.open(str(path))
    types, tags, _ = gmsh.model.mesh.getElements()
    names = [gmsh.model.mesh.getElementProperties(t)[0].split()[0].lower() for t in types]
    called = {"tetrahedron": "tetra", "prism": "wedge", "pyramid": "pyramid", "hexahedron": "hexahedron"}
    counts = {}
    for name, own in zip(names, tags):
        key = called.get(name, name)
        counts[key] = counts.get(key, 0) + len(own)
else:
    if library == "vtk":
        import pyvista
        from meshgauge.io.plumbing import vtk as bridge
        start = time.perf_counter()
        mesh = bridge.mesh(pyvista.read(str(path)), path)
    else:
        import importlib
        from meshgauge.io.plumbing import meshio as bridge
        module = importlib.import_module(library)
        start = time.perf_counter()
        try:
            source = module.read(str(path))
        except BaseException:
            source = module.read(str(path), file_format=ours)
        mesh = bridge.mesh(source, path, ())
    counts = mesh.type_counts()
print("\\n" + json.dumps([time.perf_counter() - start, counts]))
"""


def beside(path: Path, library: str, format_name: str, cells: dict[str, int]) -> str:
    """What one library makes of a file: right, wrong or refused, and its seconds."""
    command = [sys.executable, "-c", _CHILD, library, str(path), format_name]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=_SECONDS, check=False)
    except subprocess.TimeoutExpired:
        return f"none in {_SECONDS} s"
    if done.returncode:
        last = (done.stderr.strip().splitlines() or [""])[-1]
        return "no module" if "No module named" in last else "ends the process" if done.returncode < 0 else "refused"
    try:
        seconds, counts = json.loads(done.stdout.strip().splitlines()[-1])
    except (ValueError, IndexError):
        return "ends the process"
    columns = COLUMNS | OTHER_COLUMNS.get(path.name, {})
    read = {column: sum(n for name, n in counts.items() if name in names) for column, names in columns.items()}
    is_right = all(read[column] == cells.get(column, 0) for column in columns)
    return f"{'right' if is_right else 'wrong'} {seconds:.2f} s"


def cases(folder: Path) -> Iterator[Row]:
    """One row for each small file of a folder that is no part of another; cells are what was read."""
    for path in sorted(folder.iterdir()):
        if path.suffix in (".txt", ".h5"):
            continue
        start = time.perf_counter()
        try:
            mesh = io.read(path)
            name = registry.detect(path, path.read_bytes()[:4096]).name
        except ReadError as error:
            yield Row(path, "", "", 0.0, {}, {}, str(error))
            continue
        seconds, counts = time.perf_counter() - start, mesh.type_counts()
        cells = {column: sum(n for t, n in counts.items() if t in names) for column, names in COLUMNS.items()}
        yield Row(path, name, "own" if not io.FORMATS[name].is_foreign else "own or other", seconds, cells, {})


def main() -> int:
    shared = Path(os.environ.get("MESHGAUGE_SHARED", ROOT.parent / "shared"))
    given = [argument for argument in sys.argv[1:] if not argument.startswith("-")]
    folder = Path(given[0]) if given else shared / "meshes"
    if not (folder / "MANIFEST.tsv").is_file():
        print(f"no MANIFEST.tsv in {folder}", file=sys.stderr)
        return 2
    libraries = LIBRARIES if "--beside" in sys.argv else ()
    found = list(rows(folder))
    for name in ("door", "door_public"):
        if not given and (shared / "cases" / name).is_dir():
            found += cases(shared / "cases" / name)
    head = ["file", "format", "reader", "cells", "result", "time", *libraries]
    print(f"| {' | '.join(head)} |\n|{'---|' * len(head)}")
    for row in found:
        cells = ", ".join(f"{n} {column}" for column, n in row.cells.items() if n)
        result = row.error or (f"**differs: {row.wrong}**" if row.wrong else "equal")
        others = [beside(row.path, library, row.format, row.cells) for library in libraries]
        line = [row.path.name, row.format, row.reader, cells, result, f"{row.seconds:.2f} s", *others]
        print(f"| {' | '.join(line)} |", flush=True)
    bad = [row for row in found if row.wrong or row.error]
    print(f"\n{len(found)} files, {len(found) - len(bad)} equal")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
