"""Where a Nastran deck, and what it includes, hold the nodes of elements. Loads of solids name faces by nodes."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from ...plumbing.patch_faces import Faces
from ...plumbing.patch_nodes import Nodes
from .cards import Card, cards
from .elements import ELEMENTS, POINTS_FIRST
from .places import Span, fields_of

_SHELLS = ("CTRIA3", "CTRIA6", "CTRIAR", "CQUAD4", "CQUAD8", "CQUADR")
_LOADS = ("PLOAD2", "PLOAD4")
"""Pressure on a shell acts along its normal; its angle, offset and thicknesses stand behind its nodes."""


def nodes(path: Path) -> tuple[Nodes | Faces, ...]:
    """Of every element, with its number, of those only whose fields can be told; and what depends on their order."""
    by_size: dict[tuple[Path, int], list[tuple[int, list[Span]]]] = defaultdict(list)
    lines: dict[Path, tuple[list[bytes], list[int]]] = {}
    shells: set[int] = set()
    named: list[tuple[Card, Iterable[int]]] = []
    for card in cards(path):
        if card.name in _LOADS or card.name == "CHBDYE":
            named.append((card, _loaded(card)))
        if card.name not in ELEMENTS:
            continue
        if card.name.startswith(_SHELLS):
            shells.add(card.integer(0))
            behind = card.fields[2 + ELEMENTS[card.name][-1].n_nodes :]
            if any(word not in ("", "0", "0.", "0.0") for word in behind):
                named.append((card, (card.integer(0),)))
        if card.path not in lines:
            own = card.path.read_bytes().splitlines(keepends=True)
            lines[card.path] = own, np.cumsum([0, *map(len, own)]).tolist()
        spans = _of_card(card, *lines[card.path])
        if spans:
            by_size[card.path, len(spans)].append((card.integer(0), spans))
    pieces: list[Nodes | Faces] = []
    for (file, _), rows in by_size.items():
        table = np.array([spans for _, spans in rows], np.int64)
        labels = np.array([label for label, _ in rows], np.int64)
        pieces.append(Nodes(file, table[:, :, 0], table[:, :, 1], labels=labels))
    for card, given in named:
        loaded = [label for label in given if card.name == "CHBDYE" or label in shells]
        pieces.append(Faces(card.path, f"{card.name} in line {card.line}", np.array(loaded, np.int64)))
    return tuple(pieces)


def _loaded(card: Card) -> Iterable[int]:
    """The elements that a load, or an element on a side of another, names."""
    if card.name == "CHBDYE":
        return (card.integer(1),)
    fields = [card.text(1), card.text(6), card.text(7)] if card.name == "PLOAD4" else card.fields[2:]
    numbers = [int(word) for word in fields if word.isdigit()]
    if "THRU" in (word.upper() for word in fields) and len(numbers) > 1:
        return range(numbers[0], numbers[1] + 1)
    return numbers[:1] if card.name == "PLOAD4" else numbers


def _of_card(card: Card, lines: list[bytes], begins: list[int]) -> list[Span]:
    first = 1 if card.name in POINTS_FIRST else 2
    largest = ELEMENTS[card.name][-1].n_nodes
    n = max((k for k in range(1, largest + 1) if card.text(first + k - 1)), default=0)
    spans = fields_of(lines, begins, card.line - 1, first + n)[first:]
    return spans if len(spans) == n and all(start >= 0 for start, _ in spans) else []
