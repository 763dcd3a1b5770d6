"""What an Abaqus deck, or one of its parts, holds so far: nodes, elements, sets, sections."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...plumbing import budget
from ...plumbing.build import Ints, Kind
from ...plumbing.nodes import NodeTable
from .keywords import Keyword, Place, integer, real
from .types import ElementType

Reals = NDArray[np.float64]

_NONE = np.empty(0, np.int64)


@dataclass(slots=True)
class Section:
    """Elements of one kind that were given, or generated, together: labels ``(n,)`` and labels of nodes ``(n, k)``."""

    kind: Kind
    elset: str
    labels: Ints
    nodes: Ints
    is_interface: bool = False


@dataclass(slots=True)
class Deck:
    """What stands outside of parts, or in one."""

    name: str = ""
    nodes: NodeTable = field(default_factory=NodeTable)
    given: list[Keyword] = field(default_factory=list)  #: *NODE, and what generates nodes
    sections: list[Section] = field(default_factory=list)
    elsets: dict[str, list[Ints]] = field(default_factory=dict)
    nsets: dict[str, list[Ints]] = field(default_factory=dict)
    materials: dict[str, str] = field(default_factory=dict)  #: of sets
    unknown: Counter[str] = field(default_factory=Counter)
    apart: Counter[str] = field(default_factory=Counter)  #: elements that are no cells, by type
    lesser: Counter[str] = field(default_factory=Counter)  #: elements that lack nodes in faces, by type
    _known: dict[int, tuple[Section, int]] = field(default_factory=dict)
    _n_taken: int = 0

    def generate(self, n: int, keyword: Keyword) -> None:
        """Count what is generated, and refuse what would fill the memory."""
        budget.draw("generated", max(n, 0), f"*{keyword.name}", keyword.fail)

    def add_elements(self, section: Section) -> None:
        self.sections.append(section)
        if section.elset:
            self.elsets.setdefault(section.elset.upper(), []).append(section.labels)

    def element(self, label: int, place: Place) -> tuple[Section, int]:
        """The section of an element, and its row there."""
        for section in self.sections[self._n_taken :]:
            self._known.update((one, (section, row)) for row, one in enumerate(section.labels.tolist()))
        self._n_taken = len(self.sections)
        if label not in self._known:
            raise place.fail(f"refers to element {label}, which does not exist")
        return self._known[label]

    def members(self, sets: dict[str, list[Ints]], name: str, place: Place) -> Ints:
        """Labels of a set, or one label, in order."""
        if name.upper() not in sets and name.isdigit():
            return np.array([integer(place, name)], np.int64)
        if name.upper() not in sets:
            raise place.fail(f"there is no set {name!r}")
        return np.concatenate([_NONE, *sets[name.upper()]])


def take_nodes(keyword: Keyword, deck: Deck) -> None:
    """*NODE: rectangular, cylindrical or spherical coordinates."""
    deck.given.append(keyword)
    system = keyword.option("SYSTEM", "R").upper()
    table = keyword.table(4, np.float64)
    if table is None:
        rows = [[real(place, word) for word in words[:4]] for place, words in keyword.rows()]
        table = np.array([(*row, 0.0, 0.0, 0.0)[:4] for row in rows], np.float64).reshape(-1, 4)
    if not ((np.abs(table[:, 0]) < 2**53) & (table[:, 0] == np.trunc(table[:, 0]))).all():
        raise keyword.fail("a node's number is no integer")
    points = table[:, 1:]
    if system == "C":  # radius, degrees, height
        angle = np.radians(points[:, 1])
        points = np.stack([points[:, 0] * np.cos(angle), points[:, 0] * np.sin(angle), points[:, 2]], axis=1)
    elif system == "S":  # radius, degrees about z, degrees above the plane
        around, above = np.radians(points[:, 1]), np.radians(points[:, 2])
        flat = points[:, 0] * np.cos(above)
        points = np.stack([flat * np.cos(around), flat * np.sin(around), points[:, 0] * np.sin(above)], axis=1)
    elif system != "R":
        raise keyword.fail(f"nodes in the system {keyword.option('SYSTEM')!r}, expected R, C or S")
    labels = table[:, 0].astype(np.int64)
    deck.nodes.add(labels, points)
    if keyword.option("NSET"):
        deck.nsets.setdefault(keyword.option("NSET").upper(), []).append(labels)


def take_elements(keyword: Keyword, deck: Deck, made: ElementType | None) -> None:
    """*ELEMENT, of a type that is known or not."""
    name = keyword.option("TYPE")
    if made is None or made.kind is None:
        target = deck.unknown if made is None else deck.apart
        target[name] += sum(1 for _ in keyword.rows())
        return
    kind, elset = made.kind, keyword.option("ELSET")
    table = keyword.table(kind.n_nodes + 1, np.int64)
    if table is not None:
        deck.add_elements(Section(kind, elset, table[:, 0], table[:, 1:], made.is_interface))
        return
    rows = _rows(keyword, name, made)
    for one in (kind, made.lesser):
        own = [row[: one.n_nodes + 1] for row in rows if (len(row) > kind.n_nodes) == (one is kind)] if one else []
        if own and one is not None:
            whole = np.array(own, np.int64)
            deck.add_elements(Section(one, elset, whole[:, 0], whole[:, 1:], made.is_interface))
    deck.lesser[name] += sum(len(row) <= kind.n_nodes for row in rows)


def _rows(keyword: Keyword, name: str, made: ElementType) -> list[list[int]]:
    """Elements that are continued on further lines, or have something wrong.

    An element goes on until it has its nodes, whether its lines end with a comma or not; one of a type that leaves some
    nodes to the user goes on only behind a comma.
    """
    assert made.kind is not None
    most = made.kind.n_nodes + 1
    least = most if made.lesser is None else made.lesser.n_nodes + 1
    rows: list[list[int]] = []
    goes_on = False
    for place, words in keyword.rows():
        ends_open = len(words) > 1 and words[-1] == ""
        numbers = [integer(place, word) for word in words if word]
        if rows and (len(rows[-1]) < least or (goes_on and len(rows[-1]) < most)):
            rows[-1] += numbers
        else:
            rows.append(numbers)
        goes_on = ends_open
        if len(rows[-1]) > most:
            raise place.fail(f"an element of type {name} with {len(rows[-1]) - 1} nodes, expected {made.kind.n_nodes}")
    if rows and len(rows[-1]) < least:
        raise keyword.fail(f"an element of type {name} with {len(rows[-1]) - 1} nodes, expected {made.kind.n_nodes}")
    return rows


def take_set(keyword: Keyword, sets: dict[str, list[Ints]], name: str, n_known: int) -> None:
    """*ELSET or *NSET: labels, ranges, and sets that are there already; a set holds each label once.

    Members of node sets are ascending, unless UNSORTED asks for the order of the lines.
    """
    members: list[Ints] = []
    for place, words in keyword.rows():
        given = [word for word in words if word]
        if "GENERATE" in keyword.options:
            if len(given) not in (2, 3):
                raise place.fail(f"*{keyword.name}, GENERATE needs first, last and step")
            first, last = integer(place, given[0]), integer(place, given[1])
            step = integer(place, given[2]) if len(given) > 2 else 1
            n = (last - first) // step + 1 if step > 0 else 0
            if step < 1 or n + sum(map(len, members)) > 1000 * (n_known + 1000):
                what = f"*{keyword.name}, GENERATE from {first} to {last} by {step}"
                raise place.fail(f"{what} is far beyond what there is")
            budget.draw("made", 8 * n, f"the set {name!r}", place.fail)
            members.append(np.arange(first, last + 1, step, dtype=np.int64))
            continue
        members.append(np.array([int(word) for word in given if word.isdigit() and len(word) < 16], np.int64))
        for word in given:
            if word.upper() == name.upper():
                raise place.fail(f"the set {name!r} refers to itself")
            if not word.isdigit():
                members += sets.get(word.upper(), [])
    budget.draw("made", 8 * sum(map(len, (*sets.get(name.upper(), []), *members))), f"the set {name!r}", keyword.fail)
    whole = np.concatenate([*sets.get(name.upper(), []), _NONE, *members])
    unique, first_at = np.unique(whole, return_index=True)
    sets[name.upper()] = [whole[np.sort(first_at)] if "UNSORTED" in keyword.options else unique]
