"""``meshgauge improve`` on a large file: slices are measured, patches near bad cells read, the file is copied."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ..io.moving import check_movable, move_points
from ..io.plumbing.pieces import ReadWhole
from . import ahead, inputs, live, scheduler, slices, terminal
from .batch import LARGE, REFERRING, Batch, is_large
from .changed import say_how_to_undo, undo_beside
from .groups.improve import Goal

if TYPE_CHECKING:
    from ..repair.in_file import Moved


def improve_large(
    batch: Batch, path: str, target: Path, goal: Goal, *, in_place: bool = False, undo: Path | None = None
) -> tuple[Moved, live.Stop] | None:
    """Mend what is bad in a file and write the copy; with what asked to stop. None if the mesh has to be read whole.

    The file is replaced if that is wanted; undo data are kept then, and where they are asked for.

    Raises `ReadError` and `WriteError`.
    """
    if batch.reading.displacement is not None or batch.reading.dimension.value_or_none == 2:
        return None
    if batch.scheduler is None and inputs.size(path) < LARGE and not path.lower().endswith(REFERRING):
        return None
    if in_place and undo is None:
        undo = undo_beside(target)
    with live.early():
        listed = batch.pieces(path)
        if listed is None:
            return None
        from ..repair.in_file import improve_file, measured_file

        ahead.begin_for("improve", listed.n_cells, batch.threads)

        file_format = batch.reading.file_format
    try:
        with live.early():
            check_movable(listed, target, file_format=file_format, keeps_undo=undo is not None)
        with scheduler.executor(batch.scheduler or scheduler.of_environment()) as (pool, n_processes):
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
                    executor=pool,
                    n_processes=n_processes,
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
                    executor=pool,
                )
                if moved.report.outcome != "refused" and not (in_place and not len(moved.points)):
                    move_points(
                        listed,
                        target,
                        moved.points,
                        moved.coordinates,
                        file_format=file_format,
                        overwrite=in_place,
                        undo_file=undo,
                    )
                    if in_place:
                        say_how_to_undo(batch, target, undo)
        return moved, stop
    except ReadWhole as reason:
        if is_large(listed, batch.allowed_memory) and not batch.quiet:
            terminal.warn("note", f"{path}: is read whole: {reason}")
        return None
