"""``meshgauge improve``: move points so that no cell is inverted and the worst are better."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ..errors import MeshgaugeError, OptionError, WriteError
from ..look.style import number_of
from . import inputs, options
from .groups.improve import WHAT, ConstraintOptions, Goal
from .options import WRITING, option

if TYPE_CHECKING:
    from .repairing import Repaired

STILL_INVALID, REFUSED = 1, 3
"""Exit codes: some cell is still invalid, and what was reached broke a claim."""


WHOLE = (".vtu", ".vtk", ".vtkhdf")
"""Formats that hold all of a mesh, so that one with other cells may take the place of a file."""


def improve(
    meshes: options.Meshes,
    *,
    output: options.OutputMesh = None,
    output_dir: Annotated[
        Path | None,
        option("--output-dir", "DIR", "Write the meshes here, under their names; it is made if needed.", WRITING),
    ] = None,
    in_place: options.InPlace = False,
    html: options.Html = None,
    as_json: options.Json = False,
    undo: options.Undo = None,
    convert: options.Convert = False,
    all_times: options.AllTimes = False,
    quiet: options.Quiet = False,
    orient: Annotated[
        bool, option("--orient", None, "Renumber cells that are numbered in reverse first.", WHAT)
    ] = False,
    goal: Goal,
    constraints: ConstraintOptions,
    purpose: options.Purpose = None,
    keep_bricks: options.KeepBricks = False,
    threads: options.Threads = None,
    memory: options.Memory = None,
    scheduler: options.Scheduler = None,
    wedge_order: options.WedgeOrder = options.WedgeOrders.auto,
    reading: options.Reading,
) -> int:
    """Read, improve, check, write, print the report of each mesh in turn; returns the exit code."""
    paths = inputs.expand(meshes)
    targets = _targets(paths, output, output_dir, in_place=in_place)
    is_alone = len(paths) == 1
    if not is_alone and (html is not None or undo is not None):
        raise OptionError(f"--{'html' if undo is None else 'undo'} takes one mesh, {len(paths)} are given")
    if orient and in_place:
        raise OptionError("--orient goes with -o or --output-dir; first: meshgauge orient --in-place")
    read = [*paths, *([] if constraints.surface is None else [str(constraints.surface)])]
    if output_dir is None:
        inputs.check_targets(read, texts=[html], files=[output, undo])  # before an hour of work, not after
    else:
        inputs.check_folder(output_dir)
        inputs.check_targets(read, texts=[html], files=[*(targets if output_dir.is_dir() else ()), undo])
    for written in targets:
        if goal.changes_cells and in_place and written.suffix.lower() not in WHOLE:
            name = "--topology" if goal.topology else "--split-hopeless"
            raise MeshgaugeError(
                f"{written}: {name} makes other cells, and sets, loads and steps of this format would be lost: "
                f"--in-place takes {', '.join(WHOLE)} only; write another file with -o"
            )

    from . import live

    with live.early():
        from ..repair import text
        from .batch import Batch
        from .repairing import Repairing
        from .terminal import Output, emit, warn

        batch = Batch(
            reading=reading,
            wedge_order=wedge_order,
            purpose=purpose,
            threads=threads,
            keep_bricks=keep_bricks,
            memory=memory,
            scheduler=scheduler,
            quiet=quiet,
        )
        if output_dir is not None:
            inputs.make_folder(output_dir)
    repairing = Repairing(
        batch=batch,
        goal=goal,
        constraints=constraints,
        orients=orient,
        in_place=in_place,
        convert=convert,
        all_times=all_times,
        html=html,
        undo=undo,
    )

    def show(one: Repaired) -> None:
        if quiet:
            emit(f"{one.path}: {one.report.verdict}")
        else:
            Output().show(text.ImproveText(one.path, one.report, output=one.written))

    if is_alone and output_dir is None:
        one = repairing.repair(paths[0], targets[0])
        if as_json:
            emit(text.dumps(one.path, one.written, one.report))
        else:
            show(one)
        return one.stop.exit_code or _code(one) or batch.exit_code

    done: list[Repaired] = []
    where = dict(zip(paths, targets, strict=True))
    for path, one in batch.each(paths, lambda path: repairing.repair(path, where[path])):
        done.append(one)
        if not as_json:
            show(one)
        if one.stop.number:
            n_left = len(paths) - paths.index(path) - 1
            if n_left:
                warn("note", f"stopped: {number_of(n_left, 'mesh was', 'meshes were')} not looked at")
            break
    if as_json:
        emit(text.dumps_several([(one.path, one.written, one.report) for one in done], batch.failures))
    stopped = max((one.stop.exit_code for one in done), default=0)
    return stopped or batch.exit_code or max(map(_code, done), default=0)


def _code(one: Repaired) -> int:
    return REFUSED if one.report.outcome == "refused" else STILL_INVALID if one.n_unusable else 0


def _targets(paths: list[str], output: Path | None, folder: Path | None, *, in_place: bool) -> list[Path]:
    """Where each mesh goes."""
    if folder is None:
        if len(paths) > 1 and not in_place:
            raise WriteError(f"{len(paths)} meshes are given: --output-dir DIR takes them, or --in-place replaces them")
        written = inputs.mesh_target(paths[:1], output, in_place=in_place, what="better")
        return [Path(path) for path in paths] if in_place else [written or Path(paths[0])]
    if output is not None or in_place:
        raise WriteError(f"{folder}: --output-dir excludes --output and --in-place")
    targets: dict[Path, str] = {}
    for path in paths:
        target = folder / Path(path).resolve().name
        if target in targets:
            raise WriteError(f"{path} and {targets[target]}: both would be {target}")
        targets[target] = path
    return list(targets)
