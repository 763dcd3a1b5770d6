"""Where an Abaqus deck, and what it includes, hold the coordinates of nodes."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...plumbing.numerals import Ints, Text
from ...plumbing.patch import Places
from ...plumbing.spans import columns
from .deck import Deck
from .keywords import Keyword, Lines, keywords
from .read import model_of

_FORM = Text(most=20)
"""Abaqus and CalculiX read 20 characters of a field."""

_EMPTY_FIELD = re.compile(rb",[ \t]*,|^[ \t]*,", re.MULTILINE)
_LINE = re.compile(rb"[^\n]*\S[^\n]*")


def places(path: Path) -> Places:
    """Of every deck of the mesh in turn.

    Nodes that define a coordinate system have none, nor do those of a part with several instances.

    Raises
    ------
    ReadError
        If nodes are generated from others, which would move with them.
    """
    given = keywords(path)
    model = model_of(given)
    uses = Counter(id(deck) for deck, _, _ in model.decks)
    fixed = {label for keyword in given if _defines_a_system(keyword) for label in _integers(keyword)}
    whole = Places.joined([_of_deck(path, deck, fixed, is_shared=uses[id(deck)] > 1) for deck, _, _ in model.decks])
    shared = {deck.name: uses[id(deck)] for deck, _, _ in model.decks if uses[id(deck)] > 1}
    return replace(whole, why=tuple(f"part {name!r} has {n} instances: flatten it" for name, n in shared.items()))


def _defines_a_system(keyword: Keyword) -> bool:
    return keyword.name == "ORIENTATION" and keyword.option("DEFINITION").upper().startswith(("NODES", "OFFSET"))


def _integers(keyword: Keyword) -> list[int]:
    return [int(word) for _, words in keyword.rows() for word in words if word.isdigit()]


def _of_deck(path: Path, deck: Deck, fixed: set[int], *, is_shared: bool) -> Places:
    """In the order of `NodeTable.joined`: a node that is given again stands where it is given last."""
    parts = []
    for keyword in deck.given:
        if keyword.name != "NODE":
            raise keyword.fail(
                f"*{keyword.name} generates nodes from others, so that they have no place of their own in the file; "
                "--convert writes a new deck with every node, but without steps and loads"
            )
        parts += [_of_lines(lines, is_other=_is_other(keyword)) for lines in keyword.data]
    whole = Places.joined(parts)
    labels = np.empty(0, np.int64) if whole.labels is None else whole.labels
    _, last = np.unique(labels[::-1], return_index=True)
    kept = np.sort(len(labels) - 1 - last)
    whole = Places(whole.pieces, whole.starts[kept], whole.ends[kept], whole.piece[kept])
    return whole.without(np.isin(labels[kept], list(fixed)) | is_shared)


def _is_other(keyword: Keyword) -> bool:
    return keyword.option("SYSTEM", "R").upper() != "R"


def _of_lines(lines: Lines, *, is_other: bool) -> Places:
    """The nodes of some lines, with their labels."""
    data = lines.data
    spans = _irregular(data) if _EMPTY_FIELD.search(data) else columns(data, 0, len(data), 0, 4, separator=b",")
    starts, ends = (np.where(one < 0, -1, one + lines.start) for one in spans)
    labels = np.array([int(float(data[a:b])) for a, b in zip(*(one[:, 0].tolist() for one in spans), strict=True)])
    whole = Places.of(lines.path, _FORM, starts[:, 1:], ends[:, 1:], labels.astype(np.int64))
    return whole.without(np.arange(len(labels))) if is_other else whole


def _irregular(data: bytes) -> tuple[Ints, Ints]:
    """As `columns`, of lines some of whose fields are empty: these have no place."""
    starts, ends = [], []
    for line in _LINE.finditer(data):
        at, row = line.start(), []
        for field in line[0].split(b",")[:4]:
            first = at + len(field) - len(field.lstrip())
            row.append((first, first + len(field.strip())) if field.strip() else (-1, -1))
            at += len(field) + 1
        row += [(-1, -1)] * (4 - len(row))
        starts.append([a for a, _ in row])
        ends.append([b for _, b in row])
    return np.array(starts, np.int64).reshape(-1, 4), np.array(ends, np.int64).reshape(-1, 4)
