"""The tests that ran a line, by what coverage.py has noted: for `mutants.py`."""

from __future__ import annotations

import ast
import sqlite3
import xml.etree.ElementTree as ElementTree
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from coverage.numbits import nums_to_numbits, register_sqlite_functions

PACKAGE = Path("src/meshgauge")
COMPILED = {"kernel", "fused_kernel", "summing_kernel", "fused_inlined", "inlined"}
"""Decorators of functions whose lines coverage.py does not see: `kernels/jit.py`."""

Lines = dict[Path, set[int]]
"""Numbers of lines by file, below the copy."""


class Contexts:
    """Which lines each test ran, and how long it took.

    Parameters
    ----------
    data
        Written by coverage.py, with the tests as contexts.
    times
        Written by pytest: JUnit's XML of the same run.
    copy
        The checkout that the tests ran in.
    """

    N, SECONDS, FEW = 100, 40.0, 10

    def __init__(self, data: Path, times: Path, copy: Path) -> None:
        self.copy = copy
        self.database = sqlite3.connect(data, check_same_thread=False)
        register_sqlite_functions(self.database)
        self.database.create_function("count_lines", 1, lambda bits: int.from_bytes(bits, "little").bit_count())
        self.n_lines: dict[str, int] = defaultdict(int)
        bits = "line_bits join context on context.id = context_id"
        for context, n in self.database.execute(f"select context, sum(count_lines(numbits)) from {bits} group by 1"):
            self.n_lines[_test(context)] += n
        files = self.database.execute("select id, path from file").fetchall()
        self.ids = {Path(path).relative_to(copy): number for number, path in files}
        self.seconds = {
            f"{case.get('classname')}::{case.get('name')}": float(case.get("time", 0))
            for case in ElementTree.parse(times).iter("testcase")
            if all(case.find(tag) is None for tag in ("failure", "error", "skipped"))
        }

    def tests(self, file: Path, line: int) -> list[str]:
        """Tests that can tell an error in a line, the most specific first; none if no test runs its file."""
        importers = {path for path in sources(self.copy) if file in imported(self.copy, path)}
        chosen: dict[str, float] = {}
        for places in (_uses(self.copy, file, line), _functions(self.copy, {file}), _functions(self.copy, importers)):
            if len(chosen) >= self.FEW:
                break
            for test in self._in_order(self._ran(places)):
                seconds = self.seconds.get(_key(test), self.SECONDS + 1)  # it failed
                if len(chosen) < self.N and sum(chosen.values()) + seconds <= self.SECONDS:
                    chosen.setdefault(test, seconds)
        return list(chosen)

    def _ran(self, places: Lines) -> set[str]:
        query = (
            "select context from line_bits join context on context.id = context_id"
            " where file_id = ? and numbits_any_intersection(numbits, ?)"
        )
        rows = (
            self.database.execute(query, (self.ids[file], nums_to_numbits(lines))).fetchall()
            for file, lines in places.items()
            if file in self.ids
        )
        return {_test(context) for contexts in rows for (context,) in contexts if context}

    def _in_order(self, tests: set[str]) -> list[str]:
        """Those that run the fewest lines first; of each function one, then of each a second one."""
        turns: dict[str, int] = defaultdict(int)
        places = []
        for test in sorted(tests, key=lambda test: (self.n_lines[test], test)):
            function = test.partition("[")[0]
            places.append((turns[function], len(places), test))
            turns[function] += 1
        return [test for _, _, test in sorted(places)]


def _test(context: str) -> str:
    """Of ``tests/test_a.py::test_b|run`` what stands before its phase."""
    return context.rpartition("|")[0]


def _key(test: str) -> str:
    """The name that a test has in JUnit's XML."""
    file, _, name = test.partition("::")
    return f"{file.removesuffix('.py').replace('/', '.')}::{name}"


def _uses(copy: Path, file: Path, line: int) -> Lines:
    """The lines that coverage.py sees and that show a line: those of its statement, if it is in a Python function.

    A line of a kernel or of a module shows where a Python function uses the kernel, the class or the constant, through
    others if need be.
    """
    places: Lines = {}
    for path, number in _reached(copy, file, line):
        if seen := _seen(copy, path, number)[0]:
            places.setdefault(path, set()).update(seen)
    return places


