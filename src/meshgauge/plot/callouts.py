"""What is drawn over a rendered picture: rings about worst nodes, numbers, labels with their lines."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..look.bands import USUAL, PoorBelow
from ..look.colours import INK, WORDS
from ..quality.poor import limit_of
from ..quality.worst import WorstCell
from .chart_style import number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]


def picture(figure: Figure, image: NDArray[np.uint8], left: float, top: float) -> Axes:
    """Axes that show an image, measured in its pixels, with its top left corner at these pixels of the figure."""
    height, width = image.shape[:2]
    w, h = figure.get_figwidth() * 100, figure.get_figheight() * 100
    axes = figure.add_axes((left / w, 1 - (top + height) / h, width / w, height / h))
    axes.set_axis_off()
    axes.imshow(image, extent=(0, width, height, 0), interpolation="none", aspect="auto")
    axes.set_xlim(0, width)
    axes.set_ylim(height, 0)
    axes.set_clip_on(False)
    return axes


def ring(axes: Axes, at: Array, size: float = 7) -> None:
    """A white dot with a dark rim."""
    axes.plot(
        *at, "o", markersize=size, markerfacecolor="white", markeredgecolor=INK, markeredgewidth=1.6, zorder=3,
        clip_on=False,
    )  # fmt: skip


def badge(axes: Axes, at: Array, text: str) -> None:
    """A number in a dark disc."""
    axes.text(
        at[0], at[1], text, ha="center", va="center", fontsize=10.5, color="white", weight="bold", zorder=4,
        bbox={"boxstyle": "circle,pad=0.22", "facecolor": INK, "edgecolor": "white", "linewidth": 1.2},
    )  # fmt: skip


def caption(cell: WorstCell) -> tuple[str, str, str]:
    """What a cell is, its value, and where it is worst; why it is not valid if its value does not tell."""
    value_says_it = cell.status in ("ok", "inverted")
    point = f"point {cell.point}" if cell.point_label is None else f"node {cell.point_label}"
    where = f"worst at {point}" if value_says_it else cell.status.replace("_", " ")
    name = f"{cell.cell}" if cell.cell_label is None else f"element {cell.cell_label}"
    return f"{cell.type} {name}", number(cell.quality), where


def colour_of(cell: WorstCell, poor_below: PoorBelow = USUAL) -> str:
    """Of the text of a value."""
    if cell.status != "ok":
        return WORDS["invalid"]
    return WORDS["poor"] if cell.quality < limit_of(poor_below, cell.type) else WORDS["good"]


def labels(
    axes: Axes, cells: list[WorstCell], at: Array, x: float, height: float, poor_below: PoorBelow = USUAL
) -> None:
    """A column of labels at ``x``, each with a line to its ring, in the order of the rings: no lines cross."""
    step = 62.0
    order = np.argsort(at[:, 1], kind="stable")
    places = _spread(at[order, 1], step, height)
    for n, y in zip(order, places, strict=True):
        cell, (px, py) = cells[n], at[n]
        what, value, where = caption(cell)
        axes.plot([px, x + 6], [py, y], color=INK, linewidth=0.9, zorder=2, clip_on=False)
        ring(axes, at[n])
        look: dict[str, Any] = {"ha": "right", "fontsize": 12.5, "clip_on": False}
        axes.text(x, y - 3, f"{what}  ", va="bottom", color=INK, **look)
        axes.text(x, y + 3, f"{value}, {where}  ", va="top", color=colour_of(cell, poor_below), **look)


def apart(at: Array, distance: float) -> Array:
    """Places near to the given ones, no two nearer to each other than a distance."""
    places = at + np.array([0.0, -0.9 * distance])
    for _ in range(300):
        gap = places[:, None] - places[None, :]
        far = np.linalg.norm(gap, axis=2)
        np.fill_diagonal(far, np.inf)
        close = far < distance
        if not close.any():
            break
        # Those at one place leave it in different directions.
        turn = np.arange(len(places)) * 2.4
        gap += 1e-3 * (np.stack([np.cos(turn), np.sin(turn)], axis=1)[:, None] - 0.5)
        push = np.where(close[..., None], gap / np.maximum(np.linalg.norm(gap, axis=2, keepdims=True), 1e-9), 0.0)
        places = places + 0.25 * distance * push.sum(axis=1)
    return np.asarray(places)


def _spread(wanted: Array, step: float, height: float) -> Array:
    """Places as near to the wanted ones as they can be, in their order, ``step`` apart, within the height."""
    places = wanted.copy()
    for _ in range(200):
        moved = False
        for i in range(len(places) - 1):
            gap = step - (places[i + 1] - places[i])
            if gap > 0.5:
                places[i] -= gap / 2
                places[i + 1] += gap / 2
                moved = True
        places = np.clip(places, step / 2, height - step / 2)
        if not moved:
            break
    return places
