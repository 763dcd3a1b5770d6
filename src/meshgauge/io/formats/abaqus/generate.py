"""Nodes and elements that an Abaqus deck generates: *NGEN, *NFILL, *NCOPY, *ELGEN, *ELCOPY."""

from __future__ import annotations

import numpy as np

from ...plumbing.build import Ints, Kind
from ...plumbing.mirror import mirror
from .deck import Deck, Reals, Section
from .keywords import Keyword, Place, integer, real


def take(keyword: Keyword, deck: Deck) -> bool:
    """Generate what a keyword asks for; False if it is none of these.

    Raises
    ------
    ReadError
        If what it refers to does not exist, or it asks for something that is not followed.
    """
    generator = _GENERATORS.get(keyword.name)
    if generator is None:
        return False
    if keyword.name.startswith("N"):
        deck.given.append(keyword)
    generator(keyword, deck)
    return True


def _refuse(keyword: Keyword, *options: str) -> None:
    for option in options:
        if option in keyword.options:
            raise keyword.fail(f"*{keyword.name}, {option} is not followed; write the nodes out")


def _ngen(keyword: Keyword, deck: Deck) -> None:
    """Nodes between two: on a line, a parabola (P) through a third, or an arc (C) about it."""
    line = keyword.option("LINE", "S").upper()
    if keyword.option("SYSTEM", "RC").upper() not in ("RC", "R"):
        _refuse(keyword, "SYSTEM")
    if line not in ("S", "P", "C"):
        raise keyword.fail(f"*NGEN, LINE={line}, expected P or C")
    for place, words in keyword.rows():
        words = (words + [""] * 10)[:10]
        first, last = integer(place, words[0]), integer(place, words[1])
        step = abs(integer(place, words[2], 1))
        if step == 0 or (last - first) % step:
            raise place.fail(f"*NGEN from {first} to {last} by {step} does not end at the last node")
        n = abs(last - first) // step
        deck.generate(n, keyword)
        if n < 2:
            continue
        a, b = deck.nodes.at(first, keyword.refers), deck.nodes.at(last, keyword.refers)
        share = (np.arange(1, n) / n)[:, None]
        if line == "S":
            points = a + share * (b - a)
        else:
            third = integer(place, words[3], 0)
            given = np.array([real(place, word) for word in words[4:7]])
            middle = deck.nodes.at(third, keyword.refers) if third else given
            if line == "P":
                points = (
                    a * (1 - share) * (1 - 2 * share) + b * share * (2 * share - 1) + middle * 4 * share * (1 - share)
                )
            else:
                points = _arc(place, a, b, middle, np.array([real(place, word) for word in words[7:10]]), share)
        labels = first + np.sign(last - first) * step * np.arange(1, n)
        deck.nodes.add(labels, points)
        if keyword.option("NSET"):
            deck.nsets.setdefault(keyword.option("NSET").upper(), []).append(np.array([first, *labels, last], np.int64))


def _arc(place: Place, a: Reals, b: Reals, centre: Reals, normal: Reals, share: Reals) -> Reals:
    """Points at equal angles from a to b about a centre, below half a turn unless a normal says which way."""
    u, v = a - centre, b - centre
    is_given = bool(normal.any())
    normal = normal if is_given else np.cross(u, v)
    length = float(np.linalg.norm(normal))
    if not length > 0 or not u.any() or not v.any():
        raise place.fail("*NGEN, LINE=C: the ends and the centre of the arc are on one line, and no normal is given")
    normal = normal / length
    angle = float(np.arctan2(np.dot(np.cross(u, v), normal), np.dot(u, v)))
    if angle <= 0 and is_given:
        angle += 2 * np.pi
    turn = angle * share
    along = (u @ normal) * normal
    flat = u - along
    turned = np.cos(turn) * flat + np.sin(turn) * np.cross(normal, flat)
    radii = 1 + share * (np.linalg.norm(v) / np.linalg.norm(u) - 1)
    return np.asarray(centre + (along + turned) * radii)


