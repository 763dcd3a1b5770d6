"""The cells that are not ok, by status."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..mesh.interface import is_interface
from ..mesh.labels import cell_labels
from ..status import STATUSES, Category, Status
from .flat import describe
from .worst import StatusCells, spacing

if TYPE_CHECKING:
    from .measure import Quality


def status_cells(quality: Quality, n: int) -> list[StatusCells]:
    """What `Quality.findings` is."""
    mesh, status = quality.mesh, quality.status
    findings: list[StatusCells] = []
    if not status.any():
        return findings
    interface = is_interface(mesh)
    counts = True if interface is None else ~interface
    for row in STATUSES.values():
        if row.status == Status.OK or row.category == Category.APART:
            continue
        cells = np.flatnonzero((status == row.status) & counts)
        if not len(cells):
            continue
        first = tuple(int(cell) for cell in cells[:n])
        nodes = np.asarray(mesh.points[mesh.nodes(int(cells[0]))], np.float64)
        with np.errstate(invalid="ignore", over="ignore"):
            x, y, z = nodes.mean(axis=0)
        findings.append(
            StatusCells(
                status=row.name,
                text=row.text + (describe(mesh, cells) if row.category == Category.DEGENERATE else ""),
                n_cells=len(cells),
                cells=first,
                location=(float(x), float(y), float(z)),
                labels=cell_labels(mesh, first),
                spacing=spacing(nodes),
            )
        )
    return findings
