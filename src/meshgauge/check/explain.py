"""What a name or a rule means, for people: rules, words of rules, statuses, metrics, and what a mesh may be for."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from rich.console import Console, ConsoleOptions, RenderResult
from rich.table import Table
from rich.text import Text

from ..errors import OptionError, RuleError
from ..look.bands import POOR_TEXT
from ..look.names import meant
from ..quality.metrics import METRICS
from ..report.catalogue import MetricsText
from ..status import STATUSES, Category, Purpose, StatusRow, category
from .grammar import rule
from .judge import PROFILES, default_rules
from .rules import Nothing, NoWorse, Rule, Threshold
from .words import WORDS

Rows = list[tuple[str, str]]

_COUNTS = {
    Category.VALID: f"valid; poor if its J_ENS is below {POOR_TEXT}, else good",
    Category.INVALID: "invalid: no solver can use it",
    Category.DEGENERATE: "degenerate",
    Category.UNDECIDED: "undecided, which is never a pass",
    Category.UNMEASURED: "unmeasured, which is never a pass",
    Category.APART: "in no total",
}
"""What a cell of each category counts as."""

_PURPOSES = {"fem": "finite elements", "fv": "finite volumes", "explicit": "explicit time steps"}


class Explanation:
    """Everything that has a name, a block each.

    Parameters
    ----------
    name
        A rule, a metric, a status, a word after ``nothing``, or a purpose (``fem``, ``fv``, ``explicit``).

    Raises
    ------
    OptionError
        If nothing has that name, and it is no rule.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.blocks = list(_blocks(name))
        if not self.blocks:
            names = (*METRICS, *(row.name for row in STATUSES.values()), *WORDS, *PROFILES)
            hint = meant(name, names) or "; it is no rule, metric, status or purpose"
            raise OptionError(f"nothing is called {name!r}{hint}")

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        for at, (kind, rows) in enumerate(self.blocks):
            if at:
                yield Text()
            yield Text(self.name, "bold").append(f"  {kind}", "not bold")
            table = Table.grid(padding=(0, 2))
            table.add_column(style="dim", no_wrap=True)
            table.add_column(overflow="fold")
            for label, text in rows:
                table.add_row(f"  {label}", Text(text))
            yield table
        if self.name in METRICS:
            yield Text()
            yield MetricsText([METRICS[self.name]], in_full=True)


def _blocks(name: str) -> Iterator[tuple[str, Rows]]:
    """What the name is, and what is said of it."""
    for row in STATUSES.values():
        if row.name == name:
            as_fem, as_fv = _category(row, "fem"), _category(row, "fv")
            rows = [("meaning", row.text), ("counts as", _COUNTS[as_fem])]
            if as_fv != as_fem:
                rows.append(("for finite volumes", _COUNTS[as_fv]))
            yield "a status of cells", rows
    if name in WORDS and name not in {row.name for row in STATUSES.values()}:
        yield "a word of rules", [("nothing ...", f"no cell may be {WORDS[name].phrase}: {WORDS[name].text}")]
    if name in PROFILES:
        rules = [(one.level.name.lower(), str(one)) for one in default_rules(name)]
        yield f"what a mesh is for: {_PURPOSES[name]}", rules
    if name in METRICS:
        yield "a metric", [("in rules", f"{name} {'>=' if METRICS[name].better == 'higher' else '<='} NUMBER")]
    try:
        one = rule(name)
    except RuleError:
        return
    yield "a rule", list(_of_rule(one))


def _category(row: StatusRow, purpose: Purpose) -> Category:
    return Category(int(category(np.array([row.status], np.uint8), purpose)[0]))


def _of_rule(one: Rule) -> Iterator[tuple[str, str]]:
    if isinstance(one, NoWorse):
        margin = f", or worse by no more than {one.margin_text}" if one.margin_text else ""
        yield "holds if", f"J_ENS is as good as in the report {one.file}{margin}: over all cells, and for each type"
        yield "looks at", "numbers of invalid, degenerate, undecided and unmeasured cells; share of poor cells; least"
        yield "", "value, 1 % quantile and mean"
        return
    if isinstance(one, Threshold):
        what = f"{METRICS[one.metric].title or one.metric} of each cell is {one.comparison} {one.bound_text}"
        yield "holds if", what
        yield "without a value", "a cell never passes"
    if isinstance(one, Nothing):
        yield "holds if", f"no cell is {one.word.phrase}: {one.word.text}"
    amount = one.allowance
    if amount.text:
        some = f"a share of at most {amount.text}" if amount.is_share else f"at most {amount.cells(0)}"
        yield "may break it", f"{some} of the cells that it is about"
    yield "is about", f"the solid cells{one.scope}" if str(one.scope) else "all solid cells"
