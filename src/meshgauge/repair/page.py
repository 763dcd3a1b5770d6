"""A mesh before and after an improvement, as a section of a page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..errors import MeshError
from ..quality.summary import Tally
from ..report import FileReport
from ..report.html.charts import histograms, lowest
from ..report.html.page import page
from ..report.html.section import BUDGET, Section, section
from ..report.verdict import verdict
from .alternate import OLD_CELL, OLD_POINT
from .page_progress import progress_chart
from .page_report import claims, history, tree

if TYPE_CHECKING:
    from ..quality.measure import Quality

SHOWN_APART = ("history", "before", "after", "verdict", "claims")
"""Keys of a repair report that have a place of their own on the page."""


class Change(NamedTuple):
    """What became of the cells and points, each compared with itself."""

    n_better: int
    n_same: int
    n_worse: int
    cell: int  #: that lost most; -1 if none did
    was: float
    now: float
    n_moved: int
    n_points: int
    farthest: float  #: longest way of a point
    share: float  #: of the diagonal of the mesh


def improve_page(report: Any, before: Quality, after: Quality, *, title: str = "", bins: int = 20) -> str:
    """A page about one repair: distributions, progress and shapes, before and after.

    Parameters
    ----------
    report
        The repair report: a mapping, or an object with ``to_dict``. Its ``history`` is drawn if its
        entries have ``seconds`` and ``worst`` (``mean`` and ``phase`` as well), its ``claims`` are listed if they have
        ``holds``, ``name`` and ``text``, its ``verdict`` leads; every other key is shown as it is.
    before, after
        Of the same cells, other points; or with data that tell which of them stayed, as `alternate` makes them.
    title
        Of the page; by default the name of the file.
    bins
        Bars of the histograms over -1 to 1.

    Raises
    ------
    MeshError
        If the two are not of the same cells.
    """
    return page([improve_section(report, before, after, bins=bins)], title=title, templates=__package__)


def improve_section(report: Any, before: Quality, after: Quality, *, bins: int = 20, budget: int = BUDGET) -> Section:
    """A section about one improvement; parameters and errors as `improve_page`."""
    is_same = not _has_other_cells(before, after)
    if not is_same and OLD_CELL not in after.mesh.cell_data:
        raise MeshError("before and after have different cells, expected the same with other points")
    plain = report.to_dict() if hasattr(report, "to_dict") else report
    plain = dict(plain) if isinstance(plain, Mapping) else {}
    path = before.mesh.path or after.mesh.path or "mesh"
    made = section(after, FileReport.of(after, path=path), bins=bins, budget=budget, before=before if is_same else None)
    was, now = before.summary(), made.summary
    none = Tally.empty(now.all.scale, now.all.purpose)
    start = min(lowest(was, bins), lowest(now, bins))
    return replace(
        made,
        kind="improve",
        histograms=histograms(now, bins, start=start),
        extra={
            "was": was,
            "was_of": {name: dict(was.types).get(name, none) for name, _ in made.types},
            "was_verdict": verdict(was),
            "was_histograms": histograms(was, bins, start=start),
            "change": change(before, after),
            "progress": progress_chart(history(plain.get("history"))),
            "sentence": plain["verdict"] if isinstance(plain.get("verdict"), str) else "",
            "claims": claims(plain.get("claims")),
            "facts": tree({key: value for key, value in plain.items() if key not in SHOWN_APART}),
        },
    )


def change(before: Quality, after: Quality) -> Change:
    """Compare every cell and every point with itself; those that only one of the two has are left out."""
    cells, points = after.mesh.cell_data.get(OLD_CELL), after.mesh.point_data.get(OLD_POINT)
    was, now = before.values, after.values
    old, new = np.asarray(before.mesh.points, np.float64), np.asarray(after.mesh.points, np.float64)
    if cells is not None and points is not None and _has_other_cells(before, after):
        was, now, ids = was[cells[cells >= 0]], now[cells >= 0], cells[cells >= 0]
        old, new = old[points[points >= 0]], new[points >= 0]
    else:
        ids = np.arange(len(was))
    with np.errstate(invalid="ignore", over="ignore"):
        gain, way = now - was, np.linalg.norm(new - old, axis=1)
        finite = old[np.isfinite(old).all(axis=1)]
        diagonal = float(np.linalg.norm(np.ptp(finite, axis=0))) if len(finite) else 0.0
    measured = gain[~np.isnan(gain)]
    worst = int(np.nanargmin(gain)) if len(measured) and measured.min() < 0 else -1
    farthest = float(np.nanmax(way, initial=0.0))
    return Change(
        n_better=int(np.count_nonzero(measured > 0)),
        n_same=int(np.count_nonzero(measured == 0)),
        n_worse=int(np.count_nonzero(measured < 0)),
        cell=int(ids[worst]) if worst >= 0 else -1,
        was=float(was[worst]) if worst >= 0 else np.nan,
        now=float(now[worst]) if worst >= 0 else np.nan,
        n_moved=int(np.count_nonzero(way > 0)),
        n_points=len(way),
        farthest=farthest,
        share=farthest / diagonal if diagonal else 0.0,
    )


def _has_other_cells(before: Quality, after: Quality) -> bool:
    return not np.array_equal(before.mesh.connectivity, after.mesh.connectivity)
