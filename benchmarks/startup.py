"""The first and the second run on a small mesh: what a newcomer waits for.

    python benchmarks/startup.py [MESH]

The first has an empty cache of compiled kernels; the second finds it full. Also `meshgauge --help`.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

from versions import versions

MESH = Path(__file__).resolve().parent.parent / "examples" / "meshes" / "bracket.vtu"


def seconds(arguments: list[str], cache: str) -> float:
    start = time.perf_counter()
    subprocess.run(
        [sys.executable, "-m", "meshgauge", *arguments],
        env={**os.environ, "NUMBA_CACHE_DIR": cache},
        stdout=subprocess.DEVNULL,
        check=True,
    )
    return time.perf_counter() - start


def main() -> None:
    mesh = sys.argv[1] if len(sys.argv) > 1 else str(MESH)
    first, second, helps = [], [], []
    for _ in range(3):
        with tempfile.TemporaryDirectory() as cache:
            first.append(seconds(["report", mesh], cache))
            second += [seconds(["report", mesh], cache) for _ in range(2)]
            helps.append(seconds(["report", "--help"], cache))
    print(versions("vtk"))
    print(f"first run {median(first):.2f} s (< 6), second {median(second):.2f} s (< 1.2)")
    print(f"report --help {median(helps):.2f} s (< 0.3)")


if __name__ == "__main__":
    main()
