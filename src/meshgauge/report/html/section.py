"""One measured mesh as a section of a page."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...status import STATUSES
from ...summary import Summary, Tally
from ...topology import topology
from .. import style
from ..by_region import by_region
from ..record import FileReport
from ..verdict import Verdict, verdict
from . import surface
from .cells import WHOLE, WORST, Ids, arrays_of, chosen, drawable, kinds
from .charts import Histogram, histograms
from .colours import DEGENERATE, INVALID, STOPS, UNKNOWN
from .frame import Frame
from .gallery import Card, cards
from .pack import packed

if TYPE_CHECKING:
    from ..._quality import Quality

BUDGET = 18_000_000
"""Bytes of the geometry of a page, compressed and written as text."""

TRIANGLES = 300_000
"""Triangles of a surface from which it is made coarser."""

BINS = 200
"""Bars of a histogram at most: more are thinner than a line."""

REGIONS = 60
"""Rows of the table of regions at most."""

POOR = 0.2


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
    histograms: list[Histogram]
    cards: list[Card]
    report: FileReport
    left_out: list[str]
    model: dict[str, Any] | None  #: for the script of the page; None if there is nothing to draw
    geometry: str = ""  #: packed arrays
    kind: str = "mesh"
    extra: dict[str, Any] = field(default_factory=dict)


def section(quality: Quality, report: FileReport | None = None, *, bins: int = 20, budget: int = BUDGET) -> Section:
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
        Bytes that the packed geometry may take. What does not fit is left out, best cells first, and that is said.
    """
    if report is None:
        report = report_of(quality)
    ids, found = by_region(quality)
    regions, left_out = [(name, one.all) for name, one in found if one.all.n_measured], []
    if bins > BINS:
        left_out.append(f"The histograms have {BINS} bars, not {bins}.")
        bins = BINS
    names = tuple(name for name, _ in found)
    can_be_drawn = drawable(quality)
    worst = np.array([cell.cell for cell in report.worst], np.int64)
    model, geometry, more = _geometry(quality, report.summary, can_be_drawn, ids, names, bins, budget)
    if len(regions) > REGIONS:
        left_out.append(f"The table of regions has the {REGIONS} with the lowest minimum, of {len(regions)}.")
        regions = sorted(regions, key=lambda row: row[1].min)[:REGIONS]
    types = [(name, tally) for name, tally in report.summary.types.items() if tally.n_measured]
    return Section(
        path=report.path,
        n_points=report.n_points,
        n_cells=report.n_cells,
        verdict=verdict(report.summary),
        summary=report.summary,
        types=types,
        regions=regions if len(regions) > 1 else [],
        histograms=histograms(report.summary, bins),
        cards=cards(quality, worst, ids, names, can_be_drawn),
        report=report,
        left_out=[*left_out, *more],
        model=model,
        geometry=geometry,
    )


def report_of(quality: Quality, *, worst: int = 10, path: str | None = None) -> FileReport:
    """The record of a mesh that was measured from Python."""
    mesh = quality.mesh
    return FileReport(
        path=path or mesh.path or "mesh",
        n_points=mesh.n_points,
        n_cells=mesh.n_cells,
        summary=quality.summary(),
        worst=tuple(quality.worst(worst)),
        notes=tuple(mesh.notes),
        findings=tuple(quality.findings()),
    )


