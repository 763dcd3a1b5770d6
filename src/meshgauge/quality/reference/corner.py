"""The corner model: J_S of a corner with regular faces around it, where no regular-faced solid has it.

The edges of a convex corner meet a sphere around it in a spherical polygon, whose sides are the face angles. The model
takes the polygon with the angles of regular faces, inscribed in a circle: with circle radius t, side a_i spans the arc
φ_i with ``sin(a_i/2) = sin t · sin(φ_i/2)``, and the arcs make a whole turn. Regular faces may leave no room for such
a corner; then their angles are changed as little as makes one:

- Their sum must be below 360°. By Descartes the deficits of a polyhedron of regular faces sum to 720°: the angles are
  scaled so that the deficit is at least half of the mean, ½·4π/V, for V nodes.
- No angle may reach the sum of the others (two triangles beside a hexagon). It is divided, and the others are
  multiplied, by the number that leaves half of the mean deficit between them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Values = NDArray[np.float64]

_STEPS = 64
"""Bisections: each halves an interval within [0, 1], so that the last is below rounding."""


def corner_model(sizes: NDArray[np.integer], n_nodes: NDArray[np.integer]) -> Values:
    """J_S of corners.

    Parameters
    ----------
    sizes
        ``(n, d)`` numbers of sides, 3 and more, of the d >= 3 faces in order around each corner.
    n_nodes
        ``(n,)`` numbers of nodes of the corners' cells, 4 and more.

    Returns
    -------
    Values
        ``(n,)`` in (0, 1]: the fold of the consecutive triples, all positive. Where a regular-faced corner exists and
        its deficit is large enough it has d = 3: exactly ``√(1 - cos²a - cos²b - cos²c + 2 cos a cos b cos c)``.
    """
    angles = _angles(sizes, n_nodes)
    if angles.shape[1] == 3:
        a, b, c = np.cos(np.sort(angles, axis=1)).T
        return np.asarray(np.sqrt(1.0 - a * a - b * b - c * c + 2.0 * a * b * c))
    edges = _edges(angles)
    following = np.roll(edges, -1, axis=1)
    triples = (edges * np.cross(following, np.roll(edges, -2, axis=1))).sum(axis=2)
    return np.asarray(triples.min(axis=1))


def corner_cosines(sizes: NDArray[np.integer], n_nodes: NDArray[np.integer]) -> tuple[Values, Values]:
    """The angles of the model's corners.

    Parameters
    ----------
    sizes, n_nodes
        As for `corner_model`.

    Returns
    -------
    sides : ndarray, shape (n, d)
        Cosine of the angle of each face, between an edge and the next.
    diagonals : ndarray, shape (n, d)
        Cosine of the angle between an edge and the next but one.
    """
    angles = _angles(sizes, n_nodes)
    sides = np.cos(angles)
    if angles.shape[1] == 3:
        return sides, np.roll(sides, -2, axis=1)
    edges = _edges(angles)
    return sides, (edges * np.roll(edges, -2, axis=1)).sum(axis=2)


def _angles(sizes: NDArray[np.integer], n_nodes: NDArray[np.integer]) -> Values:
    sides = np.asarray(sizes, np.float64)
    return _with_room(np.pi * (sides - 2.0) / sides, 2.0 * np.pi / np.asarray(n_nodes, np.float64))


def _edges(angles: Values) -> Values:
    """``(n, d, 3)`` unit edges of corners of more than three faces."""
    radius, arcs = _inscribe(angles)
    turn = np.cumsum(arcs, axis=1) - arcs
    return np.stack(
        [
            radius[:, None] * np.cos(turn),
            radius[:, None] * np.sin(turn),
            np.broadcast_to(np.sqrt(1.0 - radius**2)[:, None], turn.shape),
        ],
        axis=2,
    )


def _with_room(angles: Values, margin: Values) -> Values:
    """The angles, changed where no convex corner has them."""
    largest = angles.max(axis=1)
    rest = angles.sum(axis=1) - largest
    # largest/x = x·rest - margin; for room to spare x would be below 1, and nothing is changed.
    ratio = (margin + np.sqrt(margin * margin + 4.0 * rest * largest)) / (2.0 * rest)
    tight = largest >= rest * (1.0 - 1e-12)
    at_largest = np.arange(angles.shape[1]) == angles.argmax(axis=1)[:, None]
    factor = np.where(tight, ratio, 1.0)[:, None]
    angles = np.where(at_largest, angles / factor, angles * factor)
    total = angles.sum(axis=1)
    return np.asarray(angles * np.minimum((2.0 * np.pi - margin) / total, 1.0)[:, None])


def _inscribe(angles: Values) -> tuple[Values, Values]:
    """sin t and the arcs ``(n, d)`` of the spherical polygons with the given sides inscribed in a circle."""
    chords = np.sin(angles / 2.0)
    longest = chords.max(axis=1)
    at_longest = np.arange(angles.shape[1]) == chords.argmax(axis=1)[:, None]
    # On the smallest circle the longest side is a diameter. If the others cannot reach around the other half, the
    # centre lies outside the polygon, and that side takes the longer way round.
    full = 2.0 * np.arcsin(np.minimum(chords / longest[:, None], 1.0))
    outside = full.sum(axis=1) < 2.0 * np.pi
    low, high = longest, np.ones_like(longest)
    for _ in range(_STEPS):
        middle = 0.5 * (low + high)
        arcs = _arcs(chords, middle, at_longest & outside[:, None])
        too_small = np.where(outside, arcs.sum(axis=1) > 2.0 * np.pi, arcs.sum(axis=1) < 2.0 * np.pi)
        low, high = np.where(too_small, low, middle), np.where(too_small, middle, high)
    return low, _arcs(chords, low, at_longest & outside[:, None])


def _arcs(chords: Values, radius: Values, the_long_way: NDArray[np.bool_]) -> Values:
    arcs = 2.0 * np.arcsin(np.minimum(chords / radius[:, None], 1.0))
    return np.asarray(np.where(the_long_way, 2.0 * np.pi - arcs, arcs))
