"""The report's Tables 1, 2 and 3: computed beside printed.

    python examples/paper_tables.py

The report (C. Lobos, Towards a unified measurement of quality for mixed-elements) prints values, but no coordinates.
``paper_shapes.json`` holds coordinates that give 97 of its 102 printed values, truncated or rounded to three decimals
(it does both). The other five can come from no coordinates; they are marked, with the reason below the table.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from math import trunc
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

import meshgauge
from meshgauge.cells import cell_type

SHAPES = Path(__file__).with_name("paper_shapes.json")


class Entry(NamedTuple):
    """One number of a table."""

    table: int
    shape: str
    row: str
    computed: float
    printed: float

    @property
    def agrees(self) -> bool:
        """True if the printed number is the computed one, truncated or rounded to three decimals."""
        printed = round(1000 * self.printed)
        # Truncation is what the report does to 0.70710...; the margin keeps 0.99999... from becoming 0.999.
        truncated = trunc(1000 * self.computed + (1e-9 if self.computed > 0 else -1e-9))
        return printed in (truncated, round(1000 * self.computed))


def values(points: Any, shape: str) -> dict[str, float]:
    """The rows of a table for one cell: extremes over its corner tetrahedra, of which a pyramid's apex has four."""
    corners = cell_type(shape).shape.triples
    scaled_jacobian = meshgauge.scaled_jacobian(points, corners, "tetra", nodes=True)[:, 0]
    # The constant k of the pyramid is that of the tetrahedron, so that one function serves both.
    jens = meshgauge.jens(points, corners, "tetra", nodes=True)[:, 0]
    found = {
        "J_S min": scaled_jacobian.min(),
        "J_S max": scaled_jacobian.max(),
        "J_ENS min": jens.min(),
        "J_ENS max": jens.max(),
    }
    if shape == "tetra":
        found["ARG_S"] = meshgauge.scaled_aspect_ratio_gamma(points, [(0, 1, 2, 3)])[0]
    return {row: float(value) for row, value in found.items()}


def entries(tables: list[dict[str, Any]]) -> Iterator[Entry]:
    """Every number of the tables."""
    for table in tables:
        for shape, cell in table["shapes"].items():
            computed = values(np.array(cell["points"], float), table["cell_type"])
            for row, printed in zip(table["rows"], cell["printed"], strict=True):
                yield Entry(table["number"], shape, row, computed[row], printed)


def main(console: Console | None = None) -> None:
    """Print the three tables, and the entries that cannot be right."""
    if console is None:
        console = Console()
        console.width = max(console.width, 108)  # narrower, the rows would wrap
    paper = json.loads(SHAPES.read_text(encoding="utf-8"))
    reasons = {(w["table"], w["shape"], w["row"]): w["reason"] for w in paper["cannot_be_right"]}
    every = list(entries(paper["tables"]))
    for table in paper["tables"]:
        title = f"Table {table['number']}: {table['title']} (computed, printed)"
        view = Table(title=title, title_justify="left", box=SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
        view.add_column("shape")
        for row in table["rows"]:
            view.add_column(row, justify="right")
        for shape in table["shapes"]:
            here = [e for e in every if (e.table, e.shape) == (table["number"], shape)]
            view.add_row(shape, *(f"{e.computed:.5f}  {e.printed:.3f}{' ' if e.agrees else '*'}" for e in here))
        console.print(view)
        for number, shape, row in reasons:
            if number == table["number"]:
                console.print(f"* {shape} {row}: {reasons[number, shape, row]}")
        console.print()
    console.print(
        f"{sum(e.agrees for e in every)} of {len(every)} printed values are the computed ones, truncated or rounded."
    )


if __name__ == "__main__":
    main()
