"""A large mesh in ``meshgauge report``: what is written of it while it is measured slice by slice, and afterwards."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from . import inputs, terminal
from .batch import Batch

if TYPE_CHECKING:
    from ..report.csv import CsvWriter
    from ..report.values_on_disk import ValuesOnDisk
    from ..slices import Ask, Job, Partial
    from ..slices.partial import CellRows
    from .bad import BadCells

T = TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class Outputs:
    """What is written of a mesh beside what is measured; None: not asked for.

    Attributes
    ----------
    table
        Takes a row a cell.
    target, in_place
        Where the mesh goes with what was measured, and whether it takes the place of the input.
    bad, bad_set
        Where the bad cells go, and the mesh with them as a set.
    """

    table: CsvWriter | None
    target: Path | None
    in_place: bool
    bad: Path | None
    bad_set: Path | None

    def why_whole(self, batch: Batch, path: str) -> str:
        """Why the mesh has to be in memory for them; empty if not."""
        if self.target is None and self.bad_set is None:
            return ""
        from ..io.conversion import writes_pieces
        from ..io.sets import takes_set

        file_format = batch.reading.file_format
        if self.target is not None and not (_adds_rows(batch, path, self.target) or writes_pieces(self.target)):
            return f"{self.target} is written at once: only VTKHDF and VTU are written slice by slice"
        if self.bad_set is not None and not (_is_file(path) and takes_set(path, self.bad_set, file_format=file_format)):
            return f"{self.bad_set} holds the whole mesh, and is written at once"
        return ""

    def measured(
        self, batch: Batch, path: str, ask: Ask, finish: Callable[[Job, Partial], T]
    ) -> tuple[T, list[str]] | None:
        """What `finish` makes of what is asked of a mesh, measured slice by slice, with all outputs written, and a line
        on each of bad cells. None if it is small, or has to be read whole after all: then nothing is written.

        The input is replaced last: what is read of it before is what was measured."""
        takers: list[Callable[[int, CellRows], object]] = []
        mark = 0
        if self.table is not None:
            table, mark = self.table, self.table.mark()
            takers.append(lambda first, rows: table.add(
                path, rows.types, rows.status, rows.values, rows.labels, first=first
            ))  # fmt: skip
        bad, as_mesh = self._bad(batch)
        with contextlib.ExitStack() as stack:
            values: ValuesOnDisk | None = None
            beside = self.target or as_mesh
            if beside is not None and (listed := batch.pieces(path)) is not None:
                from ..report.values_on_disk import ValuesOnDisk

                values = stack.enter_context(ValuesOnDisk(beside, listed.n_cells, listed.n_points))
                takers.append(values.take)
            if bad is not None:
                takers.append(bad.take)
            by_region = ask.by_region or (self.bad is not None and self.bad.suffix.lower() == ".csv")
            ask = replace(ask, keeps_rows=bool(takers), keeps_points=values is not None, by_region=by_region)
            done = batch.in_slices(path, ask, lambda first, rows: [take(first, rows) for take in takers])
            if done is None or not self._written(batch, path, done[0], values, stack):
                if self.table is not None:
                    self.table.back_to(mark)
                return None
            lines = []
            if bad is not None and self.bad is not None:
                lines.append(bad.write(self.bad, done[0], values))
            if bad is not None and self.bad_set is not None:
                lines.append(self._set(batch, done[0], bad))
            return finish(*done), lines

    def _bad(self, batch: Batch) -> tuple[BadCells | None, Path | None]:
        """What keeps the bad cells, if they are written, and the file of them if that is a mesh."""
        if self.bad is None and self.bad_set is None:
            return None, None
        from ..report.bad_cells import is_list
        from .bad import BadCells

        as_mesh = self.bad if self.bad is not None and not is_list(self.bad) else None
        return BadCells(batch, keeps_values=as_mesh is not None), as_mesh

    def _written(
        self, batch: Batch, path: str, job: Job, values: ValuesOnDisk | None, until: contextlib.ExitStack
    ) -> bool:
        """Whether the mesh was written with what was measured, if that was asked for; in place it is there when
        ``until`` is closed."""
        if self.target is None:
            return True
        from ..io.adding import CannotAdd, add_to_pieces
        from ..io.conversion import write_pieces

        assert values is not None  # for this
        adds = _adds_rows(batch, path, self.target)
        try:
            with batch.progress(f"writing {self.target}"):
                if adds:
                    add_to_pieces(
                        job.pieces,
                        self.target,
                        cells=values.cells(),
                        points=values.points(),
                        overwrite=self.in_place,
                        file_format=batch.reading.file_format,
                        step=batch.step,
                        until=until if self.in_place else None,
                    )
                else:
                    facts = job.facts
                    write_pieces(
                        job.pieces,
                        self.target,
                        cells=values.cells(),
                        points=values.points(),
                        with_labels=(facts.cell_labels == "stored", facts.point_labels == "stored"),
                        turned=bool(facts.decision.turn),
                    )
        except CannotAdd as reason:
            how = "added in slices to" if adds else "written in slices of"
            terminal.warn("note", f"{self.target}: is read whole: nothing is {how} a file that {reason}")
            return False
        return True

    def _set(self, batch: Batch, job: Job, bad: BadCells) -> str:
        import numpy as np

        from ..io.sets import add_set_to_pieces
        from ..report.bad_cells import SET
        from .bad import line

        assert self.bad_set is not None
        cells = np.concatenate(bad.ids)
        if len(cells):
            with batch.progress(f"writing {self.bad_set}"):
                add_set_to_pieces(
                    job.pieces, self.bad_set, cells, SET, file_format=batch.reading.file_format, step=batch.step
                )
        return line(self.bad_set, len(cells), is_written=len(cells) > 0, where=f" in the set {SET}")


def _is_file(path: str) -> bool:
    """Whether it is one file, and not a step of one or several that are joined."""
    return not isinstance(path, inputs.State | inputs.Joined)


def _adds_rows(batch: Batch, path: str, target: Path) -> bool:
    """Whether values are added to a copy of the file."""
    from ..io.adding import takes_rows

    return _is_file(path) and takes_rows(path, target, file_format=batch.reading.file_format)
