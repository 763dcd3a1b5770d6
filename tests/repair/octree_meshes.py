"""Cubes of which some are cut into eight: the cells beside are polyhedra with hanging nodes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from meshgauge import Mesh
from meshgauge.mesh.polyhedra import Polyhedra

Points = NDArray[np.float64]

SIDES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
"""Faces of a hexahedron, outward."""

CORNERS = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])

Place = tuple[int, int, int]


def octree(n: int, is_cut: Callable[[Points], NDArray[np.bool_]], by: float = 0.0, seed: int = 0) -> Mesh:
    """A cube of n³ cubes with sides of 2, of which those are cut whose middle says so.

    Points inside are moved at random by up to ``by`` of the edges there, and nodes that hang on an edge or a face then
    put into the middle of it. The mesh is for finite volumes.
    """
    first = np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    cut = is_cut(2.0 * first + 1.0)
    fine: set[Place] = set(map(tuple, first[cut].tolist()))
    cubes = [(2 * at, 2) for at in first[~cut]]
    cubes += [(2 * at + corner, 1) for at in first[cut] for corner in CORNERS]
    there = {tuple(p) for at, size in cubes if size == 1 for p in (at + CORNERS).tolist()}

    faces: list[list[list[Place]]] = []
    middles: dict[Place, list[Place]] = {}  # of what hangs, the ends of its edge or the corners of its face
    for at, size in cubes:
        own = []
        for side in SIDES:
            ring: list[Place] = [tuple(p) for p in (at + size * CORNERS[list(side)]).tolist()]
            if size == 1:
                own.append(ring)
                continue
            edges = [_middle(ring[m], ring[(m + 1) % 4]) for m in range(4)]
            for m, edge in enumerate(edges):
                if edge in there:
                    middles[edge] = [ring[m], ring[(m + 1) % 4]]
            centre = _middle(_middle(ring[0], ring[1]), _middle(ring[2], ring[3]))
            beyond = tuple(((2 * np.array(centre) - at - 1) // 2).tolist())  # the cube there
            if beyond in fine:
                middles[centre] = ring
                own += [[edges[m - 1], ring[m], edges[m], centre] for m in range(4)]
            else:
                own.append([p for pair in zip(ring, edges, strict=True) for p in pair if p in ring or p in there])
        faces.append(own)
    return _mesh(n, faces, [size for _, size in cubes], middles, by, seed)


def _middle(a: Place, b: Place) -> Place:
    return (a[0] + b[0]) // 2, (a[1] + b[1]) // 2, (a[2] + b[2]) // 2


def _mesh(
    n: int, faces: list[list[list[Place]]], sizes: list[int], middles: dict[Place, list[Place]], by: float, seed: int
) -> Mesh:
    order: dict[Place, int] = {}
    for own in faces:
        for ring in own:
            for place in ring:
                order.setdefault(place, len(order))
    points = np.array(list(order), np.float64)
    length = np.full(len(points), np.inf)
    for own, size in zip(faces, sizes, strict=True):
        for ring in own:
            for place in ring:
                length[order[place]] = min(length[order[place]], size)
    inside = ((points > 0) & (points < 2 * n)).all(axis=1)
    noise = np.random.default_rng(seed).uniform(-by, by, points.shape) * length[:, None]
    points[inside] += noise[inside]
    for place, ends in middles.items():
        points[order[place]] = points[[order[end] for end in ends]].mean(axis=0)
    is_cube = [len(own) == 6 and all(len(ring) == 4 for ring in own) for own in faces]
    cubes = [n for n, one in enumerate(is_cube) if one]
    others = [n for n, one in enumerate(is_cube) if not one]
    nodes = [[order[p] for p in (*reversed(faces[c][0]), *faces[c][1])] for c in cubes]
    nodes = [[ring[at] for at in (3, 0, 1, 2, 4, 5, 6, 7)] for ring in nodes]
    rings = [[order[p] for p in ring] for c in others for ring in faces[c]]
    named = [list(dict.fromkeys(order[p] for ring in faces[c] for p in ring)) for c in others]
    counts = np.array([0] * len(cubes) + [len(faces[c]) for c in others])
    return Mesh(
        points,
        np.array([12] * len(cubes) + [42] * len(others), np.uint8),
        np.concatenate([[0], np.cumsum([*map(len, nodes), *map(len, named)])]),
        np.array([p for ring in (*nodes, *named) for p in ring]),
        polyhedra=Polyhedra(
            np.concatenate([[0], np.cumsum(counts)]),
            np.arange(len(rings)),
            np.concatenate([[0], np.cumsum(list(map(len, rings)))]),
            np.array([p for ring in rings for p in ring]),
        ),
        purpose="fv",
    )
