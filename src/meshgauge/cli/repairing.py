"""One mesh of ``meshgauge improve``: read, oriented if that is asked for, repaired, written."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from .. import doctor, repair
from ..files import private
from ..files.output import write_text
from ..look.style import number_of
from ..repair.acceptance import n_unusable
from ..repair.page import improve_page
from . import ahead, live, terminal
from .batch import Batch
from .changed import ChangedMesh
from .groups.improve import ConstraintOptions, Goal
from .large_repair import improve_large


@dataclass(frozen=True)
class Repaired:
    """What became of a mesh."""

    path: str
    written: str | None  #: where to; None: nowhere, for what was reached broke a claim
    report: repair.RepairReport
    n_unusable: int
    stop: live.Stop


@dataclass(frozen=True, kw_only=True)
class Repairing:
    """The options of all meshes."""

    batch: Batch
    goal: Goal
    constraints: ConstraintOptions
    orients: bool = False
    in_place: bool = False
    convert: bool = False
    all_times: bool = False
    html: Path | None = None
    undo: Path | None = None

    def repair(self, path: str, target: Path) -> Repaired:
        """Repair a mesh and write it. Raises `MeshgaugeError`; nothing is written then."""
        with live.early():
            self.batch.require_one_state(path)
        if not self.orients:
            return self._repair(path, path, target)
        with oriented(self.batch, path, target, convert=self.convert) as (source, n_renumbered):
            if n_renumbered and not self.batch.quiet:
                terminal.warn("note", f"{path}: {number_of(n_renumbered, 'cell', 'cells')} renumbered")
            return self._repair(source, path, target)

    def _repair(self, source: str, path: str, target: Path) -> Repaired:
        """The same of a file that may hold the mesh of another, oriented."""
        batch, goal, constraints = self.batch, self.goal, self.constraints
        is_plain = not (self.convert or self.orients or self.html is not None)
        if goal.is_local and constraints.is_empty and is_plain:
            done = improve_large(batch, path, target, goal, in_place=self.in_place, undo=self.undo)
            if done is not None:
                report, n_bad = done[0].report, done[0].n_unusable
                return Repaired(path, _written(target, report), report, n_bad, done[1])
        with live.early():
            before = batch.read(source)
            ahead.begin("improve", before, batch.threads)
            changed = ChangedMesh.of(
                batch,
                before,
                target,
                in_place=self.in_place,
                undo=self.undo,
                convert=self.convert,
                all_times=self.all_times,
                changes="cells" if goal.changes_cells else "points",
            )
            fixed, surface = constraints.on(before)
            if changed.is_fixed is not None:
                fixed = changed.is_fixed if fixed is None else fixed | changed.is_fixed
        with live.stoppable() as stop:
            with live.ProgressLine(shown=not batch.quiet) as progress:
                result = repair.improve(
                    before,
                    **goal.arguments(batch.poor),
                    fixed=fixed,
                    keep=constraints.keep or (),
                    surface=surface,
                    feature_angle=constraints.feature_angle,
                    tolerance=constraints.tolerance,
                    progress=progress,
                    should_stop=stop,
                    threads=batch.threads,
                    keep_bricks=batch.keep_bricks,
                    poor_below=batch.poor,
                    rounding=changed.roundings,
                )
            if result.report.outcome != "refused":
                changed.write(result.mesh)
            if self.html is not None:
                with batch.progress(f"drawing {self.html}"):
                    write_text(self.html, improve_page(result.report, result.before, result.after))
        return Repaired(path, _written(target, result.report), result.report, n_unusable(result.after), stop)


def _written(target: Path, report: repair.RepairReport) -> str | None:
    return None if report.outcome == "refused" else str(target)


@contextlib.contextmanager
def oriented(batch: Batch, path: str, target: Path, *, convert: bool = False) -> Iterator[tuple[str, int]]:
    """A file with the cells of a mesh renumbered that were numbered in reverse, and how many; the file itself if none.

    It stands beside the target, is of its format, and is gone afterwards; ``convert`` has it written anew.
    """
    as_stored = Batch(reading=batch.reading, poor_below=batch.poor, quiet=True)
    before = as_stored.read(path)
    after, changes = doctor.orient(before)
    if after is before:
        yield path, 0
        return
    with private.folder(target.absolute().parent) as folder:
        between = folder / target.name
        changed = ChangedMesh.of(
            as_stored, before, between, in_place=False, undo=None, convert=convert, changes="order"
        )
        changed.write(after)
        yield str(between), len(changes.cells)
