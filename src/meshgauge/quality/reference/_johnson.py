"""The 92 Johnson solids: gluing, gyrating, diminishing and augmenting, and seven that nothing simpler makes.

N. W. Johnson, Convex polyhedra with regular faces, Canadian Journal of Mathematics 18 (1966), lists and names them;
V. A. Zalgaller, Convex polyhedra with regular faces (1967), proved the list complete. *Ortho* joins like parts as
mirror images, *gyro* turns one of them; *para* parts are opposite, *meta* parts are not.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np

from . import _uniform
from ._hull import Points, circumradius, faces, is_regular_faced, polish

TAU = 2.0 * np.pi
PHI = (1.0 + np.sqrt(5.0)) / 2.0


def _ring(n: int, z: float, first: float = 0.5) -> Points:
    """A regular n-gon of unit edges at height z; vertex 0 at ``first`` steps from the x axis, so that for ½ an edge
    crosses the axis."""
    angle = TAU * (np.arange(n) + first) / n
    radius = 0.5 / np.sin(np.pi / n)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(n, z)], axis=1)


def _pyramid(n: int) -> Points:
    """What a pyramid has above its base: the apex."""
    return np.array([[0.0, 0.0, np.sqrt(1.0 - circumradius(n) ** 2)]])


def _cupola(n: int) -> Points:
    """What a cupola has above its base, a 2n-gon: the n-gon, an edge of which is parallel to that across the x axis."""
    apart = 0.5 / np.tan(np.pi / (2 * n)) - 0.5 / np.tan(np.pi / n)
    return _ring(n, float(np.sqrt(1.0 - apart * apart)))


@cache
def _rotunda() -> Points:
    """What a rotunda has above its base, a decagon: half of an icosidodecahedron, with the triangle below an edge of
    its pentagon across the x axis."""
    points = _uniform.vertices("icosidodecahedron")
    pentagon = next(f for f in faces(points) if len(f) == 5)
    z = points[list(pentagon)].mean(axis=0)
    z /= np.linalg.norm(z)
    x = points[pentagon[0]] + points[pentagon[1]]
    x -= (x @ z) * z
    x /= np.linalg.norm(x)
    local: Points = points @ np.array([x, np.cross(z, x), z]).T
    return local[local[:, 2] > 1e-6]


def _turn(points: Points, angle: float) -> Points:
    c, s = np.cos(angle), np.sin(angle)
    turned: Points = points @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return turned


def _antiprism_height(n: int) -> float:
    step = 2.0 * circumradius(n) * np.sin(np.pi / (2 * n))
    return float(np.sqrt(1.0 - step * step))


NOTHING = np.empty((0, 3))


def _tower(below: Points, n: int, above: Points, middle: str = "", turn: float = 0.0) -> Points:
    """Caps on both sides of an n-gon, of an n-gonal prism or of an antiprism.

    ``below`` and ``above`` are what the caps have above their base; ``turn`` is that of the upper cap, in steps of
    the n-gon beside the one that an antiprism gives it.
    """
    height = {"": 0.0, "prism": 1.0, "antiprism": _antiprism_height(n)}[middle]
    first = turn + (0.5 if middle == "antiprism" else 0.0)
    parts = [below * [1.0, 1.0, -1.0], _ring(n, 0.0)]
    if middle:
        parts.append(_turn(_ring(n, height), TAU * first / n))
    parts.append(_turn(np.add(above, [0.0, 0.0, height]), TAU * first / n))
    return np.concatenate(parts)


def _face_ids(points: Points, n: int) -> list[tuple[int, ...]]:
    return [f for f in faces(points) if len(f) == n]


def _cap(points: Points, cap: Points, on: list[tuple[int, ...]]) -> Points:
    """Cap the given faces. Of the two ways to turn a cupola, the one that leaves no face in a neighbour's plane."""
    out = points
    for face in on:
        n = len(face)
        middle = points[list(face)].mean(axis=0)
        z = np.cross(points[face[1]] - points[face[0]], points[face[2]] - points[face[1]])
        z /= np.linalg.norm(z)
        x = 0.5 * (points[face[0]] + points[face[1]]) - middle
        x /= np.linalg.norm(x)
        frame = np.array([x, np.cross(z, x), z])
        options = [np.concatenate([out, _turn(cap, TAU * turn / n) @ frame + middle]) for turn in (0, 1)]
        out = next(o for o in options if is_regular_faced(o, faces(o)))
    return out


