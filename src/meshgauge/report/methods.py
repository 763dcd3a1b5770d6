"""What the methods of a `Quality` that report are: its text and its page."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from ..files import sources
from .record import FileReport

if TYPE_CHECKING:
    from ..quality.measure import Quality
    from .html import PageInCell


def text(report: FileReport, *, width: int) -> str:
    """The report on one mesh as ``meshgauge report`` prints it where there is no terminal."""
    from rich.console import Console

    from .text import FileText

    console = Console(width=width, color_system=None, highlight=False, markup=False, emoji=False)
    with console.capture() as captured:
        console.print(FileText(report))
    # Tables pad their lines; in a text that is but noise.
    return "\n".join(line.rstrip() for line in captured.get().rstrip().split("\n"))


def report_text(quality: Quality, *, worst: int, by_region: bool, width: int) -> str:
    """What `Quality.report` is."""
    report = FileReport.of(quality, worst=worst, by_region=by_region, with_diagnosis=True)
    return text(report, width=width)


def write_html(quality: Quality, path: str | os.PathLike[str], *, worst: int) -> None:
    """What `Quality.to_html` is."""
    from .html import HtmlWriter

    with sources.guard():
        for source in (quality.mesh.path, *quality.mesh.sources):
            if source:
                sources.note(source)
        with HtmlWriter(Path(path)) as page:
            page.add(quality, FileReport.of(quality, worst=worst, with_diagnosis=True))


def page_in_cell(quality: Quality, *, worst: int, height: int) -> PageInCell:
    """What `Quality.view` is."""
    from . import html

    report = FileReport.of(quality, worst=worst, with_diagnosis=True)
    return html.PageInCell(html.page([html.section(quality, report)]), height)
