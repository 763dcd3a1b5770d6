"""The cells that are not ok, by status."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..mesh import Mesh
from ..mesh.interface import is_interface
from ..mesh.labels import cell_labels
from ..status import STATUSES, Category, Status, StatusRow
from .flat import Flatness
from .worst import StatusCells, spacing

if TYPE_CHECKING:
    from .measure import Quality


def status_cells(quality: Quality, n: int) -> list[StatusCells]:
    """What `Quality.findings` is."""
    mesh, status = quality.mesh, quality.status
    findings: list[StatusCells] = []
    others = np.flatnonzero(status != Status.OK)
    if not len(others):
        return findings
    interface = is_interface(mesh)
    if interface is not None:
        others = others[~interface[others]]
    codes = status[others]
    n_of = np.bincount(codes, minlength=len(Status))
    for row in STATUSES.values():
        if row.status == Status.OK or row.category == Category.APART or not n_of[row.status]:
            continue
        findings.append(_of_status(mesh, row, others[codes == row.status], n))
    return findings


def _of_status(mesh: Mesh, row: StatusRow, cells: NDArray[np.int64], n: int) -> StatusCells:
    """What there is to say of the cells of one status."""
    first = tuple(int(cell) for cell in cells[:n])
    nodes = np.asarray(mesh.points[mesh.nodes(int(cells[0]))], np.float64)
    with np.errstate(invalid="ignore", over="ignore"):
        x, y, z = nodes.mean(axis=0)
    flatness = Flatness.of(mesh, cells) if row.category == Category.DEGENERATE else None
    return StatusCells(
        status=row.name,
        text=row.text + (flatness.text if flatness is not None else ""),
        n_cells=len(cells),
        cells=first,
        location=(float(x), float(y), float(z)),
        labels=cell_labels(mesh, first),
        spacing=spacing(nodes),
        flatness=flatness,
    )


def merge_findings(one: Iterable[StatusCells], other: Iterable[StatusCells], n: int) -> tuple[StatusCells, ...]:
    """The findings on the cells of both, which are of one numbering and not the same."""
    by_name = {finding.status: finding for finding in one}
    for finding in other:
        known = by_name.get(finding.status)
        by_name[finding.status] = finding if known is None else _merged(known, finding, n)
    return tuple(by_name[row.name] for row in STATUSES.values() if row.name in by_name)


def _merged(a: StatusCells, b: StatusCells, n: int) -> StatusCells:
    first = a if a.cells < b.cells else b
    cells = tuple(sorted((*a.cells, *b.cells))[:n])
    flatness = a.flatness.merge(b.flatness) if a.flatness is not None and b.flatness is not None else None
    text = next(row.text for row in STATUSES.values() if row.name == a.status)
    return replace(
        first,
        text=text + (flatness.text if flatness is not None else ""),
        n_cells=a.n_cells + b.n_cells,
        cells=cells,
        flatness=flatness,
    )
