"""Areas of regions in a plane, kept while points slide along curves: each curved one is moved by one small distance."""

from __future__ import annotations

import numpy as np

from ..problem import Ids, Points
from ..surface import EDGE
from .cells import Part
from .claims import region_areas
from .held import Held
from .track import Track

ROUNDS = 3
"""Newton steps: areas are squares of distances."""


def restored_areas(track: Track, held: Held, part: Part, given: Points, points: Points) -> Points:
    """Points in a plane with the areas of the regions as they were given, as far as curves can make up for it.

    Points along a curve that bends move at right angles to it, all by one distance: uneven chords enclose less than
    even ones do.
    """
    surface = track.surface
    on = np.flatnonzero((track.kind == EDGE) & ~held.pinned)
    curve = surface.projection.groups[surface.item[on]] - surface.n_patches
    bends = surface.facets.is_curved()[curve + surface.n_patches]
    on, curve = on[bends], curve[bends]
    if not len(on):
        return points
    target, out = region_areas(held, part, given), points.copy()
    for _ in range(ROUNDS):
        lack = target - region_areas(held, part, out)
        if np.abs(lack).max() <= 1e-13 * np.abs(target).max():
            break
        regions, outward, gain = _gradients(track, held, part, out, on)
        rates = np.zeros((len(target), surface.n_curves))
        np.add.at(rates, (regions.reshape(-1), np.repeat(curve, 2)), gain.reshape(-1))
        steps = np.linalg.lstsq(rates, lack, rcond=1e-9)[0]
        out[on, :2] += steps[curve, None] * outward
    return out


def _gradients(track: Track, held: Held, part: Part, points: Points, on: Ids) -> tuple[Ids, Points, Points]:
    """How areas grow with some points on curves.

    ``(n, 2)`` the regions on either side, twice the same if there is one; ``(n, 2)`` a unit vector at right angles to
    the curve, out of the first; and ``(n, 2)`` how fast the areas of the two grow along it.
    """
    x = points[:, :2] - points[on, :2].mean(axis=0)
    turned = part.up * np.stack([x[:, 1], -x[:, 0]], axis=1)  # the derivative of a x b by a is that of b
    ring = part.ring
    following = np.arange(1, len(ring) + 1)
    following[part.cells[1:] - 1] = part.cells[:-1]
    p, q = ring, ring[following]
    entries, growth = [p, q], [0.5 * turned[q], -0.5 * turned[p]]
    owners = [np.arange(len(ring))] * 2
    if len(part.middles):
        bent = np.flatnonzero(part.middles >= 0)
        a, b, m = p[bent], q[bent], part.middles[bent]
        growth[0][bent] = (4.0 * turned[m] - turned[b]) / 6.0
        growth[1][bent] = (turned[a] - 4.0 * turned[m]) / 6.0
        entries, growth = [*entries, m], [*growth, (turned[b] - turned[a]) * (4.0 / 6.0)]
        owners = [*owners, bent]
    at = np.full(len(points), -1)
    at[on] = np.arange(len(on))
    point = at[np.concatenate(entries)]
    region = held.region_ids[np.repeat(part.cell_ids, np.diff(part.cells))][np.concatenate(owners)]
    mine = point >= 0
    point, region, grown = point[mine], region[mine], np.concatenate(growth)[mine]
    low, high = np.full(len(on), region.max(initial=0)), np.zeros(len(on), np.int64)
    np.minimum.at(low, point, region)
    np.maximum.at(high, point, region)
    sums = np.zeros((len(on), 2, 2))
    np.add.at(sums, (point, (region != low[point]).astype(np.int64)), grown)
    size = np.linalg.norm(sums[:, 0], axis=1, keepdims=True)
    outward = np.divide(sums[:, 0], size, out=np.zeros_like(sums[:, 0]), where=size > 0.0)
    return np.stack([low, high], axis=1), outward, np.einsum("nsx,nx->ns", sums, outward)
