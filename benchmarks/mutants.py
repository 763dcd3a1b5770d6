"""Put plausible errors into the code, one at a time, and count those that the tests of their folder let through.

    pip install '.[test,mutants]'
    python benchmarks/mutants.py                       200 mutants of all folders, drawn with a fixed seed
    python benchmarks/mutants.py --n 30 check quality  30 of these folders only
    python benchmarks/mutants.py --seed 7 --jobs 2 --out survivors.tsv

Cosmic Ray makes the mutants. Each is written into a copy of the checkout and meets the tests of its folder until one
fails, first the files that name what was changed; a mutant that hangs is caught. Compiled kernels are cached by file,
so the caches of the mutated file and of all that import it are dropped. A survivor is a line that no test holds: write
the test, or show that the change is none.
"""

from __future__ import annotations

import argparse
import ast
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from queue import SimpleQueue
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = Path("src/meshgauge")

TESTS = {
    "quality": ("tests/quality", "tests/test_python_api.py", "tests/test_status.py"),
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


SURVIVED, CAUGHT, HUNG = "SURVIVED", "caught", "hung"


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


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("folders", nargs="*", default=[], help=f"of {', '.join(TESTS)}; all unless given")
    parser.add_argument("--n", type=int, default=200, help="how many mutants")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1, help="mutants at a time")
    parser.add_argument("--seconds", type=float, default=900, help="a mutant that takes longer hangs, and is caught")
    parser.add_argument("--out", type=Path, help="write the survivors here, a line each")
    args = parser.parse_args()
    folders = {name: tests for name, tests in TESTS.items() if not args.folders or name.startswith(tuple(args.folders))}
    mutants = draw(folders, args.n, args.seed)
    copies: SimpleQueue[Path] = SimpleQueue()
    survivors, n_hung, start = [], 0, time.monotonic()
    with tempfile.TemporaryDirectory(prefix="mutants-") as scratch:
        for n in range(args.jobs):
            copies.put(_copy(Path(scratch) / str(n)))

        def work(mutant: Mutant) -> tuple[Mutant, str]:
            copy = copies.get()
            try:
                return mutant, fate(mutant, copy, args.seconds)
            finally:
                copies.put(copy)

        with ThreadPoolExecutor(args.jobs) as pool:
            for n, (mutant, state) in enumerate(pool.map(work, mutants), 1):
                if state == SURVIVED:
                    survivors.append(mutant)
                n_hung += state == HUNG
                where = f"{mutant.file}:{mutant.line}"
                print(f"{n:4d}/{len(mutants)}  {state:8s}  {where:45s} {mutant.before} -> {mutant.after}", flush=True)
    share = len(survivors) / max(len(mutants), 1)
    print(f"{len(survivors)} of {len(mutants)} survived: {share:.1%}, in {time.monotonic() - start:.0f} s")
    if n_hung:
        print(f"{n_hung} took longer than {args.seconds:.0f} s, counted as caught: on a busy machine try them again")
    if args.out is not None:
        lines = (f"{m.file}:{m.line}\t{m.operator}\t{m.before}\t{m.after}" for m in survivors)
        args.out.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return 0


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


def fate(mutant: Mutant, copy: Path, seconds: float) -> str:
    """Whether the tests of its folder pass with the error in, fail, or are not done in time."""
    path = copy / PACKAGE / mutant.file
    original = path.read_text(encoding="utf-8")
    path.write_text(mutant.code, encoding="utf-8")
    _drop_caches(copy, mutant.file)
    try:
        return _run(copy, test_files(copy, mutant), seconds)
    finally:
        path.write_text(original, encoding="utf-8")
        _drop_caches(copy, mutant.file)


def test_files(copy: Path, mutant: Mutant) -> list[str]:
    """The files of tests of a mutant's folder, those first that are named as its module or one that imports it."""
    folders = [copy / tests for tests in TESTS[mutant.folder]]
    files = dict.fromkeys(
        path for folder in folders for path in (sorted(folder.rglob("test_*.py")) if folder.is_dir() else [folder])
    )
    package, own = copy / PACKAGE, {mutant.file.stem}
    above = {path.stem for path in package.rglob("*.py") if mutant.file in _imported(package, path)} - {"__init__"}

    def fit(path: Path) -> tuple[int, int, int]:
        words = set(re.split(r"[_.]", path.stem))
        named = len(re.findall(rf"\b{mutant.file.stem}\b", path.read_text(encoding="utf-8")))
        return len(words & own), named, len(words & above)

    return [str(path.relative_to(copy)) for path in sorted(files, key=fit, reverse=True)]


def _run(copy: Path, tests: list[str], seconds: float) -> str:
    environment = {**os.environ, "PYTHONPATH": str(copy / "src"), "NUMBA_CACHE_DIR": str(copy / "numba")}
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *tests]
    try:
        done = subprocess.run(command, cwd=copy, env=environment, capture_output=True, timeout=seconds)
    except subprocess.TimeoutExpired:
        return HUNG
    return SURVIVED if done.returncode == 0 else CAUGHT


def _copy(folder: Path) -> Path:
    """A copy of what is under version control."""
    names = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True).stdout.decode()
    for name in filter(None, names.split("\0")):
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
    return folder


def _drop_caches(copy: Path, file: Path) -> None:
    """Remove what Numba compiled of a file and of all that import it, directly or not."""
    stale = {path.stem for path in _importers(copy / PACKAGE, file)}
    for cached in (copy / "numba").rglob("*.nb?"):
        if cached.name.split(".")[0] in stale:
            cached.unlink(missing_ok=True)


def _importers(package: Path, file: Path) -> set[Path]:
    imports = {path.relative_to(package): _imported(package, path) for path in package.rglob("*.py")}
    found, new = {file}, {file}
    while new:
        new = {path for path, names in imports.items() if names & new} - found
        found |= new
    return found


def _imported(package: Path, path: Path) -> set[Path]:
    """Files of the package that a file may import."""
    folder = path.relative_to(package).parent
    files: set[Path] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level:
            base = folder
            for _ in range(node.level - 1):
                base = base.parent
            base = base.joinpath(*(node.module or "").split("."))
            files |= {base.parent / f"{base.name}.py", *(base / f"{alias.name}.py" for alias in node.names)}
    return files


if __name__ == "__main__":
    sys.exit(main())
