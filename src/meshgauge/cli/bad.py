"""``meshgauge report --bad`` and ``--bad-set``: the bad cells apart, or as a set of the mesh."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..look.style import number_of
from ..quality.measure import Quality
from ..report.bad_cells import SET, is_bad, is_list, write_list
from . import terminal
from .batch import Batch


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


def _line(path: Path, n: int, *, is_written: bool, where: str = "") -> str:
    return f"{path}: {number_of(n, 'bad cell', 'bad cells')}{where if is_written else ': no mesh is written'}"


def _note(path: Path, lost: Sequence[str]) -> None:
    for one in lost:
        terminal.warn("note", f"{path}: {one}")
