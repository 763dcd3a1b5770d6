"""What an ANSYS input has defined so far: nodes and elements, given in blocks, one by one, or generated from others."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...plumbing import budget
from ...plumbing.build import Ints
from ...plumbing.nodes import NodeTable, Reals
from .commands import Command

MOST_NODES = 20
"""Of an element."""
_RELEASE = re.compile(r"(R\d+\.\d+|UNBL)$", re.IGNORECASE)
_ATTRIBUTES = ("MAT", "TYPE", "REAL", "SECNUM")
_SELECTS = ("NSEL", "ESEL", "CMSEL", "NSLE", "ESLN", "ALLSEL")
_REFUSED = (
    *("VMESH", "VSWEEP", "VEXT", "VROTAT", "VDRAG", "VOFFST", "NSYM", "ESYM", "ENSYM", "ENGEN", "NSCALE", "NREAD"),
    *("EREAD", "*USE", "*REPEAT"),
)
"""Commands that make nodes or elements, or may, in ways that are not followed."""


@dataclass(slots=True)
class Model:
    """Nodes, elements, and the attributes that the next element gets.

    Attributes
    ----------
    heads, nodes
        Of elements, in pieces: ``(n, 5)`` material, type, section, label and number of nodes; ``(n, 20)`` labels of
        nodes, 0 where there is none.
    """

    points: NodeTable = field(default_factory=NodeTable)
    heads: list[Ints] = field(default_factory=list)
    nodes: list[Ints] = field(default_factory=list)
    now: dict[str, int] = field(default_factory=lambda: dict.fromkeys(_ATTRIBUTES, 1))
    system: int = 0
    last_node: int = 0
    last_element: int = 0
    is_selection: bool = False
    _open: list[list[int]] = field(default_factory=list)  #: elements given one by one: head, then nodes

    def take(self, command: Command) -> None:
        """A command; one that is none of these is passed over."""
        taker = _TAKERS.get(command.name)
        if command.name in _REFUSED:
            raise command.fail(f"{command.name} is not followed; write the mesh with CDWRITE")
        if command.name in _SELECTS:
            rest = [word.upper() for word in command.words[1:] if word]
            self.is_selection = command.name != "ALLSEL" and rest != ["ALL"]
        if taker is None or len(command.words) < 2:
            return
        if command.inside:
            raise command.fail(f"{command.name} in {command.inside}: loops and conditions are not followed")
        taker(self, command)

    def add_nodes(self, labels: Ints, points: Reals) -> None:
        """Nodes in a block."""
        self.points.add(labels, points)
        self.last_node = max(self.last_node, int(labels.max(initial=0)))

    def add_elements(self, heads: Ints, nodes: Ints) -> None:
        """Elements in a block."""
        self.flush()
        self.heads.append(heads)
        self.nodes.append(nodes)
        self.last_element = max(self.last_element, int(heads[:, 3].max(initial=0)))

    def flush(self) -> None:
        """Elements given one by one, as arrays."""
        if not self._open:
            return
        table = np.zeros((len(self._open), 5 + MOST_NODES), np.int64)
        for row, own in zip(table, self._open, strict=True):
            row[: len(own)] = own
            row[4] = len(own) - 5
        self._open.clear()
        self.heads.append(table[:, :5])
        self.nodes.append(table[:, 5:])

    def elements(self) -> tuple[Ints, Ints]:
        """Heads and nodes of all."""
        self.flush()
        self.heads = [np.concatenate([np.empty((0, 5), np.int64), *self.heads])]
        self.nodes = [np.concatenate([np.empty((0, MOST_NODES), np.int64), *self.nodes])]
        return self.heads[0], self.nodes[0]

    def _attribute(self, command: Command) -> None:
        self.now[command.name] = command.integer(1, 1)

    def _system(self, command: Command) -> None:
        self.system = command.integer(1)

    def _node(self, command: Command) -> None:
        at = 1
        if _RELEASE.match(command.word(1)):
            if command.word(2).upper() != "LOC" or command.word(3) == "-1":
                return  # its rotation, or the end
            label, at = command.integer(3), 5
        else:
            label = command.integer(1) or self.last_node + 1
        x = np.array([[command.real(at + k) for k in (1, 2, 3)]])
        if at == 1:
            x = self._global(x, command)
        self.points.add_one(label, *x[0].tolist())
        self.last_node = max(self.last_node, label)

    def _global(self, x: Reals, command: Command) -> Reals:
        """Coordinates in the global system of those in the system that is active: 1 is cylindrical, 2 spherical."""
        if self.system == 0:
            return x
        if self.system not in (1, 2):
            raise command.fail(f"a node in the coordinate system {self.system}, only 0, 1 and 2 are read")
        around, above = np.radians(x[:, 1]), np.radians(x[:, 2])
        flat = x[:, 0] * (np.cos(above) if self.system == 2 else 1.0)
        height = x[:, 0] * np.sin(above) if self.system == 2 else x[:, 2]
        return np.stack([flat * np.cos(around), flat * np.sin(around), height], axis=1)

    def _element(self, command: Command) -> None:
        if _RELEASE.match(command.word(1)):
            self._unblocked(command)
            return
        has_number = command.name == "EN"
        number = command.integer(1) if has_number else self.last_element + 1
        self.last_element = max(self.last_element, number)
        self._open.append([self.now["MAT"], self.now["TYPE"], self.now["SECNUM"], number, 0])
        self._more(command, 2 if has_number else 1)

    def _unblocked(self, command: Command) -> None:
        """CDWRITE's form of an element: its attributes, then its nodes on lines of their own."""
        if command.word(3) == "-1" or len(command.words) < 3:
            return
        if command.word(2).upper() == "NODE" and self._open:
            self._more(command, 3)
            return
        _, material, kind, _, section, _, number = (command.integer(place) for place in range(3, 10))
        self._open.append([material, kind, section, number, 0])
        self.last_element = max(self.last_element, number)

    def _more(self, command: Command, first: int = 1) -> None:
        if not self._open:
            return
        own = self._open[-1]
        own += [command.integer(place) for place in range(first, len(command.words))]
        while len(own) > 5 and own[-1] == 0:
            own.pop()
        if len(own) > 5 + MOST_NODES:
            raise command.fail(f"element {own[3]} has {len(own) - 5} nodes, expected 1 to {MOST_NODES}")

    def _range(self, command: Command, first: int) -> tuple[int, int, int]:
        """First, last and step of labels from a field on."""
        a = command.integer(first)
        return a, command.integer(first + 1, a), max(command.integer(first + 2, 1), 1)

    def _generate(self, command: Command, n: int) -> None:
        budget.draw("generated", max(n, 0), command.name, command.fail)

    def _all(self, command: Command, place: int) -> bool:
        """Whether a field asks for all; of a selection they are not known."""
        if command.word(place).upper() != "ALL":
            return False
        if self.is_selection:
            raise command.fail(f"{command.name} of what is selected is not followed; write the mesh with CDWRITE")
        return True

    def _copy_nodes(self, command: Command) -> None:
        """NGEN: a pattern of nodes, repeated with a step of labels and of coordinates."""
        n, step = command.integer(1), command.integer(2)
        if self._all(command, 3):
            labels, points = self.points.joined()
        else:
            first, last, by = self._range(command, 3)
            self._generate(command, abs(last - first) // by)
            labels = np.arange(first, last + 1, by, dtype=np.int64)
            points = np.array([self.points.at(label, command.refers) for label in labels.tolist()]).reshape(-1, 3)
        if command.word(9) and command.real(9) != 1:
            raise command.fail("NGEN with SPACE is not followed; write the mesh with CDWRITE")
        if self.system and any(command.real(place) for place in (6, 7, 8)):
            raise command.fail(f"NGEN in the coordinate system {self.system} is not followed")
        move = np.array([command.real(place) for place in (6, 7, 8)])
        self._generate(command, max(n - 1, 0) * len(labels))
        for k in range(1, n):
            self.add_nodes(labels + k * step, points + k * move)

    def _fill(self, command: Command) -> None:
        """FILL: nodes at equal distances between two."""
        if command.word(8) and command.real(8) != 1:
            raise command.fail("FILL with SPACE is not followed; write the mesh with CDWRITE")
        a, b = command.integer(1), command.integer(2)
        n = command.integer(3, abs(b - a) - 1)
        step = command.integer(5, (b - a) // (n + 1) if n > 0 else 1)
        start = command.integer(4, a + step)
        times, by = command.integer(6, 1), command.integer(7, 1)
        self._generate(command, max(n, 0) * max(times, 1))
        share = (np.arange(1, n + 1) / (n + 1))[:, None]
        for k in range(times if n > 0 else 0):
            x, y = (self.points.at(label + k * by, command.refers) for label in (a, b))
            self.add_nodes(start + k * by + step * np.arange(n), x + share * (y - x))

    def _copy_elements(self, command: Command) -> None:
        """EGEN: a pattern of elements, repeated with a step of the labels of their nodes; with a move, of nodes too."""
        n, step = command.integer(1), command.integer(2)
        heads, nodes = self.elements()
        if self._all(command, 3):
            rows = np.arange(len(heads))
        elif command.integer(3) < 0:
            rows = np.arange(max(len(heads) + command.integer(3), 0), len(heads))
        else:
            first, last, by = self._range(command, 3)
            labels = heads[:, 3]
            rows = np.flatnonzero((labels >= first) & (labels <= last) & ((labels - first) % by == 0))
        if not len(rows):
            raise command.fail(f"EGEN refers to element {command.word(3)}, which does not exist")
        by_attribute = np.array([command.integer(6), command.integer(7), command.integer(10)])
        move = np.array([command.real(place) for place in (11, 12, 13)])
        self._generate(command, max(n - 1, 0) * len(rows))
        for k in range(1, n):
            own, ids = heads[rows].copy(), nodes[rows]
            own[:, :3] += k * by_attribute
            own[:, 3] = self.last_element + 1 + np.arange(len(rows))
            if move.any():
                self._generate(command, int((ids > 0).sum()))
                labels = np.unique(ids[ids > 0])
                x = np.array([self.points.at(label, command.refers) for label in labels.tolist()])
                self.add_nodes(labels + k * step, x + k * move)
            self.add_elements(own, np.where(ids > 0, ids + k * step, 0))


_TAKERS = {
    "CSYS": Model._system,
    "N": Model._node,
    "E": Model._element,
    "EN": Model._element,
    "EMORE": Model._more,
    "NGEN": Model._copy_nodes,
    "FILL": Model._fill,
    "EGEN": Model._copy_elements,
    **dict.fromkeys(_ATTRIBUTES, Model._attribute),
}


def members(sets: dict[str, Ints], labels: Ints, most: int) -> dict[str, NDArray[np.uint8]]:
    """For each component, given by ranges of labels, 1 for each of its elements; a label is looked for from below."""
    data = {}
    for name, ranges in list(sets.items())[:most]:
        ordered = ranges[np.argsort(ranges[:, 0], kind="stable")]
        at = np.searchsorted(ordered[:, 0], labels, side="right") - 1
        ends = np.maximum.accumulate(ordered[:, 1]) if len(ordered) else ordered[:, 1]
        budget.draw("mesh", len(labels), f"component {name!r}")
        member = np.zeros(len(labels), np.uint8)
        member[at >= 0] = ends[at[at >= 0]] >= labels[at >= 0]
        data[name] = member
    return data