def _nfill(keyword: Keyword, deck: Deck) -> None:
    """Nodes on straight lines between those of two sets, in their order."""
    _refuse(keyword, "SINGULAR")
    bias = real(keyword.place, keyword.option("BIAS", "1"))
    if not bias > 0:
        raise keyword.fail(f"*NFILL, BIAS={keyword.option('BIAS')}, expected a positive number")
    for place, words in keyword.rows():
        words = (words + [""] * 4)[:4]
        starts, ends = (deck.members(deck.nsets, word, place) for word in words[:2])
        n, step = integer(place, words[2], 1), integer(place, words[3], 1)
        if len(starts) != len(ends):
            raise place.fail(f"*NFILL between a set of {len(starts)} nodes and one of {len(ends)}")
        if n < 1:
            raise place.fail(f"*NFILL with {n} intervals")
        deck.generate((n - 1) * len(starts), keyword)
        share = _bias(place, n, bias, is_twofold="TWO STEP" in keyword.options)
        every: list[Ints] = [starts, ends]
        for start, end in zip(starts.tolist(), ends.tolist(), strict=True):
            a, b = deck.nodes.at(start, keyword.refers), deck.nodes.at(end, keyword.refers)
            labels = start + step * np.arange(1, n)
            deck.nodes.add(labels, a + share * (b - a))
            every.append(labels)
        if keyword.option("NSET"):
            deck.nsets.setdefault(keyword.option("NSET").upper(), []).append(np.concatenate(every))


def _bias(place: Place, n: int, bias: float, *, is_twofold: bool) -> Reals:
    """Shares of a line at its inner nodes ``(n - 1, 1)``; each interval is 1/bias times the one before.

    Twofold: the bias is from every second node to the next, and the nodes between are in the middle.
    """
    if is_twofold and n % 2:
        raise place.fail(f"*NFILL, TWO STEP with {n} intervals, expected an even number")
    n_lengths = n // 2 if is_twofold else n
    with np.errstate(over="ignore", under="ignore"):
        lengths = bias ** -np.arange(n_lengths, dtype=float)
    if not np.isfinite(lengths).all():
        raise place.fail(f"*NFILL, BIAS={bias:g} over {n} intervals is beyond any number")
    if is_twofold:
        lengths = np.repeat(lengths / 2, 2)
    ends = np.cumsum(lengths)
    return np.asarray((ends[:-1] / ends[-1])[:, None])


def _ncopy(keyword: Keyword, deck: Deck) -> None:
    """Nodes of a set, moved, turned or mirrored, with new numbers."""
    shift = integer(keyword.place, keyword.option("CHANGE NUMBER"))
    labels = deck.members(deck.nsets, keyword.option("OLD SET"), keyword.place)
    deck.generate(len(labels), keyword)
    rows = [(place, [real(place, word) for word in words]) for place, words in keyword.rows()]
    points = np.array([deck.nodes.at(label, keyword.refers) for label in labels.tolist()]).reshape(-1, 3)
    if "POLE" in keyword.options:
        node = int(rows[0][1][0]) if rows and len(rows[0][1]) == 1 else 0
        pole = deck.nodes.at(node, keyword.refers) if node else _vector(keyword, rows, 0, 3)
        points = 2 * points - pole
    elif "REFLECT" in keyword.options:
        points = _reflect(keyword, rows, points)
    elif "SHIFT" in keyword.options:
        points = points + _vector(keyword, rows, 0, 3)
        if len(rows) > 1:
            turn = _vector(keyword, rows, 1, 7)
            times = integer(keyword.place, keyword.option("MULTIPLE"), 1)
            points = rotate(points, turn[:3], turn[3:6], float(turn[6]) * times, keyword.place)
    else:
        raise keyword.fail("*NCOPY without SHIFT, REFLECT or POLE is not followed; write the nodes out")
    deck.nodes.add(labels + shift, points)
    if keyword.option("NEW SET"):
        deck.nsets.setdefault(keyword.option("NEW SET").upper(), []).append(labels + shift)


def _vector(keyword: Keyword, rows: list[tuple[Place, list[float]]], row: int, n: int) -> Reals:
    """The first ``n`` numbers of a data line; those that are missing are 0."""
    if row >= len(rows):
        raise keyword.fail(f"*{keyword.name} has {len(rows)} data lines, more are expected")
    return np.array((*rows[row][1], *[0.0] * n)[:n])


