"""A mesh cut open, its cells coloured by quality, the invalid ones pointed out."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..errors import MeshgaugeError
from ..look.colours import DEGENERATE, FAINT, INK, colours
from ..quality.measure import Quality
from ..quality.summary import Tally
from . import callouts, chart_style
from .distributions import counts_in, edges_of
from .pyvista_cells import CELL, bad, corners, drawable, shell, surface
from .rendering import Canvas, over

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

WIDTH, HEIGHT, MESH_WIDTH, LABELS_TO = 1600, 900, 1200, 285
"""Of the picture, of the mesh in it, and where its labels end, in pixels."""

NAMED, RINGED = 6, 40
"""So many invalid cells are named, and so many ringed; of more the colour alone has to tell."""

ALL_SHOWN = 200
"""Up to so many invalid cells are drawn also before the cut, and shine through; more would hide it."""

SHINE = 0.55
"""How much is seen of an invalid cell that is behind others."""

MIDDLE = (0.25, 0.75)
"""Where a cut shows enough of both sides, as a share of the size of the mesh."""


def cut(
    quality: Quality, *, normal: tuple[float, float, float] | None = None, at: float | None = None, title: str = ""
) -> Figure:
    """The mesh cut open by a plane: cells beyond it whole, the outline of what was cut away, the invalid cells.

    Parameters
    ----------
    quality
        Of a mesh.
    normal
        From the cut to the eye; None: along the axis that shows most of it.
    at
        Where the cut is, 0 (all is cut away) to 1 (nothing is), a share of the size along the normal; None: so that the
        worst cell is the first that is seen, if it is not too near to the outside.
    title
        Above the picture.

    Returns
    -------
    matplotlib.figure.Figure
        1600 by 900 pixels, with a histogram whose colours are the legend; invalid cells are red, degenerate ones
        purple, poor ones amber, good ones the lighter the better, cells without a value grey.

    Raises
    ------
    MeshgaugeError
        If there is nothing to draw, the normal is 0, or ``at`` is not in 0 to 1.
    """
    solids = drawable(quality)
    grid = solids.grid
    skin = surface(grid)
    centres = np.asarray(grid.cell_centers().points, np.float64)
    is_bad = bad(quality)[np.asarray(grid.cell_data[CELL])]
    worst = quality.worst(max(min(int(np.count_nonzero(is_bad)), RINGED), 1))
    rings = solids.place([cell.coordinates for cell in worst])
    towards, depth = _plane(corners(skin), rings[0] if worst else None, centres, normal, at)
    # Centres in the plane, but for rounding, belong to what is shown.
    beyond = centres @ towards <= depth + 1e-9
    n_bad = int(np.count_nonzero(is_bad))
    shown = beyond | is_bad if n_bad <= ALL_SHOWN else beyond
    hidden = n_bad - int(np.count_nonzero(is_bad & shown))
    eye, up = _view(towards, is_plane=normal is None and not np.ptp(corners(skin)[:, 2]).any())
    with Canvas(
        MESH_WIDTH, HEIGHT, eye, up, corners(skin), margin=(LABELS_TO / MESH_WIDTH + 0.03, 0.02, 0.1, 0.04)
    ) as canvas:
        behind = shell(canvas, skin)
        if shown.any():
            canvas.add(surface(grid.extract_cells(np.flatnonzero(shown))))
        image = over(canvas.image(transparent=True), behind)
        if 0 < n_bad <= ALL_SHOWN:
            # Those behind others shine through.
            canvas.plotter.clear_actors()
            canvas.add(surface(grid.extract_cells(np.flatnonzero(is_bad))))
            image = over(canvas.image(transparent=True), image, SHINE)
        rings = canvas.pixels(rings)
    figure = chart_style.figure(WIDTH / 100, HEIGHT / 100, dpi=100)
    axes = callouts.picture(figure, image, 0, 0)
    for place in rings[NAMED:]:
        callouts.ring(axes, place, 5)
    if worst:
        callouts.labels(axes, worst[:NAMED], rings[:NAMED], LABELS_TO, HEIGHT, quality.poor_below)
    summary = quality.summary()
    below = chart_style.sentence(summary)
    if hidden:
        below += f"   ·   {hidden:,} invalid cells before the cut are not drawn"
    chart_style.title(figure, title, below)
    if summary.all.n_measured:
        _upright(figure.add_axes((0.805, 0.16, 0.165, 0.68)), summary.all)
    return figure


def _plane(
    points: Array,
    worst: Array | None,
    centres: Array,
    normal: tuple[float, float, float] | None,
    at: float | None,
) -> tuple[Array, float]:
    """Unit normal towards the eye, and how far along it the cut is."""
    if at is not None and not 0.0 <= at <= 1.0:
        raise MeshgaugeError(f"the cut is at {at}, expected 0 to 1")
    if normal is not None:
        chosen = np.asarray(normal, np.float64)
        length = np.linalg.norm(chosen)
        if chosen.shape != (3,) or not np.isfinite(length) or length == 0:
            raise MeshgaugeError(f"{normal} is no direction, expected three numbers that are not all 0")
        chosen = chosen / length
    else:
        chosen = _best_axis(points, worst)
    along = points @ chosen
    low, high = float(along.min()), float(along.max())
    if at is not None:
        return chosen, low + at * (high - low)
    place = 0.5
    if worst is not None and high > low:
        place = (float(worst @ chosen) - low) / (high - low)
        if not MIDDLE[0] <= place <= MIDDLE[1]:
            place = 0.5
    depth = low + place * (high - low)
    if worst is not None and place != 0.5:
        # The cell itself, of which the worst node is but a corner, belongs to what is shown.
        near = centres[int(np.argmin(np.linalg.norm(centres - worst, axis=1)))]
        depth = max(depth, float(near @ chosen))
    return chosen, depth


def _best_axis(points: Array, worst: Array | None) -> Array:
    """The axis along which the mesh is thinnest, of those that have the worst cell in the middle; its better side."""
    low, high = points.min(axis=0), points.max(axis=0)
    if low[2] == high[2]:  # of the plane: all of it, from above
        return np.array([0.0, 0.0, 1.0])
    size = np.maximum(high - low, 1e-300)
    place = (worst - low) / size if worst is not None else np.full(3, 0.5)
    outside = (place < MIDDLE[0]) | (place > MIDDLE[1])
    # Of axes alike, y: seen from the front.
    axis = min((1, 0, 2), key=lambda a: (bool(outside[a]), round(float(size[a] / size.max()), 2)))
    sign = -1.0 if axis == 1 else 1.0
    if not outside[axis] and abs(place[axis] - 0.5) > 0.1:
        sign = 1.0 if place[axis] > 0.5 else -1.0  # the larger part stays
    return np.asarray(sign * np.eye(3)[axis])


def _view(towards: Array, *, is_plane: bool) -> tuple[Array, Array]:
    """The eye a little to the side of the normal and above it, of a plane straight along it, and what is up."""
    up = np.array([0.0, 1.0, 0.0]) if abs(towards[2]) > 0.8 else np.array([0.0, 0.0, 1.0])
    if is_plane:
        return towards, up
    side = np.cross(up, towards)
    return towards + 0.42 * side / np.linalg.norm(side) + 0.36 * up, up


def _upright(axes: Axes, every: Tally) -> None:
    """Number of cells by quality, upwards; its colours are the legend of the mesh's."""
    bounds = edges_of([every], 40)
    counts = counts_in(every, bounds)
    middle = (bounds[1:] + bounds[:-1]) / 2
    top = int(counts.max())
    shown = np.where(counts > 0, np.maximum(counts, 0.008 * top), 0)
    heights = 0.88 * np.diff(bounds)
    axes.barh(middle, shown, height=heights, color=colours(middle), edgecolor=INK, linewidth=0.5)
    if every.n_degenerate:
        at = int(np.searchsorted(bounds, 0.0, side="right")) - 1
        axes.barh(
            middle[at],
            min(every.n_degenerate, int(counts[at])),
            height=heights[at],
            color=DEGENERATE,
            edgecolor=INK,
            linewidth=0.5,
        )
    axes.set_ylim(bounds[0], bounds[-1])
    axes.set_xlim(0, top * 1.02)
    axes.set_xticks([])
    axes.tick_params(axis="y", color=FAINT, labelsize=12.5, labelcolor=INK)
    for side, spine in axes.spines.items():
        spine.set_visible(side == "left")
        spine.set_color(FAINT)
    axes.set_title("quality $J_{ENS}$", fontsize=13, color=INK, loc="left", pad=12)
    lines = chart_style.words(every)
    for n, (text, colour) in enumerate(reversed(lines)):
        axes.text(0, -0.045 - 0.045 * (len(lines) - 1 - n), text, transform=axes.transAxes, fontsize=12.5, color=colour)
