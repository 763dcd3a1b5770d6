"""Damaged files by thousands, strange names, runs killed while they write: nothing hangs, crashes or is lost.

    python benchmarks/hostile.py mutants 6000 --seed 1   files of every format, their numbers and lines exchanged,
                                                         doubled or lost, bytes flipped, ends cut off
    python benchmarks/hostile.py names 2000 --seed 1     arrays and regions of strange names, by every writer; VTK or
                                                         meshio reads them back
    python benchmarks/hostile.py kills 300 --seed 1      kill -9 of improve --in-place --undo and improve -o of eight
                                                         formats, most of them within the writing; what is there then
                                                         is old or new and whole, and the undo restores the old

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
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

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
    parser.add_argument("what", choices=("mutants", "names", "kills"))
    parser.add_argument("n", type=int)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="keep the files that went wrong in this folder")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="hostile-") as folder:
        run = {"mutants": mutants, "names": names, "kills": kills}[args.what]
        return run(args.n, random.Random(args.seed), Path(folder), args.keep)


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


READERS = {
    ".vtu": "vtk", ".vtk": "vtk", ".vtkhdf": "vtk", ".msh": "gmsh", ".mesh": "medit", ".med": "med", ".su2": "su2",
    ".inp": "abaqus", ".avs": "avsucd", ".xdmf": "xdmf", ".ugrid": "ugrid", ".vol": "netgen", ".dat": "tecplot",
}  # fmt: skip
"""By whom what was written is read back: VTK, or a module of meshio."""

NAME_PARTS = (
    *map(chr, range(0x21)), "{", "}", "{}", "%", "%s", "%n", "%99999d", '"', "'", "`", "<", ">", "&", "&lt;", "]]>",
    "<!--", "\\", "/", "..", ",", ";", ":", "=", "*", "$", "#", "!", "|", "(", ")", "[", "]", "\x7f", "\x85", "\xa0",
    "\u2028", "\u2029", "\u202e", "\ufeff", "\udcff", "\ud800", "\U0001f600", "é", "漢", "a", "b", "X", "1", "_",
    "u_{1}", "\\frac{1}{2}", "$End", "$Nodes", "*NODE", "METADATA", "LOOKUP_TABLE", "FIELD", "POINT_DATA", "label",
    "region", "vtkGhostType", "GlobalIds", "nan", "VARIABLES", "ZONE", "MARKER_TAG=", "mesh3d", "x" * 300, "x" * 5000,
)  # fmt: skip


def names(n: int, rng: random.Random, folder: Path, keep: Path | None) -> int:
    """Data and regions of strange names, by every writer and back; returns 1 if one went wrong.

    Each mesh is written in a copy of this process. It goes wrong if that ends otherwise than it should, raises anything
    but an error of ours, or leaves a file that neither we nor others read with all of its cells.
    """
    _write_names(folder, ["a"], "a")  # what is loaded here, each copy of this process has
    counts: Counter[str] = Counter()
    wrong = done = 0
    while done < n:
        some = ["".join(rng.choices(NAME_PARTS, k=rng.choice((0, 1, 1, 2, 3, 6)))) for _ in range(min(25, n - done))]
        answer, sender = os.pipe()
        pid = os.fork()
        if pid == 0:
            text = "an error on the way"
            with contextlib.suppress(BaseException):
                sink = os.open(os.devnull, os.O_WRONLY)
                os.dup2(sink, 1)
                os.dup2(sink, 2)
                text = _write_names(folder, some, rng.choice(some))
            os.write(sender, text.encode("utf-8", "backslashreplace")[:60_000])
            os._exit(0)
        os.close(sender)
        with os.fdopen(answer, encoding="utf-8") as file:
            said = file.read()
        code = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
        faults = [line for line in said.splitlines() if not line.startswith("refused")]
        counts.update(line.split(":")[0] for line in said.splitlines())
        if code or faults:
            wrong += 1
            print(f"{some!r}: ended with {code}; {faults}"[:2000])
        done += len(some)
    print(f"{done} names by {len(READERS)} writers: {wrong} meshes of {-(-n // 25)} went wrong; {dict(counts)}")
    return int(wrong > 0)


def _write_names(folder: Path, some: list[str], region: str) -> str:
    """A line for each format in which something went wrong, or which refused the mesh."""
    import io_meshes
    import numpy as np

    import meshgauge
    from meshgauge.mesh import CellBlock

    lines = []
    for extension, reader in READERS.items():
        mesh = io_meshes.mesh_of("hexahedron")
        mesh = mesh.replace(
            point_data={name: np.full(mesh.n_points, float(k)) for k, name in enumerate(some)},
            cell_data={name: np.full(mesh.n_cells, k) for k, name in enumerate(some)},
            field_data={name: np.array([name]) if k % 2 else np.array([k, 3]) for k, name in enumerate(some)},
            blocks=(CellBlock(region, 0, 1), CellBlock("rest", 1, mesh.n_cells)),
        )
        path = folder / f"names{extension}"
        try:
            meshgauge.write(path, mesh)
            if meshgauge.read(path).n_cells != mesh.n_cells:
                lines.append(f"{extension}: we read other cells")
            n = _n_cells_by_others(path, reader)
            if n != mesh.n_cells:
                lines.append(f"{extension}: {reader} reads {n} cells of {mesh.n_cells}")
        except meshgauge.WriteError as error:
            lines.append(f"refused {extension}: {ascii(str(error))[:300]}")
        except (Exception, SystemExit) as error:
            lines.append(f"{extension}: {type(error).__name__}: {ascii(str(error))[:300]}")
    return "\n".join(lines)


def _n_cells_by_others(path: Path, reader: str) -> int:
    import importlib

    import pyvista

    if reader == "vtk":
        return int(pyvista.read(path).n_cells)
    return sum(len(block.data) for block in importlib.import_module(f"meshio.{reader}").read(str(path)).cells)


WRITES = tuple(
    (extension, in_place)
    for extension in (".vtu", ".vtk", ".vtkhdf", ".msh", ".inp", ".mesh", ".meshb", ".su2")
    for in_place in (True, False)
)
"""What is killed: improve --in-place --undo, and improve -o over an older file."""


def kills(n: int, rng: random.Random, folder: Path, keep: Path | None) -> int:
    """Runs that move points, killed while they write, before or after; returns 1 if something was lost.

    Most kills come some time after the temporary file has appeared, at random within what writing takes.
    """
    import meshgauge

    mesh = _tangled(meshgauge)
    plans = [_plan(folder, extension, in_place, mesh) for extension, in_place in WRITES]
    counts: Counter[tuple[str, str]] = Counter()
    lost, number = 0, 0
    while sum(k for (_, when), k in counts.items() if when != "none") < n:
        plan = plans[number % len(plans)]
        place = folder / str(number)
        place.mkdir()
        plan.set_up(place)
        wait = rng.uniform(0, plan.writing) if rng.random() < 0.8 else None
        killed = _killed(plan.command, place, wait, rng.uniform(0, plan.seconds))
        when = plan.when(place) if killed else "none"
        counts[plan.name, when] += 1
        fault = plan.fault(place, mesh)
        if fault:
            lost += 1
            print(f"{number}: {plan.name}, {when} the writing: {fault}")
            if keep is not None:
                shutil.copytree(place, keep / str(number), dirs_exist_ok=True)
        shutil.rmtree(place)
        number += 1
    for plan in plans:
        print(f"  {plan.name:24s}", *(f"{when} {counts[plan.name, when]}" for when in ("before", "during", "after")))
    total = {
        when: sum(k for (_, w), k in counts.items() if w == when) for when in ("before", "during", "after", "none")
    }
    print(
        f"{n} kills: {total['before']} before the writing, {total['during']} within it, {total['after']} after it; "
        f"{total['none']} runs ended before they were killed; {lost} lost something"
    )
    return int(lost > 0)


@dataclass
class _Plan:
    """A command that writes, and what is right after it was killed."""

    name: str
    command: tuple[str, ...]
    files: dict[str, bytes]  #: that are there before
    target: str  #: what is written
    writing: float = 0.0  #: seconds from the first sight of the temporary file to the end
    seconds: float = 0.0  #: of the whole run
    points: Any = None  #: of the better mesh

    def set_up(self, place: Path) -> None:
        for name, content in self.files.items():
            (place / name).write_bytes(content)

    def when(self, place: Path) -> str:
        """Whether a kill came before, within or after the writing."""
        if any(_temporaries(place)):
            return "during"
        return "before" if (place / self.target).read_bytes() == self.files[self.target] else "after"

    def fault(self, place: Path, mesh: Any) -> str:
        """What is wrong with what is there; nothing if all is well."""
        import meshgauge
        from meshgauge.files.undo import restored

        is_in_place = len(self.files) == 1
        try:
            for name, content in self.files.items():
                if name != self.target and (place / name).read_bytes() != content:
                    return f"{name} is another"
            now = meshgauge.read(place / self.target)
            is_old = (place / self.target).read_bytes() == self.files[self.target]
            if not is_old and not (now.points == self.points).all():
                return f"{self.target} is neither old nor new"
            if now.type_counts() != mesh.type_counts():
                return f"{self.target} has other cells"
            undo = place / "a.npz"
            if is_in_place and not is_old and not undo.exists():
                return "no undo of a new mesh"
            if undo.exists() and restored(undo, place / self.target)[""] != self.files[self.target]:
                return "the undo restores other bytes"
            meshgauge.write(place / "c.vtu", now)
            if any(_temporaries(place)):
                return "the next run leaves what was left"
        except (meshgauge.MeshgaugeError, OSError) as error:
            return str(error)
        return ""


def _plan(folder: Path, extension: str, in_place: bool, mesh: Any) -> _Plan:
    """The command, rehearsed: how long it takes, and what it makes."""
    import meshgauge

    name = f"a{extension}"
    target = name if in_place else f"b{extension}"
    where = ("--in-place", "--undo", "a.npz") if in_place else ("-o", target)
    plan = _Plan(f"{extension} {where[0]}", ("improve", name, "-q", *where, "--threads", "1"), {}, target)
    place = folder / f"plan{extension}{len(where)}"
    place.mkdir()
    meshgauge.write(place / name, mesh)
    shutil.copy(place / name, place / target) if not in_place else None
    plan.files = {file.name: file.read_bytes() for file in place.iterdir()}
    _run_here(plan.command, place)  # what is loaded and compiled here, each copy of this process has
    plan.set_up(place)
    start = time.monotonic()
    _killed(plan.command, place, None, 1e9)
    plan.seconds = time.monotonic() - start
    plan.set_up(place)
    pid, first = _started(plan.command, place), 0.0
    while not os.waitpid(pid, os.WNOHANG)[0]:
        first = first or (time.monotonic() if any(_temporaries(place)) else 0.0)
    plan.writing = time.monotonic() - first
    plan.points = meshgauge.read(place / target).points
    if (plan.points == mesh.points).all():
        raise SystemExit(f"{plan.name}: moves no points")
    return plan


def _temporaries(place: Path) -> Iterator[str]:
    return (name for name in os.listdir(place) if name.startswith(".meshgauge-"))


def _run_here(command: tuple[str, ...], place: Path) -> int:
    from meshgauge.cli.main import main as run

    with contextlib.chdir(place), contextlib.redirect_stdout(None), contextlib.redirect_stderr(None):
        return run(list(command))


def _started(command: tuple[str, ...], place: Path) -> int:
    """A copy of this process that runs a command; its id."""
    pid = os.fork()
    if pid == 0:
        with contextlib.suppress(BaseException):
            sink = os.open(os.devnull, os.O_WRONLY)
            os.dup2(sink, 1)
            os.dup2(sink, 2)
            _run_here(command, place)
        os._exit(0)
    return pid


def _killed(command: tuple[str, ...], place: Path, wait: float | None, latest: float) -> bool:
    """Run a command and kill it: so long after its temporary file appears, or if None after ``latest`` seconds; False
    if it ended before."""
    pid, end = _started(command, place), time.monotonic() + (latest if wait is None else 1e9)
    while True:
        if os.waitpid(pid, os.WNOHANG)[0]:
            return False
        if time.monotonic() >= end:
            os.kill(pid, signal.SIGKILL)
            return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == -signal.SIGKILL
        if wait is not None and end > 1e8 + time.monotonic() and any(_temporaries(place)):
            end = time.monotonic() + wait
        time.sleep(0.0002)


def _tangled(meshgauge: Any) -> Any:
    """Hexahedra of which a few are inverted: little to mend, more to write."""
    import numpy as np

    n = 16
    axis = np.arange(n + 1.0)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    points += np.random.default_rng(0).uniform(-0.1, 0.1, points.shape)
    points[(n // 2) * ((n + 1) ** 2 + n + 2)] += 1.3
    corners = np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    steps = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
    cells = np.stack([(corners + step) @ [(n + 1) ** 2, n + 1, 1] for step in steps], axis=1)
    return meshgauge.Mesh.from_arrays(points, [("hexahedron", cells)])


if __name__ == "__main__":
    sys.exit(main())
