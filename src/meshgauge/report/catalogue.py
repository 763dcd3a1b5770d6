"""The metrics for people: a table of their rows, with the references below."""

from __future__ import annotations

import json
from collections.abc import Sequence
from math import isfinite

from rich.console import Console, ConsoleOptions, RenderResult
from rich.table import Table
from rich.text import Text

from ..quality.metrics import Metric
from .tables import new_table


class MetricsText:
    """One line a metric, or everything about each."""

    def __init__(self, rows: Sequence[Metric], *, in_full: bool) -> None:
        self.rows = rows
        self.in_full = in_full

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        if self.in_full:
            for row in self.rows:
                yield from _details(row)
            return
        references = list(dict.fromkeys(row.reference for row in self.rows))
        table = new_table("metric", "range", "acceptable", "ideal", "better", "source")
        table.columns[0].no_wrap = True
        table.add_column("cells", overflow="fold")
        for row in self.rows:
            table.add_row(
                Text(row.name, "bold"),
                _interval(row.range),
                _interval(row.acceptable),
                f"{row.ideal:.4g}",
                row.better,
                f"[{references.index(row.reference) + 1}]",
                row.cell_types,
            )
        yield table
        sources = Table.grid(padding=(0, 1))
        for at, reference in enumerate(references, 1):
            sources.add_row(f"[{at}]", Text(reference, overflow="fold"))
        yield sources
        yield Text("\nRanges may differ by cell type; 'meshgauge metrics NAME' says everything about a metric.", "dim")


def metrics_json(rows: Sequence[Metric]) -> str:
    """The rows for programs; an end of a range that is infinite is null."""

    def ends(interval: tuple[float, float]) -> list[float | None]:
        return [end if isfinite(end) else None for end in interval]

    listed = [
        {
            "name": row.name,
            "title": row.title,
            "text": row.text,
            "range": ends(row.range),
            "better": row.better,
            "is_signed": row.is_signed,
            "unit": row.unit,
            "where": list(row.where),
            "polyhedra": row.polyhedra is not None or row.of_faces is not None,
            "shapes": {
                name: {"ideal": row.standard(name).ideal, "acceptable": ends(row.standard(name).acceptable)}
                for name in row.known_shapes
            },
            "source": row.source,
            "reference": row.reference,
        }
        for row in rows
    ]
    return json.dumps({"schema": "meshgauge-metrics", "version": 1, "metrics": listed}, indent=2, allow_nan=False)


def _details(row: Metric) -> RenderResult:
    yield Text(f"{row.name}", "bold").append(f"  {row.title}", "not bold")
    table = Table.grid(padding=(0, 2))
    table.add_column(style="dim", no_wrap=True)
    table.add_column(overflow="fold")
    table.add_row("  meaning", Text(row.text))
    table.add_row("  range", f"{_interval(row.range)}, {row.better} is better, unit {row.unit}")
    for shape in row.known_shapes:
        standard = row.standard(shape)
        table.add_row(f"  {shape}", f"ideal {standard.ideal:.6g}, acceptable {_interval(standard.acceptable)}")
    table.add_row("  of each", " and ".join(row.where))
    for phrase in row.masked:
        table.add_row("  undefined for", Text(phrase))
    table.add_row("  source", Text(f"{row.source}; {row.reference}"))
    yield table
    yield Text()


def _interval(ends: tuple[float, float]) -> str:
    return f"{ends[0]:.4g} to {ends[1]:.4g}"
