"""The report for people: one mesh, as Rich renderables that fit the width they are given."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray
from rich.console import Console, ConsoleOptions, Group, RenderableType, RenderResult
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from ..look import style
from ..look.bands import POOR, PoorBelow
from ..look.bands import band as band_of
from ..look.names import cell_entry, listed, point_entry
from ..quality.poor import limit_of
from ..quality.summary import UNDEFINED, Summary, Tally
from ..quality.worst import WorstCell
from ..status import STATUSES, Category
from . import beside
from .finite_volume import FiniteVolumeMeasure, face_text, place, worst_faces
from .record import FileReport
from .tables import NumbersTable, new_table, with_widths
from .verdict import verdict

SPARK_WIDTH = 20
"""Characters of the small histograms: 0.1 each, so that 0 and `POOR` fall between two."""

BAR_WIDTH = 60
"""Most characters of a bar."""

STYLES_OF_COUNTS = ("invalid", "degenerate", "poor", "good")
"""Columns of counts."""

STATUS_STYLES = {
    row.name: "bold red" if row.category in (Category.INVALID, Category.DEGENERATE) else "bold yellow"
    for row in STATUSES.values()
}

UNLIKE_THEIR_VALUE = {
    "inverted_inside": "invalid, whatever the value of their corners",
    "undecided": "no pass, whatever the value of their corners",
}
"""Statuses of cells that may have any value above 0, and what they are all the same."""

STATUS_TEXTS = {row.name: row.text for row in STATUSES.values()}


Column = tuple[str, Callable[[Tally], str | Text]]


class FileText:
    """One mesh: verdict, table by type, histogram, worst cells, what was not measured, notes."""

    def __init__(self, report: FileReport, *, bins: int = 20, with_bars: bool = True) -> None:
        self.report = report
        self.bins = bins
        self.with_bars = with_bars

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        report, summary = self.report, self.report.summary
        measured = summary.all.n_measured > 0
        yield headline(report)
        yield verdict_line(summary, ascii_only=options.ascii_only)
        if measured:
            yield type_tables(report, console, options)
            if report.regions:
                yield region_tables(report, console, options)
            if report.companions:
                yield Text(f" {beside.LEGEND}\n", "dim")
            if self.with_bars:
                yield from bars(report, self.bins, options)
        if report.findings:
            yield from findings(report)
        if report.worst:
            yield from worst_cells(report, console, options)
        if report.finite_volume:
            yield from finite_volume_text(report.finite_volume)
        of_faces = {measure.name for measure in report.finite_volume}
        for other in report.others:
            if other.metric not in of_faces:
                yield from other_metric(other)
        if report.diagnosis is not None and (report.diagnosis.findings or report.diagnosis.skipped):
            from ..doctor.text import DiagnosisText  # which loads what diagnoses

            yield DiagnosisText(report.diagnosis)
            yield Text()
        yield from remarks(report)


def headline(report: FileReport) -> Text:
    """Path, cells and points."""
    text = Text(overflow="fold")
    text.append(style.printable(report.path), "bold")
    text.append(f"  {style.plural(report.n_cells, 'cell')}, {style.plural(report.n_points, 'point')}", "dim")
    return text


def verdict_line(summary: Summary, *, ascii_only: bool) -> Table:
    """The verdict with its mark, in its colour."""
    level, text = verdict(summary)
    marks = style.MARKS_ASCII if ascii_only else style.MARKS
    return _hanging(marks[level], [text], style.LEVELS[level])


def region_tables(report: FileReport, console: Console, options: ConsoleOptions) -> RenderableType:
    """The same columns by region, in the order of the file."""
    rows = {name: summary.all for name, summary in report.regions if summary.all.n_measured}
    tallies = beside.of_regions([name for name, _ in report.regions], report.region_companions)
    return _tables(rows, "region", tallies, report.summary.poor_below, console, options)


def type_tables(report: FileReport, console: Console, options: ConsoleOptions) -> RenderableType:
    """Counts, values and small histograms by type."""
    summary = report.summary
    rows = {name: tally for name, tally in summary.types.items() if tally.n_measured}
    if len(rows) > 1:
        rows["all"] = summary.all
    return _tables(rows, "cells", beside.of_types(report), summary.poor_below, console, options)


def _tables(
    rows: dict[str, Tally],
    title: str,
    tallies: beside.Tallies,
    poor_below: PoorBelow,
    console: Console,
    options: ConsoleOptions,
) -> RenderableType:
    """One table where it fits, else two, without histograms if need be."""
    counts = _count_columns(any(tally.n_undecided for tally in rows.values()), poor_below)
    values = _value_columns(options.ascii_only)
    companions = _companion_columns(rows, tallies)
    wide = _table(rows, title, [*counts, *values[:-1], *companions, values[-1]])
    if fits(wide, console, options):
        return wide
    narrow = _table(rows, "quality", values)
    if not fits(narrow, console, options):
        narrow = _table(rows, "quality", values[:-1])
    first = _table(rows, title, [*counts, *companions])
    if fits(first, console, options) or not companions:
        return Group(first, narrow)
    return Group(_table(rows, title, counts), narrow, _table(rows, "beside", companions))


def fits(table: NumbersTable, console: Console, options: ConsoleOptions) -> bool:
    """True if nothing has to be wrapped to print this as wide as allowed."""
    return table.width_in_lines(console, options) <= options.max_width


def _count_columns(with_undecided: bool, poor_below: PoorBelow) -> list[Column]:
    undecided: Column = ("undecided", lambda t: count(t.n_undecided, "undecided"))
    return [
        ("measured", lambda t: style.number(t.n_measured)),
        ("invalid", lambda t: count(t.n_invalid, "invalid")),
        ("degenerate", lambda t: count(t.n_degenerate, "degenerate")),
        *([undecided] if with_undecided else []),
        ("poor", lambda t: count(t.n_poor, "poor")),
        ("good", lambda t: count(t.n_good, "good")),
        ("not good" if poor_below.of_shapes else f"< {poor_below.text}", share_below),
    ]


def share_below(tally: Tally) -> str:
    """The share of the measured cells that are invalid, degenerate or poor."""
    return style.percent(tally.n_measured - tally.n_good - tally.n_undecided, tally.n_measured)


def _companion_columns(rows: dict[str, Tally], tallies: beside.Tallies) -> list[Column]:
    """The mean of the node values, and the edge ratio that 1 % of the cells are below."""
    if not tallies:
        return []
    of = {id(tally): tallies[name] for name, tally in rows.items()}
    return [
        ("nodes", lambda t: style.quality(beside.nodes(of[id(t)]))),
        ("edges", lambda t: style.quality(beside.edges(of[id(t)]))),
    ]


def _value_columns(ascii_only: bool) -> list[Column]:

    def shown(tally: Tally, value: float) -> Text:
        return quality_text(value, tally.scale.acceptable[0], can_be_bad=tally.n_invalid + tally.n_degenerate > 0)

    return [
        ("min", lambda t: shown(t, t.min)),
        ("1 %", lambda t: shown(t, t.quantiles()[0.01])),
        ("5 %", lambda t: shown(t, t.quantiles()[0.05])),
        ("median", lambda t: shown(t, t.quantiles()[0.5])),
        ("mean", lambda t: shown(t, t.mean)),
        ("-1        0         1", lambda t: spark(t, ascii_only)),
    ]


def _table(rows: dict[str, Tally], title: str, columns: list[Column]) -> NumbersTable:
    table = new_table(title, *(name for name, _ in columns))
    for name, tally in rows.items():
        if name == "all" and len(rows) > 1:
            table.add_section()
        table.add_row(Text(name, "bold" if name == "all" else ""), *(cell(tally) for _, cell in columns))
    return table


def spark(tally: Tally, ascii_only: bool, width: int = SPARK_WIDTH) -> Text:
    """A histogram over -1 to 1 in one row of characters, in the colours of the bands, closed at both ends."""
    edges, parts = tally.histogram_by_status(width)
    counts = np.sum(list(parts.values()), axis=0)
    text = Text("|" if ascii_only else "▕", "dim", no_wrap=True)
    for at, character in enumerate(style.spark(counts.tolist(), ascii_only=ascii_only)):
        most = max(parts, key=lambda name, at=at: int(parts[name][at]))  # type: ignore[misc]
        own = band_of(float(edges[at]), tally.scale.acceptable[0]).style if most == "valid" else style.STYLES[most]
        text.append(character, own + " not dim not bold")
    return text.append("|" if ascii_only else "▏")


def bars(report: FileReport, bins: int, options: ConsoleOptions) -> Iterator[RenderableType]:
    """The histogram of all cells, a bar a bin, from the lowest bin that holds a cell: in each first those that are not
    valid, whatever their value, and below it which they are."""
    summary, tally = report.summary, report.summary.all
    edges, parts = tally.histogram_by_status(bins)
    counts = np.sum(list(parts.values()), axis=0)
    first = int(np.flatnonzero(counts)[0])
    digits = max(len(f"{e:.4f}".rstrip("0").split(".")[1]) for e in edges.tolist())
    digits = max(digits, 1)
    top = int(counts.max())
    poor = tally.scale.acceptable[0]
    names = _bin_names(edges, parts, first, poor)
    label, number = 2 * digits + 8, max(len(style.number(top)), 5)
    room = options.max_width - label - number - 14 - max(name.cell_len for name in names)
    width = min(max(room, 10), BAR_WIDTH)
    dash = "..." if options.ascii_only else "…"
    negative = "concave or inverted" if tally.statuses.get("concave") else "inverted"
    yield _title(f"quality of all cells (J_ENS: 1 is ideal, below {summary.poor_below.text} poor, below 0 {negative})")
    table = Table.grid(padding=(0, 1))
    for justify in ("right", "center", "right", "left", "right", "right", "left"):
        table.add_column(justify=justify, no_wrap=True)
    for at, name in zip(range(first, bins), names, strict=True):
        low, high, n = float(edges[at]), float(edges[at + 1]), int(counts[at])
        shares = {what: int(of_what[at]) for what, of_what in parts.items()}
        table.add_row(
            Text(f"{low:.{digits}f}", "dim"),
            Text(dash, "dim"),
            Text(f"{high:.{digits}f}", "dim"),
            _stacked(shares, top, width, band_of(low, poor).style, ascii_only=options.ascii_only),
            style.number(n),
            Text(style.percent(n, tally.n_measured) if n else "", "dim"),
            name,
        )
    yield Padding(with_widths(table), (0, 0, 0, 1), expand=False)
    for finding in report.findings:
        if finding.status in UNLIKE_THEIR_VALUE:
            count = style.plural(finding.n_cells, f"{finding.status} cell")
            verb = "is" if finding.n_cells == 1 else "are"
            yield Text(
                f" {count} {verb} among these: {UNLIKE_THEIR_VALUE[finding.status]}", STATUS_STYLES[finding.status]
            )
    yield Text()


def _stacked(shares: dict[str, int], top: int, width: int, of_valid: str, *, ascii_only: bool) -> Text:
    """A bar, in the colours of what its cells count as, worst first; those that there are have a character at least."""
    n = sum(shares.values())
    whole = style.bar(n, top, width, ascii_only=ascii_only)
    text = Text(whole.ljust(width), of_valid)
    start = 0
    for name, some in shares.items():
        if name != "valid" and some:
            end = min(max(round(len(whole) * some / n), 1) + start, len(whole))
            text.stylize(style.STYLES[name], start, end)
            start = end
    return text


def _bin_names(edges: NDArray[np.float64], parts: dict[str, NDArray[np.int64]], first: int, poor: float) -> list[Text]:
    """What the cells of each bin are: the band where one begins, and what their value does not say."""
    names, named = [], ""
    for at in range(first, len(edges) - 1):
        band = band_of(float(edges[at]), poor)
        shown = []
        if band.name != named and (band.start < 0 or parts["valid"][at] or not any(n[at] for n in parts.values())):
            is_usable = band.start < 0 and parts["valid"][at]  # only concave cells are, of a mesh for finite volumes
            shown, named = [Text("concave" if is_usable else band.name, band.style)], band.name
        for name, of_name in parts.items():
            if name != "valid" and of_name[at] and not (name == "invalid" and band.start < 0):
                shown.append(Text(f"{style.number(int(of_name[at]))} {name}", style.STYLES[name]))
        names.append(Text(", ").join(shown))
    return names


def findings(report: FileReport) -> Iterator[RenderableType]:
    """Cells that are not ok, by status: how many, what that means, the first of them and where it is."""
    yield _title("cells that are not ok")
    table = Table.grid(padding=(0, 2))
    for justify in ("right", "left", "left"):
        table.add_column(justify=justify, no_wrap=justify == "right")
    for finding in report.findings:
        first = listed("cell", finding.cells, finding.labels, more=finding.n_cells > len(finding.cells))
        x, y, z = style.coordinates(finding.location, finding.spacing, digits=4)
        table.add_row(
            style.number(finding.n_cells),
            Text(finding.status, STATUS_STYLES[finding.status]),
            Text(f"{first}; the first at ({x}, {y}, {z}): {finding.text}", overflow="fold"),
        )
    yield Padding(table, (0, 0, 1, 1), expand=False)


def worst_cells(report: FileReport, console: Console, options: ConsoleOptions) -> Iterator[RenderableType]:
    """The worst cells, each with the node and the point at which it is worst; fewer digits where there is no room."""
    yield _title(f"worst {style.plural(len(report.worst), 'cell')}, each with its worst node")
    tables = (_worst(report, digits, with_node_quality=digits == 6) for digits in (6, 5, 4))
    fitting = (table for table in tables if fits(table, console, options))
    yield next(fitting, _worst(report, 6, with_node_quality=False))


def _worst(report: FileReport, digits: int, *, with_node_quality: bool) -> NumbersTable:
    names = ["cell", "type", "quality", "node", *(["at node"] if with_node_quality else []), "point", "x", "y", "z"]
    with_region = bool(report.worst_regions)
    with_status = any(cell.status not in ("ok", "inverted") for cell in report.worst)
    names[3:3] = ["status"] if with_status else []
    table = new_table(*names, *(["region"] if with_region else []))
    table.columns[1].justify = "left"
    for at, cell in enumerate(report.worst):
        limit = limit_of(report.summary.poor_below, cell.type)
        table.add_row(
            cell_entry(cell.cell, cell.cell_label),
            cell.type,
            quality_text(cell.quality, limit) if cell.status == "ok" else _by_status(cell, style.quality(cell.quality)),
            *([_by_status(cell, cell.status)] if with_status else []),
            str(cell.node),
            *([quality_text(cell.node_quality, limit)] if with_node_quality else []),
            point_entry(cell.point, cell.point_label),
            *style.coordinates(cell.coordinates, cell.spacing, digits=digits),
            *([Text(report.worst_regions[at])] if with_region else []),
        )
    return table


def _by_status(cell: WorstCell, text: str) -> Text:
    """In the colour of a cell's status, which goes before that of its value."""
    return Text(text, STATUS_STYLES.get(cell.status, ""))


