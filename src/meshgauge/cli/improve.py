"""``meshgauge improve``: move points so that no cell is inverted and the worst are better."""

from __future__ import annotations

from pathlib import Path

from ..errors import MeshgaugeError
from . import inputs, options
from .groups.improve import ConstraintOptions, Goal

STILL_INVALID, REFUSED = 1, 3
"""Exit codes: some cell is still invalid, and what was reached broke a claim."""


WHOLE = (".vtu", ".vtk", ".vtkhdf")
"""Formats that hold all of a mesh, so that one with other cells may take the place of a file."""


def improve(
    mesh: options.OneMesh,
    *,
    output: options.OutputMesh = None,
    in_place: options.InPlace = False,
    html: options.Html = None,
    as_json: options.Json = False,
    undo: options.Undo = None,
    convert: options.Convert = False,
    all_times: options.AllTimes = False,
    quiet: options.Quiet = False,
    goal: Goal,
    constraints: ConstraintOptions,
    purpose: options.Purpose = None,
    keep_bricks: options.KeepBricks = False,
    threads: options.Threads = None,
    memory: options.Memory = None,
    wedge_order: options.WedgeOrder = options.WedgeOrders.auto,
    reading: options.Reading,
) -> int:
    """Read, improve, check, write, print the report; returns the exit code."""
    written = inputs.mesh_target([mesh], output, in_place=in_place, what="better") or Path(mesh)
    read = [mesh, *([] if constraints.surface is None else [str(constraints.surface)])]
    inputs.check_targets(read, texts=[html], files=[output, undo])  # before an hour of work, not after
    if goal.changes_cells and in_place and written.suffix.lower() not in WHOLE:
        option = "--topology" if goal.topology else "--split-hopeless"
        raise MeshgaugeError(
            f"{written}: {option} makes other cells, and sets, loads and steps of this format would be lost: "
            f"--in-place takes {', '.join(WHOLE)} only; write another file with -o"
        )

    from . import live

    with live.early():
        from .. import repair
        from ..files.output import write_text
        from ..repair import text
        from ..repair.acceptance import n_unusable
        from ..repair.page import improve_page
        from .batch import Batch
        from .changed import ChangedMesh
        from .large_repair import improve_large
        from .terminal import Output, emit

        batch = Batch(
            reading=reading,
            wedge_order=wedge_order,
            purpose=purpose,
            threads=threads,
            keep_bricks=keep_bricks,
            memory=memory,
            quiet=quiet,
        )
        batch.require_one_state(mesh)

    def show(report: repair.RepairReport, n_bad: int, stop: live.Stop) -> int:
        """Print what was reached; returns the exit code."""
        is_refused = report.outcome == "refused"
        if as_json:
            emit(text.dumps(mesh, None if is_refused else str(written), report))
        elif quiet:
            emit(f"{mesh}: {report.verdict}")
        else:
            Output().show(text.ImproveText(mesh, report, output=None if is_refused else str(written)))
        if stop.exit_code:
            return stop.exit_code
        return REFUSED if is_refused else STILL_INVALID if n_bad else batch.exit_code

    if goal.is_local and constraints.is_empty and not (in_place or convert or undo is not None or html is not None):
        done = improve_large(batch, mesh, written, goal)
        if done is not None:
            return show(done[0].report, done[0].n_unusable, done[1])
    with live.early():
        before = batch.read(mesh)
        changed = ChangedMesh.of(
            batch,
            before,
            written,
            in_place=in_place,
            undo=undo,
            convert=convert,
            all_times=all_times,
            changes="cells" if goal.changes_cells else "points",
        )
        fixed, surface = constraints.on(before)
        if changed.is_fixed is not None:
            fixed = changed.is_fixed if fixed is None else fixed | changed.is_fixed
    with live.stoppable() as stop:
        with live.ProgressLine(shown=not quiet) as progress:
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
                threads=threads,
                keep_bricks=keep_bricks,
                rounding=None if changed.patch is None else changed.patch.roundings,
            )
        if result.report.outcome != "refused":
            changed.write(result.mesh)
        if html is not None:
            with batch.progress(f"drawing {html}"):
                write_text(html, improve_page(result.report, result.before, result.after))
    return show(result.report, n_unusable(result.after), stop)
