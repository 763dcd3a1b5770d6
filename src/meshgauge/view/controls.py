"""Between what the page's controls hold and a `View`: plain values, which come from a browser and are not trusted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..look.colours import STATUS, bar_fill, css, css_of, shade
from ..look.names import cell_entry, cell_name, point_entry
from ..look.style import plural
from ..mesh.labels import cell_label
from ..quality.worst import worst_first
from .camera import Camera, Vector
from .card import Card, coordinates, number
from .filters import AXES, MOST_PLANES, Filters, Plane, others
from .histogram import EDGES, LEAST, bars, by_status
from .link import View
from .model import Model

SLICES = tuple(tuple(f"{name}{n or ''}" for name in ("axis", "flipped", "at")) for n in (0, *range(2, MOST_PLANES + 1)))
"""State of each slice: its axis, whether the other side is cut away, and where it is."""

OFF, OBLIQUE = "off", "view"
"""Choices of the slicing plane beside the axes: none, and along the line of sight."""

WORST = 50
"""Cells in the lists of the worst, together."""


@dataclass(frozen=True, slots=True)
class Choices:
    """What the meshes offer to be chosen from: names, and the number of solid cells of each in the first mesh."""

    types: dict[str, int]
    statuses: dict[str, int]
    regions: dict[str, int]

    @classmethod
    def of(cls, models: Sequence[Model]) -> Choices:
        """Those of the first mesh, then those that only others have."""
        totals: list[dict[str, int]] = [{}, {}, {}]
        for model in models:
            for merged, counts in zip(
                totals, (model.counts("types"), model.counts("statuses"), model.counts("regions")), strict=True
            ):
                for name, n in counts.items():
                    merged.setdefault(name, n)
        return cls(*totals)


def controls(view: View, choices: Choices) -> dict[str, Any]:
    """The values of the controls that stand for a view."""
    filters = view.filters
    slices: dict[str, Any] = {}
    for n, names in enumerate(SLICES):
        slices |= zip(names, _slice(filters.planes[n]) if n < len(filters.planes) else (OFF, False, 0.5), strict=True)
    return {
        **slices,
        "quality": [filters.low, filters.high],
        "with_undefined": filters.undefined,  # "undefined" is a word of the page's language
        "types": _choice(filters.types, choices.types),
        "statuses": _choice(filters.statuses, choices.statuses),
        "regions": [] if filters.regions is None else sorted(filters.regions),
        "peel": filters.peel,
        "edges": view.edges,
        "shrink": view.shrink,
        "hollows": view.hollows,
        "colour_by": view.colour,
    }


def _slice(plane: Plane) -> tuple[str, bool, float]:
    """The values of the controls of one slice."""
    minus = (-plane.normal[0], -plane.normal[1], -plane.normal[2])
    axis = next((name for name, along in AXES.items() if along in (plane.normal, minus)), OBLIQUE)
    return axis, axis in AXES and AXES[axis] == minus, plane.at


def filters(values: Mapping[str, Any], choices: Choices, *, sights: Sequence[Vector]) -> Filters:
    """The filters that the controls stand for. Raises `ViewError`, TypeError or ValueError if they make no sense.

    ``sights`` are the normals of planes across the line of sight, one for each slice.
    """
    low, high = sorted(float(value) for value in values["quality"])
    regions = frozenset(str(name) for name in values["regions"])
    planes = []
    for (axis, flipped, at), sight in zip(SLICES, sights, strict=True):
        if values[axis] == OFF:
            continue
        normal = sight if values[axis] == OBLIQUE else AXES[values[axis]]
        if values[axis] != OBLIQUE and values[flipped]:
            normal = (-normal[0], -normal[1], -normal[2])
        planes.append(Plane(normal, float(values[at])))
    return Filters(
        low=round(low, 4),
        high=round(high, 4),
        undefined=bool(values["with_undefined"]),
        types=_names(values["types"], choices.types),
        statuses=_names(values["statuses"], choices.statuses),
        regions=regions or None,
        planes=tuple(planes),
        peel=int(values["peel"]),
    )


def bins(models: Sequence[Model], view: View) -> list[dict[str, Any]]:
    """The bars of the histogram: of each bin its edges, colour, and for each mesh a height and how many cells."""
    parts = [by_status(model, others(model, view.filters)) for model in models]
    counts = [np.asarray(sum(of_model.values())) for of_model in parts]
    heights = [bars(n) for n in counts]
    fill = bar_fill(shade((EDGES[:-1] + EDGES[1:]) / 2, models[0].quality.poor_below.all))
    return [
        {
            "low": float(EDGES[i]),
            "high": float(EDGES[i + 1]),
            "colour": fill[i],
            "layers": _layers(parts[0], i, heights[0][i]),
            "heights": [h[i] for h in heights],
            "text": f"{number(EDGES[i])} to {number(EDGES[i + 1])}: "
            + ", ".join(_counted(of_model, i) for of_model in parts),
        }
        for i in range(len(fill))
    ]


def _layers(parts: Mapping[str, NDArray[np.int64]], at: int, height: float) -> list[dict[str, Any]]:
    """What lies over a bar, from its foot up: cells that are not valid, the highest first."""
    n, below, made = int(sum(of_name[at] for of_name in parts.values())), 0, []
    for name, fill in STATUS.items():
        below += int(parts[name][at])
        if parts[name][at]:
            made.append({"height": max(height * below / n, min(height, LEAST)), "colour": fill})
    return made[::-1]


def _counted(parts: Mapping[str, NDArray[np.int64]], at: int) -> str:
    """``28 cells, 1 invalid``."""
    names = [f"{int(parts[name][at]):,} {name}" for name in STATUS if parts[name][at]]
    return ", ".join([plural(int(sum(of_name[at] for of_name in parts.values())), "cell"), *names])


def worst(model: Model, n: int, among: NDArray[np.bool_] | None = None) -> list[dict[str, Any]]:
    """Rows of the list of the n worst cells, of all or of those that are shown."""
    quality = model.quality
    values = model.values if among is None else np.where(among, model.values, np.nan)
    cells = worst_first(values, quality.status, n, model.mesh.purpose)
    return [
        {
            "cell": cell.cell,
            "cell_name": cell_entry(cell.cell, cell.cell_label),
            "type": cell.type,
            "quality": number(cell.quality),
            "status": "" if cell.status == "ok" else cell.status.replace("_", " "),
            "colour": css_of(model.colours(np.array([cell.cell])))[0],
        }
        for cell in (quality.worst_node(int(one)) for one in cells)
    ]


def details(model: Model, card: Card, mesh: int, name: str) -> dict[str, Any]:
    """A cell for the page."""
    fill = css(np.array([row.quality for row in card.nodes]))
    return {
        "cell": card.cell,
        "cell_name": cell_name(card.cell, card.label),
        "mesh": mesh,
        "name": name,
        "type": card.type,
        "quality": number(card.quality),
        "colour": css_of(model.colours(np.array([card.cell])))[0],
        "status": card.status.replace("_", " "),
        "text": card.text,
        "region": card.region,
        "layer": card.layer,
        "neighbours": [
            {
                "cell": other,
                "name": cell_entry(other, cell_label(model.mesh, other)),
                "quality": number(float(model.values[other])),
                "colour": css_of(model.colours(np.array([other])))[0],
            }
            for other in model.neighbours(card.cell)
        ],
        "nodes": [
            {
                "node": row.node,
                "point": row.point,
                "point_name": point_entry(row.point, row.label),
                "x": coordinates(row.coordinates, card.spacing),
                "quality": number(row.quality),
                "colour": colour,
                "worst": row.is_worst,
            }
            for row, colour in zip(card.nodes, fill, strict=True)
        ],
    }


def view_from(view: View, values: Mapping[str, Any], choices: Choices, camera: Camera) -> View:
    """The view with what the controls say; a plane across the line of sight (of ``camera``) stays as it was set."""
    x, y, z = (round(-float(v), 6) for v in camera.forward)
    was, sights = controls(view, choices), []
    for n, (axis, *_) in enumerate(SLICES):
        kept = was[axis] == values[axis] == OBLIQUE
        sights.append(view.filters.planes[n].normal if kept else (x, y, z))
    return replace(
        view,
        filters=filters(values, choices, sights=sights),
        shrink=round(float(values["shrink"]), 4),
        hollows=bool(values["hollows"]),
        edges=bool(values["edges"]),
        colour=str(values["colour_by"]),
    )


def _choice(names: frozenset[str] | None, known: Mapping[str, int]) -> list[str]:
    return [name for name in known if names is None or name in names]


def _names(chosen: Sequence[Any], known: Mapping[str, int]) -> frozenset[str] | None:
    names = frozenset(str(name) for name in chosen)
    return None if names >= set(known) else names