def _apart(points: Points, among: list[tuple[int, ...]]) -> dict[str, list[tuple[int, ...]]]:
    """Of faces of a dodecahedral arrangement: one; two opposite; two and three neither opposite nor neighbours."""
    centres = [points[list(f)].mean(axis=0) for f in among]
    centres = [c / np.linalg.norm(c) for c in centres]

    def is_meta(i: int, j: int) -> bool:
        return -0.9 < float(centres[i] @ centres[j]) < 0.0

    rest = range(1, len(among))
    opposite = next(i for i in rest if centres[0] @ centres[i] < -0.9)
    second = next(i for i in rest if is_meta(0, i))
    third = next(i for i in rest if is_meta(0, i) and is_meta(second, i))
    return {
        "one": [among[0]],
        "para": [among[0], among[opposite]],
        "meta": [among[0], among[second]],
        "tri": [among[0], among[second], among[third]],
    }


def _gyrate_or_diminished(where: str, gyrated: tuple[int, ...], cut: tuple[int, ...]) -> Points:
    """A rhombicosidodecahedron with some cupolas turned and some cut off, by their number in the arrangement."""
    points = _uniform.vertices("rhombicosidodecahedron")
    places = _apart(points, _face_ids(points, 5))[where]
    out = points.copy()
    for i in gyrated:
        ids = list(places[i])
        z = points[ids].mean(axis=0)
        out[ids] = 2.0 * z - points[ids]  # half a turn is the same as a tenth for a pentagon
    kept = np.ones(len(points), np.bool_)
    for i in cut:
        kept[list(places[i])] = False
    return out[kept]


def _icosahedron_without(n: int) -> Points:
    """An icosahedron less n vertices, no two of them neighbours or opposite."""
    points = _uniform.vertices("icosahedron")
    left_out: list[int] = []
    while len(left_out) < n:
        left_out.append(
            next(
                i
                for i in range(12)
                if i not in left_out and all(abs(np.linalg.norm(points[i] - points[j]) - PHI) < 1e-6 for j in left_out)
            )
        )
    return np.delete(points, left_out, axis=0)


def _augmented_icosahedron() -> Points:
    """The tridiminished icosahedron with a tetrahedron on the triangle between its pentagons."""
    points = _icosahedron_without(3)
    of = faces(points)
    beside = {frozenset((f[i - 1], f[i])): len(f) for f in of if len(f) == 5 for i in range(5)}
    face = next(f for f in of if len(f) == 3 and all(frozenset((f[i - 1], f[i])) in beside for i in range(3)))
    return _cap(points, _pyramid(3), [face])


def _on_prism(n: int, which: tuple[int, ...]) -> Points:
    """An n-gonal prism with square pyramids on some of its sides, numbered around."""
    points = np.concatenate([_ring(n, -0.5), _ring(n, 0.5)])
    sides: list[tuple[int, ...]] = [(i, (i + 1) % n, (i + 1) % n + n, i + n) for i in which]
    return _cap(points, _pyramid(4), sides)


def _on(name: str, cap: Points, n: int, where: str) -> Points:
    """A uniform solid with caps on some of its n-gons."""
    points = _uniform.vertices(name)
    among = _face_ids(points, n)
    return _cap(points, cap, _apart(points, among)[where])


def _truncated_cube(n: int) -> Points:
    points = _uniform.vertices("truncated cube")
    among = _face_ids(points, 8)
    opposite = next(
        f for f in among if np.allclose(points[list(f)].mean(axis=0), -points[list(among[0])].mean(axis=0), atol=1e-6)
    )
    return _cap(points, _cupola(4), [among[0], opposite][:n])


def _images(orbits: list[tuple[float, float, float]]) -> Points:
    """The points and their mirror images in the planes x = 0 and y = 0."""
    points = {(sx * x + 0.0, sy * y + 0.0, z) for x, y, z in orbits for sx in (1, -1) for sy in (1, -1)}
    return np.array(sorted(points))


def _polish(rough: Points) -> Points:
    return polish(rough, faces(rough, near=0.02))


def _snub_disphenoid() -> Points:
    q = float(next(r.real for r in np.roots([2.0, 11.0, 4.0, -1.0]) if r.real > 0))
    r, s, t = np.sqrt(q), np.sqrt((1 - q) / (2 * q)), np.sqrt(2 - 2 * q)
    points = [(t, r, 0), (-t, r, 0), (0, -r, t), (0, -r, -t), (1, -s, 0), (-1, -s, 0), (0, s, 1), (0, s, -1)]
    return 0.5 * np.array(points, float)


