"""Where Medit's text files hold the nodes of cells."""

from __future__ import annotations

from pathlib import Path

from ....errors import ReadError
from ...plumbing.patch_nodes import Nodes
from ...plumbing.spans import in_place, words
from .read import SECTIONS, WORD

_SIZES = {section.keyword.lower(): section.kind.n_nodes for section in SECTIONS} | {"hexaedra": 8}


def nodes(path: Path, *, is_binary: bool) -> tuple[Nodes, ...]:
    """Of every section of cells in turn.

    Raises
    ------
    ReadError
        If the file is binary.
    """
    if is_binary:
        raise ReadError(f"{path}: cells of binary files of Medit are not renumbered in place")
    data = in_place(path.read_bytes(), b"#")
    marks, pieces = list(WORD.finditer(data)), []
    for place, mark in enumerate(marks):
        n = _SIZES.get(mark[0].decode("ascii").lower())
        if n is not None:
            end = marks[place + 1].start() if place + 1 < len(marks) else len(data)
            starts, ends = (one[1:].reshape(-1, n + 1)[:, :n] for one in words(data, mark.end(), end))
            pieces.append(Nodes(path, starts, ends, first=1))
    return tuple(pieces)
