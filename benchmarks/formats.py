"""Every real mesh read: cells by type beside those that the list of the meshes states, time, and which reader it was.

    python benchmarks/formats.py [FOLDER]

The folder has a MANIFEST.tsv with columns path, tet, hex, prism, pyr, poly; it is that of the real meshes beside a
checkout, or MESHGAUGE_SHARED, unless given. Ends with 1 if a count differs or a file cannot be read. Times are of the
second read of a file; readers of others start a process each.
"""

from __future__ import annotations

import csv
import os
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


def main() -> int:
    shared = Path(os.environ.get("MESHGAUGE_SHARED", ROOT.parent / "shared"))
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else shared / "meshes"
    if not (folder / "MANIFEST.tsv").is_file():
        print(f"no MANIFEST.tsv in {folder}", file=sys.stderr)
        return 2
    found = list(rows(folder))
    print("| file | format | reader | cells, as stated | result | time |\n|---|---|---|---|---|---:|")
    for row in found:
        cells = ", ".join(f"{n} {column}" for column, n in row.cells.items() if n)
        result = row.error or (f"**differs: {row.wrong}**" if row.wrong else "equal")
        print(f"| {row.path.name} | {row.format} | {row.reader} | {cells} | {result} | {row.seconds:.2f} s |")
    bad = [row for row in found if row.wrong or row.error]
    print(f"\n{len(found)} files, {len(found) - len(bad)} equal")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
