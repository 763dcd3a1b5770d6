"""Read thousands of damaged files, and kill hundreds of runs that write: nothing hangs, crashes, swells or is lost.

    python benchmarks/hostile.py mutants 6000 --seed 1   files of every format, their numbers and lines exchanged,
                                                         doubled or lost, bytes flipped, ends cut off
    python benchmarks/hostile.py kills 300 --seed 1      kill -9 at random times of improve --in-place --undo and of
                                                         other writes; then what is there is read

Each file is read in a process of its own, whose memory and time the system measures. A file goes wrong if reading it
ends other than with a mesh or an error of ours, takes more than 20 s, or more than 200 MB and ten times the file.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "tests" / "fuzz"), str(ROOT / "tests" / "io")]

SECONDS = 20
MEMORY = 200 << 20
SWELL = 10
"""A file may take `MEMORY` and so many times its size."""

NUMBERS = (b"0", b"-1", b"1", b"2", b"7", b"255", b"65536", b"16777216", b"2147483647", b"-2147483648", b"4294967296",
           b"9223372036854775807", b"9" * 30, b"nan", b"inf", b"1e308", b"1e-320", b"0x10", b"1.5", b"")  # fmt: skip
_NUMBER = re.compile(rb"-?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("what", choices=("mutants", "kills"))
    parser.add_argument("n", type=int)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="keep the files that went wrong in this folder")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="hostile-") as folder:
        return (mutants if args.what == "mutants" else kills)(args.n, random.Random(args.seed), Path(folder), args.keep)


def mutants(n: int, rng: random.Random, folder: Path, keep: Path | None) -> int:
    """Damaged files of every format in turn; returns 1 if one went wrong."""
    sources = _sources(folder)
    print(f"{len(sources)} whole files of {len({name for name, *_ in sources})} formats")
    counts: Counter[tuple[str, str]] = Counter()
    base = _attempt(sources[0][1], sources[0][1], rehearse=True)[2]
    slowest, largest, wrong, start = 0.0, 0, 0, time.monotonic()
    with contextlib.suppress(KeyboardInterrupt):  # which ends it early, with the counts so far
        for number in range(n):
            name, path, files = sources[number % len(sources)]
            victim = rng.choice(files)
            whole = victim.read_bytes()
            victim.write_bytes(mutant(rng, whole))
            outcome, seconds, memory = _attempt(path, victim)
            memory = max(memory - base, 0)
            allowed = MEMORY + SWELL * sum(file.stat().st_size for file in files)
            if outcome in ("read", "refused"):
                outcome = "slow" if seconds > SECONDS else "large" if memory > allowed else outcome
            slowest, largest = max(slowest, seconds), max(largest, memory)
            counts[name, outcome] += 1
            if outcome not in ("read", "refused"):
                wrong += 1
                print(f"{number}: {name}: {outcome} after {seconds:.1f} s, {memory >> 20} MB")
                if keep is not None:
                    shutil.copytree(path.parent, keep / f"{number}-{name}", dirs_exist_ok=True)
            victim.write_bytes(whole)
    for name in sorted({name for name, *_ in sources}):
        print(f"  {name:12s}", *(f"{outcome} {k}" for (one, outcome), k in sorted(counts.items()) if one == name))
    total = Counter[str]()
    for (_, outcome), k in counts.items():
        total[outcome] += k
    seconds = time.monotonic() - start
    print(f"{total.total()} files in {seconds:.0f} s: {dict(total)}; {slowest:.1f} s, {largest >> 20} MB at most")
    return int(wrong > 0)


def _sources(folder: Path) -> list[tuple[str, Path, list[Path]]]:
    """Format, file to read and all of its files: the small ones of the fuzzer, and larger ones with many names."""
    import fuzzing
    import grown_files

    os.environ.setdefault("MESHGAUGE_READ_SECONDS", "12")
    sources = [*fuzzing.seeds(folder / "small")]
    for name, make in grown_files.MAKERS.items():
        own = folder / "grown" / name
        own.mkdir(parents=True)
        path = make(own, 40)
        sources.append((name, path, [file for file in own.rglob("*") if file.is_file()]))
    return sources


def mutant(rng: random.Random, data: bytes) -> bytes:
    """The bytes with one to four things done to them."""
    for _ in range(rng.randint(1, 4)):
        data = rng.choice(DAMAGES)(rng, data) if data else data
    return data


def _number(rng: random.Random, data: bytes) -> bytes:
    """A number becomes another."""
    places = [match.span() for match in _NUMBER.finditer(data)]
    if not places:
        return data
    a, b = rng.choice(places)
    return data[:a] + rng.choice(NUMBERS) + data[b:]


def _lines(rng: random.Random, data: bytes) -> bytes:
    """Lines are doubled, many times, lost, or stand elsewhere."""
    lines = data.split(b"\n")
    a = rng.randrange(len(lines))
    block = lines[a : a + rng.randint(1, 20)]
    match rng.randrange(4):
        case 0:
            lines[a:a] = block
        case 1:
            lines[a:a] = block * min(rng.randint(2, 2000), (1 << 18) // (sum(map(len, block)) + 1) + 1)
        case 2:
            del lines[a : a + len(block)]
        case _:
            del lines[a : a + len(block)]
            b = rng.randrange(len(lines) + 1)
            lines[b:b] = block
    return b"\n".join(lines)


def _words(rng: random.Random, data: bytes) -> bytes:
    """A word takes the place of another."""
    words = [match.span() for match in re.finditer(rb"\S+", data)]
    if len(words) < 2:
        return data
    (a, b), (c, d) = rng.choice(words), rng.choice(words)
    return data[:a] + data[c:d] + data[b:]


def _long(rng: random.Random, data: bytes) -> bytes:
    """A character is there thousands of times."""
    at = rng.randrange(len(data))
    return data[:at] + data[at : at + 1] * rng.randint(1000, 100_000) + data[at:]


def _cut(rng: random.Random, data: bytes) -> bytes:
    return data[: rng.randrange(len(data))]


def _flipped(rng: random.Random, data: bytes) -> bytes:
    changed = bytearray(data)
    for _ in range(rng.randint(1, 16)):
        changed[rng.randrange(len(changed))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def _wide(rng: random.Random, data: bytes) -> bytes:
    """Four or eight bytes become a large number."""
    at, width = rng.randrange(len(data)), rng.choice((4, 8))
    value = rng.choice((0, 1, 2**31 - 1, 2**32 - 1, 2**16, 2**62)) % (1 << (8 * width))
    return data[:at] + value.to_bytes(width, rng.choice(("little", "big"))) + data[at + width :]  # type: ignore[arg-type]


DAMAGES: tuple[Callable[[random.Random, bytes], bytes], ...] = (
    _number, _number, _number, _lines, _lines, _words, _long, _cut, _flipped, _wide)  # fmt: skip


def _attempt(path: Path, victim: Path, *, rehearse: bool = False) -> tuple[str, float, int]:
    """What reading came to, the seconds and the bytes of memory that it took, in a copy of this process."""
    from meshgauge import io
    from meshgauge.errors import ReadError

    if rehearse:  # what reading loads is no part of what a file takes
        with contextlib.suppress(ReadError):
            io.read(path)
    start = time.monotonic()
    pid = os.fork()
    if pid == 0:
        code = 3
        with contextlib.suppress(BaseException):
            sink = os.open(os.devnull, os.O_WRONLY)
            os.dup2(sink, 1)
            os.dup2(sink, 2)
            try:
                io.read(path)
                code = 0
            except ReadError as error:
                code = 0 if rehearse else 1 if str(error).startswith(str(path.parent)) else 4
        os._exit(code)
    while True:
        done, status, usage = os.wait4(pid, os.WNOHANG)
        if done:
            break
        if time.monotonic() - start > 3 * SECONDS:
            os.kill(pid, signal.SIGKILL)
        time.sleep(0.002)
    seconds = time.monotonic() - start
    outcomes = {0: "read", 1: "refused", 3: "another error", 4: "an error without the file"}
    code = os.waitstatus_to_exitcode(status)
    outcome = outcomes.get(code, "hang" if code == -signal.SIGKILL else f"crash ({code})")
    return outcome, seconds, usage.ru_maxrss << 10


def kills(n: int, rng: random.Random, folder: Path, keep: Path | None) -> int:
    """Runs that are killed while they write; returns 1 if something was lost."""
    import meshgauge
    from meshgauge.repair.undo import restore_points

    mesh = _tangled(meshgauge)
    original = folder / "original.vtu"
    meshgauge.write(original, mesh)
    counts: Counter[str] = Counter()
    lost = 0
    for number in range(n):
        place = folder / str(number)
        place.mkdir()
        path = place / "a.vtu"
        shutil.copy(original, path)
        for name in ("a.csv", "a.html", "b.vtk"):
            (place / name).write_text("old")
        arguments = (
            ("improve", "a.vtu", "-q", "--in-place", "--undo", "a.npz", "--time", "1"),
            ("improve", "a.vtu", "-q", "--in-place", "--undo", "a.npz", "--time", "1"),
            ("report", "a.vtu", "-q", "--in-place"),
            ("report", "a.vtu", "-q", "--csv", "a.csv", "--html", "a.html", "-o", "b.vtk"),
        )[number % 4]
        command = [sys.executable, "-c", "import sys; from meshgauge.__main__ import run; sys.exit(run())", *arguments]
        process = subprocess.Popen(command, cwd=place, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        end = time.monotonic() + rng.uniform(0.3, 3.5)
        # Half of the kills come as soon as something is being written.
        while time.monotonic() < end and process.poll() is None:
            if number % 2 and any(one.name.startswith(".meshgauge-") for one in place.iterdir()):
                time.sleep(rng.uniform(0, 0.15))
                break
            time.sleep(0.002)
        process.kill()
        process.wait()
        left = [one.name for one in place.iterdir() if one.name.startswith(".meshgauge-")]
        fault = ""
        try:
            now = meshgauge.read(path)
            if arguments[0] == "improve" and (now.points != mesh.points).any():
                back = restore_points(place / "a.npz", now)
                fault = "" if (back.points == mesh.points).all() else "the undo restores other points"
            elif (now.points != mesh.points).any():
                fault = "points moved"
            if (place / "b.vtk").read_bytes() != b"old" and meshgauge.read(place / "b.vtk").n_cells != mesh.n_cells:
                fault = "b.vtk is half-written"
            for name, tail in (("a.csv", "\n"), ("a.html", "</html>")):
                content = (place / name).read_text(encoding="utf-8")
                if content != "old" and not content.rstrip(" \n").endswith(tail.strip()):
                    fault = f"{name} is half-written"
            with contextlib.suppress(meshgauge.WriteError):
                meshgauge.write(place / "c.vtu", mesh)
            if any(one.name.startswith(".meshgauge-") for one in place.iterdir()):
                fault = "the next run leaves what was left"
        except (meshgauge.MeshgaugeError, OSError) as error:
            fault = str(error)
        state = "done" if process.returncode >= 0 else "killed with something left" if left else "killed"
        counts[f"{arguments[0]}: {state}"] += 1
        if fault:
            lost += 1
            print(f"{number}: {' '.join(arguments)}: {fault}")
            if keep is not None:
                shutil.copytree(place, keep / str(number), dirs_exist_ok=True)
        shutil.rmtree(place)
    print(*(f"{what}: {k}" for what, k in sorted(counts.items())), sep="\n")
    print(f"{n} runs, {lost} lost something")
    return int(lost > 0)


def _tangled(meshgauge):  # type: ignore[no-untyped-def]
    """Hexahedra of which many are inverted."""
    import numpy as np

    n = 12
    axis = np.arange(n + 1.0)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    points += np.random.default_rng(0).uniform(-0.6, 0.6, points.shape)
    corners = np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    steps = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
    cells = np.stack([(corners + step) @ [(n + 1) ** 2, n + 1, 1] for step in steps], axis=1)
    return meshgauge.Mesh.from_arrays(points, [("hexahedron", cells)])


if __name__ == "__main__":
    sys.exit(main())
