"""Time and memory of `check` and `report` beside OpenFOAM's checkMesh, whole processes on the same cases.

    python benchmarks/check_mesh_speed.py [--cells 1000000] [--rounds 3] [--page docs/speed.md]

Hexahedra of blockMesh, in text and binary, and a twentieth as many polyhedra of polyDualMesh (`foam_cases`). Each round
runs all programs in turn; the medians count. With ``--page`` the table of that page is written again. Needs Debian's
openfoam and Gmsh; an idle machine: loaded, compare processor seconds alone.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

import foam_cases
import numpy as np
from versions import versions

import meshgauge

HEAD = ("mesh", "`check`", "`report`", "`checkMesh`", "`checkMesh -allGeometry`", "memory, MB")


def programs(case: Path) -> dict[str, list[str]]:
    ours = [sys.executable, "-m", "meshgauge"]
    theirs = ["checkMesh", "-constant", "-case", str(case)]
    return {
        "check": [*ours, "check", str(case)],
        "report": [*ours, "report", str(case), "--no-diagnosis"],
        "plain": theirs,
        "geometry": [*theirs, "-allGeometry"],
    }


def measured(command: list[str]) -> tuple[float, float, float]:
    """Seconds, processor seconds and megabytes of a process."""
    environment = {"WM_PROJECT_DIR": "/usr/share/openfoam", **os.environ}  # as Debian installs it
    start = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment)
    _, _, usage = os.wait4(process.pid, 0)
    return time.perf_counter() - start, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def cases(folder: Path, n: int) -> dict[str, Path]:
    side = round(n ** (1 / 3))
    made = {
        "hexahedra of blockMesh, text": foam_cases.block(folder / "text", (side, side, side)),
        "the same, binary": foam_cases.block(folder / "binary", (side, side, side), binary=True),
        "polyhedra of polyDualMesh, text": foam_cases.dual(folder / "dual", 0.9 / np.cbrt(n / 20)),
    }
    return {f"{n_solid(case):,} {name}".replace(",", " "): case for name, case in made.items()}


def n_solid(case: Path) -> int:
    text = foam_cases.run(case, "checkMesh", "-constant")
    found = re.search(r"^    cells: +(\d+)", text, re.MULTILINE)
    assert found is not None, text
    return int(found[1])


def rows(made: dict[str, Path], rounds: int) -> list[list[str]]:
    """Of the table; prints as it goes."""
    out = []
    for name, case in made.items():
        commands = programs(case)
        for command in commands.values():
            measured(command)  # what is compiled, and what the disk has, is there from now on
        runs = [{key: measured(command) for key, command in commands.items()} for _ in range(rounds)]
        middle = {key: [median(run[key][k] for run in runs) for k in range(3)] for key in commands}
        memory = " / ".join(f"{middle[key][2]:.0f}" for key in commands)
        out.append([name, *(f"{middle[key][0]:.2f} s, CPU {middle[key][1]:.2f}" for key in commands), memory])
        print(" | ".join(out[-1]), flush=True)
    return out


def write_page(page: Path, table: list[list[str]], rounds: int) -> None:
    lines = [f"| {' | '.join(row)} |" for row in (list(HEAD), ["---", *["---:"] * 5], *table)]
    lines += ["", f"Median of {rounds} on {versions().partition(';')[0]}."]
    text = page.read_text(encoding="utf-8")
    old = re.compile(rf"{re.escape(lines[0])}\n(?:\|.*\n)*\nMedian of .*\n")
    assert old.search(text), f"{page} has no such table"
    page.write_text(old.sub(lambda _: "\n".join(lines) + "\n", text), encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, default=1_000_000)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--page", type=Path)
    asked = parser.parse_args()
    print(versions(), f"OpenFOAM beside meshgauge {meshgauge.__version__}", sep="\n")
    with tempfile.TemporaryDirectory() as folder:
        table = rows(cases(Path(folder), asked.cells), asked.rounds)
    if asked.page is not None:
        write_page(asked.page, table, asked.rounds)


if __name__ == "__main__":
    main()
