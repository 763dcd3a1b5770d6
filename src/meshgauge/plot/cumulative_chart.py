"""The cumulative distribution: which share of the cells is below each value."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..look.colours import GRID, INK, SOFT
from ..look.style import plural
from ..quality.measure import JENS
from ..quality.summary import Tally
from . import chart_style
from .distributions import Drawable, edges_of, series, steps_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def cumulative(what: Drawable | Mapping[str, Drawable], *, metric: str = JENS, log: bool = True) -> Figure:
    """The share of cells that are at or below each value: a curve for each type of one mesh, or for each of several.

    Parameters
    ----------
    what, metric
        As for `histogram`.
    log
        Logarithmic shares, which show the few worst cells.

    Returns
    -------
    matplotlib.figure.Figure
        Not known to pyplot. The lower a curve, the better the mesh; each starts at its worst cell, marked by a dot.

    Raises
    ------
    MeshgaugeError
        As `histogram`.
    """
    meshes = series(what, metric)
    alone = len(meshes) == 1
    curves: list[tuple[str, Tally]] = [(mesh.name, mesh.summary.all) for mesh in meshes]
    if alone:
        kinds = [(name, tally) for name, tally in meshes[0].summary.types.items() if tally.n_measured]
        curves = [("all cells", meshes[0].summary.all), *(kinds if len(kinds) > 1 else [])]
    curves = [(name, tally) for name, tally in curves if tally.n_measured]
    edges = edges_of([tally for _, tally in curves], 20)
    figure = chart_style.figure(8, 4.6)
    below = chart_style.sentence(meshes[0].summary) if alone else "each mesh as a share of its own cells"
    chart_style.title(figure, (alone and meshes[0].name) or "Cells at or below each quality", below)
    axes = chart_style.axes(figure, (0.1, 0.13, 0.62, 0.7))
    scale = meshes[0].summary.scale
    chart_style.shade(axes, scale, float(edges[0]), float(edges[-1]))
    for n, (_, tally) in enumerate(curves):
        curve(axes, tally, n, thick=alone and n == 0)
    if log:
        axes.set_yscale("log")
        axes.grid(which="minor", axis="y", visible=False)
    fewest = min(1 / tally.n_measured for _, tally in curves)
    axes.set_ylim(fewest * 0.6 if log else 0, 1.4 if log else 1.02)
    axes.grid(axis="x", color=GRID, linewidth=0.8)
    axes.yaxis.set_major_formatter(lambda value, _: f"{100 * value:g} %")
    axes.set_ylabel("cells at or below", fontsize=10, color=INK)
    axes.set_xlabel(chart_style.axis_label(scale), fontsize=10, color=INK)
    _legend(figure, curves)
    return figure


def curve(axes: Axes, tally: Tally, n: int, *, thick: bool = False) -> None:
    """The share of the cells of a tally at or below each value, in the look of the n-th; a dot where it starts."""
    colour, style = chart_style.stroke(n)
    values, below = steps_of(tally)
    share = below / tally.n_measured
    x = np.r_[values[:1], values, axes.get_xlim()[1]]
    y = np.r_[0.0, share, share[-1]]
    # From its first value on: a logarithmic axis has no place for 0.
    axes.step(x[1:], y[1:], where="post", color=colour, linestyle=style, linewidth=2.4 if thick else 1.5)
    axes.plot(x[1], y[1], "o", color=colour, markersize=4.5)


def _legend(figure: Figure, curves: list[tuple[str, Tally]]) -> None:
    from matplotlib.lines import Line2D

    step = 0.46 / figure.get_figheight()
    for n, (name, tally) in enumerate(curves):
        y = 0.8 - n * step
        colour, style = chart_style.stroke(n)
        figure.add_artist(Line2D([0.745, 0.785], [y, y], color=colour, linewidth=2.2, linestyle=style))
        look: dict[str, Any] = {"va": "center", "fontsize": 9.5, "color": INK, "parse_math": False}
        figure.text(0.795, y, chart_style.short(name, 19), ha="left", weight="bold", **look)
        figure.text(
            0.795,
            y - 0.42 * step,
            f"{plural(tally.n_measured, 'cell')}, min {chart_style.number(tally.min)}",
            ha="left",
            va="center",
            fontsize=8.5,
            color=SOFT,
        )
