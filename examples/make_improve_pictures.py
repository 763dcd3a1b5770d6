"""The pictures of docs/improve.md: a tangled bracket before and after its repair, and the repair over time.

python examples/make_improve_pictures.py [FOLDER]

Draws off screen, with no display; needs a libEGL or libGL.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from make_meshes import inner_points
from make_pictures import HEIGHT, MESH_WIDTH, ROOT, render
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

import meshgauge
from meshgauge.cells import cell_type
from meshgauge.look.colours import FAINT, GRID, INK, SERIES, WORDS, colours

GOOD_MESH = ROOT / "examples" / "meshes" / "bracket_good.vtu"

REACH = 0.5
"""How far a point is moved at most, in mean lengths of the edges at it."""

PHASES = {"untangle": "untangle", "smooth": "smooth", "worst": "raise the worst", "mean": "raise the mean"}


def tangled(mesh: meshgauge.Mesh, *, seed: int = 2014) -> meshgauge.Mesh:
    """The mesh with each inner point moved at random, every time alike."""
    rows: dict[str, NDArray[np.int64]] = {}
    for row, _, ids in mesh.groups():
        first, last = np.arange(mesh.n_cells)[ids][[0, -1]]
        nodes = mesh.connectivity[mesh.offsets[first] : mesh.offsets[last + 1]]
        rows[row.name] = nodes.reshape(-1, row.n_nodes)
    points = np.array(mesh.points, np.float64)
    total, count = np.zeros(len(points)), np.zeros(len(points))
    for name, cells in rows.items():
        for a, b in cell_type(name).shape.edges:
            ends = cells[:, [a, b]]
            lengths = np.linalg.norm(points[ends[:, 0]] - points[ends[:, 1]], axis=1)
            for end in ends.T:
                np.add.at(total, end, lengths)
                np.add.at(count, end, 1)
    inner = inner_points(rows, len(points))
    rng = np.random.default_rng(seed)
    ways = rng.normal(size=(len(inner), 3))
    ways *= rng.uniform(0, REACH, (len(inner), 1)) / np.linalg.norm(ways, axis=1, keepdims=True)
    points[inner] += ways * (total / count)[inner, None]
    # Faces between regions are kept by a repair; moved at random themselves, they would be all that it meets.
    return mesh.replace(points=points, cell_data={})


def histogram(axes: Axes, values: NDArray[np.float64], top: int) -> None:
    """Number of cells by quality, in the colours of the mesh beside it."""
    edges = np.arange(-0.8, 1.001, 0.05)
    counts, _ = np.histogram(values, edges)
    middle = (edges[1:] + edges[:-1]) / 2
    axes.bar(
        middle,
        np.where(counts > 0, np.maximum(counts, top / 70), 0),
        width=0.044,
        color=colours(middle),
        edgecolor=INK,
        linewidth=0.5,
    )
    axes.set_xlim(-0.8, 1.0)
    axes.set_ylim(0, top * 1.02)
    axes.set_yticks([])
    axes.set_xticks(
        [-0.8, -0.4, 0.0, 0.2, 0.6, 1.0], ["\N{MINUS SIGN}0.8", "\N{MINUS SIGN}0.4", "0", "0.2", "0.6", "1"]
    )
    for side in ("top", "right", "left"):
        axes.spines[side].set_visible(False)
    axes.spines["bottom"].set_color(FAINT)
    axes.tick_params(axis="x", color=FAINT, labelcolor=INK, labelsize=15)


def before_and_after(found: meshgauge.Improvement) -> Figure:
    """Both meshes cut open, with their histograms below."""
    width, height, shown = 1800, 1010, 900
    figure = Figure(figsize=(width / 100, height / 100), dpi=100, facecolor="white")
    top = max(np.histogram(q.values, np.arange(-0.8, 1.001, 0.05))[0].max() for q in (found.before, found.after))
    for n, (name, quality) in enumerate((("before", found.before), ("after", found.after))):
        image, _ = render(quality, np.empty((0, 3)), aside=False)
        axes = figure.add_axes((n / 2, 1 - shown * HEIGHT / MESH_WIDTH / height - 0.06, shown / width, 0))
        axes.set_position(
            (n / 2, 0.94 - shown * HEIGHT / MESH_WIDTH / height, 0.5, shown * HEIGHT / MESH_WIDTH / height)
        )
        axes.imshow(image, interpolation="lanczos", aspect="auto")
        axes.set_axis_off()
        values = quality.values
        bad, poor = np.count_nonzero(values <= 0), np.count_nonzero((values > 0) & (values < 0.2))
        left = n / 2 + 0.03
        figure.text(left, 0.955, name, fontsize=24, color=INK, weight="bold", va="center")
        figure.text(
            left + 0.085, 0.955, f"{bad:,} of {len(values):,} cells inverted",
            fontsize=19, color=WORDS["invalid" if bad else "good"], va="center",
        )  # fmt: skip
        figure.text(left + 0.33, 0.955, f"{poor:,} poor", fontsize=19, color=WORDS["poor"], va="center")
        chart = figure.add_axes((left, 0.05, 0.43, 0.2))
        histogram(chart, values, top)
        told = f"worst {values.min():.2f}\nmean {values.mean():.2f}".replace("-", "\N{MINUS SIGN}")
        chart.text(0.0, 0.95, told, transform=chart.transAxes, fontsize=17, color=INK, va="top", linespacing=1.4)
    return figure


def over_time(history: tuple[meshgauge.repair.Progress, ...]) -> Figure:
    """Worst and mean quality while it runs, the phases behind them."""
    figure = Figure(figsize=(14, 6.4), dpi=100, facecolor="white")
    axes = figure.add_axes((0.065, 0.12, 0.83, 0.74))
    seconds = np.array([one.seconds for one in history])
    names = [one.phase for one in history]
    start = 0.0
    for n, (phase, said) in enumerate(PHASES.items()):
        inside = [at for at, name in zip(seconds, names, strict=True) if name == phase]
        if not inside:
            continue
        end = seconds[-1] if phase == "mean" else max(inside)
        axes.axvspan(start, end, color=GRID if n % 2 else "white", alpha=0.55, linewidth=0, zorder=0)
        if end - start > 0.03 * seconds[-1]:
            axes.text((start + end) / 2, 1.03 + 0.06 * (n % 2), said, ha="center", va="bottom", fontsize=15,
                      color=WORDS["unknown"], transform=axes.get_xaxis_transform())  # fmt: skip
        start = end
    axes.axhline(0.0, color=WORDS["invalid"], linewidth=1.2)
    axes.text(seconds[-1], -0.02, "below: inverted", color=WORDS["invalid"], fontsize=14, ha="right", va="top")
    for name, line, colour in (
        ("mean", [one.mean for one in history], SERIES[0]),
        ("worst", [one.worst for one in history], SERIES[1]),
    ):
        axes.plot(seconds, line, "-o", color=colour, linewidth=2.4, markersize=4, clip_on=False)
        axes.annotate(f"{name} {line[-1]:.2f}", (seconds[-1], line[-1]), xytext=(12, 0), textcoords="offset points",
                      va="center", fontsize=17, color=colour, annotation_clip=False)  # fmt: skip
    axes.set_xlim(0.0, seconds[-1])
    axes.set_ylim(-0.8, 1.0)
    axes.set_xlabel("seconds", fontsize=15, color=INK)
    axes.set_ylabel("$J_{ENS}$", fontsize=16, color=INK)
    axes.tick_params(color=FAINT, labelcolor=INK, labelsize=14)
    axes.grid(axis="y", color=GRID, linewidth=0.8)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(FAINT)
    return figure


def save(figure: Figure, path: Path) -> None:
    """As a PNG of few colours, which is small."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    drawn = Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3])
    drawn.quantize(256, Image.Quantize.MAXCOVERAGE, kmeans=2, dither=Image.Dither.NONE).save(path, optimize=True)


def main(folder: Path | None = None) -> None:
    """Write both pictures into a folder, by default that of the documentation."""
    folder = folder or ROOT / "docs" / "pictures"
    folder.mkdir(parents=True, exist_ok=True)
    mesh = tangled(meshgauge.read(GOOD_MESH))
    meshgauge.improve(mesh, seconds=1.0, everywhere=True)  # so that no kernel is loaded on the clock
    found = meshgauge.improve(mesh, everywhere=True)
    print(found)
    save(before_and_after(found), folder / "improve.png")
    save(over_time(found.history), folder / "improve_progress.png")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
