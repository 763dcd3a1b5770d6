"""The worst cells: where they are in the mesh, and each of them seen from near."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import MeshgaugeError, expect
from ..look.colours import FAINT, INK, SOFT
from ..mesh.high_order import row_of
from ..mesh.polyhedra import Polyhedra
from ..quality.measure import Quality
from ..quality.worst import WorstCell
from . import callouts, chart_style
from .pyvista_cells import CELL, Solids, corners, drawable, shell, surface
from .rendering import Canvas, frame, over

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

WIDTH, HEIGHT, HEAD, CAPTION = 1600, 900, 70, 64
WHERE = 620
"""Width of the picture of the whole mesh."""

MOST = 12


def worst(quality: Quality, n: int = 6, *, title: str = "") -> Figure:
    """The worst cells, invalid ones first: where they are, numbered, and each from near among its neighbours.

    Parameters
    ----------
    quality
        Of a mesh.
    n
        How many, 1 to 12; fewer if fewer have a value.
    title
        Above the picture.

    Returns
    -------
    matplotlib.figure.Figure
        1600 by 900 pixels. The worst node has a ring; the edges of its corner are heavy; neighbours are outlined.

    Raises
    ------
    MeshgaugeError
        If there is nothing to draw or ``n`` is not in 1 to 12.
    """
    if not 1 <= n <= MOST:
        raise MeshgaugeError(f"{n} worst cells are asked for, expected 1 to {MOST}")
    return _scene(quality, expect(quality, Quality).worst(n), title)


def one_cell(quality: Quality, position: int, *, title: str = "") -> Figure:
    """One cell: where it is, and from near among its neighbours, as in `worst`.

    Parameters
    ----------
    quality
        Of a mesh.
    position
        Of the cell in the file, from 0.
    title
        Above the picture.

    Returns
    -------
    matplotlib.figure.Figure
        1600 by 900 pixels.

    Raises
    ------
    MeshgaugeError
        If there is no such cell, or it has no value or no finite coordinates, so that it cannot be drawn.
    """
    if not 0 <= position < expect(quality, Quality).mesh.n_cells:
        raise MeshgaugeError(f"no cell {position}: the mesh has cells 0 to {quality.mesh.n_cells - 1}")
    drawn = drawable(quality).grid.cell_data[CELL]
    if np.isnan(quality.values[position]) or position not in drawn:
        raise MeshgaugeError(f"cell {position} has no value, so that it cannot be drawn")
    return _scene(quality, [quality.worst_node(position)], title)


def _scene(quality: Quality, cells: list[WorstCell], title: str) -> Figure:
    """Some cells in the whole mesh, and each from near."""
    if not cells:
        raise MeshgaugeError("there is nothing to draw: no cell has a value")
    solids = drawable(quality)
    figure = chart_style.figure(WIDTH / 100, HEIGHT / 100, dpi=100)
    chart_style.title(figure, title, chart_style.sentence(quality.summary()))
    drawn = surface(some_cells(solids.grid, [cell.cell for cell in cells]))
    numbered(figure, solids, drawn, [cell.coordinates for cell in cells])
    columns = min(len(cells), 3 if len(cells) <= 6 else 4)
    rows = -(-len(cells) // columns)
    width, height = (WIDTH - WHERE - 20) // columns, (HEIGHT - HEAD) // rows
    for number, one in enumerate(cells):
        left, top = WHERE + (number % columns) * width, HEAD + (number // columns) * height
        _near(figure, solids, quality, one, number + 1, (left, top, width - 12, height - 12))
    return figure


def numbered(figure: Figure, solids: Solids, drawn: Any, places: ArrayLike) -> None:
    """The mesh seen through, with what is drawn in it and numbers at some places of the mesh."""
    skin = surface(solids.grid)
    points = corners(skin)
    size = points.max(axis=0) - points.min(axis=0)
    # Seen along the direction in which the mesh is thinnest, from a little above and aside.
    up = np.array([0.0, 0.0, 1.0]) if size[2] > 0.5 * size.max() else np.array([0.0, 1.0, 0.0])
    front = np.array([0.0, -1.0, 0.0]) if up[2] else np.array([0.0, 0.0, 1.0])
    # A mesh of the plane from straight above.
    eye = front + 0.5 * np.cross(up, front) + 0.45 * up if size[2] > 0.0 else front
    with Canvas(WHERE - 20, HEIGHT - HEAD, eye, up, points, margin=(0.07, 0.07, 0.05, 0.05)) as canvas:
        image = shell(canvas, skin)
        canvas.add(drawn, width=0.8)
        image = over(canvas.image(transparent=True), image)
        at = canvas.pixels(solids.place(places))
    axes = callouts.picture(figure, image, 10, HEAD)
    for number, (place, point) in enumerate(zip(callouts.apart(at, 26.0), at, strict=True), 1):
        if np.linalg.norm(place - point) > 2:
            axes.plot(*zip(place, point, strict=True), color=INK, linewidth=0.9, zorder=2)
        callouts.badge(axes, place, str(number))


def _near(
    figure: Figure, solids: Solids, quality: Quality, cell: WorstCell, number: int, box: tuple[int, int, int, int]
) -> None:
    """One cell from near, with what it is written above it."""
    left, top, width, height = box
    mesh = quality.mesh
    nodes = mesh.nodes(cell.cell)
    points = solids.place(mesh.points[nodes])
    where = solids.place(cell.coordinates)[0]
    outward = where - points.mean(axis=0)
    reach = float(np.abs(points - where).max())
    along = outward / np.linalg.norm(outward) if np.linalg.norm(outward) > 1e-3 * reach else np.array([0.0, 0.0, 1.0])
    up = np.array([0.0, 0.0, 1.0]) if abs(along[2]) < 0.8 else np.array([0.0, 1.0, 0.0])
    right, above, _ = frame(along, up)
    eye = along + 0.45 * right + 0.35 * above
    if mesh.dimension == 2:  # from above
        eye, up = _normal(points, up), right
    is_node = np.zeros(mesh.n_points, np.bool_)
    is_node[nodes] = True
    entries = np.flatnonzero(is_node[mesh.connectivity])
    around = np.unique(np.searchsorted(mesh.offsets, entries, side="right") - 1)
    with Canvas(width, height - CAPTION, eye, up, points, margin=(0.16, 0.16, 0.14, 0.14)) as canvas:
        neighbours = some_cells(solids.grid, around)
        canvas.lines(neighbours.extract_all_edges(), FAINT, 0.7)
        behind = canvas.image()
        canvas.plotter.clear_actors()
        canvas.add(surface(some_cells(solids.grid, [cell.cell])), edge_opacity=0.9, width=1.1)
        image = over(canvas.image(transparent=True), behind, 0.93)
        at = canvas.pixels(np.array([where, *solids.place(_ends(quality, cell))]))
    axes = callouts.picture(figure, image, left, top + CAPTION)
    for end in at[1:]:
        axes.plot([at[0, 0], end[0]], [at[0, 1], end[1]], color=INK, linewidth=2.4, solid_capstyle="round", zorder=2)
    callouts.ring(axes, at[0])
    what, value, node = callouts.caption(cell)
    callouts.badge(axes, np.array([20.0, 26.0 - CAPTION]), str(number))
    look: dict[str, Any] = {"va": "center", "clip_on": False}
    axes.text(42, 15 - CAPTION, f"{what}", color=INK, fontsize=11.5, **look)
    colour = callouts.colour_of(cell, quality.poor_below)
    axes.text(42, 37 - CAPTION, f"{value}", color=colour, fontsize=11.5, weight="bold", **look)
    axes.text(42 + 11 * len(value), 37 - CAPTION, node, color=SOFT, fontsize=10.5, **look)


def _normal(points: Array, otherwise: Array) -> Array:
    """The direction in which some points extend least, upwards; of points on a line any."""
    _, sizes, axes = np.linalg.svd(points - points.mean(axis=0))
    normal = axes[2] if sizes[1] > 0.0 else otherwise
    return np.asarray(normal if normal[2] >= 0.0 else -normal)


def some_cells(grid: Any, cells: ArrayLike) -> Any:
    """Some of the cells by their position in the file, ascending; those that are not drawn are left out."""
    drawn = np.asarray(grid.cell_data[CELL])
    wanted = np.unique(cells)
    at = np.minimum(np.searchsorted(drawn, wanted), len(drawn) - 1)
    return grid.extract_cells(at[drawn[at] == wanted])


def _ends(quality: Quality, cell: WorstCell) -> Array:
    """The other ends of the edges at the worst corner, ``(n, 3)``; edges of curved cells are drawn straight."""
    mesh = quality.mesh
    row = row_of(mesh, cell.cell)
    if row is not None and row.shape is not None:
        corner = row.corners.index(cell.node)
        ends = [a + b - corner for a, b in row.shape.edges if corner in (a, b)]
        ids = mesh.nodes(cell.cell)[[row.corners[end] for end in ends]].tolist()
    else:
        ids = _neighbours(mesh.polyhedra, cell) if mesh.polyhedra is not None else []
    return np.asarray(mesh.points[ids], np.float64).reshape(-1, 3)


def _neighbours(polyhedra: Polyhedra, cell: WorstCell) -> list[int]:
    """The points beside the worst one in the faces of a polyhedron."""
    neighbours: set[int] = set()
    for face in polyhedra.cell_faces[polyhedra.cell_offsets[cell.cell] : polyhedra.cell_offsets[cell.cell + 1]]:
        loop = polyhedra.face_points[polyhedra.face_offsets[face] : polyhedra.face_offsets[face + 1]].tolist()
        if cell.point in loop:
            at = loop.index(cell.point)
            neighbours |= {loop[at - 1], loop[(at + 1) % len(loop)]}
    return sorted(neighbours)
