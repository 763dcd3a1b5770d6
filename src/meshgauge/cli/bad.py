"""``meshgauge report --bad`` and ``--bad-set``: the bad cells apart, or as a set of the mesh."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..look.style import number_of
from ..quality.measure import Quality
from ..report.bad_cells import SET, among, is_bad, is_list, write_list, write_numbers
from . import terminal
from .batch import Batch

if TYPE_CHECKING:
    from ..slices import Ask, Job, Partial
    from ..slices.partial import CellRows


def write(batch: Batch, quality: Quality, bad: Path | None, bad_set: Path | None) -> list[str]:
    """Write the cells that are not valid, or poor, see `report.bad_cells`; a line for each output. A mesh of none is
    not written, nor is an empty set: nobody could check it."""
    lines = []
    if bad is not None:
        if is_list(bad):
            lines.append(_line(bad, write_list(bad, quality), is_written=True))
        else:
            cells = quality.with_data()[is_bad(quality)]
            if cells.n_cells:
                batch.write(bad, cells)
            lines.append(_line(bad, cells.n_cells, is_written=cells.n_cells > 0))
    if bad_set is not None:
        chosen = np.flatnonzero(is_bad(quality))
        if len(chosen):
            with batch.progress(f"writing {bad_set}"):
                _note(bad_set, batch.write_set(quality.source, bad_set, chosen, SET))
        lines.append(_line(bad_set, len(chosen), is_written=len(chosen) > 0, where=f" in the set {SET}"))
    return lines


def write_in_slices(batch: Batch, path: str, ask: Ask, bad: Path) -> tuple[tuple[Job, Partial], list[str]] | None:
    """Measure a mesh slice by slice and write its bad cells, see `Batch.in_slices`; with a line on the output. None if
    that cannot be: a table, and cells beside others, ask for the mesh as a whole."""
    from ..report.values_on_disk import ValuesOnDisk
    from ..slices.some_cells import gathered, some_cells

    listed = batch.pieces(path)
    if listed is None or bad.suffix.lower() == ".csv":
        return None
    as_list = is_list(bad)
    purpose = "fem" if batch.purpose is None else batch.purpose.of_mesh
    ids, labels = [np.empty(0, np.int64)], [np.empty(0, np.int64)]
    rows: dict[str, list[NDArray[Any]]] = {}

    def take(first: int, own: CellRows) -> None:
        which = among(own.types, own.status, own.values["jens"], batch.poor, purpose)
        ids.append(np.flatnonzero(which) + first)
        labels.append(own.labels[which] if own.labels is not None else ids[-1])
        measured: dict[str, NDArray[Any]] = {**own.values, "status": own.status}
        for name, values in measured.items():
            rows.setdefault(name, []).append(values[which])
        if values_of_points is not None:
            values_of_points.take(first, own)

    asked = replace(ask, keeps_rows=True, keeps_points=not as_list)
    with contextlib.ExitStack() as stack:
        values_of_points = None
        if not as_list:
            values_of_points = stack.enter_context(ValuesOnDisk(bad, listed.n_cells, listed.n_points))
        done = batch.in_slices(path, asked, take)
        if done is None:
            return None
        job, cells = done[0], np.concatenate(ids)
        if as_list:
            has_labels = job.facts.cell_labels != "none"
            write_numbers(bad, cells, np.concatenate(labels) if has_labels else None)
        elif len(cells):
            assert values_of_points is not None
            with batch.progress(f"writing {bad}"):
                mesh, points = some_cells(job.pieces, job.facts, cells, job.purpose)
                of_points = {name: gathered([one], [0], points) for name, one in values_of_points.points().items()}
                of_cells = {name: np.concatenate(parts) for name, parts in rows.items()}
                job.pieces.check_unchanged()
            batch.write(
                bad,
                mesh.replace(cell_data={**mesh.cell_data, **of_cells}, point_data={**mesh.point_data, **of_points}),
            )
    return done, [_line(bad, len(cells), is_written=as_list or len(cells) > 0)]


def _line(path: Path, n: int, *, is_written: bool, where: str = "") -> str:
    return f"{path}: {number_of(n, 'bad cell', 'bad cells')}{where if is_written else ': no mesh is written'}"


def _note(path: Path, lost: Sequence[str]) -> None:
    for one in lost:
        terminal.warn("note", f"{path}: {one}")
