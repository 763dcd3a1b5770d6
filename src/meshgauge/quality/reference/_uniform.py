"""The Platonic and Archimedean solids by Wythoff's construction.

Three mirrors at angles π/p, π/q, π/2 generate the symmetry group of {p, q}. The images of a point at distance ½ from
some of the mirrors and on the others are the vertices of a uniform solid of unit edges (Coxeter, Regular Polytopes,
chapter V). The snub solids are images under rotations alone.
"""

from __future__ import annotations

import numpy as np

from ._hull import Points

NAMES = {
    "tetrahedron": (3, "100"),
    "cube": (4, "100"),
    "octahedron": (4, "001"),
    "dodecahedron": (5, "100"),
    "icosahedron": (5, "001"),
    "truncated tetrahedron": (3, "110"),
    "cuboctahedron": (4, "010"),
    "truncated cube": (4, "110"),
    "truncated octahedron": (4, "011"),
    "rhombicuboctahedron": (4, "101"),
    "truncated cuboctahedron": (4, "111"),
    "snub cube": (4, "snub"),
    "icosidodecahedron": (5, "010"),
    "truncated dodecahedron": (5, "110"),
    "truncated icosahedron": (5, "011"),
    "rhombicosidodecahedron": (5, "101"),
    "truncated icosidodecahedron": (5, "111"),
    "snub dodecahedron": (5, "snub"),
}
"""For each solid, p of the group {p, 3} and the mirrors that the vertex is off."""


def vertices(name: str) -> Points:
    """``(n, 3)`` vertices of a Platonic or Archimedean solid, centred."""
    p, rings = NAMES[name]
    mirrors = _mirrors(p)
    reflections = [np.eye(3) - 2.0 * np.outer(m, m) for m in mirrors]
    if rings == "snub":
        rotations = [reflections[i] @ reflections[j] for i, j in ((0, 1), (1, 2), (0, 2))]
        return _images(_snub_vertex(_off(mirrors, "111"), rotations), rotations)
    return _images(_off(mirrors, rings), reflections)


def _off(mirrors: Points, rings: str) -> Points:
    """The point at distance ½ from the ringed mirrors and on the others."""
    return np.asarray(np.linalg.solve(mirrors, [0.5 * int(ring) for ring in rings]), np.float64)


def _mirrors(p: int) -> Points:
    """Unit normals of the mirrors of {p, 3}, as rows."""
    a, b = np.cos(np.pi / p), 0.5
    first, second = np.array([1.0, 0.0, 0.0]), np.array([-a, np.sin(np.pi / p), 0.0])
    y = -b / second[1]
    return np.array([first, second, [0.0, y, np.sqrt(1.0 - y * y)]])


def _images(point: Points, generators: list[Points]) -> Points:
    """Every image of a point under the group, in the order found."""
    orbit = [point]
    for at in orbit:
        for g in generators:
            image = g @ at
            if min(np.linalg.norm(image - other) for other in orbit) > 1e-6:
                orbit.append(image)
    return np.array(orbit)


def _snub_vertex(start: Points, rotations: list[Points]) -> Points:
    """The point that all three rotations move by 1: by Newton's method from the vertex of the omnitruncated solid."""
    x = start
    maps = [np.eye(3) - r for r in rotations]
    for _ in range(60):
        moved = [m @ x for m in maps]
        error = np.array([v @ v - 1.0 for v in moved])
        x = x - np.linalg.solve(np.array([2.0 * m.T @ v for m, v in zip(maps, moved, strict=True)]), error)
    return x
