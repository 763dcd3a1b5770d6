"""The gate as Markdown: the summary of a job, or a comment on a merge request."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence

from ...errors import FailedFile
from ...look import style
from ...look.names import cell_entry, point_entry
from .. import Check, Outcome, State
from .lines import printable
from .text import verdict

ICONS = {State.PASS: "✅", State.EMPTY: "➖", State.WARN: "⚠️", State.FAIL: "❌", State.UNCHECKED: "❓"}

MOST = 50
"""Meshes whose cells are listed; a job's summary may have 1 MB."""


def markdown(checks: Sequence[Check], failures: Sequence[FailedFile] = ()) -> str:
    """A table of the meshes, then the broken rules of each with their cells."""
    return "\n".join([*_overview(checks, failures), *_details(checks)]) + "\n"


def _overview(checks: Sequence[Check], failures: Sequence[FailedFile]) -> Iterator[str]:
    passed, whole = sum(check.is_passed for check in checks), len(checks) + len(failures)
    icon = ICONS[State.PASS if passed == whole else State.FAIL]
    yield f"## {icon} Mesh quality: {passed} of {whole} {'passes' if passed == 1 else 'pass'}"
    yield ""
    yield "| | mesh | cells | |"
    yield "|---|---|---:|---|"
    for check in checks:
        yield f"| {ICONS[check.state]} | {_escape(check.path)} | {check.n_cells:,} | {_escape(verdict(check))} |"
    for failure in failures:
        yield f"| {ICONS[State.UNCHECKED]} | {_escape(failure.path)} | | {_escape(failure.reason)} |"


def _details(checks: Sequence[Check]) -> Iterator[str]:
    broken_checks = [check for check in checks if check.of(State.FAIL, State.WARN, State.UNCHECKED)]
    for check in broken_checks[:MOST]:
        yield ""
        yield f"### {_escape(check.path)}"
        yield ""
        yield "| | rule | |"
        yield "|---|---|---|"
        for outcome in check.outcomes:
            yield f"| {ICONS[outcome.state]} | {_escape(str(outcome.rule))} | {_escape(outcome.text)} |"
        for outcome in check.outcomes:
            if outcome.cells:
                yield from _cells(outcome)
    if len(broken_checks) > MOST:
        yield ""
        yield f"Meshes with broken rules that are not shown here: {len(broken_checks) - MOST:,}"


def _cells(outcome: Outcome) -> Iterator[str]:
    yield ""
    yield f"{ICONS[outcome.state]} **{_escape(str(outcome.rule))}**"
    yield ""
    metric = outcome.cells[0].metric
    yield f"| cell | type | {_escape(metric)} | status | node | point | coordinates | region |"
    yield "|---:|---|---:|---|---:|---:|---|---|"
    for cell in outcome.cells:
        place = ", ".join(style.coordinates(cell.coordinates, cell.spacing))
        value = "none" if math.isnan(cell.value) else f"{cell.value:.4g}"
        name, point = cell_entry(cell.cell, cell.cell_label), point_entry(cell.point, cell.point_label)
        node = "" if cell.node is None else str(cell.node)
        point = "" if cell.point is None else point
        region = _escape(cell.region or "")
        yield f"| {name} | {cell.type} | {value} | {cell.status} | {node} | {point} | {place} | {region} |"
    if outcome.n_more:
        yield ""
        yield f"and {outcome.n_more:,} more"


def _escape(text: str) -> str:
    """Text that shows as it is: nothing in a name of a file or a region is taken for Markdown or HTML."""
    plain = " ".join(printable(text).split())
    plain = plain.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return re.sub(r"([\\`*_\[\]|#~@])", r"\\\1", plain)