def other_metric(summary: Summary) -> Iterator[RenderableType]:
    """Another metric by type: both ends of its values, because lower may be better."""
    low, high = (f"{end:.4g}" for end in summary.scale.acceptable)
    yield _title(f"{summary.metric} (usually acceptable: {low} to {high})")
    table = new_table("cells", "measured", "acceptable", "min", "1 %", "median", "mean", "99 %", "max")
    rows = {name: tally for name, tally in summary.types.items() if tally.n_measured}
    if len(rows) > 1:
        rows["all"] = summary.all
    for name, tally in rows.items():
        at = tally.quantiles()
        numbers = (tally.min, at[0.01], at[0.5], tally.mean, at[0.99], tally.max)
        share = style.percent(tally.n_good, tally.n_measured)
        table.add_row(name, style.number(tally.n_measured), share, *map(style.quality, numbers))
    yield table if rows else Text("  no cell has a value\n", "dim")


def finite_volume_text(measures: tuple[FiniteVolumeMeasure, ...]) -> Iterator[RenderableType]:
    """A table of the measures, then the worst faces of those beyond their limits."""
    yield _title("for finite volumes")
    table = new_table("measure", "limit", "worst", "mean", "beyond", "of", "worst at")
    for one in measures:
        bad = "bold red" if one.n_beyond else ""
        table.add_row(
            one.name,
            one.limit,
            Text(style.quality(one.worst), bad),
            style.quality(one.mean),
            Text(style.number(one.n_beyond), bad or "dim"),
            f"{style.number(one.n)} {one.of}",
            place(one),
        )
    yield table
    beyond = worst_faces(measures)
    if beyond:
        yield _title("the worst faces beyond their limits")
        faces = new_table("measure", "value", "face of", "x", "y", "z")
        for face in beyond:
            at = (f"{value:.6g}" for value in face.centre)
            faces.add_row(face.measure, style.quality(face.value), face_text(face), *at)
        yield faces