def _reflect(keyword: Keyword, rows: list[tuple[Place, list[float]]], points: Reals) -> Reals:
    how = keyword.option("REFLECT").upper()
    first = _vector(keyword, rows, 0, 6)
    a, b = first[:3], first[3:]
    if how == "POINT":
        return 2 * a - points
    if how == "LINE":
        return rotate(points, a, b, 180.0, keyword.place)
    if how != "MIRROR":
        raise keyword.fail(f"*NCOPY, REFLECT={how}, expected POINT, LINE or MIRROR")
    normal = np.cross(b - a, _vector(keyword, rows, 1, 3) - a)
    length = float(np.linalg.norm(normal))
    if not length > 0:
        raise keyword.fail("*NCOPY, REFLECT=MIRROR: the three points are on one line")
    normal = normal / length
    return np.asarray(points - 2 * ((points - a) @ normal)[:, None] * normal)


def rotate(points: Reals, a: Reals, b: Reals, degrees: float, place: Place) -> Reals:
    """Points turned about the axis from a to b, counter-clockwise as seen from b."""
    length = float(np.linalg.norm(b - a))
    if not length > 0:
        raise place.fail("an axis of rotation has no length")
    u, angle = (b - a) / length, np.deg2rad(degrees)
    d = points - a
    along = (d @ u)[:, None] * u
    return np.asarray(a + along + np.cos(angle) * (d - along) + np.sin(angle) * np.cross(u, d))


def _elgen(keyword: Keyword, deck: Deck) -> None:
    """Rows, layers of rows and layers of elements like one that is there already."""
    elset = keyword.option("ELSET")
    for place, words in keyword.rows():
        words = (words + [""] * 10)[:10]
        label = integer(place, words[0])
        section, row = deck.element(label, place)
        node_shift, label_shift = np.zeros(1, np.int64), np.zeros(1, np.int64)
        n_all = 1
        for at in (1, 4, 7):
            n = max(integer(place, words[at], 1), 1)
            by_node, by_label = integer(place, words[at + 1], 1), integer(place, words[at + 2], 1)
            n_all *= n
            deck.generate(n_all, keyword)
            steps = np.arange(n)[:, None]
            node_shift = (steps * by_node + node_shift).ravel()
            label_shift = (steps * by_label + label_shift).ravel()
        nodes = section.nodes[row] + node_shift[1:, None]
        deck.add_elements(Section(section.kind, elset, label + label_shift[1:], nodes, section.is_interface))
        if elset:  # the first belongs to the set as well
            deck.elsets[elset.upper()].append(np.array([label], np.int64))


def _elcopy(keyword: Keyword, deck: Deck) -> None:
    """Elements of a set with new numbers of theirs and of their nodes."""
    by_label = integer(keyword.place, keyword.option("ELEMENT SHIFT"))
    by_node = integer(keyword.place, keyword.option("SHIFT NODES"))
    members = deck.members(deck.elsets, keyword.option("OLD SET"), keyword.place)
    deck.generate(len(members), keyword)
    copies = []
    for section in deck.sections:
        rows = np.flatnonzero(np.isin(section.labels, members))
        if len(rows):
            nodes = section.nodes[rows] + by_node
            if "REFLECT" in keyword.options:
                nodes = _mirror_numbering(section.kind, nodes)
            labels = section.labels[rows] + by_label
            copies.append(Section(section.kind, keyword.option("NEW SET"), labels, nodes, section.is_interface))
    for copy in copies:
        deck.add_elements(copy)


def _mirror_numbering(kind: Kind, nodes: Ints) -> Ints:
    """Nodes of solids, in Abaqus's order, put in order behind a mirror; surfaces and lines stay."""
    order = mirror(kind.name)
    if order is None:
        return nodes
    places = np.array(kind.order or range(kind.n_nodes))
    after = nodes.copy()
    after[:, places] = nodes[:, places[list(order)]]
    return after


_GENERATORS = {"NGEN": _ngen, "NFILL": _nfill, "NCOPY": _ncopy, "ELGEN": _elgen, "ELCOPY": _elcopy}
