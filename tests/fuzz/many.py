"""Try many broken files: ``python tests/fuzz/many.py 10000 [--seed 0] [--only gmsh]``; ends with 1 if one went wrong.

Nine of ten are of formats that are read in this process; the others start a process each. Batches run in processes of
their own, so that a crash of one of our own readers would be seen and counted; its file is kept.
"""

from __future__ import annotations

import argparse
import collections
import faulthandler
import multiprocessing
import shutil
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
import fuzzing

BATCH = 250
KEPT = Path(tempfile.gettempdir()) / "meshgauge-fuzz"


def batch(seed: int, n: int, only: str, results: multiprocessing.Queue) -> None:  # type: ignore[type-arg]
    """Break and read ``n`` files; say what is being tried before it is, so that a crash has a name."""
    faulthandler.enable()
    rng = np.random.default_rng(seed)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        found = [seed for seed in fuzzing.seeds(folder) if not only or seed[0] == only]
        own = [s for s in found if s[0] in fuzzing.OWN]
        foreign = [s for s in found if s[0] not in fuzzing.OWN]
        for number in range(n):
            group = foreign if foreign and (not own or number % 10 == 0) else own
            kind, path, files = group[int(rng.integers(len(group)))]
            victim = files[int(rng.integers(len(files)))]
            whole = victim.read_bytes()
            victim.write_bytes(fuzzing.broken(rng, whole))
            kept = KEPT / f"{kind}-{seed}-{number}"
            results.put((kind, "", ""))
            start = time.monotonic()
            outcome = fuzzing.attempt(path)
            if outcome not in ("read", "refused"):
                shutil.rmtree(kept, ignore_errors=True)
                shutil.copytree(path.parent, kept)
            results.put((kind, outcome, f"{time.monotonic() - start:.2f} {kept}"))
            victim.write_bytes(whole)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("n", type=int)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    tally: dict[str, collections.Counter[str]] = collections.defaultdict(collections.Counter)
    wrong, slowest, tried, seed = [], 0.0, 0, options.seed
    context = multiprocessing.get_context("spawn")
    while tried < options.n:
        results = context.Queue()
        process = context.Process(target=batch, args=(seed, min(BATCH, options.n - tried), options.only, results))
        process.start()
        trying, alive = None, True
        while alive or not results.empty():
            alive = process.is_alive()
            try:
                kind, outcome, more = results.get(timeout=0.05)
            except Exception:  # queue.Empty: nothing yet
                continue
            if not outcome:
                trying = kind
                continue
            trying = None
            tried += 1
            what = outcome.split(":")[0].split(" ")[0]
            tally[kind][what] += 1
            slowest = max(slowest, float(more.split()[0]))
            if what not in ("read", "refused"):
                wrong.append(f"{kind} {more}\n{outcome}")
        process.join()
        if process.exitcode != 0:
            tried += 1
            tally[trying or "?"]["crash"] += 1
            wrong.append(f"{trying}: the process ended with {process.exitcode} (seed {seed})")
        seed += 1
    print("\n\n".join(wrong[:20]))
    print(f"{'format':<12}{'read':>8}{'refused':>9}{'wrong':>7}")
    for kind, counts in sorted(tally.items()):
        bad = sum(counts.values()) - counts["read"] - counts["refused"]
        print(f"{kind:<12}{counts['read']:>8}{counts['refused']:>9}{bad:>7}")
    print(f"{tried} files, {len(wrong)} went wrong; the slowest took {slowest:.1f} s")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
