"""Where an LS-DYNA file, and what it includes, hold the coordinates of nodes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...plumbing.numerals import Text
from ...plumbing.patch import Places
from .cards import Card, cards

_SYSTEMS = "DEFINE_COORDINATE_NODES"


def places(path: Path) -> Places:
    """Of all nodes but those that define a coordinate system."""
    given = cards(path)
    fixed = {node for card in given if card.name.startswith(_SYSTEMS) for node in _nodes_of_system(card)}
    whole = Places.joined([_of_card(card) for card in given if card.name == "NODE"])
    return whole if whole.labels is None else whole.without(np.isin(whole.labels, list(fixed)))


def _nodes_of_system(card: Card) -> list[int]:
    lines, numbers = card.numbered()
    return [int(node) for node in card.table(lines, numbers, [10] * 4, np.int64)[:, 1:].ravel()]


def _of_card(card: Card) -> Places:
    width = 20 if card.width == 20 else 16
    labels, spans, at = [], [], card.start
    for line in card.data.split(b"\n"):
        if line.strip() and not line.startswith(b"$"):
            own = _between_commas(line, at) if b"," in line else _in_columns(line, at, card.width, width)
            labels.append(int(line.split(b",")[0] if b"," in line else line[: card.width]))
            spans.append(own)
        at += len(line) + 1
    table = np.array(spans, np.int64).reshape(-1, 3, 2)
    form = Text(most=width, is_field=True)
    return Places.of(card.path, form, table[:, :, 0], table[:, :, 1], np.array(labels, np.int64))


def _in_columns(line: bytes, at: int, first: int, width: int) -> list[tuple[int, int]]:
    """The last field need not be filled to its end; one that is blank has no place."""
    spans = []
    for start in range(first, first + 3 * width, width):
        end = min(start + width, len(line))
        spans.append((at + start, at + end) if line[start:end].strip() else (-1, -1))
    return spans


def _between_commas(line: bytes, at: int) -> list[tuple[int, int]]:
    spans = []
    for field in line.split(b",")[:4]:
        start = at + len(field) - len(field.lstrip())
        spans.append((start, start + len(field.strip())) if field.strip() else (-1, -1))
        at += len(field) + 1
    return [*spans[1:], *[(-1, -1)] * 3][:3]