def remarks(report: FileReport) -> Iterator[RenderableType]:
    """What was not measured, what was measured only in part, how exact the numbers are, and what the reader noticed."""
    summary = report.summary
    lines = []
    for name, reasons in summary.not_measured.items():
        for reason, n in reasons.items():
            why = "the metric is not defined for it" if reason == UNDEFINED else STATUS_TEXTS[reason]
            lines.append(f"not measured: {style.number(n)} {name} ({reason}: {why})")
    for name, n in summary.corners_only.items():
        lines.append(f"measured at the corners only, not known inside: {style.number(n)} {name}")
    resolution = summary.all.quantile_resolution
    if resolution:
        lines.append(f"quantiles are right to {resolution:g}")
    lines.extend(report.notes)
    if lines:
        yield _title("notes")
        yield Padding(_hanging("-", lines, "dim"), (0, 0, 0, 1), expand=False)


def _hanging(mark: str, lines: list[str], look: str) -> Table:
    """Paragraphs, each behind a mark; their further lines stay clear of it."""
    table = Table.grid(padding=(0, 1))
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for line in lines:
        table.add_row(Text(mark, look), Text(line, look))
    return table


def _title(text: str) -> Text:
    return Text(text, "bold")


def count(n: int, band: str) -> Text:
    """A number of cells in a band, in its colour unless it is 0."""
    return Text(style.number(n), style.STYLES[band] if n else "dim")


def quality_text(value: float, poor: float = POOR, *, can_be_bad: bool = True) -> Text:
    """A value of J_ENS, in the colour of its band unless it is good.

    Where no cell is invalid or degenerate, one of a value below 0 is poor: a concave one, for finite volumes.
    """
    bad = "bold magenta" if value == 0 else band_of(value, poor).style
    bad = bad if can_be_bad else style.STYLES["poor"]
    return Text(style.quality(value), "" if value >= poor else bad)
