"""Which polyhedra have the form of a regular-faced solid, and its constants at their nodes.

Cheap invariants first (numbers of nodes and darts, the faces around every node, as one number); then, for candidates
only, the face graphs themselves: a dart of the cell is mapped to every dart of the solid that looks alike, in both
orientations, and the rest must follow. Most trials fail after a few darts, and most solids fit at the first.
"""

from __future__ import annotations

from math import pi, sin, sqrt, tan
from typing import Any

import numpy as np

from ..arrays import Float64Array, Index, Int64Array, UInt8Array, UInt64Array
from ..jit import inlined, kernel
from .codes import ANTIPRISM, NO_SOLID, PRISM


@inlined
def _mix(value: Any) -> Any:
    """A number with all its bits stirred (the finaliser of SplitMix64)."""
    z = np.uint64(value) + np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@kernel
def invariants(
    node_counts: Int64Array, valences: Int64Array, is_hanging: UInt8Array, link_sizes: Int64Array, out: UInt64Array
) -> None:
    """One number (uint64) a cell that does not depend on its numbering or orientation; hanging nodes are left out."""
    v, at = np.int64(0), np.int64(0)
    for c in range(len(node_counts)):
        total, n_nodes, n_darts = np.uint64(0), np.int64(0), np.int64(0)
        for _ in range(node_counts[c]):
            d = valences[v]
            if not is_hanging[v]:
                around = np.uint64(d)
                for i in range(d):
                    a, b = link_sizes[at + i], link_sizes[at + (i + 1 if i + 1 < d else 0)]
                    around += _mix(_mix(a) + _mix(b))
                total += _mix(around)
                n_nodes, n_darts = n_nodes + 1, n_darts + d
            at += d
            v += 1
        out[c] = _mix(total ^ _mix(n_nodes)) ^ _mix(n_darts + 1)


@inlined
def _family(
    first: Index,
    stop: Index,
    n_corners: Index,
    at: Index,
    valences: Int64Array,
    is_hanging: UInt8Array,
    link_sizes: Int64Array,
) -> Any:
    """`PRISM` or `ANTIPRISM` and the size of its base if the faces around every node are those of one."""
    kind, n = 0, 0
    for v in range(first, stop):
        d = valences[v]
        if not is_hanging[v]:
            if d != 3 and d != 4:
                return NO_SOLID, 0
            others, usual, base = 0, 4 if d == 3 else 3, 0
            for i in range(d):
                if link_sizes[at + i] != usual:
                    others += 1
                    base = link_sizes[at + i]
            if others == 0:
                base = usual
            if others > 1 or (kind != 0 and (kind != d or n != base)):
                return NO_SOLID, 0
            kind, n = d, base
        at += d
    if kind == 0 or n_corners != 2 * n:
        return NO_SOLID, 0
    return (PRISM if kind == 3 else ANTIPRISM), n


@inlined
def _family_k(kind: Index, n: Index) -> Any:
    """J_S at the corners of a prism or antiprism of unit edges over a regular n-gon.

    Prism: two right angles and one of (n - 2)π/n. Antiprism: the least of the determinants of four edges in turn, two
    along the base and two up to height h.
    """
    if kind == PRISM:
        return sin(2.0 * pi / n)
    half = 0.5 * tan(0.5 * pi / n)
    return sqrt(0.75 - half * half) * min(sin(pi / n), sin(2.0 * pi / n))


