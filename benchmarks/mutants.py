"""Put plausible errors into the code, one at a time, and count those that the tests of their folder let through.

    pip install '.[test,mutants]'
    python benchmarks/mutants.py                       200 mutants of all folders, drawn with a fixed seed
    python benchmarks/mutants.py --n 30 check quality  30 of these folders only
    python benchmarks/mutants.py --seed 7 --jobs 2 --out survivors.tsv
    python benchmarks/mutants.py --contexts FOLDER     a mutant meets the tests that run its line, not a whole folder
    python benchmarks/mutants.py --contexts FOLDER --only 17,120    numbers 17 and 120 of that draw again

Cosmic Ray makes the mutants. Each is written into a copy of the checkout and meets the tests of its folder until one
fails, first the files that name what was changed; a mutant that hangs is caught. Numba caches kernels by file; those of
the mutated line and of all that use what it defines are set aside. A survivor is a line that no test holds: write the
test, or show that the change is none.

With ``--contexts`` the tests of all folders run once with coverage.py, which notes the test that runs each line; the
folder keeps that, the copy and what was compiled in it for the next call (empty it when code or tests have changed). A
mutant then meets at most 100 tests that took 40 seconds at most, of whatever folder: those that ran its statement, the
ones that ran the fewest lines first, of each function with parameters one and then a second one; for a kernel and for a
constant of a module, those that ran a statement that uses it; if that makes few, also those that ran any line of its
file and of the files that import it. What is printed names the test that caught it. Such a run takes seconds a mutant,
a minute where much is compiled.
"""

from __future__ import annotations

import argparse
import ast
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from mutant_tests import PACKAGE, Contexts, compiled_of, imported, sources

ROOT = Path(__file__).resolve().parent.parent

TESTS = {
    "quality": (
        "tests/quality",
        "tests/test_python_api.py",
        "tests/test_status.py",
        "tests/integrations/test_integration_jupyter.py",
    ),
    "check": ("tests/check",),
    "repair": ("tests/repair", "tests/cli/test_cli_improve.py"),
    "io/plumbing": ("tests/io", "tests/integrations/test_integration_vtk.py", "tests/quality/polyhedra"),
    "kernels/cells": ("tests/kernels", "tests/quality"),
    "kernels/certificate": ("tests/quality/certificate", "tests/quality"),
    "kernels/polyhedra": (
        "tests/quality/polyhedra",
        "tests/quality/test_flat.py",
        "tests/quality/test_concave.py",
        "tests/doctor/test_doctor_inward.py",
    ),
    "kernels/topology": ("tests/doctor", "tests/mesh"),
    "kernels/repair": ("tests/repair",),
}
"""The tests that must catch an error in each folder."""

SPARED = ("quality/reference/_johnson.py", "quality/reference/_uniform.py", "quality/reference/build.py")
"""They made a table that ships and is tested; nothing runs them."""

OPERATORS = (
    *(f"ReplaceComparisonOperator_{pair}" for pair in
      ("Eq_NotEq", "NotEq_Eq", "Lt_LtE", "Lt_GtE", "LtE_Lt", "LtE_Gt", "Gt_GtE", "Gt_LtE", "GtE_Gt", "GtE_Lt",
       "Is_IsNot", "IsNot_Is")),
    *(f"ReplaceBinaryOperator_{pair}" for pair in
      ("Add_Sub", "Sub_Add", "Mul_Div", "Div_Mul", "FloorDiv_Mul", "Mod_FloorDiv", "BitAnd_BitOr", "BitOr_BitAnd",
       "Pow_Mul", "LShift_RShift", "RShift_LShift")),
    *("AddNot", "NumberReplacer", "ReplaceAndWithOr", "ReplaceOrWithAnd", "ReplaceTrueWithFalse",
      "ReplaceFalseWithTrue", "ReplaceUnaryOperator_Delete_Not", "ReplaceUnaryOperator_Delete_USub",
      "ReplaceUnaryOperator_Delete_Invert", "ReplaceBreakWithContinue", "ReplaceContinueWithBreak",
      "ZeroIterationForLoop"),
)  # fmt: skip


