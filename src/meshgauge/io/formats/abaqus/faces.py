"""What an Abaqus deck says of elements that is another once they are renumbered: faces by their numbers, layers."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from ....errors import WriteError
from ...plumbing.numerals import Ints
from ...plumbing.patch import contents
from ...plumbing.patch_faces import Faces, Hunk
from .deck import Deck
from .keywords import Keyword, Lines

_NONE = np.empty(0, np.int64)

_TABLES = {
    "tetra": ((1, 2, 3), (1, 4, 2), (2, 4, 3), (3, 4, 1)),
    "pyramid": ((1, 2, 3, 4), (1, 5, 2), (2, 5, 3), (3, 5, 4), (4, 5, 1)),
    "wedge": ((1, 2, 3), (4, 6, 5), (1, 4, 5, 2), (2, 5, 6, 3), (3, 6, 4, 1)),
    "hexahedron": ((1, 2, 3, 4), (5, 8, 7, 6), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 8, 4), (4, 8, 5, 1)),
}
"""Faces of solid elements from 1 on, Abaqus User's Manual, "Three-dimensional solid element library"."""

_BY_FACE = (
    *("SURFACE", "DLOAD", "FILM", "RADIATE", "DFLUX", "FOUNDATION", "DFLOW", "DECHARGE", "DECURRENT", "IMPEDANCE"),
    *("FLUID CAVITY", "REBAR", "FLOW", "SIMPEDANCE"),
)
"""Keywords whose lines may begin with an element or a set of some and the name of a face. Others name surfaces."""

_FACE = re.compile(rb"(S|P|HP|F|R|Q|I|TRVEC|TRSHR|ES)([1-6])([A-Z]*|NU[0-9]*)", re.IGNORECASE)
_BODY = re.compile(rb"GRAV|CENT|CENTRIF|CORIO|ROTA|ROTDYNF|NEWTON|[MV]?BF(NU)?|B[XYZ](NU)?", re.IGNORECASE)
_SECTIONS = ("SOLID SECTION", "SHELL SECTION", "SHELL GENERAL SECTION", "COHESIVE SECTION", "GASKET SECTION")
_TURNS = ("COMPOSITE", "STACK DIRECTION", "OFFSET")
"""Options of sections that count from one side of an element."""


def faces(given: list[Keyword], decks: list[Deck]) -> Iterator[Faces]:
    """Of each line, or section, that names any; ``decks`` hold the sets."""
    sets = _Sets(decks, has_instances=any(keyword.name == "INSTANCE" for keyword in given))
    for keyword in given:
        what = f"*{keyword.name} in line {keyword.place.line}"
        if keyword.name in _SECTIONS and not keyword.options.keys().isdisjoint(_TURNS):
            yield Faces(keyword.place.path, what, sets.cells(keyword.option("ELSET")))
        elif keyword.name in _BY_FACE and keyword.option("TYPE", "ELEMENT").upper() == "ELEMENT":
            for lines in keyword.data:
                yield from _of_lines(lines, keyword.name, sets)


@dataclass(frozen=True, eq=False)
class _Sets:
    """Sets of elements by name, of the deck, its parts and its instances."""

    decks: list[Deck]
    has_instances: bool

    def cells(self, name: str) -> Ints:
        """The elements of a set in all that have one of the name, or an element; all elements if there is no name."""
        name = name.strip(' "').rpartition(".")[2].upper()
        if not name:
            return np.concatenate([_NONE, *(section.labels for deck in self.decks for section in deck.sections)])
        found = [labels for deck in self.decks for labels in deck.elsets.get(name, ())]
        if not found and name.isdigit() and len(name) < 16:
            return np.array([int(name)], np.int64)
        return np.unique(np.concatenate([_NONE, *found]))

    def is_one(self, name: str) -> bool:
        """True if one of the decks only has a set of this name, or it is a number."""
        name = name.strip(' "').rpartition(".")[2].upper()
        return name.isdigit() or sum(name in deck.elsets for deck in self.decks) == 1


def _of_lines(lines: Lines, keyword: str, sets: _Sets) -> Iterator[Faces]:
    at, separator = 0, b"\r\n" if b"\r\n" in contents(lines.path) else b"\n"
    for number, line in enumerate(lines.data.split(b"\n"), lines.first):
        fields = line.split(b",")
        start, at = at, at + len(line) + 1
        face = fields[1].strip() if len(fields) > 1 else b""
        if not face or _BODY.fullmatch(face):
            continue
        name, what = fields[0].decode("utf-8", "replace"), f"*{keyword} in line {number}"
        cells, match = sets.cells(name), _FACE.fullmatch(face)
        if match is None or not sets.is_one(name):
            yield Faces(lines.path, what, cells)
            continue
        digit = start + len(fields[0]) + 1 + fields[1].index(face) + match.start(2)
        end = start + len(line) - (separator == b"\r\n" and line.endswith(b" "))  # which stands for the first byte
        line_at = _Line(lines, what, start, end, digit, name.strip(), separator, is_shared=sets.has_instances)
        numbers = np.full(len(cells), int(match[2]))
        yield Faces(lines.path, what, cells, numbers, _TABLES, partial(_written, line_at, cells))


@dataclass(frozen=True, eq=False)
class _Line:
    """A line that names a face: its bytes, and that of the number, in the lines of a keyword."""

    lines: Lines
    what: str
    start: int
    end: int
    digit: int
    name: str
    separator: bytes
    is_shared: bool


def _written(line: _Line, cells: Ints, numbers: Ints) -> Iterable[Hunk]:
    """Another number; where elements of a set have several, a line for each element."""
    first = line.lines.start
    if (numbers == numbers[0]).all():
        return ((first + line.digit, first + line.digit + 1, str(numbers[0]).encode()),)
    if line.is_shared:
        raise WriteError(
            f"{line.lines.path}: {line.what} names one face of all elements of {line.name}, of which some are to be "
            "renumbered, in an assembly; --convert writes the mesh anew, without what the file holds beside it"
        )
    data = line.lines.data
    before, rest = data[data.index(b",", line.start) : line.digit], data[line.digit + 1 : line.end]
    texts = [f"{cell}".encode() + before + f"{face}".encode() + rest for cell, face in zip(cells, numbers, strict=True)]
    return ((first + line.start, first + line.end, line.separator.join(texts)),)
