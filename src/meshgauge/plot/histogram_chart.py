"""The histogram of quality: bars coloured by band for one mesh, outlines over each other for several."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..look.colours import FAINT, INK, STATUS, WORDS, colours
from ..look.style import plural
from ..quality.measure import JENS
from ..quality.summary import Scale, Tally
from . import chart_style
from .distributions import Counts, Drawable, Series, Values, by_status, counts_in, edges_of, series

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BINS = 80
"""Over the whole range of a bounded metric: 0.025 each for one from -1 to 1."""

LEAST = 0.006
"""Height of the lowest bar, as a share of the highest: three bad cells of millions are seen."""


def histogram(
    what: Drawable | Mapping[str, Drawable], *, metric: str = JENS, bins: int = BINS, log: bool = False
) -> Figure:
    """Histogram of a metric over all solid cells.

    Parameters
    ----------
    what
        A `Summary` or `Quality`, or several by name. One mesh is drawn in bars coloured by band, several as outlines,
        each as a share of its own cells.
    metric
        Which one of a `Quality`.
    bins
        Bins over the range of the metric; only the part that is used is drawn.
    log
        Logarithmic counts.

    Returns
    -------
    matplotlib.figure.Figure
        Not known to pyplot; ``savefig`` writes it.

    Raises
    ------
    MeshgaugeError
        If no cell has a value, or the summaries are of different metrics.
    MetricError
        If the metric was not measured.
    """
    meshes = series(what, metric)
    edges = edges_of([mesh.summary.all for mesh in meshes], bins)
    if len(meshes) == 1:
        return _one(meshes[0], edges, log)
    return _several(meshes, edges, log)


def _one(mesh: Series, edges: Values, log: bool) -> Figure:
    from matplotlib.ticker import MaxNLocator

    every = mesh.summary.all
    figure = chart_style.figure(8, 4.4)
    chart_style.title(figure, mesh.name or "Quality of all cells", chart_style.sentence(mesh.summary))
    axes = chart_style.axes(figure, (0.09, 0.13, 0.88, 0.55 if every.n_degenerate else 0.62))
    chart_style.shade(axes, every.scale, float(edges[0]), float(edges[-1]))
    counts = counts_in(every, edges)
    bars(axes, every, edges, counts, log)
    axes.set_ylabel("cells", fontsize=10, color=INK)
    axes.set_xlabel(chart_style.axis_label(every.scale), fontsize=10, color=INK)
    if not log:
        # There are no parts of cells.
        axes.yaxis.set_major_locator(MaxNLocator("auto", integer=True, min_n_ticks=1, steps=[1, 2, 2.5, 5, 10]))
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:,.0f}")
    _count_bands(axes, every, edges)
    return figure


def colours_on(values: Values, scale: Scale) -> NDArray[np.float64]:
    """`colours` of valid cells of a metric's values, by the range and direction of its scale."""
    lower_is_better = scale.better == "lower"
    return colours(values, scale.acceptable, is_signed=False, lower_is_better=lower_is_better)


def bars(axes: Axes, tally: Tally, edges: Values, counts: Counts, log: bool = False) -> None:
    """Bars in the colours of what their cells count as, worst at the foot; of valid ones in those of their values."""
    top = int(counts.max())
    heights = np.where(counts > 0, np.maximum(counts, 0 if log else LEAST * top), 0)
    middles = (edges[1:] + edges[:-1]) / 2
    width = np.diff(edges)
    look: dict[str, Any] = {"edgecolor": INK, "linewidth": 0.35}
    axes.bar(middles, heights, width=0.88 * width, color=colours_on(middles, tally.scale), **look)
    parts, below, layers = by_status(tally, edges), np.zeros(len(counts), np.int64), []
    for name, colour in STATUS.items():
        below = below + parts[name]
        # At the foot of its bar; those that there are have a line of it at least.
        least = np.minimum(np.maximum(below, 0 if log else LEAST * top), heights)
        layers.append((np.where(parts[name] > 0, least, 0), colour))
    for tall, colour in layers[::-1]:
        shown = tall > 0
        axes.bar(middles[shown], tall[shown], width=0.88 * width[shown], color=colour, **look)
    if log:
        axes.set_yscale("log")
        axes.set_ylim(0.7, top * 1.5)
    else:
        axes.set_ylim(0, top * 1.03)


