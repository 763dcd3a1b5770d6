"""One measured mesh as a section of a page."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...quality.by_region import by_region
from ...quality.companions import companions_by_region
from ...quality.summary import Summary, Tally
from .. import beside
from ..record import FileReport
from ..verdict import Verdict, verdict
from .cell_cards import Card, cards
from .charts import Histogram, histograms
from .frame import Frame
from .geometry import geometry
from .hard_faces import ListedFace, drawn_faces, listed_faces
from .page_cells import drawable

if TYPE_CHECKING:
    from ...quality.measure import Quality

BUDGET = 18_000_000
"""Bytes of the geometry of a page, compressed and written as text."""

BINS = 200
"""Bars of a histogram at most: more are thinner than a line."""

REGIONS = 60
"""Rows of the table of regions at most."""


@dataclass(frozen=True)
class Section:
    """What the template of a mesh is filled with."""

    path: str
    n_points: int
    n_cells: int
    verdict: Verdict
    summary: Summary
    types: list[tuple[str, Tally]]
    regions: list[tuple[str, Tally]]
    beside_types: beside.Tallies  #: what the table of types shows beside J_ENS, by name of row
    beside_regions: beside.Tallies
    histograms: list[Histogram]
    cards: list[Card]
    report: FileReport
    left_out: list[str]
    model: dict[str, Any] | None  #: for the script of the page; None if there is nothing to draw
    geometry: str = ""  #: packed arrays
    faces: list[ListedFace] = field(default_factory=list)  #: the worst for finite volumes
    kind: str = "mesh"  #: name of the template
    extra: dict[str, Any] = field(default_factory=dict)  #: what other templates need


def section(
    quality: Quality,
    report: FileReport | None = None,
    *,
    bins: int = 20,
    budget: int = BUDGET,
    before: Quality | None = None,
    frame: Frame | None = None,
) -> Section:
    """A section of `meshgauge.report.html.page` about one mesh.

    Parameters
    ----------
    quality
        What was measured.
    report
        What else is to be shown: worst cells, other metrics, diagnosis. None: made from ``quality``.
    bins
        Bars of the histograms over -1 to 1.
    budget
        Bytes that the packed geometry may take. What does not fit is left out, best cells first, and the page says so.
    before
        The same cells with their points elsewhere: the picture can then show either state.
    frame
        In which the mesh is placed, for several in one scene; None: its own.
    """
    if report is None:
        report = FileReport.of(quality)
    left_out: list[str] = []
    if bins > BINS:
        left_out.append(f"The histograms have {BINS} bars, not {bins}.")
        bins = BINS
    ids, summaries = by_region(quality)
    names = tuple(name for name, _ in summaries)
    regions = _rows_of_regions(summaries, left_out)
    worst = np.array([cell.cell for cell in report.worst], np.int64)
    drawn = geometry(quality, report.summary, ids, names, bins=bins, budget=budget, before=before, frame=frame)
    faces = listed_faces(report.finite_volume)
    model = drawn.model
    if model is not None and faces:
        place = Frame(tuple(model["frame"]["centre"]), model["frame"]["half"])
        model = {**model, "faces": drawn_faces(faces, quality.mesh, place)}
    return Section(
        path=report.path,
        n_points=report.n_points,
        n_cells=report.n_cells,
        verdict=verdict(report.summary),
        summary=report.summary,
        types=[(name, tally) for name, tally in report.summary.types.items() if tally.n_measured],
        regions=regions if len(regions) > 1 else [],
        beside_types=beside.of_types(report),
        beside_regions=_beside_regions(quality, ids, names, report) if len(regions) > 1 else {},
        histograms=histograms(report.summary, bins),
        cards=cards(quality, worst, ids, names, drawable(quality)),
        report=report,
        left_out=[*left_out, *drawn.remarks],
        model=model,
        faces=faces,
        geometry=drawn.text,
    )


NOT_DRAWN = "The mesh is not drawn: it was measured slice by slice, and there is no memory for it as a whole."


def section_without_model(report: FileReport, *, bins: int = 20) -> Section:
    """The section of a mesh that was measured slice by slice, and is not in memory: all but its pictures.

    Parameters
    ----------
    report
        With the regions, if they are to be shown.
    bins
        As for `section`.
    """
    left_out = [NOT_DRAWN]
    regions = _rows_of_regions(report.regions, left_out)
    names = [name for name, _ in report.regions]
    has_beside = len(regions) > 1 and len(report.region_companions) == len(names)
    return Section(
        path=report.path,
        n_points=report.n_points,
        n_cells=report.n_cells,
        verdict=verdict(report.summary),
        summary=report.summary,
        types=[(name, tally) for name, tally in report.summary.types.items() if tally.n_measured],
        regions=regions if len(regions) > 1 else [],
        beside_types=beside.of_types(report),
        beside_regions=beside.of_regions(names, report.region_companions) if has_beside else {},
        histograms=histograms(report.summary, min(bins, BINS)),
        cards=[],
        report=report,
        left_out=left_out,
        model=None,
    )


def _rows_of_regions(summaries: Iterable[tuple[str, Summary]], left_out: list[str]) -> list[tuple[str, Tally]]:
    """Rows of the table of regions; what it has no place for is added to ``left_out``."""
    regions = [(name, one.all) for name, one in summaries if one.all.n_measured]
    if len(regions) > REGIONS:
        left_out.append(f"The table of regions has the {REGIONS} with the lowest minimum, of {len(regions)}.")
        regions = sorted(regions, key=lambda row: row[1].min)[:REGIONS]
    return regions


def _beside_regions(
    quality: Quality, ids: NDArray[np.int64], names: tuple[str, ...], report: FileReport
) -> beside.Tallies:
    """What is known of each region beside J_ENS: as the report has it, else measured here."""
    if len(report.region_companions) == len(names):
        return beside.of_regions(names, report.region_companions)
    found = companions_by_region(quality, ids)[1]
    known = [n for n in range(len(names)) if n in found]
    return beside.of_regions([names[n] for n in known], [found[n] for n in known])
