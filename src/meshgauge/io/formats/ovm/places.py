"""Where OpenVolumeMesh's files hold the coordinates of vertices."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ...plumbing.numerals import Raw, Text
from ...plumbing.patch import Places
from ...plumbing.spans import after_lines, columns, in_place
from . import binary

_VERTICES = re.compile(rb"^[ \t]*vertices[ \t]*\n\s*(\d+)[ \t]*\n", re.MULTILINE | re.IGNORECASE)


def places(path: Path) -> Places:
    """A line each, or one after another in chunks."""
    data = path.read_bytes()
    if data.startswith(binary.MAGIC[:5]):
        parts = []
        for begin, n, kind, dimension in binary.vertices(data):
            size = np.dtype(kind).itemsize
            starts = np.full((n, 3), -1, np.int64)
            starts[:, :dimension] = begin + size * np.arange(n * dimension).reshape(n, dimension)
            parts.append(Places.of(path, Raw(kind), starts, starts + size))
        return Places.joined(parts)
    text = in_place(data, b"#")
    head = _VERTICES.search(text)
    if head is None:
        return Places.of(path, Text(), *np.empty((2, 0, 3), np.int64))
    end = after_lines(text, head.end(), int(head[1]))
    return Places.of(path, Text(), *columns(text, head.end(), end, 0, 3))