def _geometry(
    quality: Quality,
    summary: Summary,
    can_be_drawn: NDArray[np.bool_],
    ids: Ids,
    names: tuple[str, ...],
    bins: int,
    budget: int,
) -> tuple[dict[str, Any] | None, str, list[str]]:
    """The model of the whole mesh for the script, its arrays as text, and what was left out of them."""
    mesh = quality.mesh
    n_drawn = int(np.count_nonzero(can_be_drawn))
    if not n_drawn:
        return None, "", []
    frame = Frame.of(mesh.points)
    boundary = surface.boundary(topology(mesh))
    most, triangles = (WHOLE if n_drawn <= WHOLE else WORST), TRIANGLES
    while True:
        cells = chosen(quality, can_be_drawn, most)
        skin, is_coarse = _skin(quality, boundary, frame, triangles)
        result = packed({**arrays_of(quality, cells, ids, bins, frame), **skin})
        if len(result.text) <= budget or most < 50:
            break
        most, triangles = min(most, len(cells)) // 2, triangles // 2
    values = quality.values[cells]
    whole = len(cells) == n_drawn
    reach = 1.0 if whole else math.floor(float(np.nanmax(values)) * 100) / 100
    told = [f"All {style.number(n_drawn)} cells are in this page."] if whole else [_partly(len(cells), n_drawn, reach)]
    if is_coarse:
        told.append(
            f"The surface is made coarser, from {style.number(boundary.n_triangles)} triangles to "
            f"{style.number(len(skin['surfaceSize']))}; it has the shape of the mesh, but not its faces."
        )
    solid = summary.all.n_cells
    if n_drawn < solid:
        told.append(
            f"{style.plural(solid - n_drawn, 'solid cell')} cannot be drawn: no known faces, or no finite place."
        )
    model = {
        "kinds": kinds(mesh.types[cells]),
        "layout": result.layout,
        "edges": summary.all.histogram(bins)[0].tolist(),
        "regions": list(names),
        "statuses": [
            {"name": row.name, "valid": row.is_valid, "text": row.text} for _, row in sorted(STATUSES.items())
        ],
        "whole": whole,
        "total": n_drawn,
        "reach": reach,
        "start": min(_start(values), reach),
        "frame": {"centre": list(frame.centre), "half": frame.half},
        "coarse": is_coarse,
        "colours": {"stops": STOPS, "invalid": INVALID, "degenerate": DEGENERATE, "unknown": UNKNOWN},
    }
    return model, result.text, told


def _partly(n: int, of: int, reach: float) -> str:
    return (
        f"Of {style.number(of)} cells the {style.number(n)} worst are in this page with their shape: all that are not "
        f"valid or below {reach:.2f}, as far as there is room. The numbers are of all cells."
    )


def _start(values: NDArray[np.float64]) -> float:
    """Where the slider stands first: poor cells if there are any, else about the worst hundredth."""
    measured = np.sort(values[~np.isnan(values)])
    if not len(measured) or measured[0] < POOR:
        return POOR
    place = min(max(len(measured) // 100, 20), len(measured) - 1)
    return min(math.ceil(float(measured[place]) * 100 + 1e-9) / 100, 1.0)


def _skin(
    quality: Quality, boundary: surface.Polygons, frame: Frame, most: int
) -> tuple[dict[str, NDArray[Any]], bool]:
    """The arrays of the surface, points quantised to 16 bits; made coarser, without quality, if it is too large."""
    if boundary.n_triangles > most:
        used, local = np.unique(boundary.points, return_inverse=True)
        corners = surface.triangles(surface.Polygons(boundary.offsets, local.reshape(-1), boundary.cells))
        points, kept = surface.decimated(frame.shown(quality.mesh.points[used]), corners, most)
        return {
            "surfaceSize": np.full(len(kept), 3, np.uint16),
            "surfacePoint": kept.astype(np.uint32),
            "surfaceXyz": _quantised(points),
        }, True
    used, local = np.unique(boundary.points, return_inverse=True)
    return {
        "surfaceSize": np.diff(boundary.offsets).astype(np.uint16),
        "surfacePoint": local.reshape(-1).astype(np.uint32),
        "surfaceXyz": _quantised(frame.shown(quality.mesh.points[used])),
        "surfaceCell": boundary.cells.astype(np.uint32),
        "surfaceValue": quality.values[boundary.cells].astype(np.float32),
        "surfaceStatus": quality.status[boundary.cells],
    }, False


def _quantised(points: NDArray[np.float64]) -> NDArray[np.uint16]:
    return np.rint((np.clip(points, -1, 1) + 1) * 32767.5).astype(np.uint16)
