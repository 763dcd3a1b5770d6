"""``meshgauge compare``: meshes of one domain side by side."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import MeshgaugeError
from . import inputs, options
from .completion import mesh_files
from .options import WRITING, option


def compare(
    meshes: Annotated[
        list[str],
        typer.Argument(
            metavar="MESH MESH...",
            help="Two or more; the first is what others are held against.",
            autocompletion=mesh_files,
        ),
    ],
    *,
    as_json: options.Json = False,
    html: options.Html = None,
    plot: Annotated[Path | None, option("--plot", "PICTURE", "Draw them: a png, svg or pdf.", WRITING)] = None,
    quiet: options.Quiet = False,
    worst: options.Worst = 5,
    by: options.By = None,
    purpose: options.Purpose = None,
    keep_bricks: options.KeepBricks = False,
    threads: options.Threads = None,
    wedge_order: options.WedgeOrder = options.WedgeOrders.auto,
    reading: options.Reading,
) -> int:
    """Read, measure and compare; returns the exit code."""
    paths = inputs.expand(meshes)
    if len(paths) < 2 and reading.step != "all":
        raise MeshgaugeError(f"{paths[0]}: is one mesh; give two or more to compare, or see 'meshgauge report'")
    inputs.check_targets(paths, texts=(html,), files=(plot,))

    from ..compare import Builder
    from ..compare.json import comparison_json
    from ..compare.sentences import names, sentences
    from ..compare.text import ComparisonText
    from .batch import Batch
    from .terminal import Output, emit

    if plot is not None:
        from ..plot.figure_file import format_of

        format_of(plot)  # a name without a format is an error before anything is measured

    batch = Batch(
        reading=reading, wedge_order=wedge_order, purpose=purpose, threads=threads, keep_bricks=keep_bricks, quiet=quiet
    )
    paths = batch.states(paths)
    builder: Builder | None = None
    pages = None
    if html is not None:
        from ..compare.page import Pages

        pages = Pages(len(paths), worst=worst)
    for path, quality in batch.each(paths, batch.measure):
        if builder is None:
            builder = Builder(path, quality, losses=worst, by_regions=by is not None)
        else:
            with batch.progress(f"comparing {path}"):
                builder.add(path, quality)
        if pages is not None:
            with batch.progress(f"drawing {path}"):
                pages.add(path, quality)
    comparison = builder.finish() if builder is not None and len(builder.sides) > 1 else None
    if as_json:
        emit(comparison_json(comparison, batch.failures))
    elif comparison is not None and quiet:
        emit("\n".join(text for text in sentences(comparison) if text))
    elif comparison is not None:
        Output().show(ComparisonText(comparison, batch.failures))
    if comparison is not None and pages is not None and html is not None:
        from ..files.output import write_text

        write_text(html, pages.finish(comparison))
    if comparison is not None and plot is not None:
        from ..compare.plot import comparison_chart
        from ..plot import save

        with batch.progress(f"drawing {plot}"):
            save(comparison_chart(comparison, names=names(comparison)), plot)
    return batch.exit_code