def _snub_square_antiprism() -> Points:
    # Four squares, each turned by an eighth against the next: radius and heights of the inner two from the lengths.
    r = 1.21320555
    h1, h2 = np.sqrt(1 - (r - np.sqrt(0.5)) ** 2), np.sqrt(0.75 - (r - 0.5) ** 2)
    top, inner = (h1 + h2) / 2, (h2 - h1) / 2

    def square(radius: float, z: float, eighths: int) -> Points:
        angle = TAU / 8 * (eighths + 2 * np.arange(4))
        return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(4, z)], axis=1)

    half = np.sqrt(0.5)
    return _polish(
        np.concatenate([square(half, top, 0), square(r, inner, 0), square(half, -top, 1), square(r, -inner, 1)])
    )


def _sphenocorona() -> Points:
    k = 0.85273
    c = np.sqrt(1 - k * k)
    orbits = [
        (0.0, 1.0, 2 * c),
        (2 * k, 1.0, 0.0),
        (0.0, 1 + np.sqrt(3 - 4 * k * k) / c, (1 - 2 * k * k) / c),
        (1.0, 0.0, -np.sqrt(2 + 4 * k - 4 * k * k)),
    ]
    return _polish(0.5 * _images(orbits))


def _augmented_sphenocorona() -> Points:
    points = _sphenocorona()
    return _cap(points, _pyramid(4), _face_ids(points, 4)[:1])


# Vertices to three or four digits, enough to tell the faces; `polish` finds the rest.


def _sphenomegacorona() -> Points:
    return _polish(
        _images([(0.5, 0.5946, 0.8040), (0.8547, 0, 1.5255), (0, 0.5, 1.6649), (1.2831, 0, 0.6219), (0.5, 0, 0)])
    )


def _hebesphenomegacorona() -> Points:
    return _polish(
        _images([(0.5, 0.7168, 0.9762), (1.1013, 0, 0.6233), (0.8357, 0, 1.5873), (0.5, 0.5, 0), (0, 0.5, 1.8146)])
    )


def _disphenocingulum() -> Points:
    upper = [(-0.090, 0.165), (0.615, 0.608), (-0.350, 0.707), (-0.745, -0.542), (0.655, -0.378), (-1.004, 0.0)]
    upper += [(0.350, 0.707), (-0.615, 0.608), (0.0, -1.085), (1.004, 0.0), (-0.860, -0.985), (0.860, -0.985)]
    upper += [(-0.655, -0.378), (0.090, 0.165), (0.0, -1.085), (0.745, -0.542)]
    z = [-1.156, -0.602, -0.357, -0.889, -0.767, -0.090, 0.357, 0.602, -0.5, 0.090, 0.0, 0.0, 0.767, 1.156, 0.5, 0.889]
    return _polish(np.array([(x, y, h) for (x, y), h in zip(upper, z, strict=True)]))


def _bilunabirotunda() -> Points:
    points = [(PHI, 1, 1), (-PHI, 1, 1), (PHI, 1, -1), (-PHI, 1, -1), (1, 1 + PHI, 0), (-1, 1 + PHI, 0), (0, 0, PHI)]
    half = 0.5 * np.array(points, float)
    return np.concatenate([half, -half])


def _triangular_hebesphenorotunda() -> Points:
    """A triangle above a hexagon of edges 1 and φ above a regular hexagon, and the tips of three pentagons."""
    x = np.sqrt(2 * PHI * PHI / 3 - 0.25)
    x1, x2 = 1 / np.sqrt(3), np.sqrt(3) / 2
    h1, h2 = np.sqrt(0.75 - (x - x1) ** 2), -np.sqrt(1 - (x - x2) ** 2)
    edge = np.array([-x1 / 2, 0.0, h1])
    tip = edge + PHI * (np.array([-PHI * np.sqrt(5 / 12), 0.0, 0.0]) - edge)
    third = np.array([(x1, 0, h1), (x, 0.5, 0), (x, -0.5, 0), tip, (x2, 0.5, h2), (x2, -0.5, h2)])
    return np.concatenate([_turn(third, TAU * i / 3) for i in range(3)])


