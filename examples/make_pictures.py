"""The picture of the README: the bracket cut open, its cells coloured by quality, the inverted ones pointed out.

python examples/make_pictures.py [FOLDER]

Draws off screen, with no display; needs a libEGL or libGL.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")  # looks for no display first

import pyvista
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

import meshgauge
from meshgauge.look.colours import FAINT, INK, INVALID, WORDS, colours

ROOT = Path(__file__).resolve().parent.parent
MESH = ROOT / "examples" / "meshes" / "bracket.vtu"

WIDTH, HEIGHT, MESH_WIDTH = 1600, 880, 1140
SMOOTHING = 2
"""Pixels rendered for each pixel drawn, a side."""

LIGHTS = (((-0.4, 0.9, 1.6), 0.72), ((1.5, 0.2, 0.8), 0.25), ((-1.0, -0.2, 0.2), 0.25), ((0.0, 1.0, 0.0), 0.2))
"""Where each light comes from, and how strong it is."""

CUT = (0.02, 0.052, 0.0215, 0.055)
"""Depth up to which each of the four lengths of the bracket is shown, in metres."""


def render(
    quality: meshgauge.Quality, at: NDArray[np.float64], *, aside: bool = True
) -> tuple[Image.Image, NDArray[np.float64]]:
    """The mesh before the outline of what was cut away, and where some points of space are, in pixels from top left.

    Without ``aside`` no invalid cell of the part that is cut away is shown.
    """
    grid = pyvista.read(MESH)
    grid.points = quality.mesh.points  # the same cells, wherever its points are
    values = quality.values
    grid.cell_data["colour"] = (255 * colours(values)).round().astype(np.uint8)
    depth = grid.cell_centers().points[:, 2]
    shown = (depth < np.array(CUT)[grid.cell_data["region"]]) | (aside & (values < 0))

    plotter = pyvista.Plotter(
        off_screen=True, window_size=[SMOOTHING * MESH_WIDTH, SMOOTHING * HEIGHT], lighting="none"
    )
    plotter.set_background("white")
    for position, intensity in LIGHTS:
        plotter.add_light(pyvista.Light(position=position, intensity=intensity, light_type="scene light"))
    plotter.camera_position = [(-0.07, 0.36, 0.72), (0.119, 0.106, 0.035), (0.0, 1.0, 0.0)]
    plotter.camera.parallel_projection = True
    plotter.camera.parallel_scale = 0.146
    edges = grid.extract_surface(algorithm="dataset_surface").extract_feature_edges(
        40, boundary_edges=False, non_manifold_edges=False, manifold_edges=False
    )
    outline = plotter.add_mesh(edges, color=FAINT, line_width=0.9 * SMOOTHING, lighting=False)
    plotter.show(auto_close=False)
    behind = Image.fromarray(plotter.screenshot(return_img=True))
    plotter.remove_actor(outline)
    plotter.add_mesh(
        grid.extract_cells(shown).extract_surface(algorithm="dataset_surface"),
        scalars="colour",
        rgb=True,
        show_edges=True,
        edge_color=INK,
        edge_opacity=0.5,
        line_width=0.6 * SMOOTHING,
        ambient=0.35,
        diffuse=0.75,
    )
    mesh = Image.fromarray(plotter.screenshot(return_img=True, transparent_background=True))
    behind.paste(mesh, mask=mesh.getchannel("A"))
    image = behind.resize((MESH_WIDTH, HEIGHT), Image.Resampling.LANCZOS)
    pixels = []
    for point in at:
        plotter.renderer.SetWorldPoint(*point, 1.0)
        plotter.renderer.WorldToDisplay()
        x, y, _ = plotter.renderer.GetDisplayPoint()
        pixels.append((x / SMOOTHING, HEIGHT - y / SMOOTHING))
    plotter.close()
    return image, np.array(pixels)


def point_out(axes: Axes, worst: list[meshgauge.WorstCell], pixels: NDArray[np.float64]) -> None:
    """A ring about the worst node of each cell, a line, and what it is."""
    places = {"hexahedron": (370, 390), "wedge": (800, 800), "pyramid": (400, 150)}
    for cell, (x, y) in zip(worst, pixels, strict=True):
        to = places[cell.type]
        axes.plot([x, to[0]], [y, to[1]], color=INK, linewidth=0.9, zorder=2)
        axes.plot(x, y, "o", markersize=7, markerfacecolor="white", markeredgecolor=INK, markeredgewidth=1.6, zorder=3)
        right = to[0] > x
        axes.text(
            to[0] + (8 if right else -8),
            to[1],
            f"{cell.type} {cell.cell}:  {cell.quality:.3f}".replace("-", "\N{MINUS SIGN}")
            + f"\nworst at point {cell.point}",
            ha="left" if right else "right",
            va="center",
            color=INK,
            fontsize=15,
            linespacing=1.35,
        )


def histogram(axes: Axes, values: NDArray[np.float64]) -> None:
    """Number of cells by quality; its colours are the legend of the mesh's."""
    edges = np.arange(-0.1, 1.001, 0.05)
    counts, _ = np.histogram(values, edges)
    middle = (edges[1:] + edges[:-1]) / 2
    axes.barh(
        middle,
        np.where(counts > 0, np.maximum(counts, 6), 0),
        height=0.044,
        color=colours(middle),
        edgecolor=INK,
        linewidth=0.5,
    )
    axes.set_ylim(-0.1, 1.0)
    axes.set_xlim(0, counts.max() * 1.02)
    axes.set_yticks([0.0, 0.2, 0.4, 0.6, 0.8, 1.0], ["0", "0.2", "0.4", "0.6", "0.8", "1"], fontsize=15, color=INK)
    axes.set_xticks([])
    for side in ("top", "right", "bottom"):
        axes.spines[side].set_visible(False)
    axes.spines["left"].set_color(FAINT)
    axes.tick_params(axis="y", color=FAINT)
    bands = (
        (-0.05, values < 0, "inverted", INVALID),
        (0.1, (values > 0) & (values < 0.2), "poor", WORDS["poor"]),
        (0.3, values >= 0.2, "good", WORDS["good"]),
    )
    for y, where, name, colour in bands:
        axes.text(
            counts.max() * (0.98 if name == "good" else 0.16),
            y,
            f"{np.count_nonzero(where):,} {name}",
            va="center",
            ha="right" if name == "good" else "left",
            fontsize=16,
            color=colour,
        )
    axes.set_title(f"$J_{{ENS}}$ of the {len(values):,} cells", fontsize=16, color=INK, loc="left", pad=12)


def main(folder: Path | None = None) -> None:
    """Write the picture into a folder, by default that of the documentation."""
    folder = folder or ROOT / "docs" / "pictures"
    folder.mkdir(parents=True, exist_ok=True)
    quality = meshgauge.measure(meshgauge.read(MESH))
    worst = quality.worst(int(np.count_nonzero(quality.values < 0)))
    image, pixels = render(quality, np.array([cell.coordinates for cell in worst]))
    figure = Figure(figsize=(WIDTH / 100, HEIGHT / 100), dpi=100, facecolor="white")
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_axis_off()
    axes.imshow(image, extent=(0, image.width, HEIGHT, 0), interpolation="none")
    axes.set_xlim(0, WIDTH)
    axes.set_ylim(HEIGHT, 0)
    point_out(axes, worst, pixels)
    histogram(figure.add_axes((0.775, 0.13, 0.195, 0.7)), quality.values)
    canvas.draw()
    drawn = Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3])
    drawn.quantize(256, Image.Quantize.MAXCOVERAGE, kmeans=2, dither=Image.Dither.NONE).save(
        folder / "bracket.png", optimize=True
    )


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
