"""``meshgauge trend``: how meshes went over a history of stored reports."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from . import inputs, options
from .options import option


def trend(
    reports: Annotated[
        list[str],
        typer.Argument(metavar="REPORT", help="JSON of 'meshgauge report --json', oldest first, or folders of them."),
    ],
    *,
    git: Annotated[
        bool, option("--git", None, "Follow each file over the commits of git that changed it, as a baseline.")
    ] = False,
    as_json: options.Json = False,
    html: options.Html = None,
) -> int:
    """Read the reports and show each mesh over them; returns the exit code."""
    from ..compare.trend import TrendText, dumps, files_of, history, trend_page, trends
    from ..files.output import write_text
    from .terminal import DONE, Output, emit, warn

    files = files_of(reports)
    inputs.check_targets(map(str, files), texts=(html,))
    if git:
        commits, left_out = history(files)
        for reason in left_out:
            warn("note", reason)
        found = trends(commits)
    else:
        found = trends(files)
    if html is not None:
        write_text(html, trend_page(found))
    if as_json:
        emit(dumps(found))
    elif html != Path("-"):
        output = Output()
        for one in found:
            output.show(TrendText(one))
    return DONE
