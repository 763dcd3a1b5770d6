"""Where an Abaqus deck, and what it includes, hold the nodes of elements."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...plumbing.patch_faces import Faces
from ...plumbing.patch_nodes import Nodes
from ...plumbing.spans import words
from .faces import faces
from .keywords import Keyword, keywords
from .read import model_of
from .types import element_type


def nodes(path: Path) -> tuple[Nodes | Faces, ...]:
    """Of the elements of each keyword, with their numbers; and what names faces of elements by their local numbers."""
    given = keywords(path)
    model = model_of(given)
    pieces: list[Nodes | Faces] = []
    for keyword in given:
        made = element_type(keyword.option("TYPE"), has_fluid_surfaces=False) if keyword.name == "ELEMENT" else None
        if made is not None and made.kind is not None:
            pieces += _elements(keyword, made.kind.n_nodes)
    return (*pieces, *faces(given, [model.outside, *model.parts.values(), *(one.own for one in model.instances)]))


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
