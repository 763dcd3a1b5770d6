"""A cell and its neighbours as a flat drawing, for readers without scripts or WebGL, and where to look at it from."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...look.colours import colour

Values = NDArray[np.float64]

SIZE, ZOOM = 100.0, 58.0
"""The drawing is a square from -SIZE to SIZE; the cell's ball of radius 1 becomes one of this radius."""


class Sketch(NamedTuple):
    """Polygons as texts of SVG, from back to front."""

    around: list[str]  #: faces of the neighbours
    faces: list[str]  #: of the cell
    fill: str
    is_striped: bool  #: the cell is not usable
    node: tuple[float, float]  #: the worst


def side(points: Values, faces: list[list[int]], bad: int) -> Values:
    """The direction from which a cell is best seen: its worst node in front, and no flat face from its edge.

    Parameters
    ----------
    points
        ``(n, 3)`` with the cell in the ball of radius 1 about the origin.
    faces
        Of the cell, positions in ``points``.
    bad
        The worst node.
    """
    areas = np.array(
        [
            np.cross(points[face[t]] - points[face[0]], points[face[t + 1]] - points[face[0]])
            for face in faces
            for t in range(1, len(face) - 1)
        ]
    )
    angles = np.arange(24) * np.pi / 12 + 0.13
    height = np.repeat([-0.25, 0.3, 0.7], len(angles))
    sides = np.stack([*(np.tile(f(angles), 3) for f in (np.cos, np.sin)), height], axis=1)
    sides /= np.linalg.norm(sides, axis=1, keepdims=True)
    total = float(np.linalg.norm(areas, axis=1).sum()) or 1.0
    seen = np.abs(areas @ sides.T).sum(axis=0) / total
    towards = points[bad] / (float(np.linalg.norm(points[bad])) or 1.0)
    # No flat face straight from the front either: it would hide all behind it.
    best: Values = sides[np.argmax(np.minimum(seen, 0.6) + 0.3 * sides @ towards + 0.05 * height)]
    return best


def sketch(model: dict[str, Any]) -> Sketch:
    """The drawing of a card's model."""
    eye = np.array(model["from"])
    right = np.cross((0.0, 0.0, 1.0), eye)
    right /= np.linalg.norm(right)
    up = np.cross(eye, right)
    points = np.array(model["points"])
    flat = np.stack([points @ right, -(points @ up)], axis=1) * ZOOM
    depth = points @ eye

    def drawn(faces: list[list[int]]) -> list[str]:
        in_order = sorted(faces, key=lambda face: float(depth[face].mean()))
        return [" ".join(f"{x:.1f},{y:.1f}" for x, y in flat[face].tolist()) for face in in_order]

    cell, *others = model["cells"]
    x, y = flat[model["bad"]].tolist()
    return Sketch(
        around=drawn([face for other in others for face in other["faces"]]),
        faces=drawn(cell["faces"]),
        fill=colour(cell["shade"]),
        is_striped=cell["class"] > 0,
        node=(round(x, 1), round(y, 1)),
    )
