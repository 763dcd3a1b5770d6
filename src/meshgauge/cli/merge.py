"""``meshgauge merge``: the report on a mesh of which every part was measured apart."""

from __future__ import annotations

from typing import Annotated

import typer

from . import inputs, options
from .options import READING, option
from .terminal import DONE


def merge(
    partials: Annotated[
        list[str],
        typer.Argument(metavar="PARTIAL", help="Files of 'report --partial', or patterns such as 'out/*.mgp'."),
    ],
    *,
    parts: Annotated[
        int | None,
        option("--parts", "N", "Of how many parts the mesh is; fewer are an error.", READING, least=1, default=False),
    ] = None,
    memory: options.Memory = None,
    bins: options.Bins = 20,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> int:
    """Read partial reports, merge them, show the report; returns the exit code."""
    from ..report.merging import merge as merged
    from .printer import printer
    from .slices import n_bytes

    report = merged(inputs.expand(partials), parts=parts, memory=None if memory is None else n_bytes(memory))
    printing = printer(as_json=as_json, quiet=quiet, bins=bins, several=False)
    printing.file(report)
    printing.end([report], [])
    return DONE
