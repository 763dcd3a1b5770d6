"""Make the table of regular-faced solids again: ``python -m meshgauge.quality.reference.build [FILE]``.

Every solid is checked before it is written: Euler's formula, edges of length 1, faces planar and regular, convex.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from . import _johnson, _uniform
from ._hull import Faces, Points, faces, is_regular_faced, polish
from .table import FILE, node_k


def regular_faced_solids() -> list[tuple[str, Points, Faces]]:
    """Name, vertices and faces of the 110 solids."""
    makers: list[tuple[str, Callable[[], Points]]] = [
        *((name, partial(_uniform.vertices, name)) for name in _uniform.NAMES),
        *_johnson.makers(),
    ]
    solids = []
    for name, maker in makers:
        rough = maker()
        of = faces(rough)
        points = polish(rough, of)
        problem = _problem(points, of)
        if problem:
            raise ArithmeticError(f"{name}: {problem}")
        solids.append((name, points, of))
    return solids


def _problem(points: Points, of: Faces) -> str:
    """What keeps a solid from being convex with regular faces of unit edges, to 1e-12; empty if nothing."""
    if not is_regular_faced(points, of):
        return "the faces do not close, or are not regular"
    for face in of:
        ring = points[list(face)]
        edges = np.linalg.norm(ring - np.roll(ring, 1, axis=0), axis=1)
        normal = np.cross(ring[1] - ring[0], ring[2] - ring[1])
        height = (points - ring[0]) @ (normal / np.linalg.norm(normal))
        if np.abs(edges - 1.0).max() > 1e-12:
            return f"face {face} has edges {edges}, expected 1"
        if np.abs(height[list(face)]).max() > 1e-12:
            return f"face {face} is warped"
        if np.delete(height, list(face)).max() > -1e-3:
            return f"face {face} is not convex with the rest"
    return ""


def write(path: Path) -> None:
    """Write the table: NumPy's own format, about 60 kB."""
    rows = regular_faced_solids()
    np.savez_compressed(
        path,
        names=np.array([name for name, _, _ in rows]),
        n_nodes=np.array([len(points) for _, points, _ in rows], np.uint8),
        n_faces=np.array([len(of) for _, _, of in rows], np.uint8),
        face_sizes=np.array([len(face) for _, _, of in rows for face in of], np.uint8),
        face_points=np.array([node for _, _, of in rows for face in of for node in face], np.uint8),
        points=np.concatenate([points for _, points, _ in rows]),
        k=np.concatenate([node_k(points, of) for _, points, of in rows]),
    )


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else FILE
    write(target)
    print(f"{target}: {target.stat().st_size} bytes")
