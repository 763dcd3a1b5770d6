"""Meshes side by side: the distribution of each type of cell, and beside it the share of the worst cells."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..errors import MeshgaugeError
from ..look.colours import GRID, INK, SOFT
from ..plot import chart_style
from ..plot.cumulative_chart import curve
from ..plot.distributions import Series, edges_of
from ..plot.histogram_chart import BINS, legend, outlines
from . import Comparison

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ROW = 1.35
"""Height of a row, in inches."""


def comparison_chart(comparison: Comparison, *, names: Sequence[str] | None = None, bins: int = BINS) -> Figure:
    """Draw a comparison: a row for each type of cell and for all, on one axis of quality.

    Parameters
    ----------
    comparison
        From `meshgauge.compare.comparison`.
    names
        What to call the meshes; None: as they are.
    bins
        Bins over the range of J_ENS.

    Returns
    -------
    matplotlib.figure.Figure
        Not known to pyplot. Left, histograms, each mesh as a share of its own cells of the type; right, the share of
        the cells at or below each value, on a logarithmic axis: the lower a curve, the fewer bad cells.

    Raises
    ------
    MeshgaugeError
        If no cell has a value.
    """
    if not comparison.rows or not any(side.tally("all") for side in comparison.sides):
        raise MeshgaugeError("there is nothing to draw: no cell has a value")
    called = names if names is not None else [side.name for side in comparison.sides]
    meshes = [Series(name, side.summary) for name, side in zip(called, comparison.sides, strict=True)]
    edges = edges_of([mesh.summary.all for mesh in meshes], bins)
    head, foot = 0.95 + 0.24 * len(meshes), 0.6
    height = head + ROW * len(comparison.rows) + foot
    figure = chart_style.figure(10, height)
    chart_style.title(figure, "Quality side by side", "each mesh as a share of its own cells of the type")
    legend(figure, meshes, 1 - 0.72 / height)
    for n, cells in enumerate(comparison.rows):
        bottom = (foot + ROW * (len(comparison.rows) - 1 - n) + 0.12) / height
        size = (ROW - 0.3) / height
        tallies = [side.tally(cells) for side in comparison.sides]
        empty = meshes[0].summary.all.empty(meshes[0].summary.scale)
        left = chart_style.axes(figure, (0.12, bottom, 0.42, size))
        right = chart_style.axes(figure, (0.63, bottom, 0.345, size))
        for axes in (left, right):
            chart_style.shade(axes, meshes[0].summary.scale, float(edges[0]), float(edges[-1]))
            axes.tick_params(labelbottom=n == len(comparison.rows) - 1)
        left.grid(visible=False)
        left.set_yticks([])
        left.set_ylim(0, outlines(left, [tally or empty for tally in tallies], edges) * 1.05)
        name = "all cells" if cells == "all" else cells
        left.text(-0.025, 0.45, name, transform=left.transAxes, ha="right", va="center", fontsize=10, color=INK)
        for at, tally in enumerate(tallies):
            if tally is not None:
                curve(right, tally, at)
        right.set_yscale("log")
        right.set_ylim(min(1 / tally.n_measured for tally in tallies if tally is not None) * 0.6, 1.4)
        right.grid(which="minor", axis="y", visible=False)
        right.grid(axis="x", color=GRID, linewidth=0.8)
        right.yaxis.set_major_formatter(lambda value, _: f"{100 * value:g} %")
    for x, text in ((0.12, "share of cells"), (0.63, "cells at or below")):
        figure.text(x, 1 - (head - 0.02) / height, text, ha="left", va="bottom", fontsize=9.5, color=SOFT)
    for axes in (left, right):
        axes.set_xlabel(chart_style.axis_label(meshes[0].summary.scale), fontsize=10, color=INK)
    return figure
