"""The pictures of docs/improve.md: meshes before and after their repair, and the repair over time.

A tangled bracket; a bar of four cell types whose tetrahedra are joined anew; layers at a wall; a boundary that slid.

python examples/make_improve_pictures.py [FOLDER]

Draws off screen, with no display; needs a libEGL or libGL.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyvista
from make_meshes import inner_points
from make_pictures import LIGHTS, ROOT, SMOOTHING, render
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.colors import LinearSegmentedColormap, to_rgb
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

import meshgauge
from meshgauge.cells import cell_type
from meshgauge.look.colours import FAINT, GRID, INK, RAMP, SERIES, SOFT, WORDS, colours
from meshgauge.repair.constraints import constraints_of
from meshgauge.repair.deviation import deviation
from meshgauge.repair.surface import surface_of

GOOD_MESH = ROOT / "examples" / "meshes" / "bracket_good.vtu"
MIXED_MESH = ROOT / "examples" / "meshes" / "mixed_tangled.vtu"
CAN = ROOT / "examples" / "real" / "can.vtu"

LEAST = -0.8
"""Where histograms begin, unless said otherwise."""

REACH = 0.5
"""How far a point is moved at most, in mean lengths of the edges at it."""

TOLERANCE = 0.01
"""How far the boundary of the can may give, as a share of the diagonal."""

LOOK_BAR = ((-0.4, -3.4, 1.9), (0.5, 0.5, 0.46), 1.03)
LOOK_CAN = ((-9.0, 26.0, 2.0), (-3.2, 0.8, -15.9), 6.0)
LOOK_CAN_BELOW = ((0.0, -20.0, -36.0), (-3.2, 0.8, -15.9), 6.0)
"""Where a camera stands, what it looks at, and half the height of what it sees."""

FEATURE_ANGLE = 40.0
"""In degrees: what `improve` takes for an edge of the surface unless told."""

N_LAYERS, N_AROUND, N_UP = 45, 16, 6
THINNEST, GROWTH = 1e-5, 1.25
"""Of the layers at a quarter of a cylinder of radius 1."""

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


def layers() -> meshgauge.Mesh:
    """Hexahedra that get thinner towards a cylinder; two points are pushed through their neighbours."""
    radii = 1.0 + THINNEST * (GROWTH ** np.arange(N_LAYERS + 1) - 1.0) / (GROWTH - 1.0)
    z, angle, r = np.meshgrid(
        0.1 * np.arange(N_UP + 1), np.linspace(0.0, np.pi / 2, N_AROUND + 1), radii, indexing="ij"
    )
    angle = angle + 0.15 * (r - 1.0)
    points = np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=-1)
    for at in ((2, 5, 42), (3, 9, 42)):
        points[at] += (0.25, -0.3, 0.12)
    ids = np.arange(z.size).reshape(z.shape)
    corners = [(0, 0, 0), (0, 0, 1), (0, 1, 1), (0, 1, 0), (1, 0, 0), (1, 0, 1), (1, 1, 1), (1, 1, 0)]
    cells = [ids[a : a + N_UP, b : b + N_AROUND, c : c + N_LAYERS].ravel() for a, b, c in corners]
    return meshgauge.Mesh.from_arrays(points.reshape(-1, 3), {"hexahedron": np.stack(cells, axis=1)})


def histogram(axes: Axes, values: NDArray[np.float64], top: int, least: float = LEAST) -> None:
    """Number of cells by quality, in the colours of the mesh beside it."""
    edges = np.arange(least, 1.001, 0.05)
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
    axes.set_xlim(least, 1.0)
    axes.set_ylim(0, top * 1.02)
    axes.set_yticks([])
    ticks = [least, least / 2, 0.0, 0.2, 0.6, 1.0]
    axes.set_xticks(ticks, [f"{tick:g}".replace("-", "\N{MINUS SIGN}") for tick in ticks])
    for side in ("top", "right", "left"):
        axes.spines[side].set_visible(False)
    axes.spines["bottom"].set_color(FAINT)
    axes.tick_params(axis="x", color=FAINT, labelcolor=INK, labelsize=15)


def title(figure: Figure, left: float, height: float, name: str, quality: meshgauge.Quality) -> None:
    """The name of a mesh, and how many of its cells are inverted and poor."""
    values = quality.values
    bad, poor = np.count_nonzero(values <= 0), np.count_nonzero((values > 0) & (values < 0.2))
    figure.text(left, height, name, fontsize=24, color=INK, weight="bold", va="center")
    figure.text(
        left + 0.085, height, f"{bad:,} of {len(values):,} cells inverted",
        fontsize=19, color=WORDS["invalid" if bad else "good"], va="center",
    )  # fmt: skip
    figure.text(left + 0.33, height, f"{poor:,} poor", fontsize=19, color=WORDS["poor"], va="center")


def worst_and_mean(values: NDArray[np.float64]) -> str:
    return f"worst {values.min():.2f}\nmean {values.mean():.2f}".replace("-", "\N{MINUS SIGN}")


def place(figure: Figure, image: Image.Image, left: float, bottom: float, width: float) -> Axes:
    """An image as wide as said, in shares of the figure; returns its axes."""
    wide, high = figure.get_size_inches()
    axes = figure.add_axes((left, bottom, width, width * wide / high * image.height / image.width))
    axes.imshow(image, interpolation="lanczos", aspect="auto")
    axes.set_axis_off()
    return axes


def before_and_after(
    found: meshgauge.Improvement, picture: Callable[[meshgauge.Quality], Image.Image], least: float = LEAST
) -> Figure:
    """Both meshes cut open, with their histograms below."""
    image = picture(found.before)
    shown = 9.0 * image.height / image.width
    height = shown + 3.15
    figure = Figure(figsize=(18.0, height), dpi=100, facecolor="white")
    edges = np.arange(least, 1.001, 0.05)
    top = max(np.histogram(q.values, edges)[0].max() for q in (found.before, found.after))
    for n, (name, quality) in enumerate((("before", found.before), ("after", found.after))):
        place(figure, image if n == 0 else picture(quality), n / 2, (height - 0.6 - shown) / height, 0.5)
        left = n / 2 + 0.03
        title(figure, left, 1.0 - 0.45 / height, name, quality)
        chart = figure.add_axes((left, 0.5 / height, 0.43, 2.0 / height))
        histogram(chart, quality.values, top, least)
        chart.text(
            0.0, 0.95, worst_and_mean(quality.values),
            transform=chart.transAxes, fontsize=17, color=INK, va="top", linespacing=1.4,
        )  # fmt: skip
    return figure


def bracket(quality: meshgauge.Quality) -> Image.Image:
    return render(quality, np.empty((0, 3)), aside=False)[0]


Look = tuple[tuple[float, float, float], tuple[float, float, float], float]


def scene(part: pyvista.DataSet, whole: pyvista.DataSet, look: Look) -> Image.Image:
    """A part of a mesh by its cell data ``colour``, before the outline of the whole."""
    size = (1140, 700)
    plotter = pyvista.Plotter(off_screen=True, window_size=[SMOOTHING * n for n in size], lighting="none")
    plotter.set_background("white")
    for position, intensity in LIGHTS:
        plotter.add_light(pyvista.Light(position=position, intensity=intensity, light_type="camera light"))
    plotter.camera_position = [look[0], look[1], (0.0, 0.0, 1.0)]
    plotter.camera.parallel_projection = True
    plotter.camera.parallel_scale = look[2]
    edges = whole.extract_surface(algorithm="dataset_surface").extract_feature_edges(
        40, boundary_edges=False, non_manifold_edges=False, manifold_edges=False
    )
    outline = plotter.add_mesh(edges, color=FAINT, line_width=0.9 * SMOOTHING, lighting=False)
    plotter.show(auto_close=False)
    behind = Image.fromarray(plotter.screenshot(return_img=True))
    plotter.remove_actor(outline)
    plotter.add_mesh(
        part.extract_surface(algorithm="dataset_surface"),
        scalars="colour", rgb=True, show_edges=True, edge_color=INK, edge_opacity=0.5,
        line_width=0.6 * SMOOTHING, ambient=0.55, diffuse=0.5,
    )  # fmt: skip
    drawn = Image.fromarray(plotter.screenshot(return_img=True, transparent_background=True))
    behind.paste(drawn, mask=drawn.getchannel("A"))
    plotter.close()
    return behind.resize(size, Image.Resampling.LANCZOS)


def cut_open(quality: meshgauge.Quality, axis: int, at: float, look: Look) -> Image.Image:
    """The cells of which the middle is beyond a plane, by quality."""
    grid = quality.mesh.to_pyvista()
    grid.cell_data["colour"] = (255 * colours(quality.values)).round().astype(np.uint8)
    part = grid.extract_cells(np.flatnonzero(grid.cell_centers().points[:, axis] > at))
    return scene(part, grid, look)


def bar(quality: meshgauge.Quality) -> Image.Image:
    return cut_open(quality, 1, 0.5, LOOK_BAR)


def layers_kept(found: meshgauge.Improvement) -> Figure:
    """The layers cut open across the cylinder before and after, and the thinnest of them from near."""
    figure = Figure(figsize=(18.0, 12.2), dpi=100, facecolor="white")
    cells = found.before.mesh.connectivity.reshape(N_UP, N_AROUND, N_LAYERS, 8)
    for n, (name, quality) in enumerate((("before", found.before), ("after", found.after))):
        points = np.asarray(quality.mesh.points)
        values = quality.values.reshape(cells.shape[:3])
        left = n / 2 + 0.03
        title(figure, left, 0.963, name, quality)
        axes = figure.add_axes((left, 0.36, 0.44, 0.58))
        level = N_UP // 2  # the faces on top of the cells below, in which both points that were pushed are seen
        faces = points[cells[level - 1, :, :, 4:]][..., :2].reshape(-1, 4, 2)
        worst = np.minimum(values[level - 1], values[level]).ravel()
        axes.add_collection(
            PolyCollection(faces, facecolors=colours(worst), edgecolors=(*to_rgb(INK), 0.5), linewidths=0.5)
        )
        axes.set_xlim(-0.3, 1.93)
        axes.set_ylim(-0.03, 1.95)
        axes.set_aspect("equal")
        axes.set_axis_off()
        axes.text(0.02, 0.1, worst_and_mean(quality.values), transform=axes.transAxes,
                  fontsize=17, color=INK, va="bottom", linespacing=1.4)  # fmt: skip
        near = figure.add_axes((left + 0.015, 0.075, 0.4, 0.24))
        close_up(near, points, cells[level - 1], worst.reshape(N_AROUND, N_LAYERS))
    figure.text(
        0.5, 0.335, "the first five layers at the wall, and their heights", fontsize=17, color=SOFT, ha="center"
    )
    return figure


def close_up(
    axes: Axes, points: NDArray[np.float64], cells: NDArray[np.int64], values: NDArray[np.float64], n: int = 5
) -> None:
    """The first layers unrolled: the way along the wall across, the distance from it upwards, far larger."""
    at = points[cells[:, :n, 4:]]
    radius, angle = np.hypot(at[..., 0], at[..., 1]) - 1.0, np.arctan2(at[..., 1], at[..., 0])
    faces = np.stack([np.degrees(angle), 1e5 * radius], axis=-1).reshape(-1, 4, 2)
    axes.add_collection(
        PolyCollection(faces, facecolors=colours(values[:, :n].ravel()), edgecolors=INK, linewidths=0.7)
    )
    heights = np.linalg.norm(at[:, :, 1] - at[:, :, 0], axis=-1)
    for layer in range(n):
        middle = 1e5 * (radius[-1, layer, 0] + radius[-1, layer, 1]) / 2
        low, high = heights[:, layer].min(), heights[:, layer].max()
        said = f"{1e5 * low:.3f}" if np.isclose(low, high, rtol=5e-4) else f"{1e5 * low:.3f} to {1e5 * high:.3f}"
        axes.text(91.0, middle, said, fontsize=14, color=INK, va="center")
    axes.set_xlim(0.0, 90.0)
    axes.set_ylim(0.0, 1e5 * radius.max())
    axes.set_xticks([0, 30, 60, 90], ["0°", "30°", "60°", "90°"])
    axes.set_yticks([0, 2, 4, 6, 8])
    axes.set_ylabel("from the wall, 10$^{-5}$", fontsize=14, color=INK)
    axes.tick_params(color=FAINT, labelcolor=INK, labelsize=14)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def slid(found: meshgauge.Improvement) -> Figure:
    """A mesh cut open before and after its boundary has slid, and how far its surface is from what it was."""
    height = 13.4
    figure = Figure(figsize=(18.0, height), dpi=100, facecolor="white")
    for n, (name, quality) in enumerate((("before", found.before), ("after", found.after))):
        left = n / 2 + 0.03
        place(figure, can(quality), n / 2, 7.3 / height, 0.5)
        title(figure, left, 1.0 - 0.45 / height, name, quality)
        figure.text(left, 7.25 / height, worst_and_mean(quality.values), fontsize=17, color=INK, linespacing=1.4)
    old, new = found.before.mesh, np.asarray(found.after.mesh.points, np.float64)
    surface = surface_of(
        constraints_of(old, found.before, None),
        np.asarray(old.points, np.float64),
        FEATURE_ANGLE,
    )
    apart = deviation(surface, new, is_given=False)  # of each face from the patch that it was on, from either side
    away = 100.0 * np.maximum(apart.of_faces, apart.of_old_faces) / np.linalg.norm(np.ptp(old.points, axis=0))
    faces = pyvista.PolyData(new, np.insert(surface.faces, surface.face_offsets[:-1], np.diff(surface.face_offsets)))
    shades = LinearSegmentedColormap.from_list("deviation", RAMP[::-1], N=10)
    most = 100.0 * TOLERANCE
    faces.cell_data["colour"] = (255 * shades(away / most)[:, :3]).round().astype(np.uint8)
    for n, look in enumerate((LOOK_CAN, LOOK_CAN_BELOW)):
        place(figure, scene(faces, faces, look), n / 2, 1.1 / height, 0.5)
    figure.text(0.03, 6.7 / height, "how far the surface is from what it was", fontsize=24, color=INK, weight="bold")
    bar_axes = figure.add_axes((0.3, 0.85 / height, 0.4, 0.28 / height))
    bar_axes.imshow(
        np.linspace(0, 1, 1000)[None], cmap=shades, interpolation="nearest", aspect="auto", extent=(0, most, 0, 1)
    )
    bar_axes.set_yticks([])
    bar_axes.tick_params(color=FAINT, labelcolor=INK, labelsize=15)
    bar_axes.set_xticks(np.linspace(0, most, 6))
    bar_axes.set_xlabel("per cent of the diagonal", fontsize=16, color=INK)
    moved = found.report.displacement
    figure.text(
        0.97, 6.7 / height,
        f"at most {100 * moved.deviation_share:.2f} %, mean {100 * moved.deviation_mean_share:.2f} %",
        fontsize=19, color=INK, ha="right",
    )  # fmt: skip
    return figure


def can(quality: meshgauge.Quality) -> Image.Image:
    return cut_open(quality, 2, -15.0, LOOK_CAN_BELOW)


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
    """Write the pictures into a folder, by default that of the documentation."""
    folder = folder or ROOT / "docs" / "pictures"
    folder.mkdir(parents=True, exist_ok=True)
    mesh = tangled(meshgauge.read(GOOD_MESH))
    meshgauge.improve(mesh, seconds=1.0, everywhere=True)  # so that no kernel is loaded on the clock
    found = meshgauge.improve(mesh, everywhere=True)
    print(found)
    save(before_and_after(found, bracket), folder / "improve.png")
    save(over_time(found.history), folder / "improve_progress.png")
    found = meshgauge.improve(meshgauge.read(MIXED_MESH), everywhere=True, floor=1.0, topology=True)
    print(found)
    save(before_and_after(found, bar, -1.0), folder / "improve_topology.png")
    found = meshgauge.improve(layers())
    print(found)
    save(layers_kept(found), folder / "improve_layers.png")
    found = meshgauge.improve(meshgauge.read(CAN), everywhere=True, boundary="slide", tolerance=TOLERANCE)
    print(found)
    save(slid(found), folder / "improve_slide.png")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