def _count_bands(axes: Axes, tally: Tally, edges: Values) -> None:
    """How many cells are in each band, above it."""
    low, high = float(edges[0]), float(edges[-1])
    start, end = tally.scale.acceptable
    zero = 0.0 if tally.scale.is_signed else low
    middle = {
        "invalid": (low + zero) / 2,
        "degenerate": zero,
        "poor": (max(zero, low) + start) / 2 if start > low else (end + high) / 2,
        "good": (max(start, low) + min(end, high)) / 2,
    }
    n_of = chart_style.band_counts(tally)
    for band, x in middle.items():
        n = n_of[band]
        if (band == "degenerate" or not low < x < high) and not n:
            continue
        at = low if band == "invalid" else min(x, high)
        side = "left" if at == low else "right" if at == high else "center"
        raised = 0.16 if band == "degenerate" else 0.0  # between its neighbours there is no room
        look: dict[str, Any] = {"color": WORDS[band] if n else FAINT, "ha": side, "va": "bottom"}
        axes.text(at, 1.075 + raised, f"{n:,}", transform=axes.get_xaxis_transform(), fontsize=13, **look)
        axes.text(at, 1.02 + raised, band, transform=axes.get_xaxis_transform(), fontsize=9, **look)


def _several(meshes: list[Series], edges: Values, log: bool) -> Figure:
    figure = chart_style.figure(8, 4.2 + 0.24 * len(meshes))
    height = figure.get_figheight()
    chart_style.title(figure, "Quality of all cells", "each mesh as a share of its own cells")
    room = (0.72 + 0.24 * len(meshes)) / height
    axes = chart_style.axes(figure, (0.09, 0.55 / height, 0.88, 1 - room - 0.62 / height))
    scale = meshes[0].summary.scale
    chart_style.shade(axes, scale, float(edges[0]), float(edges[-1]))
    top = outlines(axes, [mesh.summary.all for mesh in meshes], edges, log)
    if not log:
        axes.set_ylim(0, top * 1.05)
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g} %")
    axes.set_xlabel(chart_style.axis_label(scale), fontsize=10, color=INK)
    legend(figure, meshes, 1 - 0.72 / height)
    return figure


def outlines(axes: Axes, tallies: list[Tally], edges: Values, log: bool = False) -> float:
    """Outlines of histograms over each other, each in percent of its measured cells; returns the highest."""
    top = 0.0
    for n, tally in enumerate(tallies):
        if not tally.n_measured:
            continue
        share = 100.0 * counts_in(tally, edges) / tally.n_measured
        top = max(top, float(share.max()))
        colour, style = chart_style.stroke(n)
        axes.stairs(share, edges, color=colour, linewidth=1.6, linestyle=style, zorder=3)
        axes.stairs(share, edges, color=colour, alpha=0.09, fill=True, zorder=2)
    if log:
        axes.set_yscale("log")
    return top


def legend(figure: Figure, meshes: list[Series], top: float) -> None:
    """A line a mesh: its stroke, its name, its counts."""
    from matplotlib.lines import Line2D

    step = 0.24 / figure.get_figheight()
    for n, mesh in enumerate(meshes):
        y = top - n * step
        colour, style = chart_style.stroke(n)
        figure.add_artist(Line2D([0.09, 0.135], [y, y], color=colour, linewidth=2, linestyle=style))
        every = mesh.summary.all
        counts_text = ", ".join(text for text, _ in chart_style.words(every, without=("good",)))
        least = f", min {chart_style.number(every.min)}" if every.n_measured else ""
        text = f"{plural(every.n_cells, 'cell')}{least}{', ' if counts_text else ''}{counts_text}"
        look: dict[str, Any] = {"va": "center", "fontsize": 9.5, "color": INK, "parse_math": False}
        figure.text(0.145, y, chart_style.short(mesh.name, 86 - len(text)), ha="left", weight="bold", **look)
        figure.text(0.97, y, text, ha="right", **look)
