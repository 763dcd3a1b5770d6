"""One measured mesh as a section of a page."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...quality.by_region import by_region
from ...quality.companions import companions_by_region
from ...quality.summary import Summary, Tally
from ...slices import Job, Partial
from .. import beside
from ..diagnosis import boundary_cells
from ..record import FileReport, StepOf
from ..stream import file_report
from ..verdict import Verdict, verdict
from .cell_cards import Card, cards, inverted_inside
from .charts import Histogram, histograms
from .frame import Frame
from .geometry import Geometry, geometry, in_both
from .hard_faces import ListedFace, drawn_faces, listed_faces
from .in_slices import Drawing
from .page_cells import drawable
from .picture import Picture

if TYPE_CHECKING:
    from ...doctor.streamed.passes import Share
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
    ids, summaries = by_region(quality)
    names = tuple(name for name, _ in summaries)
    can_be_drawn = drawable(quality) if before is None else in_both(before, quality)
    picture: Picture | None = None
    own: list[Card] = []
    if can_be_drawn.any():
        frame = frame or Frame.of(quality.mesh.points, *(() if before is None else (before.mesh.points,)))
        picture = Picture.of(quality, ids, names, can_be_drawn=can_be_drawn, frame=frame)
        own = cards(picture, worst_ids(report), inverted_inside(quality.status, len(report.worst)))
    return section_of(
        report,
        summaries,
        _beside_regions(quality, ids, names, report) if len(names) > 1 else {},
        picture,
        own,
        bins=bins,
        budget=budget,
        before=before,
    )


NOT_DRAWN = "The mesh is not drawn: it was measured slice by slice, and there is too little memory to draw it."


OF_PARTS = (
    "The mesh is not drawn: partial reports hold numbers, not its surface. 'meshgauge report --as-one --html', given "
    "the files of the parts, draws it."
)


def section_without_model(report: FileReport, *, bins: int = 20, why: str = NOT_DRAWN) -> Section:
    """The section of a mesh that was measured slice by slice or in parts, and is not in memory: all but its pictures.

    Parameters
    ----------
    report
        With the regions, if they are to be shown.
    bins
        As for `section`.
    why
        Why there are none, a sentence for the page.
    """
    return section_of(report, report.regions, beside_of(report), None, bins=bins, left_out=(why,))


def section_in_slices(
    job: Job,
    partial: Partial,
    *,
    path: str | None = None,
    step: StepOf | None = None,
    with_diagnosis: bool = False,
    memory: int | None = None,
    tell: Share | None = None,
    bins: int = 20,
    budget: int = BUDGET,
) -> tuple[Section, FileReport]:
    """The section of a mesh that was measured slice by slice, the same as of the whole, and the report on it.

    Parameters
    ----------
    job, partial
        The mesh and what was measured, with the regions, counted by a `ShownCounter`.
    path, with_diagnosis, memory, tell
        As for `file_report`.
    step
        Which of several time steps it is.
    bins, budget
        As for `section`.
    """
    drawing = Drawing(job, partial)
    report = file_report(
        job, partial, path=path, with_diagnosis=with_diagnosis, memory=memory, on_few=drawing.take_boundary, tell=tell
    )
    if drawing.lacks_boundary:
        drawing.take_boundary(boundary_cells(job, partial, memory))
    report = replace(report, step=step)
    picture, cells = drawing.picture(report)
    return section_of(report, report.regions, beside_of(report), picture, cells, bins=bins, budget=budget), report


def section_of(
    report: FileReport,
    summaries: Iterable[tuple[str, Summary]],
    beside_regions: beside.Tallies,
    picture: Picture | None,
    cells: Sequence[Card] = (),
    *,
    bins: int,
    budget: int = BUDGET,
    before: Quality | None = None,
    left_out: Sequence[str] = (),
) -> Section:
    """A section of what is known of a mesh.

    Parameters
    ----------
    report
        All but its regions.
    summaries, beside_regions
        Name and J_ENS of each region, and what stands beside.
    picture, cells
        What is drawn; None: nothing.
    bins, budget, before
        As for `section`.
    left_out
        What the page is to say of itself.
    """
    said = list(left_out)
    if bins > BINS:
        said.append(f"The histograms have {BINS} bars, not {bins}.")
        bins = BINS
    regions = _rows_of_regions(summaries, said)
    drawn = Geometry(None, "", [])
    if picture is not None:
        drawn = geometry(picture, report.summary, bins=bins, budget=budget, before=before)
    faces, model = listed_faces(report.finite_volume), drawn.model
    if model is not None and faces:
        assert picture is not None  # of a mesh in memory: else faces are not measured
        place = Frame(tuple(model["frame"]["centre"]), model["frame"]["half"])
        model = {**model, "faces": drawn_faces(faces, picture.quality.mesh, place)}
    return Section(
        path=report.path,
        n_points=report.n_points,
        n_cells=report.n_cells,
        verdict=verdict(report.summary),
        summary=report.summary,
        types=[(name, tally) for name, tally in report.summary.types.items() if tally.n_measured],
        regions=regions if len(regions) > 1 else [],
        beside_types=beside.of_types(report),
        beside_regions=beside_regions if len(regions) > 1 else {},
        histograms=histograms(report.summary, bins),
        cards=list(cells),
        report=report,
        left_out=[*said, *drawn.remarks],
        model=model,
        faces=faces,
        geometry=drawn.text,
    )


def beside_of(report: FileReport) -> beside.Tallies:
    """What a report has on its regions beside J_ENS."""
    names = [name for name, _ in report.regions]
    return beside.of_regions(names, report.region_companions) if len(report.region_companions) == len(names) else {}


def worst_ids(report: FileReport) -> NDArray[np.int64]:
    """Of the worst cells."""
    return np.array([cell.cell for cell in report.worst], np.int64)


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
