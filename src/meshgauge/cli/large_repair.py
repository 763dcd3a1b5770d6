"""``meshgauge improve`` on a large file: slices are measured, patches near bad cells read, and the file is copied."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ..io.moving import check_movable, move_points
from ..io.plumbing.pieces import ReadWhole
from . import ahead, inputs, live, slices, terminal
from .batch import LARGE, REFERRING, Batch, is_large
from .groups.improve import Goal

if TYPE_CHECKING:
    from ..repair.in_file import Moved


def improve_large(batch: Batch, path: str, target: Path, goal: Goal) -> tuple[Moved, live.Stop] | None:
    """Mend what is bad in a file and write the copy; with what asked to stop. None if the mesh has to be read whole.

    Raises `ReadError` and `WriteError`.
    """
    if batch.reading.displacement is not None or batch.reading.dimension.value_or_none == 2:
        return None
    if inputs.size(path) < LARGE and not path.lower().endswith(REFERRING):
        return None
    with live.early():
        listed = batch.pieces(path)
        if listed is None:
            return None
        from ..repair.in_file import improve_file, measured_file

        ahead.begin_for("improve", listed.n_cells, batch.threads)

        file_format = batch.reading.file_format
    try:
        with live.early():
            check_movable(listed, target, file_format=file_format)
        with slices.progress(path, shown=not batch.quiet) as measuring:
            source = measured_file(
                listed,
                target=goal.aim(batch.poor),
                wedge_order=batch.wedge_order.value,
                purpose=None if batch.purpose is None else batch.purpose.of_mesh,
                keep_bricks=batch.keep_bricks,
                poor_below=batch.poor,
                memory=batch.allowed_memory,
                threads=batch.threads,
                progress=measuring,
            )
        with live.stoppable() as stop, live.ProgressLine(shown=not batch.quiet) as progress:
            moved = improve_file(
                source,
                size_change=goal.size_change,
                strict=goal.strict,
                seconds=goal.seconds,
                progress=progress,
                should_stop=stop,
            )
            if moved.report.outcome != "refused":
                move_points(listed, target, moved.points, moved.coordinates, file_format=file_format)
        return moved, stop
    except ReadWhole as reason:
        if is_large(listed, batch.allowed_memory) and not batch.quiet:
            terminal.warn("note", f"{path}: is read whole: {reason}")
        return None
