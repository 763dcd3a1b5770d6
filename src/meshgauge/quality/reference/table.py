"""The convex polyhedra whose faces are regular polygons: 5 Platonic, 13 Archimedean and 92 Johnson solids from a file
that ships with the package, prisms and antiprisms made when asked for. There are no others (Zalgaller 1967).

``python -m meshgauge.quality.reference.build`` makes the file again.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

FILE = Path(__file__).with_name("solids.npz")


@dataclass(frozen=True, eq=False, repr=False)
class Solid:
    """A convex polyhedron of unit edges with regular faces.

    Attributes
    ----------
    name, family
        ``"elongated square gyrobicupola"``; one of ``"Platonic"``, ``"Archimedean"``, ``"Johnson"``, ``"prism"``,
        ``"antiprism"``.
    symbol
        ``"J37"`` for a Johnson solid, else empty.
    points
        ``(n, 3)``, centred on their mean.
    faces
        Outward, each from its lowest node.
    k
        ``(n,)`` J_S at each node.
    """

    name: str
    family: str
    symbol: str
    points: NDArray[np.float64]
    faces: tuple[tuple[int, ...], ...]
    k: NDArray[np.float64]

    def __repr__(self) -> str:
        return f"<Solid {self.symbol} {self.name}: {len(self.points)} nodes, {len(self.faces)} faces>".replace(
            "  ", " "
        )


@cache
def solids() -> tuple[Solid, ...]:
    """The 110 solids of the file: Platonic, Archimedean, Johnson, each in the usual order."""
    with np.load(FILE) as data:
        columns = {name: data[name] for name in data.files}
    node_ends, face_ends = np.cumsum(columns["n_nodes"]), np.cumsum(columns["n_faces"])
    corner_ends = np.cumsum(columns["face_sizes"])
    corners = np.split(columns["face_points"].astype(np.int64), corner_ends[:-1])
    rows = []
    for i, name in enumerate(columns["names"].tolist()):
        nodes = slice(int(node_ends[i] - columns["n_nodes"][i]), int(node_ends[i]))
        faces = corners[int(face_ends[i] - columns["n_faces"][i]) : int(face_ends[i])]
        family = "Platonic" if i < 5 else "Archimedean" if i < 18 else "Johnson"
        points, k = columns["points"][nodes], columns["k"][nodes]
        points.flags.writeable = k.flags.writeable = False
        rows.append(
            Solid(
                name=name,
                family=family,
                symbol=f"J{i - 17}" if family == "Johnson" else "",
                points=points,
                faces=tuple(tuple(face.tolist()) for face in faces),
                k=k,
            )
        )
    return tuple(rows)


def solid(which: str) -> Solid:
    """The solid of a name (``"cube"``) or symbol (``"J37"``).

    Raises
    ------
    KeyError
        If there is none.
    """
    for one in solids():
        if which in (one.name, one.symbol):
            return one
    raise KeyError(f"no regular-faced solid {which!r}; names are those of meshgauge.quality.reference.solids()")


def prism(n: int) -> Solid:
    """The prism of unit edges over a regular n-gon, n >= 3."""
    below, above = _ring(n, 0.0, -0.5), _ring(n, 0.0, 0.5)
    faces = [(*range(n - 1, -1, -1),), (*range(n, 2 * n),)]
    faces += [(i, (i + 1) % n, (i + 1) % n + n, i + n) for i in range(n)]
    return _solid("prism", n, np.concatenate([below, above]), faces)


def antiprism(n: int) -> Solid:
    """The antiprism of unit edges over a regular n-gon, n >= 3."""
    half = np.sqrt(0.75 - (0.5 * np.tan(0.5 * np.pi / n)) ** 2) / 2.0
    faces = [(*range(n - 1, -1, -1),), (*range(n, 2 * n),)]
    faces += [(i, (i + 1) % n, i + n) for i in range(n)]
    faces += [((i + 1) % n, (i + 1) % n + n, i + n) for i in range(n)]
    return _solid("antiprism", n, np.concatenate([_ring(n, 0.0, -half), _ring(n, 0.5, half)]), faces)


def _ring(n: int, first: float, z: float) -> NDArray[np.float64]:
    angle = 2.0 * np.pi * (np.arange(n) + first) / n
    radius = 0.5 / np.sin(np.pi / n)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(n, z)], axis=1)


def _solid(family: str, n: int, points: NDArray[np.float64], faces: list[tuple[int, ...]]) -> Solid:
    turned = tuple(face[face.index(min(face)) :] + face[: face.index(min(face))] for face in faces)
    return Solid(f"{n}-gonal {family}", family, "", points, turned, node_k(points, turned))


def node_k(points: NDArray[np.float64], faces: tuple[tuple[int, ...], ...]) -> NDArray[np.float64]:
    """J_S at each node of a convex solid: the least determinant of three consecutive unit edges around it."""
    after: list[dict[int, int]] = [{} for _ in points]
    for face in faces:
        for i, node in enumerate(face):
            after[node][face[i - 1]] = face[(i + 1) % len(face)]
    least = np.empty(len(points))
    for node, next_of in enumerate(after):
        ring = [min(next_of)]
        while len(ring) < len(next_of):
            ring.append(next_of[ring[-1]])
        edges = points[ring] - points[node]
        edges /= np.linalg.norm(edges, axis=1)[:, None]
        triples = (edges * np.cross(np.roll(edges, -1, axis=0), np.roll(edges, -2, axis=0))).sum(axis=1)
        least[node] = triples.min()
    return least
