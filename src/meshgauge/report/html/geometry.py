"""The shapes of a mesh for the script of the page: a model in plain data, and arrays as text."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...look import style
from ...look.bands import POOR
from ...look.colours import DEGENERATE, EDGE, GHOST, INVALID, STOPS, UNKNOWN
from ...quality.summary import Summary
from ...status import STATUSES, is_usable
from . import surface
from .frame import ABOVE, ASIDE, Frame
from .pack import pack_arrays
from .page_cells import WHOLE, WORST, Ids, arrays_of, cells_to_show, drawable, drawing_code, kinds, nodes_of
from .picture import TRIANGLES, Picture, Skin

if TYPE_CHECKING:
    from ...quality.measure import Quality

CHANGING = ("bin", "value", "status", "nodeValue", "xyz", "surfaceXyz", "surfaceValue", "surfaceStatus")
"""The arrays that differ between two states of a mesh; those of the state before are called so."""


class Geometry(NamedTuple):
    """What there is to draw."""

    model: dict[str, Any] | None  #: None if there is nothing
    text: str  #: packed arrays
    remarks: list[str]  #: what is in them, and what was left out


def geometry(picture: Picture, summary: Summary, *, bins: int, budget: int, before: Quality | None = None) -> Geometry:
    """The whole mesh for the script.

    Parameters
    ----------
    picture, summary
        Of the mesh; the cells that cannot be drawn are left out.
    bins
        Of the histograms that are linked with the picture.
    budget
        Characters that the arrays may take; what does not fit is left out, the best cells first.
    before
        Of the same cells with their points elsewhere, to be shown in turn.
    """
    quality, frame, n_drawn = picture.quality, picture.frame, picture.n_drawn
    mesh, can_be_drawn, names = quality.mesh, picture.can_be_drawn, picture.names
    most, triangles = (WHOLE if n_drawn <= WHOLE else WORST), TRIANGLES
    while True:
        cells = cells_to_show(quality, can_be_drawn, most)
        reach = _reach(quality, cells)
        if before is not None:
            others = cells_to_show(before, can_be_drawn, most)
            reach = min(reach, _reach(before, others))
            cells = np.union1d(cells, others)
        arrays = _arrays(picture, cells, bins, triangles)
        if before is not None:
            then = replace(picture, quality=before, skin=replace(picture.skin, points=before.mesh.points))
            other = _arrays(then, cells, bins, triangles)
            arrays |= {f"{name}Before": other[name] for name in CHANGING if name in other and _is_fine(arrays, name)}
        result = pack_arrays(arrays)
        if len(result.text) <= budget or most < 50:
            break
        most, triangles = min(most, len(cells)) // 2, triangles // 2
    whole, is_coarse = len(cells) == n_drawn, "surfaceCell" not in arrays
    reach = 1.0 if whole else reach
    model = {
        "kinds": kinds(mesh.types[cells], mesh.dimension, quality.poor_below),
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
        "from": list(ABOVE if mesh.up else ASIDE),
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
    return Geometry(model, result.text, _remarks(summary, len(cells), n_drawn, reach, picture.skin, arrays))


def _is_fine(arrays: dict[str, NDArray[Any]], name: str) -> bool:
    """False for arrays of a surface that was made coarser: in another state it has other triangles."""
    return "surfaceCell" in arrays or not name.startswith("surface")


def in_both(before: Quality, after: Quality) -> NDArray[np.bool_]:
    """The cells that can be drawn in both states, with the same nodes."""
    can_be_drawn = drawable(before) & drawable(after)
    if after.polyhedra is not None:
        cells = after.polyhedra.cells[can_be_drawn[after.polyhedra.cells]]
        if not np.array_equal(nodes_of(before, cells).points, nodes_of(after, cells).points):
            can_be_drawn[cells] = False
    return can_be_drawn


def _remarks(
    summary: Summary, n: int, n_drawn: int, reach: float, skin: Skin, arrays: dict[str, NDArray[Any]]
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
            f"The surface is made coarser, from {style.number(skin.n_triangles)} triangles to "
            f"{style.number(len(arrays['surfaceSize']))}; it has the form of the mesh, but not its faces."
        )
    missing = summary.all.n_cells - n_drawn
    if missing:
        remarks.append(f"{style.plural(missing, 'cell')} cannot be drawn: no known faces, or no finite place.")
    return remarks


def _arrays(picture: Picture, cells: Ids, bins: int, most: int) -> dict[str, NDArray[Any]]:
    quality, skin, frame = picture.quality, picture.skin, picture.frame
    own = arrays_of(quality, cells, picture.regions, bins, frame, n_regions=len(picture.names))
    return picture.named({**own, **_skin(quality, skin, frame, most)})


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


def _skin(quality: Quality, skin: Skin, frame: Frame, most: int) -> dict[str, NDArray[Any]]:
    """The arrays of the surface, points quantised to 16 bits; made coarser, without quality, if it is too large."""
    faces = skin.polygons
    if faces is None or skin.n_triangles > most:
        points, kept = _coarser(skin, frame, most)
        return {
            "surfaceSize": np.full(len(kept), 3, np.uint16),
            "surfacePoint": kept.astype(np.uint32),
            "surfaceXyz": _quantise(points),
        }
    used, local = np.unique(faces.points, return_inverse=True)
    return {
        "surfaceSize": np.diff(faces.offsets).astype(np.uint16),
        "surfacePoint": local.reshape(-1).astype(np.uint32),
        "surfaceXyz": _quantise(frame.shown(skin.points[used])),
        "surfaceCell": faces.cells.astype(np.uint32),
        "surfaceValue": quality.values[faces.cells].astype(np.float32),
        **(
            {"surfacePoor": quality.poor_limits(faces.cells).astype(np.float32)} if quality.poor_below.of_shapes else {}
        ),
        "surfaceStatus": quality.status[faces.cells],
    }


def _coarser(skin: Skin, frame: Frame, most: int) -> tuple[NDArray[np.float64], Ids]:
    if skin.coarse is not None:
        points, corners = skin.coarse
        return (points, corners) if len(corners) <= most else surface.decimate(points, corners, most)
    assert skin.polygons is not None  # one of the two is there
    return surface.decimate(frame.shown(skin.points), surface.triangles(skin.polygons), most)


def _quantise(points: NDArray[np.float64]) -> NDArray[np.uint16]:
    # A point that is not finite in the other of two states is of no face that is drawn.
    return np.rint((np.clip(np.nan_to_num(points), -1, 1) + 1) * 32767.5).astype(np.uint16)