SURVIVED, CAUGHT, HUNG, BROKEN = "SURVIVED", "caught", "hung", "BROKEN"

_PYTEST = (sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider")


@dataclass(frozen=True)
class Mutant:
    """One error: what is put where."""

    folder: str
    file: Path  #: below the package
    operator: str
    line: int
    before: str
    after: str
    code: str  #: of the whole file


@dataclass(frozen=True)
class Fate:
    """What became of a mutant."""

    state: str
    by: str  #: the test that caught it, or how many let it through


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("folders", nargs="*", default=[], help=f"of {', '.join(TESTS)}; all unless given")
    parser.add_argument("--n", type=int, default=200, help="how many mutants")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1, help="mutants at a time")
    parser.add_argument("--seconds", type=int, default=900, help="a mutant that computes longer hangs, and is caught")
    parser.add_argument("--contexts", type=Path, metavar="FOLDER", help="choose tests by the lines that they run")
    parser.add_argument("--only", help="run these of the mutants drawn: numbers with commas between")
    parser.add_argument("--out", type=Path, help="write the survivors here, a line each")
    args = parser.parse_args()
    folders = {name: tests for name, tests in TESTS.items() if not args.folders or name.startswith(tuple(args.folders))}
    mutants = dict(enumerate(draw(folders, args.n, args.seed), 1))
    if args.only:
        mutants = {n: mutants[n] for n in map(int, args.only.split(","))}
    start = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="mutants-") as temporary:
        fates = {}
        for n, fate in _fates(mutants, (args.contexts or Path(temporary)).resolve(), args):
            fates[n], mutant = fate, mutants[n]
            where = f"{mutant.file}:{mutant.line}"
            print(
                f"{n:4d}/{args.n}  {fate.state:8s}  {where:45s} {mutant.before} -> {mutant.after}  [{fate.by}]",
                flush=True,
            )
        catching = sorted({fate.by for fate in fates.values() if fate.state == CAUGHT and "::" in fate.by})
        broken = _failing((args.contexts or Path(temporary)).resolve() / "copy0", catching)
        for n in [n for n, fate in fates.items() if fate.by in broken]:
            fates[n] = Fate(BROKEN, fates[n].by)
            print(f"{n:4d}/{args.n}  {BROKEN}: {fates[n].by} fails without the error as well")
    survivors = [mutants[n] for n, fate in fates.items() if fate.state in (SURVIVED, BROKEN)]
    n_hung = sum(fate.state == HUNG for fate in fates.values())
    share = len(survivors) / max(len(mutants), 1)
    print(f"{len(survivors)} of {len(mutants)} survived: {share:.1%}, in {time.monotonic() - start:.0f} s")
    if n_hung:
        print(f"{n_hung} took longer than {args.seconds} s, counted as caught: try them again with more")
    if args.out is not None:
        lines = (f"{m.file}:{m.line}\t{m.operator}\t{m.before}\t{m.after}" for m in survivors)
        args.out.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return 0


def _fates(mutants: dict[int, Mutant], scratch: Path, args: argparse.Namespace) -> Iterator[tuple[int, Fate]]:
    """What becomes of each mutant, in their order."""
    copies: SimpleQueue[Path] = SimpleQueue()
    for n in range(args.jobs):
        copies.put(_copy(scratch / f"copy{n}"))
    contexts = _contexts(scratch) if args.contexts else None

    def work(mutant: Mutant) -> Fate:
        copy = copies.get()
        try:
            tests = contexts.tests(PACKAGE / mutant.file, mutant.line) if contexts else ()
            return fate_of(mutant, copy, list(tests) or test_files(copy, mutant), args.seconds)
        finally:
            copies.put(copy)

    with ThreadPoolExecutor(args.jobs) as pool:
        yield from zip(mutants, pool.map(work, mutants.values()), strict=True)


