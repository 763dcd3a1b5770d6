"""``meshgauge plot``: pictures of quality."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from ..errors import OptionError
from . import inputs, options
from .groups.plot import JENS, Kinds, Picture, Scenes
from .options import WRITING, option

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ..quality.measure import Quality
    from ..quality.summary import Summary


def plot(
    meshes: options.Meshes,
    *,
    output: Annotated[Path, option("--output -o", "PICTURE", "A png, svg or pdf.", WRITING)],
    picture: Picture,
    quiet: options.Quiet = False,
    threads: options.Threads = None,
    wedge_order: options.WedgeOrder = options.WedgeOrders.auto,
    reading: options.Reading,
) -> int:
    """Measure the meshes and draw them; returns the exit code."""
    paths = inputs.expand(meshes)
    targets = picture.targets(output)
    inputs.check_targets(paths, files=targets.values())
    picture.check(paths)

    # From here on NumPy, the readers and matplotlib are needed, which `--help` does not wait for.
    from .. import plot as drawing
    from ..look.style import printable
    from ..plot.figure_file import format_of
    from ..quality.metrics import metric as metric_row
    from ..report.record import short_names
    from .batch import Batch
    from .terminal import COULD_NOT

    format_of(output)
    for name in targets:
        metric_row(name)
    batch = Batch(reading=reading, wedge_order=wedge_order, threads=threads, quiet=quiet)
    paths = batch.states(paths, every=picture.kind is Kinds.steps)
    names = dict(zip(paths, map(printable, short_names(paths)), strict=True))
    summaries: dict[str, dict[str, Summary]] = {name: {} for name in targets}
    for path, quality in batch.each(paths, lambda path: batch.measure(path, targets)):
        for name in targets:
            summaries[name][names[path]] = quality.summary(name)
        last, title = quality, names[path]
    if len(batch.failures) == len(paths):
        return COULD_NOT
    if picture.kind is Kinds.steps:
        known = {path: summaries[JENS][name] for path, name in names.items() if name in summaries[JENS]}
        with batch.progress(f"drawing {output}"):
            drawing.save(_over_time(known), output)
        return batch.exit_code
    for name, target in targets.items():
        with batch.progress(f"drawing {target}"):
            is_chart = not picture.is_scene
            figure = _chart(summaries[name], picture) if is_chart else _scene(last, title, picture, name)
            drawing.save(figure, target)
    return batch.exit_code


def _chart(summaries: Mapping[str, Summary], picture: Picture) -> Any:
    """The chart of a metric of one or several meshes."""
    from .. import plot as drawing

    if picture.kind is Kinds.types:
        return drawing.types(summaries, bins=picture.bins)
    if picture.kind is Kinds.cumulative:
        return drawing.cumulative(summaries, log=picture.log is not False)
    return drawing.histogram(summaries, bins=picture.bins, log=bool(picture.log))


def _over_time(summaries: Mapping[str, Summary]) -> Any:
    """The chart of the time steps of a file: over time, if it tells that of each, else over their numbers."""
    from .. import plot as drawing
    from ..look.style import printable

    steps = {path: one for path, one in summaries.items() if isinstance(path, inputs.State) and one.all.n_measured}
    if len(steps) < 2:
        raise OptionError("--kind steps draws a file of several time steps; this one has no two with values")
    states = list(steps)
    has_times = len({state.time for state in states if state.time is not None}) == len(states)
    values = {(state.time if has_times else float(state.step)): one for state, one in steps.items()}
    return drawing.over_time(
        {at: one for at, one in values.items() if at is not None},
        title=printable(states[0].file),
        axis="time" if has_times else "step",
    )


def _scene(quality: Quality, title: str, picture: Picture, metric: str) -> Any:
    """The scene of one mesh."""
    from .. import plot as drawing
    from ..mesh.labels import find_cell

    if picture.cell is not None:
        return drawing.one_cell(quality, find_cell(quality.mesh, picture.cell), title=title)
    if picture.scene is Scenes.faces:
        return drawing.worst_faces(quality, metric, picture.worst, title=title)
    if picture.scene is Scenes.worst:
        return drawing.worst(quality, picture.worst, title=title)
    return drawing.cut(quality, normal=picture.normal, at=picture.at, title=title)
