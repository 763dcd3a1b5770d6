"""``meshgauge improve``: move points so that no cell is inverted and the worst are better."""

from __future__ import annotations

from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated

from ..errors import MeshgaugeError
from ..look.bands import POOR
from . import inputs, options
from .options import WRITING, option

WHAT, FIXED = "What to reach", "What must stay"


class Boundaries(StrEnum):
    """What may happen to points of the boundary."""

    fixed = "fixed"
    slide = "slide"


def improve(
    mesh: options.OneMesh,
    *,
    output: options.OutputMesh = None,
    in_place: options.InPlace = False,
    html: options.Html = None,
    as_json: options.Json = False,
    undo: Annotated[Path | None, option("--undo", "FILE", "Keep the old places of points (.npz).", WRITING)] = None,
    restore: Annotated[
        Path | None, option("--restore", "FILE", "Put points back with such a file instead.", WRITING)
    ] = None,
    quiet: options.Quiet = False,
    boundary: Annotated[
        Boundaries, option("--boundary", None, "Points of the boundary stay, or move on it.", WHAT)
    ] = Boundaries.fixed,
    target: Annotated[float, option("--target", "Q", "J_ENS that every cell should have.", WHAT)] = POOR,
    floor: Annotated[
        float,
        option("--floor", "SHARE", "Share of the worst quality that raising the mean keeps; 1: all of it.", WHAT),
    ] = 0.9,
    strict: Annotated[bool, option("--strict", None, "No cell ends worse than it began.", WHAT)] = False,
    seconds: Annotated[
        float | None, option("--time", "S", "Stop after these seconds.", WHAT, default="no limit")
    ] = None,
    fixed_points: Annotated[
        list[str] | None, option("--fixed-points", "NAME", "Points where this point data is not 0; repeatable.", FIXED)
    ] = None,
    fixed_region: Annotated[
        list[str] | None,
        option("--fixed-region", "NAME", "Points of this region, or of those that fit a pattern; repeatable.", FIXED),
    ] = None,
    fixed_box: Annotated[
        list[str] | None,
        option(
            "--fixed-box",
            "BOX",
            "Points in xmin,xmax,ymin,ymax,zmin,zmax; an empty end is infinite; repeatable.",
            FIXED,
        ),
    ] = None,
    surface: Annotated[
        Path | None, option("--surface", "FILE", "With --boundary slide: an STL or VTP surface to move on.", FIXED)
    ] = None,
    feature_angle: Annotated[
        float,
        option("--feature-angle", "DEGREES", "With --boundary slide: faces that meet at more keep their edge.", FIXED),
    ] = 40.0,
    purpose: options.Purpose = None,
    threads: options.Threads = None,
    wedge_order: options.WedgeOrder = options.WedgeOrders.auto,
    reading: options.Reading,
) -> int:
    """Read, improve, check, write, print the report; returns the exit code."""
    if restore is not None and (undo is not None or html is not None or as_json):
        raise MeshgaugeError(f"{restore}: --restore puts points back; it goes with no --undo, --html or --json")
    written = inputs.mesh_target([mesh], output, in_place=in_place, what="better") or Path(mesh)
    read = [mesh, *(str(path) for path in (surface, restore) if path is not None)]
    inputs.check_targets(read, texts=[html], files=[output, undo])  # before an hour of work, not after

    from .. import repair
    from ..repair import text
    from ..repair.acceptance import n_unusable
    from ..repair.fixed import fixed_points as mask_of
    from ..repair.page import improve_page
    from ..repair.surface_file import surface_in
    from ..repair.undo import restored, store
    from ..report.html.page import write
    from . import live
    from .batch import Batch
    from .terminal import Output, emit

    batch = Batch(reading=reading, wedge_order=wedge_order, purpose=purpose, threads=threads, quiet=quiet)
    batch.require_one_state(mesh)
    before = batch.read(mesh)
    if restore is not None:
        batch.write(written, restored(restore, before), overwrite=in_place)
        if not quiet:
            emit(f"{written}: points are where they were")
        return batch.exit_code
    mask = mask_of(before, fixed_points or (), fixed_region or (), fixed_box or ())
    slides_on = surface_in(surface) if surface is not None else None
    with live.stoppable() as stop:
        with live.ProgressLine(shown=not quiet) as progress:
            result = repair.improve(
                before,
                boundary=boundary.value,
                target=target,
                floor=floor,
                strict=strict,
                seconds=seconds,
                fixed=mask,
                surface=slides_on,
                feature_angle=feature_angle,
                progress=progress,
                should_stop=stop,
                threads=threads,
            )
        is_refused = result.report.outcome == "refused"
        if not is_refused:
            keep = None if undo is None else partial(store, undo, before)
            if not in_place or result.mesh is not before:
                batch.write(written, result.mesh, overwrite=in_place, before_replacing=keep)
            elif keep is not None:
                keep(before)
        if html is not None:
            with batch.progress(f"drawing {html}"):
                write(html, improve_page(result.report, result.before, result.after))
    if as_json:
        emit(text.dumps(mesh, None if is_refused else str(written), result.report))
    elif quiet:
        emit(f"{mesh}: {result.report.verdict}")
    else:
        Output().show(text.ImproveText(mesh, result.report, output=None if is_refused else str(written)))
    if is_refused:
        return 3
    return 1 if n_unusable(result.after) else 0
