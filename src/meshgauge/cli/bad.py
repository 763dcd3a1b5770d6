"""``meshgauge report --bad`` and ``--bad-set``: the bad cells apart, or as a set of the mesh."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..look.style import number_of
from ..quality.measure import Quality
from ..report.bad_cells import SET, Listed, among, is_bad, is_list, write_list, write_numbers, write_table
from . import terminal
from .batch import Batch

if TYPE_CHECKING:
    from ..report.values_on_disk import ValuesOnDisk
    from ..slices import Job
    from ..slices.partial import CellRows


def write(batch: Batch, quality: Quality, bad: Path | None, bad_set: Path | None) -> list[str]:
    """Write the cells that are not valid, or poor, see `report.bad_cells`; a line for each output. A mesh of none is
    not written, nor is an empty set: nobody could check it."""
    lines = []
    if bad is not None:
        if is_list(bad):
            lines.append(line(bad, write_list(bad, quality), is_written=True))
        else:
            cells = quality.with_data()[is_bad(quality)]
            if cells.n_cells:
                batch.write(bad, cells)
            lines.append(line(bad, cells.n_cells, is_written=cells.n_cells > 0))
    if bad_set is not None:
        chosen = np.flatnonzero(is_bad(quality))
        if len(chosen):
            with batch.progress(f"writing {bad_set}"):
                _note(bad_set, batch.write_set(quality.source, bad_set, chosen, SET))
        lines.append(line(bad_set, len(chosen), is_written=len(chosen) > 0, where=f" in the set {SET}"))
    return lines


class BadCells:
    """The bad cells of a mesh that passes by slice by slice; ``keeps_values``: with what was measured on them."""

    def __init__(self, batch: Batch, *, keeps_values: bool) -> None:
        self.batch, self.keeps_values = batch, keeps_values
        self.ids, self.labels = [np.empty(0, np.int64)], [np.empty(0, np.int64)]
        self.rows: dict[str, list[NDArray[Any]]] = {}

    def take(self, first: int, own: CellRows) -> None:
        """Those among the cells from ``first`` on."""
        purpose = "fem" if self.batch.purpose is None else self.batch.purpose.of_mesh
        which = among(own.types, own.status, own.values["jens"], self.batch.poor, purpose)
        self.ids.append(np.flatnonzero(which) + first)
        self.labels.append(own.labels[which] if own.labels is not None else self.ids[-1])
        measured: dict[str, NDArray[Any]] = {**own.values, "status": own.status} if self.keeps_values else {}
        for name, values in measured.items():
            self.rows.setdefault(name, []).append(values[which])

    def write(self, bad: Path, job: Job, values_of_points: ValuesOnDisk | None) -> str:
        """Write them, and return a line on that; of a mesh with the values of its points."""
        from ..slices.some_cells import gathered, some_cells
        from ..slices.some_cells import measured as measured_again

        cells, facts = np.concatenate(self.ids), job.facts
        if bad.suffix.lower() == ".csv":
            quality, points = measured_again(job, cells)
            ids = facts.regions.ids_of_cells(cells, quality.mesh.cell_data)
            write_table(bad, Listed(quality, ids, facts.regions.names, cells, points), cells)
        elif is_list(bad):
            write_numbers(bad, cells, np.concatenate(self.labels) if facts.cell_labels != "none" else None)
        elif len(cells):
            assert values_of_points is not None
            with self.batch.progress(f"writing {bad}"):
                mesh, points = some_cells(job.pieces, facts, cells, job.purpose)
                of_points = {name: gathered([one], [0], points) for name, one in values_of_points.points().items()}
                of_cells = {name: np.concatenate(parts) for name, parts in self.rows.items()}
                job.pieces.check_unchanged()
            self.batch.write(
                bad,
                mesh.replace(cell_data={**mesh.cell_data, **of_cells}, point_data={**mesh.point_data, **of_points}),
            )
        return line(bad, len(cells), is_written=is_list(bad) or len(cells) > 0)


def line(path: Path, n: int, *, is_written: bool, where: str = "") -> str:
    """What became of an output; that nothing was written is a note, also where nothing else is said."""
    if not is_written:
        terminal.warn("note", f"{path}: there are no bad cells: nothing is written")
        return ""
    return f"{path}: {number_of(n, 'bad cell', 'bad cells')}{where}"


def _note(path: Path, lost: Sequence[str]) -> None:
    for one in lost:
        terminal.warn("note", f"{path}: {one}")
