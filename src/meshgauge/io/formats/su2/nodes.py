"""Where SU2's files hold the nodes of elements: behind their type, a line each."""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import numpy as np

from ....errors import ReadError
from ...plumbing.patch_nodes import Nodes
from ...plumbing.spans import after_lines, columns, in_place

_HEAD = re.compile(rb"^[ \t]*(NELEM|MARKER_ELEMS|NZONE)[ \t]*=[ \t]*(\d+)[^\n]*\n", re.MULTILINE | re.IGNORECASE)
_SIZES = {1: 1, 3: 2, 5: 3, 9: 4, 10: 4, 12: 8, 13: 6, 14: 5}


def nodes(path: Path) -> tuple[Nodes, ...]:
    """Of the elements of a zone, then of its markers.

    Raises
    ------
    ReadError
        If the file has several zones, or markers that are sent and received.
    """
    data = in_place(path.read_bytes(), b"%")
    pieces: list[Nodes] = []
    for head in _HEAD.finditer(data):
        if (head[1].upper() == b"NZONE" and int(head[2]) > 1) or b"SEND_RECEIVE" in data:
            raise ReadError(f"{path}: cells of several zones, or that are sent and received, are not renumbered")
        if head[1].upper() != b"NZONE" and int(head[2]):
            pieces += _section(path, data, head.end(), int(head[2]))
    return tuple(pieces)


def _section(path: Path, data: bytes, start: int, n: int) -> list[Nodes]:
    """Runs of elements of one type."""
    starts, ends = columns(data, start, after_lines(data, start, n), 0, 9)
    codes = np.array([int(data[a:b]) for a, b in zip(starts[:, 0].tolist(), ends[:, 0].tolist(), strict=True)])
    edges = [0, *(np.flatnonzero(np.diff(codes)) + 1).tolist(), len(codes)]
    return [
        Nodes(path, starts[a:b, 1 : 1 + _SIZES[int(codes[a])]], ends[a:b, 1 : 1 + _SIZES[int(codes[a])]], first=0)
        for a, b in itertools.pairwise(edges)
    ]