def _towers() -> list[tuple[str, Callable[[], Points]]]:
    """J1 to J48."""
    p3, p4, p5, c3, c4, c5, ro = (_pyramid(3), _pyramid(4), _pyramid(5), _cupola(3), _cupola(4), _cupola(5), _rotunda())
    rows: list[tuple[str, tuple[Any, ...]]] = [
        ("square pyramid", (NOTHING, 4, p4)),
        ("pentagonal pyramid", (NOTHING, 5, p5)),
        ("triangular cupola", (NOTHING, 6, c3)),
        ("square cupola", (NOTHING, 8, c4)),
        ("pentagonal cupola", (NOTHING, 10, c5)),
        ("pentagonal rotunda", (NOTHING, 10, ro)),
        ("elongated triangular pyramid", (NOTHING, 3, p3, "prism")),
        ("elongated square pyramid", (NOTHING, 4, p4, "prism")),
        ("elongated pentagonal pyramid", (NOTHING, 5, p5, "prism")),
        ("gyroelongated square pyramid", (NOTHING, 4, p4, "antiprism")),
        ("gyroelongated pentagonal pyramid", (NOTHING, 5, p5, "antiprism")),
        ("triangular bipyramid", (p3, 3, p3)),
        ("pentagonal bipyramid", (p5, 5, p5)),
        ("elongated triangular bipyramid", (p3, 3, p3, "prism")),
        ("elongated square bipyramid", (p4, 4, p4, "prism")),
        ("elongated pentagonal bipyramid", (p5, 5, p5, "prism")),
        ("gyroelongated square bipyramid", (p4, 4, p4, "antiprism")),
        ("elongated triangular cupola", (NOTHING, 6, c3, "prism")),
        ("elongated square cupola", (NOTHING, 8, c4, "prism")),
        ("elongated pentagonal cupola", (NOTHING, 10, c5, "prism")),
        ("elongated pentagonal rotunda", (NOTHING, 10, ro, "prism")),
        ("gyroelongated triangular cupola", (NOTHING, 6, c3, "antiprism")),
        ("gyroelongated square cupola", (NOTHING, 8, c4, "antiprism")),
        ("gyroelongated pentagonal cupola", (NOTHING, 10, c5, "antiprism")),
        ("gyroelongated pentagonal rotunda", (NOTHING, 10, ro, "antiprism")),
        ("gyrobifastigium", ()),
        ("triangular orthobicupola", (c3, 6, c3)),
        ("square orthobicupola", (c4, 8, c4)),
        ("square gyrobicupola", (c4, 8, c4, "", 1.0)),
        ("pentagonal orthobicupola", (c5, 10, c5)),
        ("pentagonal gyrobicupola", (c5, 10, c5, "", 1.0)),
        ("pentagonal orthocupolarotunda", (ro, 10, c5)),
        ("pentagonal gyrocupolarotunda", (ro, 10, c5, "", 1.0)),
        ("pentagonal orthobirotunda", (ro, 10, ro)),
        ("elongated triangular orthobicupola", (c3, 6, c3, "prism")),
        ("elongated triangular gyrobicupola", (c3, 6, c3, "prism", 1.0)),
        ("elongated square gyrobicupola", (c4, 8, c4, "prism", 1.0)),
        ("elongated pentagonal orthobicupola", (c5, 10, c5, "prism")),
        ("elongated pentagonal gyrobicupola", (c5, 10, c5, "prism", 1.0)),
        ("elongated pentagonal orthocupolarotunda", (ro, 10, c5, "prism")),
        ("elongated pentagonal gyrocupolarotunda", (ro, 10, c5, "prism", 1.0)),
        ("elongated pentagonal orthobirotunda", (ro, 10, ro, "prism")),
        ("elongated pentagonal gyrobirotunda", (ro, 10, ro, "prism", 1.0)),
        ("gyroelongated triangular bicupola", (c3, 6, c3, "antiprism")),
        ("gyroelongated square bicupola", (c4, 8, c4, "antiprism")),
        ("gyroelongated pentagonal bicupola", (c5, 10, c5, "antiprism")),
        ("gyroelongated pentagonal cupolarotunda", (ro, 10, c5, "antiprism")),
        ("gyroelongated pentagonal birotunda", (ro, 10, ro, "antiprism")),
    ]
    return [(name, partial(_tower, *arguments) if arguments else _gyrobifastigium) for name, arguments in rows]


def _gyrobifastigium() -> Points:
    """Two triangular prisms joined by a square, one turned by a quarter: a cupola over an edge rather than a face."""
    h = np.sqrt(0.75)
    square = [(0.5, 0.5, 0.0), (-0.5, 0.5, 0.0), (-0.5, -0.5, 0.0), (0.5, -0.5, 0.0)]
    return np.array([*square, (0.0, 0.5, h), (0.0, -0.5, h), (0.5, 0.0, -h), (-0.5, 0.0, -h)])


