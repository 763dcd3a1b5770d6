"""The worst faces for finite volumes: where they are in the mesh, and each from near with the cells beside it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import MeshgaugeError, expect
from ..look import style
from ..look.colours import FAINT, INK, SOFT, WORDS, colours
from ..quality.faces import WorstFace
from ..quality.measure import Quality
from ..quality.metrics import LIMITS, METRICS
from ..quality.neighbours import with_face_metrics
from . import callouts, chart_style
from .pyvista_cells import Solids, drawable, surface
from .rendering import Canvas, over
from .worst_cells_scene import CAPTION, HEAD, HEIGHT, MOST, WHERE, WIDTH, numbered, some_cells

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MEASURES = tuple(name for name in LIMITS if "face" in METRICS[name].where)
"""The measures of faces."""


def worst_faces(quality: Quality, measure: str = "non_orthogonality", n: int = 6, *, title: str = "") -> Figure:
    """The worst faces of a measure of finite volumes: where they are, numbered, and each from near with its cells.

    Parameters
    ----------
    quality
        Of a mesh; what is needed beside it is measured.
    measure
        One of `MEASURES`.
    n
        How many, 1 to 12; fewer if fewer have a value.
    title
        Above the picture.

    Returns
    -------
    matplotlib.figure.Figure
        1600 by 900 pixels. Faces are orange beyond the limit of the measure, blue within it; the edges of the cells
        beside are drawn.

    Raises
    ------
    MeshgaugeError
        If the measure is none of faces, ``n`` is not in 1 to 12, or no face has a value.
    """
    if measure not in MEASURES:
        raise MeshgaugeError(f"{measure} is no measure of faces; known are {', '.join(MEASURES)}")
    if not 1 <= n <= MOST:
        raise MeshgaugeError(f"{n} worst faces are asked for, expected 1 to {MOST}")
    quality = with_face_metrics(expect(quality, Quality), [measure])
    row = METRICS[measure]
    if quality.faces is None:
        raise MeshgaugeError("there is nothing to draw: the mesh has no faces between solid cells")
    found = quality.faces.worst(measure, n, highest=row.better == "lower")
    if not found:
        raise MeshgaugeError(f"there is nothing to draw: no face has a value of {measure}")
    solids = drawable(quality)
    figure = chart_style.figure(WIDTH / 100, HEIGHT / 100, dpi=100)
    chart_style.title(figure, title, f"The worst faces by {measure}; its limit is {LIMITS[measure]}")
    numbered(figure, solids, _faces(solids, quality, found), [face.centre for face in found])
    columns = min(len(found), 3 if len(found) <= 6 else 4)
    rows = -(-len(found) // columns)
    width, height = (WIDTH - WHERE - 20) // columns, (HEIGHT - HEAD) // rows
    for number, face in enumerate(found):
        left, top = WHERE + (number % columns) * width, HEAD + (number // columns) * height
        _near(figure, solids, quality, face, number + 1, (left, top, width - 12, height - 12))
    return figure


def _faces(solids: Solids, quality: Quality, faces: list[WorstFace]) -> Any:
    """Some faces as polygons in the colours of their values."""
    import pyvista

    mesh = quality.mesh
    points = solids.place(np.concatenate([mesh.points[list(face.points)] for face in faces]))
    starts = np.cumsum([0, *(len(face.points) for face in faces)])
    loops = [[len(face.points), *range(a, b)] for face, a, b in zip(faces, starts[:-1], starts[1:], strict=True)]
    made = pyvista.PolyData(points, faces=np.concatenate(loops))
    row = METRICS[faces[0].measure]
    values = np.array([face.value for face in faces])
    shades = colours(values, row.acceptable, is_signed=False, lower_is_better=row.better == "lower")
    made.cell_data["colour"] = (255 * shades).round().astype(np.uint8)
    return made


def _near(
    figure: Figure, solids: Solids, quality: Quality, face: WorstFace, number: int, box: tuple[int, int, int, int]
) -> None:
    """One face from near among the edges of its cells, with what it is written above it."""
    left, top, width, height = box
    mesh = quality.mesh
    beside = [cell for cell in (face.owner, face.neighbour) if cell is not None]
    nodes = np.concatenate([mesh.nodes(cell) for cell in beside])
    ring = solids.place(mesh.points[list(face.points)])
    normal = _normal(ring)
    eye, up = _aside(normal)
    points = solids.place(mesh.points[nodes])
    with Canvas(width, height - CAPTION, eye, up, points, margin=(0.16, 0.16, 0.14, 0.14)) as canvas:
        canvas.lines(some_cells(solids.grid, beside).extract_all_edges(), FAINT, 1.2)
        behind = canvas.image()
        canvas.plotter.clear_actors()
        canvas.add(surface(_faces(solids, quality, [face])), edge_opacity=0.9, width=1.6)
        image = over(canvas.image(transparent=True), behind, 0.93)
    callouts.picture(figure, image, left, top + CAPTION)
    axes = figure.axes[-1]
    callouts.badge(axes, np.array([20.0, 26.0 - CAPTION]), str(number))
    look: dict[str, Any] = {"va": "center", "clip_on": False}
    low, high = METRICS[face.measure].acceptable
    is_beyond = not low <= face.value <= high
    value = style.quality(face.value)
    axes.text(42, 15 - CAPTION, face.name, color=INK, fontsize=11.5, **look)
    axes.text(
        42, 37 - CAPTION, value, color=WORDS["poor" if is_beyond else "good"], fontsize=11.5, weight="bold", **look
    )
    said = "beyond its limit" if is_beyond else "within its limit"
    axes.text(42 + 11 * len(value), 37 - CAPTION, said, color=SOFT, fontsize=10.5, **look)


def _normal(ring: NDArray[np.float64]) -> NDArray[np.float64]:
    """The unit normal of a loop of points; of one without area z."""
    area = np.cross(ring, np.roll(ring, -1, axis=0)).sum(axis=0)
    size = float(np.linalg.norm(area))
    return area / size if size > 0.0 else np.array([0.0, 0.0, 1.0])


def _aside(normal: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """From where a face is looked at, a little from aside, and what is up."""
    up = np.array([0.0, 0.0, 1.0]) if abs(normal[2]) < 0.8 else np.array([0.0, 1.0, 0.0])
    right = np.cross(up, normal)
    return normal + 0.55 * right / np.linalg.norm(right) + 0.4 * up, up