def compiled_of(copy: Path, file: Path, line: int) -> set[Path]:
    """The files whose kernels may be others if a line is."""
    return {path for path, number in _reached(copy, file, line) if _seen(copy, path, number)[1]}


def _reached(copy: Path, file: Path, line: int) -> Iterator[tuple[Path, int]]:
    """A line, and those that use what it defines outside of Python functions, and so on."""
    waiting, done = [(file, line)], set()
    while waiting:
        path, number = waiting.pop()
        yield path, number
        for name in _seen(copy, path, number)[1]:
            if (path, name) in done:
                continue
            done.add((path, name))
            for other in sources(copy):
                if other == path or path in imported(copy, other):
                    waiting += [(other, at) for at in _names(copy / other).get(name, ())]


@cache
def _seen(copy: Path, file: Path, line: int) -> tuple[frozenset[int], frozenset[str]]:
    """The lines of a statement if coverage.py sees it in a function; otherwise the names that it defines."""
    tree, function = _tree(copy / file), None
    around = [node for node in ast.walk(tree) if isinstance(node, ast.stmt) and line in _range(node)]
    for node in around:  # from the outermost to the innermost
        if isinstance(node, ast.FunctionDef) and (function is None or not _is_compiled(function)):
            function = node
    if not around:
        return frozenset(), frozenset()
    if function is not None and not _is_compiled(function) and line >= function.body[0].lineno:
        return frozenset(_extent(around[-1])), frozenset()
    top = around[0]
    defined = {top.name} if isinstance(top, ast.FunctionDef | ast.ClassDef) else _targets(top)
    return frozenset(), frozenset(defined)


def _targets(statement: ast.stmt) -> set[str]:
    stored = (node for node in ast.walk(statement) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store))
    return {node.id for node in stored}


def _is_compiled(function: ast.FunctionDef) -> bool:
    return any(isinstance(node, ast.Name) and node.id in COMPILED for node in function.decorator_list)


def _range(node: ast.stmt) -> range:
    return range(node.lineno, (node.end_lineno or node.lineno) + 1)


def _extent(node: ast.stmt) -> range:
    """The lines of a statement without the statements in it."""
    body = getattr(node, "body", None)
    return range(node.lineno, max(body[0].lineno, node.lineno + 1) if body else _range(node).stop)


def _functions(copy: Path, files: set[Path]) -> Lines:
    """All lines inside functions of these files."""
    return {
        file: {n for node in ast.walk(_tree(copy / file)) if isinstance(node, ast.FunctionDef) for n in _inner(node)}
        for file in files
    }


def _inner(function: ast.FunctionDef) -> Iterator[int]:
    return iter(range(function.body[0].lineno, _range(function).stop))


@cache
def sources(copy: Path) -> tuple[Path, ...]:
    folders = (PACKAGE, Path("tests"))
    return tuple(path.relative_to(copy) for folder in folders for path in sorted((copy / folder).rglob("*.py")))


@cache
def _tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def _names(path: Path) -> dict[str, list[int]]:
    """The lines in which each name is used."""
    lines: dict[str, list[int]] = defaultdict(list)
    for node in ast.walk(_tree(path)):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
            lines[node.id].append(node.lineno)
        elif isinstance(node, ast.Attribute):
            lines[node.attr].append(node.lineno)
    return lines


@cache
def imported(copy: Path, path: Path) -> frozenset[Path]:
    """Files of the package that a file may import; all below the copy."""
    files: set[Path] = set()
    for node in ast.walk(_tree(copy / path)):
        names = (node.module or "").split(".") if isinstance(node, ast.ImportFrom) else []
        if isinstance(node, ast.ImportFrom) and (node.level or names[0] == PACKAGE.name):
            base = path.parents[node.level - 1].joinpath(*names) if node.level else PACKAGE.parent.joinpath(*names)
            files |= {base.parent / f"{base.name}.py", *(base / f"{alias.name}.py" for alias in node.names)}
            if (copy / base / "__init__.py").exists() and path.name != "__init__.py":
                files |= imported(copy, base / "__init__.py")
    return frozenset(files)