def makers() -> list[tuple[str, Callable[[], Points]]]:
    """Name and maker of the vertices of J1 to J92, in order."""
    gyrate = _gyrate_or_diminished
    p5, c5 = _pyramid(5), _cupola(5)
    dodecahedron, truncated = "dodecahedron", "truncated dodecahedron"
    return [
        *_towers(),
        ("augmented triangular prism", partial(_on_prism, 3, (0,))),
        ("biaugmented triangular prism", partial(_on_prism, 3, (0, 1))),
        ("triaugmented triangular prism", partial(_on_prism, 3, (0, 1, 2))),
        ("augmented pentagonal prism", partial(_on_prism, 5, (0,))),
        ("biaugmented pentagonal prism", partial(_on_prism, 5, (0, 2))),
        ("augmented hexagonal prism", partial(_on_prism, 6, (0,))),
        ("parabiaugmented hexagonal prism", partial(_on_prism, 6, (0, 3))),
        ("metabiaugmented hexagonal prism", partial(_on_prism, 6, (0, 2))),
        ("triaugmented hexagonal prism", partial(_on_prism, 6, (0, 2, 4))),
        ("augmented dodecahedron", partial(_on, dodecahedron, p5, 5, "one")),
        ("parabiaugmented dodecahedron", partial(_on, dodecahedron, p5, 5, "para")),
        ("metabiaugmented dodecahedron", partial(_on, dodecahedron, p5, 5, "meta")),
        ("triaugmented dodecahedron", partial(_on, dodecahedron, p5, 5, "tri")),
        ("metabidiminished icosahedron", partial(_icosahedron_without, 2)),
        ("tridiminished icosahedron", partial(_icosahedron_without, 3)),
        ("augmented tridiminished icosahedron", _augmented_icosahedron),
        ("augmented truncated tetrahedron", _augmented_truncated_tetrahedron),
        ("augmented truncated cube", partial(_truncated_cube, 1)),
        ("biaugmented truncated cube", partial(_truncated_cube, 2)),
        ("augmented truncated dodecahedron", partial(_on, truncated, c5, 10, "one")),
        ("parabiaugmented truncated dodecahedron", partial(_on, truncated, c5, 10, "para")),
        ("metabiaugmented truncated dodecahedron", partial(_on, truncated, c5, 10, "meta")),
        ("triaugmented truncated dodecahedron", partial(_on, truncated, c5, 10, "tri")),
        ("gyrate rhombicosidodecahedron", partial(gyrate, "one", (0,), ())),
        ("parabigyrate rhombicosidodecahedron", partial(gyrate, "para", (0, 1), ())),
        ("metabigyrate rhombicosidodecahedron", partial(gyrate, "meta", (0, 1), ())),
        ("trigyrate rhombicosidodecahedron", partial(gyrate, "tri", (0, 1, 2), ())),
        ("diminished rhombicosidodecahedron", partial(gyrate, "one", (), (0,))),
        ("paragyrate diminished rhombicosidodecahedron", partial(gyrate, "para", (0,), (1,))),
        ("metagyrate diminished rhombicosidodecahedron", partial(gyrate, "meta", (0,), (1,))),
        ("bigyrate diminished rhombicosidodecahedron", partial(gyrate, "tri", (0, 1), (2,))),
        ("parabidiminished rhombicosidodecahedron", partial(gyrate, "para", (), (0, 1))),
        ("metabidiminished rhombicosidodecahedron", partial(gyrate, "meta", (), (0, 1))),
        ("gyrate bidiminished rhombicosidodecahedron", partial(gyrate, "tri", (0,), (1, 2))),
        ("tridiminished rhombicosidodecahedron", partial(gyrate, "tri", (), (0, 1, 2))),
        ("snub disphenoid", _snub_disphenoid),
        ("snub square antiprism", _snub_square_antiprism),
        ("sphenocorona", _sphenocorona),
        ("augmented sphenocorona", _augmented_sphenocorona),
        ("sphenomegacorona", _sphenomegacorona),
        ("hebesphenomegacorona", _hebesphenomegacorona),
        ("disphenocingulum", _disphenocingulum),
        ("bilunabirotunda", _bilunabirotunda),
        ("triangular hebesphenorotunda", _triangular_hebesphenorotunda),
    ]


def _augmented_truncated_tetrahedron() -> Points:
    points = _uniform.vertices("truncated tetrahedron")
    return _cap(points, _cupola(3), _face_ids(points, 6)[:1])
