"""Many meshes at a glance: how many break each rule."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from rich.console import Console, ConsoleOptions, RenderResult
from rich.text import Text

from ...errors import FailedFile
from ...look import style
from ...report.tables import new_table
from .. import Check, State
from .text import LOOKS


@dataclass(frozen=True, slots=True)
class RuleStatistics:
    """What one rule came to on all meshes."""

    rule: str
    level: str
    n_meshes: int  #: that it was checked on, or could not be
    n_broken: int  #: meshes that break it
    n_unchecked: int
    n_cells: int  #: cells that break it, of those meshes
    worst: str  #: the mesh with the most of them; empty if none breaks it

    def to_dict(self) -> dict[str, Any]:
        """Plain data."""
        return {name: getattr(self, name) for name in self.__slots__}


def statistics(checks: Sequence[Check]) -> list[RuleStatistics]:
    """What each rule came to, those that most meshes break first."""
    found: dict[tuple[str, str], list[tuple[Check, Any]]] = {}
    for check in checks:
        for outcome in check.outcomes:
            found.setdefault((str(outcome.rule), outcome.rule.level.value), []).append((check, outcome))
    made = []
    for (rule, level), outcomes in found.items():
        broken = [(check, one) for check, one in outcomes if one.state in (State.FAIL, State.WARN)]
        worst = max(broken, key=lambda pair: pair[1].n_failing, default=None)
        made.append(
            RuleStatistics(
                rule,
                level,
                len(outcomes),
                len(broken),
                sum(one.state is State.UNCHECKED for _, one in outcomes),
                sum(one.n_failing for _, one in broken),
                "" if worst is None else worst[0].path,
            )
        )
    return sorted(made, key=lambda one: (-one.n_broken - one.n_unchecked, one.level, one.rule))


class StatisticsText:
    """A line a rule."""

    def __init__(self, checks: Sequence[Check], failures: Sequence[FailedFile] = ()) -> None:
        self.checks, self.failures = checks, failures

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        passed = sum(check.is_passed for check in self.checks)
        whole = len(self.checks) + len(self.failures)
        state = State.PASS if passed == whole else State.FAIL
        share = f"{passed:,} of {style.number_of(whole, 'mesh', 'meshes')}"
        yield Text(f"{share} {'passes' if passed == 1 else 'pass'}", style.LEVELS[LOOKS[state]])
        table = new_table("rule", "level", "broken by", "of", "cells", "most in")
        for column in (1, 5):
            table.columns[column].justify = "left"
        for one in statistics(self.checks):
            look = style.LEVELS["bad" if one.level == "fail" else "poor"] if one.n_broken else "dim"
            broken = Text(style.number(one.n_broken), look)
            if one.n_unchecked:
                broken.append(f" + {one.n_unchecked:,} unchecked", style.LEVELS["unknown"])
            numbers = style.number(one.n_meshes), style.number(one.n_cells)
            table.add_row(one.rule, one.level, broken, *numbers, style.printable(one.worst))
        yield table
        for failure in self.failures:
            yield Text(f"? {style.printable(failure.path)}: {style.printable(failure.reason)}", overflow="fold")
