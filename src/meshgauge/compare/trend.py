"""How meshes went over a history of stored reports: what each report says of them, in order."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from rich.console import Console, ConsoleOptions, RenderResult
from rich.text import Text

from .._version import __version__
from ..errors import ReadError
from ..files import sources
from ..look import style
from ..look.names import natural
from ..quality.summary import CRITERIA, ROUNDING, KeyFigures
from ..report.html.line_charts import Chart, line_chart
from ..report.html.page import page
from ..report.json import finite
from ..report.tables import new_table
from .git_history import Version, versions

SCHEMA, REPORT, VERSION = "meshgauge-trend", "meshgauge-report", 3

KEYS = ("n_invalid", "n_degenerate", "share_not_good", "min", "quantile_0.01", "mean")
"""Criteria that are followed."""

LARGEST = 256 << 20
"""Bytes of a stored report."""


class Point(NamedTuple):
    """What one report says of a mesh."""

    report: str
    figures: KeyFigures


@dataclass(frozen=True)
class Trend:
    """One mesh over the reports that have it, in order."""

    path: str
    points: tuple[Point, ...]

    def values(self, key: str) -> list[float]:
        """One criterion, report by report."""
        return [CRITERIA[key].value(point.figures) for point in self.points]

    def change(self, key: str, at: int) -> int:
        """1 if a report is better than the one before it, -1 if it is worse, 0 if neither."""
        values = self.values(key)
        if at == 0 or math.isnan(values[at]) or math.isnan(values[at - 1]):
            return 0
        step = values[at] - values[at - 1]
        step = step if CRITERIA[key].higher_is_better else -step
        return 0 if abs(step) <= ROUNDING else 1 if step > 0 else -1

    def to_dict(self) -> dict[str, Any]:
        """Plain data; undefined numbers are NaN."""
        values = {key: self.values(key) for key in KEYS}
        return {"path": self.path, "reports": [point.report for point in self.points], "values": values}


def files_of(paths: Sequence[str]) -> list[Path]:
    """The files that are named, and of folders the .json files in them, in the order of the numbers in their names.

    Raises
    ------
    ReadError
        If a folder has none.
    """
    files: list[Path] = []
    for path in map(Path, paths):
        if not path.is_dir():
            files.append(path)
            continue
        own = sorted(path.glob("*.json"), key=lambda one: natural(one.name))
        if not own:
            raise ReadError(f"{path}: has no .json files; 'meshgauge report --json' writes reports")
        files += own
    return files


def history(files: Sequence[Path]) -> tuple[list[Version], list[str]]:
    """The versions of some files in git, oldest first, and for each that is no report of today why it is left out.

    Raises
    ------
    ReadError
        If a file has no history, or no version of it can be read.
    """
    kept: list[Version] = []
    reasons: list[str] = []
    for file in files:
        n_before, last = len(kept), ""
        for version in versions(file):
            try:
                trends([version])
            except ReadError as error:
                last = str(error)
                reasons.append(last)
            else:
                kept.append(version)
        if len(kept) == n_before:
            raise ReadError(last)
    return kept, reasons


def trends(files: Sequence[Path | Version]) -> list[Trend]:
    """The meshes of stored reports, by path: of files, or versions of one.

    Raises
    ------
    ReadError
        If a file is no report.
    """
    found: dict[str, list[Point]] = {}
    for file in files:
        try:
            text = file.contents if isinstance(file, Version) else sources.contents(file, most=LARGEST)
            document = json.loads(text)
        except OSError as error:
            raise ReadError(f"{file}: {error.strerror or error}") from error
        except (ValueError, RecursionError) as error:
            raise ReadError(f"{file}: is not JSON: {error}") from error
        if not isinstance(document, dict) or (document.get("schema"), document.get("version")) != (REPORT, VERSION):
            raise ReadError(f"{file}: is no report of version {VERSION}, as 'meshgauge report --json' writes it")
        try:
            for mesh in document["files"]:
                found.setdefault(str(mesh["path"]), []).append(Point(file.stem, KeyFigures.from_dict(mesh["all"])))
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise ReadError(f"{file}: is damaged: {type(error).__name__} {error}") from error
    return [Trend(path, tuple(points)) for path, points in found.items()]


def dumps(given: Sequence[Trend]) -> str:
    """Trends as JSON text, indented, ASCII only."""
    head = {"schema": SCHEMA, "version": 1, "meshgauge": __version__}
    return json.dumps(finite({**head, "meshes": [one.to_dict() for one in given]}), indent=2, allow_nan=False)


def number(key: str, value: float) -> str:
    """A value of a criterion, as it is written."""
    if math.isnan(value):
        return "-"
    if CRITERIA[key].kind == "count":
        return style.number(int(value))
    return f"{100 * value:.3g} %" if CRITERIA[key].kind == "share" else style.quality(value)


class TrendText:
    """A table of one mesh: a report a line, what became worse in red, what became better in green."""

    def __init__(self, trend: Trend) -> None:
        self.trend = trend

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        yield Text(style.printable(self.trend.path), "bold")
        table = new_table("report", *(CRITERIA[key].label for key in KEYS))
        for at, point in enumerate(self.trend.points):
            looks = {1: "green", -1: "bold red", 0: ""}
            cells = [Text(number(key, self.trend.values(key)[at]), looks[self.trend.change(key, at)]) for key in KEYS]
            table.add_row(style.printable(point.report), *cells)
        yield table


def charts(trend: Trend) -> list[Chart]:
    """A chart for each criterion that has a value."""
    names = [point.report for point in trend.points]
    lines = (
        line_chart(CRITERIA[key].label, trend.values(key), names, partial(number, key), unit="report") for key in KEYS
    )
    return [line for line in lines if line is not None]


@dataclass(frozen=True)
class Lead:
    """What stands on the page."""

    meshes: tuple[tuple[Trend, list[Chart]], ...]
    template: str = "trend.html.jinja"
    keys: tuple[str, ...] = KEYS

    def label(self, key: str) -> str:
        """Of a criterion."""
        return CRITERIA[key].label

    def number(self, key: str, value: float) -> str:
        """A value of it."""
        return number(key, value)


def trend_page(given: Sequence[Trend]) -> str:
    """A page that opens offline: charts and a table for each mesh."""
    lead = Lead(tuple((one, charts(one)) for one in given))
    return page([], title="History of quality", lead=lead, templates=__package__)
