"""The shapes of a mesh for the script of the page: a model in plain data, and arrays as text."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...look import style
from ...look.bands import POOR
from ...look.colours import DEGENERATE, EDGE, GHOST, INVALID, STOPS, UNKNOWN
from ...mesh.topology import topology
from ...quality.summary import Summary
from ...status import STATUSES, is_usable
from . import surface
from .frame import Frame
from .pack import pack_arrays
from .page_cells import WHOLE, WORST, Ids, arrays_of, cells_to_show, drawable, drawing_code, kinds, nodes_of

if TYPE_CHECKING:
    from ...quality.measure import Quality

TRIANGLES = 400_000
"""Triangles of a surface from which it is made coarser."""


CHANGING = ("bin", "value", "status", "nodeValue", "xyz", "surfaceXyz", "surfaceValue", "surfaceStatus")
"""The arrays that differ between two states of a mesh; those of the state before are called so."""


class Geometry(NamedTuple):
    """What there is to draw."""

    model: dict[str, Any] | None  #: None if there is nothing
    text: str  #: packed arrays
    remarks: list[str]  #: what is in them, and what was left out


def geometry(
    quality: Quality,
    summary: Summary,
    ids: Ids,
    names: tuple[str, ...],
    *,
    bins: int,
    budget: int,
    before: Quality | None = None,
    frame: Frame | None = None,
) -> Geometry:
    """The whole mesh for the script.

    Parameters
    ----------
    quality, summary
        Of the mesh; the cells that cannot be drawn are left out.
    ids, names
        The region of each cell.
    bins
        Of the histograms that are linked with the picture.
    budget
        Characters that the arrays may take; what does not fit is left out, the best cells first.
    before
        Of the same cells with their points elsewhere, to be shown in turn.
    frame
        In which the mesh is placed, for several in one scene; None: its own.
    """
    mesh = quality.mesh
    can_be_drawn = drawable(quality) if before is None else _in_both(before, quality)
    n_drawn = int(np.count_nonzero(can_be_drawn))
    if not n_drawn:
        return Geometry(None, "", [])
    frame = frame or Frame.of(mesh.points, *(() if before is None else (before.mesh.points,)))
    boundary = surface.of_surfaces(mesh) if mesh.dimension == 2 else surface.boundary(topology(mesh))
    most, triangles = (WHOLE if n_drawn <= WHOLE else WORST), TRIANGLES
    while True:
        cells = cells_to_show(quality, can_be_drawn, most)
        reach = _reach(quality, cells)
        if before is not None:
            others = cells_to_show(before, can_be_drawn, most)
            reach = min(reach, _reach(before, others))
            cells = np.union1d(cells, others)
        arrays = _arrays(quality, cells, ids, bins, frame, boundary, triangles)
        if before is not None:
            other = _arrays(before, cells, ids, bins, frame, boundary, triangles)
            arrays |= {f"{name}Before": other[name] for name in CHANGING if name in other and _is_fine(arrays, name)}
        result = pack_arrays(arrays)
        if len(result.text) <= budget or most < 50:
            break
        most, triangles = min(most, len(cells)) // 2, triangles // 2
    whole, is_coarse = len(cells) == n_drawn, "surfaceCell" not in arrays
    reach = 1.0 if whole else reach
    model = {
        "kinds": kinds(mesh.types[cells], mesh.dimension or 3, quality.poor_below),
        "layout": result.layout,
        "edges": summary.all.histogram(bins)[0].tolist(),
        "regions": list(names),
        "statuses": [
            {"name": row.name, "class": drawing_code(status, mesh.purpose), "text": row.text}
            for status, row in sorted(STATUSES.items())
        ],
        "poorBelow": quality.poor_below.all,
        "whole": whole,
        "total": n_drawn,
        "reach": reach,
        "start": min(_start(quality, cells), reach),
        **({} if before is None else {"startBefore": min(_start(before, cells), reach)}),
        "frame": {"centre": list(frame.centre), "half": frame.half},
        "coarse": is_coarse,
        "before": before is not None,
        "colours": {
            "stops": STOPS,
            "invalid": INVALID,
            "degenerate": DEGENERATE,
            "unknown": UNKNOWN,
            "ghost": GHOST,
            "edge": EDGE,
            "poorBelow": POOR,
        },
    }
    return Geometry(model, result.text, _remarks(summary, len(cells), n_drawn, reach, boundary, arrays))


def _is_fine(arrays: dict[str, NDArray[Any]], name: str) -> bool:
    """False for arrays of a surface that was made coarser: in another state it has other triangles."""
    return "surfaceCell" in arrays or not name.startswith("surface")


def _in_both(before: Quality, after: Quality) -> NDArray[np.bool_]:
    """The cells that can be drawn in both states, with the same nodes."""
    can_be_drawn = drawable(before) & drawable(after)
    if after.polyhedra is not None:
        cells = after.polyhedra.cells[can_be_drawn[after.polyhedra.cells]]
        if not np.array_equal(nodes_of(before, cells).points, nodes_of(after, cells).points):
            can_be_drawn[cells] = False
    return can_be_drawn


def _remarks(
    summary: Summary, n: int, n_drawn: int, reach: float, boundary: surface.Polygons, arrays: dict[str, NDArray[Any]]
) -> list[str]:
    if n == n_drawn:
        remarks = ["The one cell is in this page." if n == 1 else f"All {style.number(n)} cells are in this page."]
    else:
        remarks = [
            f"Of {style.number(n_drawn)} cells the {style.number(n)} worst are in this page with their shape: all that "
            f"are not usable or below {reach:g}, as far as there is room. The numbers are of all cells."
        ]
    if "surfaceCell" not in arrays:
        remarks.append(
            f"The surface is made coarser, from {style.number(boundary.n_triangles)} triangles to "
            f"{style.number(len(arrays['surfaceSize']))}; it has the form of the mesh, but not its faces."
        )
    missing = summary.all.n_cells - n_drawn
    if missing:
        remarks.append(f"{style.plural(missing, 'cell')} cannot be drawn: no known faces, or no finite place.")
    return remarks


def _arrays(
    quality: Quality, cells: Ids, ids: Ids, bins: int, frame: Frame, boundary: surface.Polygons, most: int
) -> dict[str, NDArray[Any]]:
    return {**arrays_of(quality, cells, ids, bins, frame), **_skin(quality, boundary, frame, most)}


def _reach(quality: Quality, cells: Ids) -> float:
    """A quality below which all usable cells of the mesh are among these, the worst ones; a multiple of 0.005."""
    values = quality.values[cells[is_usable(quality.status[cells], quality.mesh.purpose)]]
    return math.floor(float(values[~np.isnan(values)].max(initial=-1.0)) * 200) / 200


def _start(quality: Quality, cells: Ids) -> float:
    """Where the slider stands first: poor cells if there are any, else about the worst hundredth."""
    values, limit = quality.values[cells], quality.poor_below.all
    measured = np.sort(values[~np.isnan(values)])
    if not len(measured) or measured[0] < limit:
        return limit
    place = min(max(len(measured) // 100, 20), len(measured) - 1)
    return min(math.ceil(float(measured[place]) * 100 + 1e-9) / 100, 1.0)


def _skin(quality: Quality, boundary: surface.Polygons, frame: Frame, most: int) -> dict[str, NDArray[Any]]:
    """The arrays of the surface, points quantised to 16 bits; made coarser, without quality, if it is too large."""
    used, local = np.unique(boundary.points, return_inverse=True)
    local = local.reshape(-1)
    points = frame.shown(quality.mesh.points[used])
    if boundary.n_triangles > most:
        corners = surface.triangles(surface.Polygons(boundary.offsets, local, boundary.cells))
        points, kept = surface.decimate(points, corners, most)
        return {
            "surfaceSize": np.full(len(kept), 3, np.uint16),
            "surfacePoint": kept.astype(np.uint32),
            "surfaceXyz": _quantise(points),
        }
    return {
        "surfaceSize": np.diff(boundary.offsets).astype(np.uint16),
        "surfacePoint": local.astype(np.uint32),
        "surfaceXyz": _quantise(points),
        "surfaceCell": boundary.cells.astype(np.uint32),
        "surfaceValue": quality.values[boundary.cells].astype(np.float32),
        **(
            {"surfacePoor": quality.poor_limits(boundary.cells).astype(np.float32)}
            if quality.poor_below.of_shapes
            else {}
        ),
        "surfaceStatus": quality.status[boundary.cells],
    }


def _quantise(points: NDArray[np.float64]) -> NDArray[np.uint16]:
    # A point that is not finite in the other of two states is of no face that is drawn.
    return np.rint((np.clip(np.nan_to_num(points), -1, 1) + 1) * 32767.5).astype(np.uint16)
