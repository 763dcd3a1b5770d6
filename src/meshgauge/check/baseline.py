"""A stored report, and what is worse than it."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import Any

from ..errors import BaselineError
from ..files import output, sources
from ..look.bands import PoorBelow
from ..look.records import brief
from ..quality.summary import CRITERIA, ROUNDING, Criterion, KeyFigures, Summary
from ..report import FileReport
from ..report.json import dumps
from .outcome import Change

SCHEMA, VERSION = "meshgauge-report", 3

KEYS = ("n_invalid", "n_degenerate", "n_undecided", "n_unmeasured", "share_not_good", "min", "quantile_0.01", "mean")
"""The criteria in which a mesh must be no worse."""

LARGEST = 256 << 20
"""Bytes of a stored report: some thousand meshes take a few MiB."""

FiguresByType = Mapping[str, KeyFigures]


@dataclass(frozen=True)
class Baseline:
    """What a report stored of meshes: by path, for all cells (``all``) and by type."""

    path: str
    meshes: Mapping[str, FiguresByType]
    poor_below: Mapping[str, PoorBelow] = field(default_factory=dict)  #: by path, where it is stored

    __repr__ = brief

    @classmethod
    def from_file(cls, path: str | Path) -> Baseline:
        """From the JSON of ``meshgauge report --json`` or ``meshgauge check --write-baseline``.

        Raises
        ------
        BaselineError
            If the file cannot be read, is no regular file, is too large or is something else.
        """
        try:
            document = json.loads(sources.contents(path, most=LARGEST))
        except OSError as error:
            raise BaselineError(f"{path}: {error.strerror or error}") from error
        except (ValueError, RecursionError) as error:
            raise BaselineError(f"{path}: is not JSON: {error}") from error
        if not isinstance(document, dict) or document.get("schema") != SCHEMA:
            raise BaselineError(f"{path}: is no report; write one with --write-baseline or 'meshgauge report --json'")
        if document.get("version") != VERSION:
            raise BaselineError(
                f"{path}: is version {document.get('version')!r} of a report, expected {VERSION}; renew it with "
                "--write-baseline"
            )
        try:
            meshes = {str(file["path"]): _figures(file) for file in document["files"]}
            limits = {str(file["path"]): PoorBelow.of(file.get("poor_below")) for file in document["files"]}
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise BaselineError(f"{path}: is damaged: {type(error).__name__} {error}") from error
        if not meshes:
            raise BaselineError(f"{path}: holds no mesh")
        return cls(str(path), meshes, limits)

    def of(self, mesh: str) -> FiguresByType:
        """What it holds of a mesh, see `path_of`. Raises `BaselineError` if none is meant."""
        return self.meshes[self.path_of(mesh)]

    def path_of(self, mesh: str) -> str:
        """Which mesh is meant: that of the same path, or the only one of the same file name, or the only one.

        Raises
        ------
        BaselineError
            If none is meant.
        """
        if len(self.meshes) == 1:
            return next(iter(self.meshes))
        same = [path for path in self.meshes if os.path.normpath(path) == os.path.normpath(mesh)]
        if not same:
            same = [path for path in self.meshes if PurePath(path).name == PurePath(mesh).name]
        if len(same) != 1:
            held = ", ".join(list(self.meshes)[:5]) + (", ..." if len(self.meshes) > 5 else "")
            raise BaselineError(f"{self.path}: has no {mesh}, but {held}; renew it with --write-baseline")
        return same[0]


def write(path: Path, reports: Sequence[FileReport]) -> None:
    """Store reports, as ``meshgauge report --json`` prints them. Raises `WriteError`."""
    output.write_text(path, dumps(reports) + "\n")


def worse(
    before: FiguresByType, summary: Summary, margin: float = 0.0, poor_below: PoorBelow | None = None
) -> list[Change]:
    """What is worse in a summary of J_ENS than it was, over all cells and for each type that was there.

    Numbers of invalid, degenerate, undecided and unmeasured cells may not grow; the share of cells that are poor or
    worse, the least value, the 1 % quantile and the mean may be worse by the margin. Below 0 less is not worse, because
    J_ENS rises again as a cell turns further: a least value or quantile that was negative and still is counts as no
    worse. Where other limits said what is poor (``poor_below``; None: the same), shares of poor cells are not compared.
    """
    keys = [key for key in KEYS if key != "share_not_good" or poor_below in (None, summary.poor_below)]
    now = {"all": KeyFigures.of(summary.all), **{name: KeyFigures.of(tally) for name, tally in summary.types.items()}}
    return [
        change
        for cells, standing in now.items()
        if cells in before
        for change in _changes(cells, before[cells], standing, margin, keys)
    ]


def _changes(
    cells: str, before: KeyFigures, now: KeyFigures, margin: float, keys: Sequence[str] = KEYS
) -> Iterator[Change]:
    for row in (CRITERIA[key] for key in keys):
        old, new = row.value(before), row.value(now)
        if math.isnan(old) or (math.isnan(new) and row.kind != "count" and now.n_unmeasured > before.n_unmeasured):
            continue  # nothing to compare with, or counted as unmeasured already
        if row.kind in ("value", "quantile") and row.key != "mean" and old < 0 and new < 0:
            continue
        slack = 0.0 if row.kind == "count" else margin + ROUNDING
        if row.kind == "quantile":
            slack += before.resolution + now.resolution
        is_no_worse = new >= old - slack if row.higher_is_better else new <= old + slack
        if not is_no_worse:  # also if it is NaN
            yield Change(cells, row.key, old, new, _text(cells, row, old, new))


def _text(cells: str, row: Criterion, old: float, new: float) -> str:
    label = row.label if cells == "all" else f"{row.label} of {cells}"
    if row.kind == "count":
        return f"{label} {new:,} against {old:,}"
    if row.kind == "share":
        return f"{label} {100 * new:.3g} % against {100 * old:.3g} %"
    return f"{label} {new:.4g} against {old:.4g}"


def _figures(file: Mapping[str, Any]) -> FiguresByType:
    types = {str(name): KeyFigures.from_dict(tally) for name, tally in file["cell_types"].items()}
    return {"all": KeyFigures.from_dict(file["all"]), **types}
