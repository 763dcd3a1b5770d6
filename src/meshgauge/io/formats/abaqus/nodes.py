"""Where an Abaqus deck, and what it includes, hold the nodes of elements."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...plumbing.patch_nodes import Nodes
from ...plumbing.spans import words
from .keywords import Keyword, keywords
from .types import element_type

_BY_FACE = (
    *("DLOAD", "DSLOAD", "FILM", "SFILM", "RADIATE", "SRADIATE", "DFLUX", "DSFLUX", "CONTACT PAIR", "TIE", "SURFACE"),
    *("FLUID CAVITY", "DFLOW", "DECHARGE", "IMPEDANCE", "SIMPEDANCE"),
)
"""Keywords whose lines may name a face of an element by its local number, or a surface that does."""


def nodes(path: Path) -> tuple[Nodes, ...]:
    """Of the elements of each keyword, with their numbers.

    Raises
    ------
    ReadError
        If the deck names faces of elements by their local numbers, which would be other faces then.
    """
    given = keywords(path)
    for keyword in given:
        if keyword.name in _BY_FACE and keyword.option("TYPE", "ELEMENT").upper() == "ELEMENT":
            raise keyword.fail(
                f"*{keyword.name} may name faces of elements by their local numbers, which are others once a cell is "
                "renumbered; --convert writes a new deck, without steps and loads"
            )
    pieces: list[Nodes] = []
    for keyword in given:
        made = element_type(keyword.option("TYPE"), has_fluid_surfaces=False) if keyword.name == "ELEMENT" else None
        if made is not None and made.kind is not None:
            pieces += _elements(keyword, made.kind.n_nodes)
    return tuple(pieces)


def _elements(keyword: Keyword, n: int) -> list[Nodes]:
    """Those whose lines stand in one file and have all nodes; others have no place."""
    pieces = []
    for lines in keyword.data:
        starts, ends = words(lines.data, 0, len(lines.data), separator=b",")
        if len(starts) and len(starts) % (n + 1) == 0:
            starts, ends = starts.reshape(-1, n + 1), ends.reshape(-1, n + 1)
            spans = zip(starts[:, 0].tolist(), ends[:, 0].tolist(), strict=True)
            labels = np.array([int(lines.data[a:b]) for a, b in spans], np.int64)
            pieces.append(Nodes(lines.path, lines.start + starts[:, 1:], lines.start + ends[:, 1:], labels=labels))
    return pieces
