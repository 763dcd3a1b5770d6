"""What an improvement reached, for people, and for programs in a versioned schema."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from .._version import __version__
from ..look import style
from ..look.names import cell_entry
from ..quality.summary import Tally
from ..report.json import finite
from ..report.tables import NumbersTable, new_table
from ..report.text import count, fits, quality_text, spark

if TYPE_CHECKING:
    from ..errors import FailedFile
    from . import RepairReport

SCHEMA, SEVERAL = "meshgauge-improve", "meshgauge-improve-several"
VERSION = 3
NAMED = 5
"""Cells named one by one."""

ROUNDING = 1e-9
"""Share of a volume or area that is no change: it is a sum over all cells."""

LEVELS = {"improved": "good", "unchanged": "good", "not untangled": "bad", "refused": "bad"}


def improve_dict(path: str, output: str | None, report: RepairReport) -> dict[str, Any]:
    """A repair report as plain data; numbers that are undefined or infinite are None."""
    plain: dict[str, Any] = finite(
        {
            "schema": SCHEMA,
            "version": VERSION,
            "meshgauge": __version__,
            "path": path,
            "output": output,
            **report.to_dict(),
        }
    )
    return plain


def dumps(path: str, output: str | None, report: RepairReport) -> str:
    """The same as JSON text, indented, ASCII only."""
    return json.dumps(improve_dict(path, output, report), indent=2, allow_nan=False)


def dumps_several(done: Iterable[tuple[str, str | None, RepairReport]], failures: Iterable[FailedFile]) -> str:
    """Several meshes as one document: path, output and report of each, and what could not be repaired."""
    document = {
        "schema": SEVERAL,
        "version": VERSION,
        "meshgauge": __version__,
        "files": [improve_dict(*one) for one in done],
        "errors": [{"path": one.path, "message": one.reason} for one in failures],
    }
    return json.dumps(document, indent=2, allow_nan=False)


class ImproveText:
    """One improvement: verdict, before and after by type, what is left and why, what it cost, what was checked."""

    def __init__(self, path: str, report: RepairReport, *, output: str | None = None) -> None:
        self.path = style.printable(path)
        self.report = report
        self.output = output

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        report = self.report
        yield Text(self.path, "bold", overflow="fold")
        yield verdict_line(report, ascii_only=options.ascii_only)
        yield by_type(report, console, options)
        if report.n_below:
            yield from below(report)
        if report.n_worse:
            yield from worse(report)
        yield from cost(report)
        yield from claims(report, ascii_only=options.ascii_only)
        if report.notes:
            yield Text("notes", "bold")
            yield _lines(("-", note, "dim") for note in report.notes)
        if self.output is not None:
            yield Text(f"written to {self.output}", overflow="fold")


def verdict_line(report: RepairReport, *, ascii_only: bool = False) -> RenderableType:
    """The verdict with its mark, in its colour."""
    level = LEVELS.get(report.outcome, "unknown")
    if not report.holds or report.after.all.n_invalid:
        level = "bad"
    elif level == "good" and report.n_below:
        level = "poor"
    marks = style.MARKS_ASCII if ascii_only else style.MARKS
    return _lines([(marks[level], report.verdict, style.LEVELS[level])], indent=0)


def by_type(report: RepairReport, console: Console, options: ConsoleOptions) -> RenderableType:
    """Two rows for each type: before and after."""
    was, now = dict(report.before.types), dict(report.after.types)
    none = Tally.empty(report.after.all.scale, report.after.all.purpose)
    pairs = ((name, was.get(name, none), now.get(name, none)) for name in dict.fromkeys((*was, *now)))
    rows = [row for row in pairs if row[1].n_measured or row[2].n_measured]
    if len(rows) > 1:
        rows.append(("all", report.before.all, report.after.all))
    wide = _by_type(rows, ascii_only=options.ascii_only, bars=True)
    if fits(wide, console, options):
        return wide
    return _by_type(rows, ascii_only=options.ascii_only, bars=False)


def _by_type(rows: list[tuple[str, Tally, Tally]], *, ascii_only: bool, bars: bool) -> NumbersTable:
    names = ["", "invalid", "poor", "min", "1 %", "median", "mean", *(["-1        0         1"] if bars else [])]
    table = new_table("cells", *names)
    table.columns[1].justify = "left"
    for name, *pair in rows:
        is_other = pair[0].n_cells != pair[1].n_cells
        for when, tally in zip(("before", "after"), pair, strict=True):
            at = tally.quantiles()
            table.add_row(
                Text(f"{style.number(tally.n_cells)} {name}" if tally is pair[0] or is_other else "", "bold"),
                Text(when, "dim"),
                count(tally.n_invalid, "invalid"),
                count(tally.n_poor, "poor"),
                quality_text(tally.min, tally.scale.acceptable[0]),
                quality_text(at[0.01], tally.scale.acceptable[0]),
                quality_text(at[0.5], tally.scale.acceptable[0]),
                quality_text(tally.mean, tally.scale.acceptable[0]),
                *([spark(tally, ascii_only)] if bars and tally.n_measured else []),
            )
    return table


def below(report: RepairReport) -> Iterator[RenderableType]:
    """The cells below the target, by reason, and the worst of them."""
    target = report.options.get("target")
    what = f"invalid or below {target:g}" if target else "invalid"
    yield Text(
        f"still {what}: {style.plural(report.n_below, 'cell')} ({style.number(report.n_below_before)} before)", "bold"
    )
    yield _lines((style.number(n), why, "") for why, n in sorted(report.reasons.items(), key=lambda item: -item[1]))
    table = new_table("cell", "type", "quality", "at most")
    table.columns[1].justify = "left"
    for cell in report.below[:NAMED]:
        bound = style.quality(cell.bound) if cell.bound < 1.0 else "-"
        table.add_row(cell_entry(cell.cell, cell.cell_label), cell.type, quality_text(cell.quality), bound)
    yield Padding(table, (0, 0, 0, 2), expand=False)


def worse(report: RepairReport) -> Iterator[RenderableType]:
    """The cells that paid."""
    lost = f"by {style.quality(report.mean_loss)} on average, at most {style.quality(report.largest_loss)}"
    yield Text(f"cells made worse: {style.number(report.n_worse)}, {lost}", "bold")
    table = new_table("cell", "type", "before", "after")
    table.columns[1].justify = "left"
    for cell in report.worse[:NAMED]:
        name = cell_entry(cell.cell, cell.cell_label)
        table.add_row(name, cell.type, quality_text(cell.before), quality_text(cell.after))
    yield Padding(table, (0, 0, 0, 2), expand=False)


def cost(report: RepairReport) -> Iterator[RenderableType]:
    """How far points moved, what became of volume and surface, and the time."""
    moved = report.displacement
    lines = [
        f"{style.plural(moved.n_points, 'point')} moved ({share(moved.share)} of all), by at most {moved.largest:.4g} "
        f"({share(moved.largest_share)} of the diagonal)"
    ]
    if (joined := report.reconnection) is not None:
        cells, done = joined.n_cells, [f"{style.number(n)} {what}" for what, n in joined.operations.items() if n]
        lines.insert(0, f"other cells: {style.number(cells[0])} → {style.number(cells[1])} cells, "
                        f"{style.number(joined.n_new_cells)} of them new; {', '.join(done)}")  # fmt: skip
    if moved.n_boundary:
        lines.append(
            f"{style.number(moved.n_boundary)} of them on the boundary, by at most {moved.boundary_largest:.4g}; "
            f"it is at most {moved.deviation:.3g} ({share(moved.deviation_share)} of the diagonal) off the old one, "
            f"{moved.deviation_mean:.3g} ({share(moved.deviation_mean_share)}) in the mean"
        )
    elif moved.deviation > 0.0:
        far = f"{moved.deviation:.3g} ({share(moved.deviation_share)} of the diagonal)"
        mean = f"{moved.deviation_mean:.3g} ({share(moved.deviation_mean_share)})"
        lines.append(f"the surface is at most {far} off the old one, {mean} in the mean")
    if report.sizes.n_cells and moved.n_points:
        lines.append(sizes(report))
    is_local = not report.options.get("everywhere", True)
    for name, (was, now) in (("volume", report.volume), ("surface", report.surface)):
        if is_local and not moved.n_points:
            break
        if not was and not now:
            continue  # surface cells have no volume
        change = f"{100 * (now - was) / was:+.2g} %" if was and abs(now - was) > ROUNDING * abs(was) else "unchanged"
        lines.append(f"{name}{' near bad cells' if is_local else ''} {now:.6g} ({change})")
    if report.ceiling < 1.0:
        lines.append(f"with these points fixed the worst cell can have at most {style.quality(report.ceiling)}")
    stopped = {"time": ", stopped when the time was up", "interrupted": ", interrupted"}.get(report.stopped, "")
    lines.append(f"{report.seconds:.1f} s, {style.plural(report.evaluations, 'evaluation')}{stopped}")
    yield Text("cost", "bold")
    yield _lines(("-", line, "dim") for line in lines)


def share(part: float) -> str:
    """A share in per cent."""
    per_cent = 100.0 * part
    return f"{per_cent:.3g} %" if per_cent >= 10.0 else f"{per_cent:.2g} %"


def sizes(report: RepairReport) -> str:
    """What became of the sizes of cells that were good, as a line."""
    one = report.sizes
    what = "volumes" if any(report.volume) else "areas"  # surface cells have no volume
    return (
        f"of {style.plural(one.n_cells, 'cell')} that had 0.9 or more, {what} changed by a factor of at most "
        f"{one.volume:.3g} (99 %: {one.volume_most:.3g}), edges of {one.edge:.3g} (99 %: {one.edge_most:.3g})"
    )


def claims(report: RepairReport, *, ascii_only: bool) -> Iterator[RenderableType]:
    """What was checked on the result."""
    marks = style.MARKS_ASCII if ascii_only else style.MARKS
    yield Text("checked on the result", "bold")
    yield _lines(
        (marks["good" if claim.holds else "bad"], claim.text if claim.holds else f"does NOT hold: {claim.text}",
         style.LEVELS["good" if claim.holds else "bad"])
        for claim in report.claims
    )  # fmt: skip


def _lines(lines: Any, indent: int = 1) -> RenderableType:
    """Paragraphs, each behind a mark; their further lines stay clear of it."""
    table = Table.grid(padding=(0, 1))
    table.add_column(no_wrap=True, justify="right")
    table.add_column(overflow="fold")
    for mark, line, look in lines:
        table.add_row(Text(mark, look), Text(line))
    return Padding(table, (0, 0, 0, indent), expand=False)
