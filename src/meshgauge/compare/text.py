"""A comparison for people: each type on one axis, which mesh is better in what, and cell by cell where that goes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from ..errors import FailedFile
from ..look import style
from ..look.names import cell_entry, point_entry
from ..quality.summary import CRITERIA, Tally
from ..report.tables import NumbersTable, new_table
from ..report.text import fits, quality_text, spark
from . import Against, Comparison, Loss, PairCounts, PairedCells, Row, sentences
from .comparison import ALL

WIDTHS = (40, 20)
"""Characters of the small histograms, the first that fits: -1 to 1, so that 0 and `POOR` fall between two."""

COUNTS = ("n_measured", "n_invalid", "n_degenerate", "share_not_good")
VALUES = ("min", "quantile_0.01", "quantile_0.5", "mean")
HEADS = {
    "n_measured": "measured",
    "n_invalid": "invalid",
    "n_degenerate": "degenerate",
    "share_not_good": "not good",
    "min": "min",
    "quantile_0.01": "1 %",
    "quantile_0.5": "median",
    "mean": "mean",
}


class ComparisonText:
    """The whole comparison."""

    def __init__(self, comparison: Comparison, failures: Sequence[FailedFile] = ()) -> None:
        self.comparison = comparison
        self.failures = failures

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        comparison = self.comparison
        yield Text(f"{len(comparison.sides):,} meshes compared", "bold")
        yield from _sides(comparison)
        yield from _distributions(comparison, _by_type(comparison), console, options)
        text = sentences.which_is_better(comparison)
        if text:
            yield Text(text, overflow="fold")
        if comparison.regions:
            yield from _distributions(comparison, _by_region(comparison), console, options, title="region")
        for note in comparison.notes:
            yield Text(note, "yellow", overflow="fold")
        for one in comparison.against:
            yield from _against(comparison, one, console, options)
        if any(one.superiority for one in comparison.against):
            yield Text(sentences.CAUTION, "dim", overflow="fold")
        for failure in self.failures:
            yield Text(
                f"not compared: {style.printable(failure.path)}: {style.printable(failure.reason)}",
                "bold red",
                overflow="fold",
            )


def _sides(comparison: Comparison) -> Iterator[RenderableType]:
    table = Table.grid(padding=(0, 2))
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for _ in range(2):
        table.add_column(justify="right", no_wrap=True)
    for letter, side in zip(sentences.letters(comparison), comparison.sides, strict=True):
        cells, points = style.plural(side.n_cells, "cell"), style.plural(side.n_points, "point")
        table.add_row(Text(letter, "bold"), Text(side.name), Text(cells, "dim"), Text(points, "dim"))
    yield Padding(table, (0, 0, 0, 1), expand=False)


class _Group(NamedTuple):
    """Some cells: their name, the rows of the comparison, and the tally of each mesh."""

    name: str
    rows: tuple[Row, ...]
    tallies: list[Tally | None]


def _by_type(comparison: Comparison) -> list[_Group]:
    return [
        _Group(cells, rows, [side.tally(cells) for side in comparison.sides]) for cells, rows in comparison.rows.items()
    ]


def _by_region(comparison: Comparison) -> list[_Group]:
    return [
        _Group(region, rows, [side.region(region) for side in comparison.sides])
        for region, rows in comparison.regions.items()
    ]


def _distributions(
    comparison: Comparison,
    groups: Sequence[_Group],
    console: Console,
    options: ConsoleOptions,
    title: str = "cells",
) -> Iterator[RenderableType]:
    """One table where it fits, else two: counts, and values beside their distribution."""
    letters = sentences.letters(comparison)
    tables = (_table(letters, groups, title, (*COUNTS, *VALUES), width, options.ascii_only) for width in WIDTHS)
    fitting = next((table for table in tables if fits(table, console, options)), None)
    if fitting is not None:
        yield fitting
        return
    yield _table(letters, groups, title, COUNTS, 0, options.ascii_only)
    yield _table(letters, groups, title, VALUES, WIDTHS[-1], options.ascii_only)


def _table(
    letters: Sequence[str], groups: Sequence[_Group], title: str, keys: Sequence[str], width: int, ascii_only: bool
) -> NumbersTable:
    """A line for each mesh, group by group; with distributions if they have a width."""
    half = width // 2 - 1
    axis = [f"-1{' ' * (half - 1)}0{' ' * half}1"] if width else []
    table = new_table(title, "mesh", *(HEADS[key] for key in keys), *axis)
    table.columns[1].justify = "left"
    for group in groups:
        by_key = {row.criterion: row for row in group.rows}
        if group.name == ALL and len(groups) > 1:
            table.add_section()
        name = Text(group.name, "bold" if group.name == ALL else "")
        for at, (letter, tally) in enumerate(zip(letters, group.tallies, strict=True)):
            if tally is None:
                continue
            numbers: list[RenderableType] = [
                style.number(tally.n_measured) if key == "n_measured" else _value(by_key[key], at) for key in keys
            ]
            table.add_row(name, letter, *numbers, *([spark(tally, ascii_only, width)] if width else []))
            name = Text()
    return table


def _value(row: Row, at: int) -> Text:
    """A value, in bold and underlined where it is better than another."""
    value = row.values[at]
    assert value is not None
    kind = CRITERIA[row.criterion].kind
    n_there = sum(v is not None for v in row.values)
    is_best = at in row.best and len(row.best) < n_there
    if kind == "count":
        text, look = style.number(int(value)), "bold red" if value else "dim"
    elif kind == "share":
        text, look = f"{100 * value:.3g} %" if value else "0 %", "yellow" if value else "dim"
    else:
        shown = quality_text(value)
        text, look = shown.plain, str(shown.style)
    # Appended, so that the padding of the column is not underlined.
    return Text().append(text, "bold underline" if is_best else look)


def _against(
    comparison: Comparison, one: Against, console: Console, options: ConsoleOptions
) -> Iterator[RenderableType]:
    called = sentences.names(comparison)
    yield Text()
    yield Text(f"{called[one.position]} against {called[0]}", "bold")
    for text in (sentences.at_random(comparison, one), sentences.of_the_worst(comparison, one)):
        if text:
            yield Padding(Text(text, overflow="fold"), (0, 0, 0, 1), expand=False)
    if len(one.superiority) > 1:
        table = new_table("cells", "better", "worse", "equal", "")
        table.columns[-1].justify = "left"
        for cells, draws in one.superiority.items():
            if cells != ALL:
                table.add_row(
                    cells, *(f"{100 * s:.1f} %" for s in (draws.better, draws.worse, draws.equal)), draws.words
                )
        yield table
    if one.paired is None:
        yield Padding(Text(f"Not compared cell by cell: {one.why_not}.", "dim"), (0, 0, 0, 1), expand=False)
        return
    yield from _pairs(one.paired, console, options)


def _pairs(paired: PairedCells, console: Console, options: ConsoleOptions) -> Iterator[RenderableType]:
    text = sentences.cell_by_cell(paired.all)
    if paired.n_moved:
        text += f" {style.plural(paired.n_moved, 'point')} moved, at most by {paired.largest_move:.4g}."
    yield Padding(Text(text, overflow="fold"), (0, 0, 0, 1), expand=False)
    heads = ("better", "worse", "equal", "repaired", "broken", "change 5 %", "median", "95 %")
    table = new_table("cells", *heads)
    for name, counts in (*(paired.types.items() if len(paired.types) > 1 else ()), (ALL, paired.all)):
        if name == ALL and len(paired.types) > 1:
            table.add_section()
        table.add_row(name, *_count_columns(counts), *(_change(change) for change in counts.changes))
    yield table
    if paired.losses:
        yield Text(f"largest {'loss' if len(paired.losses) == 1 else 'losses'}", "bold")
        tables = [_losses(paired.losses, digits) for digits in (6, 5, 4)]
        yield next((table for table in tables if fits(table, console, options)), tables[-1])


def _count_columns(counts: PairCounts) -> Iterator[Text]:
    for n, look in (
        (counts.n_better, "green"),
        (counts.n_worse, "yellow"),
        (counts.n_equal, ""),
        (counts.n_repaired, "green"),
        (counts.n_broken, "bold red"),
    ):
        yield Text(style.number(n), look if n else "dim")


def _change(change: float) -> Text:
    if math.isnan(change):
        return Text("-", "dim")
    return Text(f"{change:+.3f}" if abs(change) >= 5e-4 else "0", "dim" if abs(change) < 5e-4 else "")


def _losses(losses: Sequence[Loss], digits: int) -> NumbersTable:
    table = new_table("cell", "type", "before", "after", "status", "node", "point", "x", "y", "z")
    for column in (1, 4):
        table.columns[column].justify = "left"
    for loss in losses:
        table.add_row(
            cell_entry(loss.cell, loss.cell_label),
            loss.type,
            quality_text(loss.before),
            quality_text(loss.after),
            loss.status_after,
            str(loss.node),
            point_entry(loss.point, loss.point_label),
            *style.coordinates(loss.coordinates, loss.spacing, digits=digits),
        )
    return table
