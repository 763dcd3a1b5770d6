"""Where a Nastran deck, and what it includes, hold the nodes of elements. Its loads name faces by nodes."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

import numpy as np

from ...plumbing.patch_nodes import Nodes
from .cards import Card, cards
from .elements import ELEMENTS, POINTS_FIRST
from .places import Span, fields_of


def nodes(path: Path) -> tuple[Nodes, ...]:
    """Of every element, with its number; of those only whose fields can be told."""
    by_size: dict[tuple[Path, int], list[tuple[int, list[Span]]]] = defaultdict(list)
    lines: dict[Path, tuple[list[bytes], list[int]]] = {}
    for card in cards(path):
        if card.name not in ELEMENTS:
            continue
        if card.path not in lines:
            own = card.path.read_bytes().splitlines(keepends=True)
            lines[card.path] = own, np.cumsum([0, *map(len, own)]).tolist()
        spans = _of_card(card, *lines[card.path])
        if spans:
            by_size[card.path, len(spans)].append((card.integer(0), spans))
    pieces = []
    for (file, _), rows in by_size.items():
        table = np.array([spans for _, spans in rows], np.int64)
        labels = np.array([label for label, _ in rows], np.int64)
        pieces.append(Nodes(file, table[:, :, 0], table[:, :, 1], labels=labels))
    return tuple(pieces)


def _of_card(card: Card, lines: list[bytes], begins: list[int]) -> list[Span]:
    first = 1 if card.name in POINTS_FIRST else 2
    largest = ELEMENTS[card.name][-1].n_nodes
    n = max((k for k in range(1, largest + 1) if card.text(first + k - 1)), default=0)
    spans = fields_of(lines, begins, card.line - 1, first + n)[first:]
    return spans if len(spans) == n and all(start >= 0 for start, _ in spans) else []