def _contexts(scratch: Path) -> Contexts:
    """Which test ran which line in the first copy, found out unless it is known."""
    copy, data, times = scratch / "copy0", scratch / "coverage", scratch / "times.xml"
    if not (data.exists() and times.exists()):
        measured = ["--cov=meshgauge", "--cov=tests", "--cov-context=test", "--cov-report="]
        tests = sorted({tests for of_folder in TESTS.values() for tests in of_folder})
        command = [*_PYTEST, "-n", "auto", f"--junitxml={times}", *measured, *tests]
        subprocess.run(command, cwd=copy, env={**_environment(copy), "COVERAGE_FILE": str(data)}, check=False)
    return Contexts(data, times, copy)


def draw(folders: dict[str, tuple[str, ...]], n: int, seed: int) -> list[Mutant]:
    """Mutants of these folders: first a file by its number of lines, then a kind of error, then a place for it."""
    rng = random.Random(seed)
    files = [(folder, path) for folder in folders for path in sorted((ROOT / PACKAGE / folder).rglob("*.py"))]
    files = [(folder, path) for folder, path in files if str(path.relative_to(ROOT / PACKAGE)) not in SPARED]
    weights = [path.read_text(encoding="utf-8").count("\n") for _, path in files]
    chosen: dict[tuple[Path, str], Mutant] = {}
    for _ in range(1000 * n):
        folder, path = rng.choices(files, weights)[0]
        mutant = mutate(folder, path, rng)
        if mutant is not None:
            chosen[mutant.file, mutant.code] = mutant
        if len(chosen) == n:
            break
    return list(chosen.values())


def mutate(folder: str, path: Path, rng: random.Random) -> Mutant | None:
    """One error in a file; None if the place drawn does not change what the file does."""
    from cosmic_ray import plugins
    from cosmic_ray.mutating import mutate_code

    code = path.read_text(encoding="utf-8")
    operator = rng.choice(OPERATORS)
    make = plugins.get_operator(f"core/{operator}")()
    n_places = sum(len(list(make.mutation_positions(node))) for node in _nodes(code))
    if not n_places:
        return None
    changed = mutate_code(code.encode(), make, rng.randrange(n_places))
    if changed is None or _meaning(changed) in (_meaning(code), ""):
        return None
    lines, others = code.split("\n"), changed.split("\n")
    at = next((n for n, (a, b) in enumerate(zip(lines, others, strict=False)) if a != b), -1)
    if at + 1 not in _lines_that_act(code):
        return None
    where = path.relative_to(ROOT / PACKAGE)
    return Mutant(folder, where, operator, at + 1, lines[at].strip(), others[at].strip(), changed)


@cache
def _nodes(code: str) -> list[Any]:
    """The nodes of the syntax tree that Cosmic Ray walks."""
    from cosmic_ray.ast import get_ast

    waiting, nodes = [get_ast(code.encode())], []
    while waiting:
        node = waiting.pop()
        nodes.append(node)
        waiting += getattr(node, "children", [])
    return nodes


@cache
def _meaning(code: str) -> str:
    """The code without its layout; nothing if it is no Python."""
    try:
        return ast.dump(ast.parse(code))
    except SyntaxError:
        return ""


@cache
def _lines_that_act(code: str) -> set[int]:
    """Lines of statements: no signatures, annotations, imports, docstrings."""
    lines: set[int] = set()
    idle = ast.FunctionDef | ast.ClassDef | ast.AnnAssign | ast.Import | ast.ImportFrom
    for node in ast.walk(ast.parse(code)):
        is_text = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
        if not isinstance(node, ast.stmt) or is_text or isinstance(node, idle):
            continue
        body = getattr(node, "body", None)
        end = body[0].lineno - 1 if body else node.end_lineno or node.lineno
        lines |= set(range(node.lineno, max(end, node.lineno) + 1))
    return lines


