"""The histogram of each type of cell, one under the other."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from ..look.colours import INK
from ..quality.measure import JENS
from . import chart_style
from .distributions import Drawable, counts_in, edges_of, series
from .histogram_chart import BINS, bars, legend, outlines

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ROW = 1.0
"""Height of a row, in inches."""


def types(what: Drawable | Mapping[str, Drawable], *, metric: str = JENS, bins: int = BINS) -> Figure:
    """A histogram for each type of cell, on one axis.

    Parameters, errors and result as `histogram`; each row has a scale of its own.
    """
    meshes = series(what, metric)
    type_names = list(dict.fromkeys(name for mesh in meshes for name, t in mesh.summary.types.items() if t.n_measured))
    edges = edges_of([mesh.summary.all for mesh in meshes], bins)
    alone = len(meshes) == 1
    head = 0.75 if alone else 0.75 + 0.24 * len(meshes)
    height = head + ROW * len(type_names) + 0.6
    figure = chart_style.figure(8, height)
    if alone:
        chart_style.title(figure, meshes[0].name or "Quality by type of cell", chart_style.sentence(meshes[0].summary))
    else:
        chart_style.title(figure, "Quality by type of cell", "each mesh as a share of its own cells of the type")
        legend(figure, meshes, 1 - 0.72 / height)
    for n, name in enumerate(type_names):
        bottom = 0.6 + ROW * (len(type_names) - 1 - n)
        axes = chart_style.axes(figure, (0.17, (bottom + 0.08) / height, 0.66 if alone else 0.8, (ROW - 0.2) / height))
        tallies = [mesh.summary.types.get(name) for mesh in meshes]
        there = [tally for tally in tallies if tally is not None]
        chart_style.shade(axes, there[0].scale, float(edges[0]), float(edges[-1]))
        axes.grid(visible=False)
        axes.set_yticks([])
        if alone:
            bars(axes, there[0], edges, counts_in(there[0], edges))
            chart_style.line_of_words(axes, 1.03, 0.97, chart_style.words(there[0]), ha="left")
        else:
            empty = meshes[0].summary.all.empty(there[0].scale)
            axes.set_ylim(0, outlines(axes, [tally or empty for tally in tallies], edges) * 1.05)
        axes.tick_params(labelbottom=n == len(type_names) - 1)
        label = f"{name}\n{there[0].n_cells:,}" if alone else name
        axes.text(-0.025, 0.45, label, transform=axes.transAxes, ha="right", va="center", fontsize=10, color=INK)
    axes.set_xlabel(chart_style.axis_label(meshes[0].summary.scale), fontsize=10, color=INK)
    return figure
