"""Which polyhedra have the form of a regular-faced solid, and its constants at their nodes.

Cheap invariants first (numbers of nodes and darts, the faces around every node, as one number); then, for candidates
only, the face graphs themselves: a dart of the cell is mapped to every dart of the solid that looks alike, in both
orientations, and the rest must follow. Most trials fail after a few darts, and most solids fit at the first.
"""

from __future__ import annotations

from math import pi, sin, sqrt, tan
from typing import Any

import numpy as np

from ..arrays import BoolArray, Float64Array, Index, Int64Array, UInt8Array, UInt64Array
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
def three_faced(
    node_counts: Int64Array,
    valences: Int64Array,
    is_hanging: UInt8Array,
    link_sizes: Int64Array,
    wanted: BoolArray,
    forms: UInt64Array,
    form_of: Int64Array,
) -> int:
    """Number the different corners of three faces of the cells that are wanted. Returns how many there are.

    ``forms`` receives of each the sizes of its faces, ascending, and the number of corners of its cell, 16 bits each;
    ``form_of`` for each node its number, or -1: not wanted, not of three faces, larger than 16 bits, or no room for
    one more. There is room for a power of two.
    """
    room = 2 * len(forms)
    mask, keys, numbers = np.uint64(room - 1), np.zeros(room, np.uint64), np.empty(room, np.int64)
    v, at, n_forms = np.int64(0), np.int64(0), np.int64(0)
    for c in range(len(node_counts)):
        n_corners = np.int64(0)
        for u in range(v, v + node_counts[c]):
            n_corners += (not is_hanging[u]) and valences[u] > 0
        for u in range(v, v + node_counts[c]):
            form_of[u] = -1
            if wanted[c] and valences[u] == 3 and not is_hanging[u]:
                one, two, three = link_sizes[at], link_sizes[at + 1], link_sizes[at + 2]
                low = one if one < two else two
                high = one + two - low
                least, most = three if three < low else low, three if three > high else high
                middle = low + high + three - least - most
                key = np.uint64(least << 48 | middle << 32 | most << 16 | n_corners)
                place = _mix(key) & mask
                while keys[place] != 0 and keys[place] != key:
                    place = (place + np.uint64(1)) & mask
                fits = (most | n_corners) < 1 << 16
                if fits and keys[place] == 0 and n_forms < len(forms):
                    keys[place], numbers[place], forms[n_forms] = key, n_forms, key
                    n_forms += 1
                if fits and keys[place] == key:
                    form_of[u] = numbers[place]
            at += valences[u]
        v += node_counts[c]
    return int(n_forms)


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
def families(
    node_counts: Int64Array,
    valences: Int64Array,
    is_hanging: UInt8Array,
    link_sizes: Int64Array,
    which: Int64Array,
    k: Float64Array,
    keys: UInt64Array,
) -> None:
    """For each cell `PRISM`, `ANTIPRISM` or `NO_SOLID`, and k at each node of a prism or antiprism; see `match`.

    ``keys`` receives one number (uint64) a cell that does not depend on its numbering or orientation.
    """
    v, at = np.int64(0), np.int64(0)
    for c in range(len(node_counts)):
        first, base, total, corners = v, at, np.uint64(0), np.int64(0)
        v += node_counts[c]
        for u in range(first, v):
            d = valences[u]
            if d > 0 and not is_hanging[u]:
                around = np.int64(0)
                for i in range(at, at + d):
                    around += link_sizes[i] * link_sizes[i] * link_sizes[i]
                total += _mix(around * 64 + d)
                corners += 1
            at += d
        keys[c] = total
        which[c] = NO_SOLID
        if corners:
            which[c], size = _family(first, v, corners, base, valences, is_hanging, link_sizes)
            if which[c] != NO_SOLID:
                value = _family_k(which[c], size)
                for u in range(first, v):
                    k[u] = value


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
        Of the cells, from `links` and `families`; a cell with a valence of 0 is left out.
    solid_keys, solid_order
        Keys of the solids, sorted, and which solid each is of.
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
        `PRISM`, `ANTIPRISM` or `NO_SOLID` for each cell, see `families`; receives the number of its solid.
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
        corners = np.int64(0)
        for u in range(first, v):
            corners += (not is_hanging[u]) and valences[u] > 0
            at += valences[u]
        row = rows[c]
        if which[c] != NO_SOLID or corners == 0 or row == len(solid_keys) or solid_keys[row] != keys[c]:
            continue
        best, best_dart, dart = np.int64(-1), np.int64(-1), base
        for u in range(n):
            starts[u] = dart
            d = valences[first + u]
            for i in range(d):
                node_of[dart + i - base], slot_of[dart + i - base] = u, i
                if not is_hanging[first + u]:
                    score = link_sizes[dart + i] * 1024 + link_sizes[dart + (i + 1 if i + 1 < d else 0)]
                    if score > best:
                        best, best_dart = score, dart + i
            dart += d
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
