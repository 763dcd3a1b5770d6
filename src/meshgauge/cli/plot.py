"""``meshgauge plot``: pictures of quality."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from . import inputs, options
from .options import WRITING, option

if TYPE_CHECKING:
    from ..quality.summary import Summary

KIND, SCENE = "Charts", "Scenes"
JENS = "jens"
MOST = 12
"""Cells in a scene of the worst ones."""


class Kinds(StrEnum):
    """The charts."""

    histogram = "histogram"
    types = "types"
    cumulative = "cumulative"


class Scenes(StrEnum):
    """The scenes."""

    worst = "worst"
    cut = "cut"


def plot(
    meshes: options.Meshes,
    *,
    output: Annotated[Path, option("--output -o", "PICTURE", "A png, svg or pdf.", WRITING)],
    kind: Annotated[Kinds | None, option("--kind", None, "The chart.", KIND)] = None,
    scene: Annotated[Scenes | None, option("--scene", None, "Draw one mesh in space instead.", SCENE)] = None,
    metric: options.Metrics = None,
    bins: options.Bins = 80,
    log: Annotated[
        bool | None, option("--log/--linear", None, "Scale of the counts.", KIND, default="log if cumulative")
    ] = None,
    worst: options.Worst = 6,
    normal: Annotated[
        tuple[float, float, float] | None,
        option("--normal", "X Y Z", "From the cut to the eye.", SCENE, default="what shows most"),
    ] = None,
    at: Annotated[
        float | None,
        option(
            "--at",
            "S",
            "Where to cut, a share of the size along the normal.",
            SCENE,
            least=0.0,
            most=1.0,
            default="at the worst cell",
        ),
    ] = None,
    quiet: options.Quiet = False,
    threads: options.Threads = None,
    wedge_order: options.WedgeOrder = options.WedgeOrders.auto,
    reading: options.Reading,
) -> int:
    """Measure the meshes and draw them; returns the exit code."""
    paths = inputs.expanded(meshes)
    metrics = tuple(dict.fromkeys(metric or (JENS,)))
    targets = {name: output if len(metrics) == 1 else _beside(output, name) for name in metrics}
    inputs.check_targets(paths, files=targets.values())
    _check(paths, kind, scene, metrics, log, worst, (normal, at))

    # From here on NumPy, the readers and matplotlib are needed, which `--help` does not wait for.
    from .. import plot as pictures
    from ..plot.figure_file import format_of
    from ..quality.metrics import metric as metric_row
    from ..report.record import short_names
    from .batch import Batch
    from .terminal import COULD_NOT

    format_of(output)
    for name in metrics:
        metric_row(name)
    batch = Batch(reading=reading, wedge_order=wedge_order, threads=threads, quiet=quiet)
    paths = batch.states(paths)
    names = dict(zip(paths, short_names(paths), strict=True))
    summaries: dict[str, dict[str, Summary]] = {name: {} for name in metrics}
    for path, quality in batch.each(paths, lambda path: batch.measure(path, metrics)):
        for name in metrics:
            summaries[name][names[path]] = quality.summary(name)
        last, title = quality, names[path]
    if len(batch.failures) == len(paths):
        return COULD_NOT
    for name, target in targets.items():
        with batch.progress(f"drawing {target}"):
            if scene is Scenes.worst:
                figure = pictures.worst(last, worst, title=title)
            elif scene is Scenes.cut:
                figure = pictures.cut(last, normal=normal, at=at, title=title)
            elif kind is Kinds.types:
                figure = pictures.types(summaries[name], bins=bins)
            elif kind is Kinds.cumulative:
                figure = pictures.cumulative(summaries[name], log=log is not False)
            else:
                figure = pictures.histogram(summaries[name], bins=bins, log=bool(log))
            pictures.save(figure, target)
    return batch.exit_code


def _beside(output: Path, metric: str) -> Path:
    """The picture of one of several metrics: ``out-jens.png``."""
    return output.with_name(f"{output.stem}-{metric}{output.suffix}")


def _check(
    paths: list[str],
    kind: Kinds | None,
    scene: Scenes | None,
    metrics: tuple[str, ...],
    log: bool | None,
    worst: int,
    cut: tuple[object, object],
) -> None:
    """Options that do not go together are an error, not ignored."""
    if scene is not None:
        if kind is not None:
            raise typer.BadParameter("--kind draws a chart and --scene a scene: give one of them")
        if len(paths) > 1:
            raise typer.BadParameter(f"--scene takes one mesh, {len(paths)} are given")
        if metrics != (JENS,) or log is not None:
            raise typer.BadParameter("--metric and --log are of charts; a scene is coloured by jens")
    if scene is Scenes.worst and not 1 <= worst <= MOST:
        raise typer.BadParameter(f"--worst is {worst}; a scene shows 1 to {MOST} cells")
    if scene is not Scenes.cut and cut != (None, None):
        raise typer.BadParameter("--normal and --at are of --scene cut")
    if kind is Kinds.types and log is not None:
        raise typer.BadParameter("--log is of histogram and cumulative")