@kernel
def match(
    node_counts: Int64Array,
    valences: Int64Array,
    is_hanging: UInt8Array,
    link_sizes: Int64Array,
    link_twins: Int64Array,
    keys: UInt64Array,
    rows: Int64Array,
    solid_keys: UInt64Array,
    solid_order: Int64Array,
    solid_darts: Int64Array,
    solid_nodes: Int64Array,
    solid_starts: Int64Array,
    solid_valences: Int64Array,
    solid_sizes: Int64Array,
    solid_twins: Int64Array,
    solid_node: Int64Array,
    solid_k: Float64Array,
    solid_diagonals: Float64Array,
    which: Int64Array,
    k: Float64Array,
    diagonals: Float64Array,
) -> None:
    """For each cell the regular-faced solid whose form it has, and k at each node (left as it is where there is none).

    Parameters
    ----------
    node_counts, valences, is_hanging, link_sizes, link_twins, keys
        Of the cells, from `links` and `invariants`; a cell with a valence of 0 is left out.
    solid_keys, solid_order
        Invariants of the solids, sorted, and which solid each is of.
    rows
        The first of ``solid_keys`` that is not below each of ``keys``.
    solid_darts, solid_nodes
        ``(n_solids + 1,)`` where the darts and nodes of a solid start.
    solid_starts, solid_valences, solid_k
        For each node of the solids: its first dart, its valence, J_S.
    solid_sizes, solid_twins, solid_node
        For each dart of the solids: as the cells' links, and the node that it is at.
    solid_diagonals
        For each dart of the solids: what ``diagonals`` receives.
    which
        Receives for each cell the solid's number, `PRISM`, `ANTIPRISM` or `NO_SOLID`.
    k
        Receives J_S of the solid at each node of the cell.
    diagonals
        Receives, for each dart of a cell that has the form of a solid (not of a prism or an antiprism), the cosine of
        the solid's angle between it and the next but one; empty if that is not wanted.
    """
    most_nodes, most_darts, v, at = np.int64(1), np.int64(1), np.int64(0), np.int64(0)
    for c in range(len(node_counts)):
        darts = np.int64(0)
        for u in range(v, v + node_counts[c]):
            darts += valences[u]
        v += node_counts[c]
        most_nodes, most_darts = max(most_nodes, node_counts[c]), max(most_darts, darts)
    node_of, slot_of = np.empty(most_darts, np.int64), np.empty(most_darts, np.int64)
    starts, image, stack = (
        np.empty(most_nodes, np.int64),
        np.empty(most_nodes, np.int64),
        np.empty(most_nodes, np.int64),
    )
    shift = np.empty(most_nodes, np.int64)
    v = np.int64(0)
    for c in range(len(node_counts)):
        first, base, n = v, at, node_counts[c]
        v += n
        corners, best, best_dart = np.int64(0), np.int64(-1), np.int64(-1)
        for u in range(n):
            starts[u] = at
            d = valences[first + u]
            for i in range(d):
                node_of[at + i - base], slot_of[at + i - base] = u, i
                if not is_hanging[first + u]:
                    score = link_sizes[at + i] * 1024 + link_sizes[at + (i + 1 if i + 1 < d else 0)]
                    if score > best:
                        best, best_dart = score, at + i
            corners += (not is_hanging[first + u]) and d > 0
            at += d
        which[c] = NO_SOLID
        if best_dart < 0:
            continue
        kind, size = _family(first, v, corners, base, valences, is_hanging, link_sizes)
        if kind != NO_SOLID:
            which[c] = kind
            value = _family_k(kind, size)
            for u in range(first, v):
                k[u] = value
            continue
        row = rows[c]
        while row < len(solid_keys) and solid_keys[row] == keys[c] and which[c] == NO_SOLID:
            solid = solid_order[row]
            row += 1
            n_solid = solid_nodes[solid + 1] - solid_nodes[solid]
            if n_solid != corners:
                continue
            for trial in range(2 * (solid_darts[solid + 1] - solid_darts[solid])):
                r0, sense = solid_darts[solid] + trial // 2, 1 - 2 * (trial & 1)
                if (
                    _match_from(
                        best_dart,
                        r0,
                        sense,
                        base,
                        first,
                        n,
                        valences,
                        link_sizes,
                        link_twins,
                        starts,
                        node_of,
                        slot_of,
                        solid_starts,
                        solid_valences,
                        solid_sizes,
                        solid_twins,
                        solid_node,
                        image,
                        shift,
                        stack,
                    )
                    == corners
                ):
                    which[c] = solid
                    for u in range(n):
                        if not is_hanging[first + u]:
                            k[first + u] = solid_k[image[u]]
                            for i in range(valences[first + u] if len(diagonals) else 0):
                                # In a mirror the next but one of a dart's image is the last but one.
                                j = (shift[u] + sense * i - (0 if sense > 0 else 2)) % valences[first + u]
                                diagonals[starts[u] + i] = solid_diagonals[solid_starts[image[u]] + j]
                    break


@inlined
def _match_from(
    dart: Index,
    target: Index,
    sense: Index,
    base: Index,
    first: Index,
    n: Index,
    valences: Int64Array,
    link_sizes: Int64Array,
    link_twins: Int64Array,
    starts: Int64Array,
    node_of: Int64Array,
    slot_of: Int64Array,
    solid_starts: Int64Array,
    solid_valences: Int64Array,
    solid_sizes: Int64Array,
    solid_twins: Int64Array,
    solid_node: Int64Array,
    image: Int64Array,
    shift: Int64Array,
    stack: Int64Array,
) -> Any:
    """How many nodes of the cell fall on nodes of the solid if one dart falls on another; -1 if they do not fit.

    ``image`` receives the solid's node for each node, ``shift`` which of its darts the node's dart 0 falls on.
    """
    for w in range(n):
        image[w] = -1
    u, r = node_of[dart - base], solid_node[target]
    image[u] = r
    shift[u] = (target - solid_starts[r] - sense * slot_of[dart - base]) % solid_valences[r]
    stack[0], waiting, seen = u, 1, 1
    while waiting:
        waiting -= 1
        u = stack[waiting]
        r, d = image[u], valences[first + u]
        if solid_valences[r] != d:
            return -1
        for i in range(d):
            j = (shift[u] + sense * i) % d
            # The face after dart i lies, seen in a mirror, before its image.
            f = j if sense > 0 else (j - 1) % d
            if link_sizes[starts[u] + i] != solid_sizes[solid_starts[r] + f]:
                return -1
            twin, other = link_twins[starts[u] + i], solid_twins[solid_starts[r] + j]
            w, q = node_of[twin - base], solid_node[other]
            turn = (other - solid_starts[q] - sense * slot_of[twin - base]) % solid_valences[q]
            if image[w] == -1:
                image[w], shift[w] = q, turn
                stack[waiting] = w
                waiting, seen = waiting + 1, seen + 1
            elif image[w] != q or shift[w] != turn:
                return -1
    return seen
