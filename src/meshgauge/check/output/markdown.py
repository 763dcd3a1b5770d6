"""The gate as Markdown: the summary of a job, or a comment on a merge request."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence

from ...errors import FailedFile
from ...look import style
from ...look.names import cell_entry, point_entry
from ...quality.summary import Tally
from .. import Check, Outcome, State
from .lines import printable
from .mermaid import BINS, chart
from .text import verdict

ICONS = {State.PASS: "✅", State.EMPTY: "➖", State.WARN: "⚠️", State.FAIL: "❌", State.UNCHECKED: "❓"}

MOST = 50
"""Meshes whose cells are listed; a job's summary may have 1 MB."""


PICTURES = 5
"""Meshes whose distributions are drawn."""


def markdown(checks: Sequence[Check], failures: Sequence[FailedFile] = ()) -> str:
    """A table of the meshes, then the broken rules of each with their cells."""
    return "\n".join([*_overview(checks, failures), *_details(checks)]) + "\n"


def _overview(checks: Sequence[Check], failures: Sequence[FailedFile]) -> Iterator[str]:
    passed, whole = sum(check.is_passed for check in checks), len(checks) + len(failures)
    icon = ICONS[State.PASS if passed == whole else State.FAIL]
    yield f"## {icon} Mesh quality: {passed} of {whole} {'passes' if passed == 1 else 'pass'}"
    yield ""
    yield "| | mesh | cells | invalid | min | J_ENS from −1 over 0 to 1 | |"
    yield "|---|---|---:|---:|---:|---|---|"
    for check in checks:
        figures = " | ".join([f"{check.n_cells:,}", *_figures(check.tally)])
        yield f"| {ICONS[check.state]} | {_escape(check.path)} | {figures} | {_escape(verdict(check))} |"
    for failure in failures:
        yield f"| {ICONS[State.UNCHECKED]} | {_escape(failure.path)} | | | | | {_escape(failure.reason)} |"


def _figures(tally: Tally | None) -> tuple[str, str, str]:
    """Invalid cells, the least value, and the distribution as a row of bars that every reader of Markdown shows."""
    if tally is None or not tally.n_measured:
        return "", "", ""
    _, counts = tally.histogram(BINS)
    bars = style.spark(counts.tolist()).replace(" ", "·")
    return f"{tally.n_invalid:,}", style.quality(tally.min), f"`{bars[: BINS // 2]}│{bars[BINS // 2 :]}`"


def _details(checks: Sequence[Check]) -> Iterator[str]:
    broken_checks = [check for check in checks if check.of(State.FAIL, State.WARN, State.UNCHECKED)]
    for number, check in enumerate(broken_checks[:MOST]):
        yield ""
        yield f"### {_escape(check.path)}"
        yield ""
        if number < PICTURES and check.tally is not None and check.tally.n_measured:
            yield from chart(check.tally)
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
