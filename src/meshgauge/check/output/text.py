"""The gate for people: a line a rule, then the cells that break them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from ...errors import FailedFile
from ...look import style
from ...look.names import cell_entry, point_entry
from ...report.tables import NumbersTable, new_table
from ...report.text import fits, quality_text
from .. import Check, FailingCell, Outcome, State
from ..outcome import first_step

LOOKS = {
    State.PASS: "good",
    State.EMPTY: "good",
    State.WARN: "poor",
    State.FAIL: "bad",
    State.UNCHECKED: "unknown",
}
"""The level of the report's style that a state looks like."""

VERBS = (
    (State.FAIL, "fails", "fail"),
    (State.WARN, "warns", "warn"),
    (State.UNCHECKED, "could not be checked", "could not be checked"),
)
"""What is said of one rule and of several."""


class CheckText:
    """One mesh: the verdict, every rule with what came of it, and the cells of the broken ones."""

    def __init__(self, check: Check) -> None:
        self.check = check

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        check = self.check
        title = Text(style.printable(check.path), "bold", overflow="fold")
        title.append(
            f"  {style.plural(check.n_cells, 'cell')}, {style.plural(check.n_points, 'point')}", "not bold dim"
        )
        yield title
        line = Text(f"{_mark(check.state, options)} ", _look(check.state))
        yield line.append(verdict(check))
        table = Table.grid(padding=(0, 2, 0, 0))
        table.add_column(no_wrap=True)
        table.add_column(overflow="fold", max_width=48)
        table.add_column(overflow="fold")
        for outcome in check.outcomes:
            is_plain = outcome.state in (State.PASS, State.EMPTY)
            table.add_row(
                Text(_mark(outcome.state, options), _look(outcome.state)),
                Text(str(outcome.rule), "" if is_plain else "bold"),
                Text(outcome.text, "dim" if is_plain else ""),
            )
        yield Padding(table, (1, 0, 1, 1), expand=False)
        for outcome in check.of(State.FAIL, State.WARN):
            if outcome.cells:
                yield from _cells(outcome, console, options)
        for note in check.notes:
            yield Padding(Text(f"note: {note}", "dim", overflow="fold"), (0, 0, 0, 1))
        if check.notes:
            yield ""


class CheckLine:
    """One mesh in one line: the verdict, and the rules that it breaks."""

    def __init__(self, check: Check) -> None:
        self.check = check

    def __rich__(self) -> Text:
        broken = "; ".join(str(outcome.rule) for outcome in self.check.of(State.FAIL, State.WARN, State.UNCHECKED))
        return Text(f"{style.printable(self.check.path)}: {verdict(self.check)}{f': {broken}' if broken else ''}")


class ChecksText:
    """The end, where there are several meshes: how many pass, and those that do not."""

    def __init__(self, checks: Sequence[Check], failures: Sequence[FailedFile]) -> None:
        self.checks = checks
        self.failures = failures

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        passed = sum(check.is_passed for check in self.checks)
        whole = len(self.checks) + len(self.failures)
        state = State.PASS if passed == whole else State.FAIL
        share = f"{passed:,} of {whole:,} meshes {'passes' if passed == 1 else 'pass'}"
        yield Text(f"{_mark(state, options)} {share}", _look(state))
        for check in self.checks:
            if not check.is_passed:
                yield Text(
                    f"  {_mark(check.state, options)} {style.printable(check.path)}: {verdict(check)}", overflow="fold"
                )
        first = first_step(self.checks)
        if first is not None:
            broken = ", ".join(str(one.rule) for one in first.of(State.FAIL))
            yield Text(f"first step that breaks a rule: {style.printable(first.path)}: {broken}", overflow="fold")
        for failure in self.failures:
            yield Text(f"  ? {style.printable(failure.path)}: {style.printable(failure.reason)}", overflow="fold")


def verdict(check: Check) -> str:
    """How the mesh came out, in one line: ``2 of 5 rules fail, 1 warns``."""
    n = len(check.outcomes)
    clauses: list[str] = []
    for state, one, many in VERBS:
        k = len(check.of(state))
        if k:
            whole = "" if clauses else f" of {style.plural(n, 'rule')}"
            clauses.append(f"{k}{whole} {one if k == 1 else many}")
    if clauses:
        return ", ".join(clauses)
    return "the rule holds" if n == 1 else f"all {n} rules hold"


def _cells(outcome: Outcome, console: Console, options: ConsoleOptions) -> Iterator[RenderableType]:
    n = len(outcome.cells)
    which = f"the worst {n:,} of {outcome.n_failing:,} cells" if outcome.n_more else style.plural(n, "cell")
    which = f"the worst {style.plural(n, 'cell')} of the worse types" if outcome.changes else which
    yield Text(str(outcome.rule), "bold").append(f": {which}", "not bold dim")
    has_regions = any(cell.region is not None for cell in outcome.cells)
    tables = [_table(outcome.cells, digits, has_regions) for digits in (6, 5, 4)]
    tables.append(_table(outcome.cells, 4, False))
    yield next((table for table in tables if fits(table, console, options)), tables[-1])


def _table(cells: Sequence[FailingCell], digits: int, with_region: bool) -> NumbersTable:
    metric = cells[0].metric
    table = new_table("cell", "type", metric, "status", "node", "point", "x", "y", "z", *["region"] * with_region)
    for column in (1, 3, 9)[: 2 + with_region]:
        table.columns[column].justify = "left"
    for cell in cells:
        table.add_row(
            cell_entry(cell.cell, cell.cell_label),
            cell.type,
            quality_text(cell.value) if metric == "jens" else style.quality(cell.value),
            cell.status,
            "-" if cell.node is None else str(cell.node),
            point_entry(cell.point, cell.point_label),
            *style.coordinates(cell.coordinates, cell.spacing, digits=digits),
            *([cell.region or ""] if with_region else []),
        )
    return table


def _mark(state: State, options: ConsoleOptions) -> str:
    if state is State.EMPTY:
        return "-"
    return (style.MARKS_ASCII if options.ascii_only else style.MARKS)[LOOKS[state]]


def _look(state: State) -> str:
    return style.LEVELS[LOOKS[state]]
