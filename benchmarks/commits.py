"""Two commits against each other, in one run: is anything slower than it was?

    python benchmarks/commits.py OLD [NEW] [--rounds 5] [--cells 1000000] [--most 1.15] [--only WORD]

OLD and NEW are commits; without NEW the files as they are here. Each is checked out beside, and the cases run as whole
processes in turn, old, new, old, new, ...: the help, a report of a small mesh, and the cases of `around.py`. Printed is
the median of processor seconds, and of the ratios pair by pair. The exit code is 1 if a ratio is above `--most`.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
from contextlib import ExitStack
from pathlib import Path
from statistics import median

HERE = Path(__file__).resolve().parent
MESH = HERE.parent / "examples" / "meshes" / "bracket.vtu"
PROCESSES = {
    "--help": ["-m", "meshgauge", "--help"],
    "report --help": ["-m", "meshgauge", "report", "--help"],
    "report, small mesh": ["-m", "meshgauge", "report", str(MESH)],
    "doctor, small mesh": ["-m", "meshgauge", "doctor", str(MESH), "--exit-zero"],
}
INSIDE = ("tetra", "pyramid", "order", "doctor")
"""Cases of `around.py`, which times itself."""


def checked_out(commit: str, folder: Path, stack: ExitStack) -> Path:
    """The tree of a commit, until the stack is left."""
    git = ["git", "-C", str(HERE)]
    subprocess.run([*git, "worktree", "add", "--detach", "--quiet", str(folder), commit], check=True)
    stack.callback(subprocess.run, [*git, "worktree", "remove", "--force", str(folder)], check=True)
    return folder


def seconds(tree: Path, command: list[str], *, by_itself: bool, cache: Path) -> float:
    """Processor seconds of a process that has the package of that tree: as it states them, or of all of it."""
    environment = {
        **os.environ,
        "PYTHONPATH": str(tree / "src"),
        "NUMBA_CACHE_DIR": str(cache / "kernels"),
        "PYTHONPYCACHEPREFIX": str(cache / "modules"),
    }
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([sys.executable, *command], env=environment, check=True, capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if by_itself:
        return sum(float(word) for word in done.stdout.split())
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old")
    parser.add_argument("new", nargs="?")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--cells", type=int, default=1_000_000)
    parser.add_argument("--most", type=float, default=1.15)
    parser.add_argument("--only", default="")
    asked = parser.parse_args()
    inside = {
        name: [str(HERE / "around.py"), "--bare", name, "--cells", str(asked.cells), "--rounds", "3"] for name in INSIDE
    }
    slower = []
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        here = Path(folder)
        old = checked_out(asked.old, here / "old", stack)
        new = checked_out(asked.new, here / "new", stack) if asked.new else HERE.parent
        print("| case | old, s | new, s | new / old |\n|---|---|---|---|")
        for name, command in {**PROCESSES, **inside}.items():
            if asked.only not in name:
                continue
            pairs = []
            for turn in range(asked.rounds + 1):  # the first fills the caches
                taken = [
                    seconds(tree, command, by_itself=name in inside, cache=here / f"cache of {which}")
                    for which, tree in (("old", old), ("new", new))
                ]
                pairs += [taken] if turn else []
            ratio = median(after / before for before, after in pairs)
            slower += [name] if ratio > asked.most else []
            before, after = (median(column) for column in zip(*pairs, strict=True))
            print(f"| {name} | {before:.3f} | {after:.3f} | {ratio:.2f} |", flush=True)
    if slower:
        print(f"slower than {asked.most} times: {', '.join(slower)}")
    return 1 if slower else 0


if __name__ == "__main__":
    sys.exit(main())
