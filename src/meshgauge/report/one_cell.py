"""The report on one cell: as text, and as JSON (docs/json-schema.md)."""

from __future__ import annotations

import json
from collections.abc import Sequence

from rich.console import Console, ConsoleOptions, RenderResult
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from .._version import __version__
from ..look import style
from ..look.names import cell_name, point_entry
from ..quality.one_cell import OneCell
from .json import finite
from .tables import new_table
from .text import STATUS_STYLES, quality_text

SCHEMA, VERSION = "meshgauge-cell", 1


class OneCellText:
    """Names, status, region, metrics, and a row for each node; the worst is marked."""

    def __init__(self, path: str, one: OneCell, *, notes: Sequence[str] = ()) -> None:
        self.path = path
        self.one = one
        self.notes = notes

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        one = self.one
        yield Text(self.path, "bold", overflow="fold")
        facts = Table.grid(padding=(0, 2))
        facts.add_column(style="dim", no_wrap=True)
        facts.add_column(overflow="fold")
        facts.add_row("cell", Text(f"{one.type} {cell_name(one.cell, one.cell_label)}", "bold"))
        facts.add_row("status", Text(one.status, STATUS_STYLES.get(one.status, "")).append(f"  {one.text}", "dim"))
        if one.region is not None:
            facts.add_row("region", Text(one.region))
        for name, value in one.metrics.items():
            facts.add_row(name, quality_text(value) if name == "jens" else style.quality(value))
        yield Padding(facts, (0, 0, 0, 1), expand=False)
        table = new_table("node", "point", "J_ENS", "x", "y", "z", "")
        table.columns[0].justify = "right"
        for row in one.nodes:
            place = style.coordinates(row.coordinates, one.spacing)
            mark = Text("worst", "bold") if row is one.worst else Text()
            names = str(row.node), point_entry(row.point, row.point_label)
            table.add_row(*names, quality_text(row.quality), *place, mark)
        yield table
        for note in self.notes:
            yield Text(f" - {note}", "dim", overflow="fold")


def dumps(path: str, one: OneCell) -> str:
    """The same as JSON text, indented, ASCII only; numbers that are undefined or infinite are null."""
    plain = finite(
        {
            "schema": SCHEMA,
            "version": VERSION,
            "meshgauge": __version__,
            "path": path,
            "cell": one.cell,
            "cell_label": one.cell_label,
            "type": one.type,
            "status": one.status,
            "text": one.text,
            "region": one.region,
            "metrics": dict(one.metrics),
            "nodes": [
                {
                    "node": row.node,
                    "point": row.point,
                    "point_label": row.point_label,
                    "coordinates": list(row.coordinates),
                    "quality": row.quality,
                }
                for row in one.nodes
            ],
        }
    )
    return json.dumps(plain, indent=2, allow_nan=False)
