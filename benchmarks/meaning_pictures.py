"""The pictures of docs/meaning.md, from what `meaning` found."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from first_order import Values
from PIL import Image

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from meaning import Samples, Solved

COLOURS = {"tetra": "#d55e00", "pyramid": "#e69f00", "wedge": "#009e73", "hexahedron": "#0072b2"}
MARKERS = {"tetra": "^", "pyramid": "d", "wedge": "P", "hexahedron": "s"}
TITLES = {"noise": "noise", "stretching": "stretching, to 1:16", "shear": "uniform shear"}
COSTS = {
    "condition": "conditioning",
    "elastic condition": "conditioning (elasticity)",
    "error": "error of the gradient",
    "steps": "explicit time steps",
    "elastic steps": "explicit time steps (elasticity)",
}
NAMES = {
    "jens": "jens (J_ENS)",
    "jens_mean": "jens_mean",
    "shape": "shape",
    "edge_ratio": "edge_ratio",
    "verdict_scaled_jacobian": "verdict_scaled_jacobian",
    "verdict_shape": "verdict_shape",
}
STYLE = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 10,
    "axes.grid": True,
    "grid.color": "0.92",
    "axes.axisbelow": True,
}


def write(folder: Path, samples: Samples, ranks: dict[tuple[str, str, str], float], solved: list[Solved]) -> None:
    """``meaning-cells.png``, ``meaning-ranks.png`` and ``meaning-meshes.png``."""
    with plt.rc_context(STYLE):
        for name, figure in (
            ("cells", cells(samples)),
            ("ranks", of_ranks(ranks)),
            ("meshes", of_meshes(solved)),
        ):
            path = folder / f"meaning-{name}.png"
            figure.savefig(path, dpi=110)
            plt.close(figure)
            with Image.open(path) as image:
                few_colours = image.convert("RGB").quantize(96)
            few_colours.save(path, optimize=True)


def cells(samples: Samples) -> plt.Figure:
    """Cost against J_ENS: medians of bands, and the middle 80 %."""
    losses = ("condition", "error", "steps")
    figure, axes = plt.subplots(3, 3, figsize=(9.2, 7.6), sharex=True, sharey="row", layout="constrained")
    for row, loss in zip(axes, losses, strict=True):
        for ax, how in zip(row, TITLES, strict=True):
            ax.axvspan(0.0, 0.2, color="0.95", zorder=0)
            for name, colour in COLOURS.items():
                one = samples[name, how]
                at, quantiles = banded(one.candidates["jens"], one.losses[loss])
                ax.fill_between(at, quantiles[0], quantiles[2], color=colour, alpha=0.13, lw=0)
                ax.plot(at, quantiles[1], color=colour, marker=MARKERS[name], ms=3.5, lw=1.4, label=name)
            ax.set(yscale="log", xlim=(0.0, 1.0))
            ax.yaxis.set_major_formatter(lambda v, _: f"{v:g}")
        row[0].set_ylabel(COSTS[loss])
    for ax, title in zip(axes[0], TITLES.values(), strict=True):
        ax.set_title(title)
    axes[0, 0].text(0.1, 0.97, "poor", transform=axes[0, 0].get_xaxis_transform(), ha="center", va="top", color="0.45")
    axes[0, 2].legend(frameon=False)
    for ax in axes[-1]:
        ax.set_xlabel("J_ENS of the cell")
    figure.suptitle("What a cell costs, relative to the ideal cell of its type and volume", fontsize=11)
    return figure


def banded(of: Values, values: Values, least: int = 20) -> tuple[Values, Values]:
    """Middles of the bands of 0.05 with cells enough, and ``(3, n_bands)`` quantiles .1, .5, .9 in them."""
    edges = np.linspace(0.0, 1.0, 21)
    inside = [values[(of >= low) & (of < high)] for low, high in pairwise(edges)]
    kept = [k for k, one in enumerate(inside) if len(one) >= least]
    return edges[kept] + 0.025, np.array([np.quantile(inside[k], (0.1, 0.5, 0.9)) for k in kept]).T


def of_ranks(ranks: dict[tuple[str, str, str], float]) -> plt.Figure:
    """A dot for each loss, a bar at their mean."""
    figure, axes = plt.subplots(1, 3, figsize=(9.2, 3.0), sharey=True, sharex=True, layout="constrained")
    order = sorted(NAMES, key=lambda one: np.mean([v for (name, *_), v in ranks.items() if name == one]))
    marks = dict(zip(COSTS, ("o", "s", "D", "^", "v"), strict=True))
    for ax, how in zip(axes, TITLES, strict=True):
        for y, candidate in enumerate(order):
            values = [-ranks[candidate, how, loss] for loss in COSTS]
            ax.plot([np.mean(values)] * 2, [y - 0.3, y + 0.3], color="0.1", lw=2)
            for loss, mark in marks.items():
                label = COSTS[loss] if y == 0 else None
                face = "#0072b2" if "elastic" not in loss else "white"
                ax.plot(-ranks[candidate, how, loss], y, mark, mec="#0072b2", mfc=face, ms=5, alpha=0.85, label=label)
        ax.set(title=TITLES[how], yticks=range(len(order)), yticklabels=[NAMES[one] for one in order])
    axes[0].invert_yaxis()
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=5, frameon=False, fontsize=8)
    figure.suptitle("How well it ranks cells by cost, types pooled (rank correlation; 1: as the solver)", fontsize=11)
    return figure


def of_meshes(solved: list[Solved]) -> plt.Figure:
    """One bad cell against all; then the error against the least value and the share of poor cells."""
    figure, axes = plt.subplots(2, 2, figsize=(9.2, 7.0), layout="constrained")
    of_one_and_all(axes[0, 0], solved, "error", "error of the gradient")
    of_one_and_all(axes[0, 1], solved, "elastic steps", "explicit time steps (elasticity)")
    for ax, measure, title in (
        (axes[1, 0], lambda one: one.least, "least J_ENS of the mesh"),
        (axes[1, 1], lambda one: max(100.0 * one.share, 0.02), "% of cells below 0.2"),
    ):
        for name, colour in COLOURS.items():
            of = [one for one in solved if one.name == name and one.kind == "noise"]
            style = {"color": colour, "alpha": 0.75, "ms": 5, "label": name, "mew": 0}
            ax.plot([measure(one) for one in of], [one.losses["error"] for one in of], MARKERS[name], **style)
        ax.set(xlabel=title, ylabel="error of the gradient", title="a share of the points moved at random")
    axes[1, 1].set_xscale("log")
    axes[1, 1].xaxis.set_major_formatter(lambda v, _: "none" if v < 0.03 else f"{v:g}")
    axes[1, 1].set_xticks([0.02, 0.1, 1, 10, 100])
    axes[1, 0].legend(frameon=False)
    figure.suptitle("What a mesh costs, relative to the even mesh of its type", fontsize=11)
    return figure


def of_one_and_all(ax: Axes, solved: list[Solved], loss: str, title: str) -> None:
    """Bars: one cell bad, all cells bad, by type."""
    kinds = [kind for kind in dict.fromkeys(one.kind for one in solved) if " at " in kind]
    kinds.sort(key=lambda kind: (kind.startswith("all"), -float(kind.split()[-1])))
    for x, name in enumerate(COLOURS):
        for k, kind in enumerate(kinds):
            value = np.median([one.losses[loss] for one in solved if one.name == name and one.kind == kind])
            place = x + 0.2 * (k - 1.5)
            hatch = None if kind.startswith("all") else "////"
            ax.bar(place, value - 1.0, 0.18, 1.0, color=COLOURS[name], alpha=0.45 + 0.4 * (k % 2), hatch=hatch, ec="w")
            ax.text(place, value * 1.05, f"{value:.2g}" if value < 99.5 else f"{value:.0f}", ha="center", fontsize=7)
    ax.set(title=title, yscale="log", ylim=(1.0, None), xticks=range(len(COLOURS)), xticklabels=list(COLOURS))
    ax.yaxis.set_major_formatter(lambda v, _: f"{v:g}")
    bad = [f"{'one cell' if kind.startswith('one') else 'all'} at {kind.split()[-1]}" for kind in kinds]
    ax.set_xlabel("bars: " + ", ".join(bad), fontsize=8)