def fate_of(mutant: Mutant, copy: Path, tests: list[str], seconds: int) -> Fate:
    """Whether tests pass with the error in, fail, or are not done in time."""
    path, original = copy / PACKAGE / mutant.file, ROOT / PACKAGE / mutant.file
    stale = {one.stem for one in compiled_of(copy, PACKAGE / mutant.file, mutant.line)} | {mutant.file.stem}

    def compiled() -> list[Path]:
        return [cached for cached in (copy / "numba").rglob("*.nb?") if cached.name.split(".")[0] in stale]

    aside = [cached.rename(cached.with_name(f"{cached.name}.aside")) for cached in compiled()]
    path.write_text(mutant.code, encoding="utf-8")
    try:
        fate = _run(copy, tests, seconds)
    finally:
        shutil.copy2(original, path)  # with its time, by which Numba and Python know it
        for cached in compiled():
            cached.unlink()
        for cached in aside:
            cached.rename(cached.with_suffix(""))
    if fate.state == CAUGHT and "::" not in fate.by and _run(copy, tests, seconds).state != SURVIVED:
        return Fate(BROKEN, fate.by)  # not by the error
    return fate


def test_files(copy: Path, mutant: Mutant) -> list[str]:
    """The files of tests of a mutant's folder, those first that are named as its module or one that imports it."""
    folders = [copy / tests for tests in TESTS[mutant.folder]]
    files = dict.fromkeys(
        path for folder in folders for path in (sorted(folder.rglob("test_*.py")) if folder.is_dir() else [folder])
    )
    file, own = PACKAGE / mutant.file, set(mutant.file.stem.split("_"))
    above = {path.stem for path in sources(copy) if file in imported(copy, path)} - {"__init__"}

    def fit(path: Path) -> tuple[int, int, int]:
        words = set(re.split(r"[_.]", path.stem))
        named = len(re.findall(rf"\b{mutant.file.stem}\b", path.read_text(encoding="utf-8")))
        return len(words & own), named, len(words & above)

    return [str(path.relative_to(copy)) for path in sorted(files, key=fit, reverse=True)]


def _run(copy: Path, tests: list[str], seconds: int) -> Fate:
    """Run tests until one fails; seconds of the processor, as other work may slow the clock tenfold."""
    command = ["sh", "-c", f'ulimit -S -t {seconds}; exec "$@"', "sh", *_PYTEST, "-x", *tests]
    try:
        done = subprocess.run(
            command, cwd=copy, env=_environment(copy), capture_output=True, text=True, timeout=10 * seconds
        )
    except subprocess.TimeoutExpired:
        return Fate(HUNG, "waits")
    if done.returncode in (0, -signal.SIGXCPU):
        return Fate(HUNG if done.returncode else SURVIVED, f"{len(tests)} tests or files of them")
    failed = re.search(r"^(?:FAILED|ERROR) (.*?)(?: - .*)?$", done.stdout, re.MULTILINE)
    return Fate(CAUGHT, failed[1] if failed else f"pytest ends with {done.returncode}")


def _failing(copy: Path, tests: list[str]) -> set[str]:
    """Those of some tests that fail without an error put in."""
    if not tests:
        return set()
    done = subprocess.run([*_PYTEST, *tests], cwd=copy, env=_environment(copy), capture_output=True, text=True)
    return {
        test for test in tests if re.search(rf"^(FAILED|ERROR) {re.escape(test)}( - |$)", done.stdout, re.MULTILINE)
    }


def _environment(copy: Path) -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(copy / "src"), "NUMBA_CACHE_DIR": str(copy / "numba")}


def _copy(folder: Path) -> Path:
    """A copy of what is under version control, with the times of the files."""
    names = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True).stdout.decode()
    for name in filter(None, names.split("\0")):
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
    return folder


if __name__ == "__main__":
    sys.exit(main())
