"""Where Medit's text files hold the nodes of cells."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ....cells import CELL_TYPES
from ....errors import ReadError
from ...plumbing.patch_faces import Faces
from ...plumbing.patch_nodes import Nodes
from ...plumbing.spans import in_place, words
from .read import SECTIONS, WORD

_SIZES = {section.keyword.lower(): section.kind.n_nodes for section in SECTIONS} | {"hexaedra": 8}
_SOLIDS = {section.keyword.lower() for section in SECTIONS if CELL_TYPES[section.kind.vtk_id].dimension == 3} | {
    "hexaedra"
}
_AT_NODES = ("normalattrianglevertices", "normalatquadrilateralvertices", "tangentatedgevertices", "tangentatedges")
"""Sections that name a node of a cell by its place in it."""


def nodes(path: Path, *, is_binary: bool) -> tuple[Nodes | Faces, ...]:
    """Of every section of cells in turn; normals and tangents at nodes of surface cells and lines name their places.

    Raises
    ------
    ReadError
        If the file is binary.
    """
    if is_binary:
        raise ReadError(
            f"{path}: cells of binary files of Medit are not renumbered in place; --convert writes the mesh anew"
        )
    data = in_place(path.read_bytes(), b"#")
    marks = list(WORD.finditer(data))
    pieces: list[Nodes | Faces] = []
    n_cells, lesser, named = 0, [np.empty(0, np.int64)], ""
    for place, mark in enumerate(marks):
        word = mark[0].decode("ascii").lower()
        named = mark[0].decode("ascii") if word in _AT_NODES else named
        n = _SIZES.get(word)
        if n is not None:
            end = marks[place + 1].start() if place + 1 < len(marks) else len(data)
            starts, ends = (one[1:].reshape(-1, n + 1)[:, :n] for one in words(data, mark.end(), end))
            pieces.append(Nodes(path, starts, ends, first=1))
            lesser += [n_cells + np.arange(len(starts))] if word not in _SOLIDS else []
            n_cells += len(starts)
    return (*pieces, Faces(path, named, np.concatenate(lesser))) if named else tuple(pieces)
