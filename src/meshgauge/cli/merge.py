"""``meshgauge merge``: the report on a mesh of which every part was measured apart."""

from __future__ import annotations

from typing import Annotated

import typer

from . import inputs, options
from .terminal import DONE


def merge(
    partials: Annotated[
        list[str],
        typer.Argument(metavar="PARTIAL", help="Files of 'report --partial', or patterns such as 'out/*.mgp'."),
    ],
    *,
    parts: options.PartsOf = None,
    memory: options.Memory = None,
    bins: options.Bins = 20,
    html: options.Html = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> int:
    """Read partial reports, merge them, show the report; returns the exit code."""
    from ..report.merging import merge as merged
    from .printer import printer
    from .slices import n_bytes

    files = inputs.expand(partials)
    inputs.check_targets(files, texts=(html,))
    report = merged(files, parts=parts, memory=None if memory is None else n_bytes(memory))
    if html is not None:
        from ..report.html import HtmlWriter
        from ..report.html.section import OF_PARTS

        with HtmlWriter(html, bins=bins) as page:
            page.add_without_model(report, OF_PARTS)
    printing = printer(as_json=as_json, quiet=quiet, bins=bins, several=False)
    printing.file(report)
    printing.end([report], [])
    return DONE
