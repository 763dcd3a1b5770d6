"""Where SU2's files hold the coordinates of points: after NPOIN, a line each."""

from __future__ import annotations

import re
from pathlib import Path

from ...plumbing.numerals import Text
from ...plumbing.patch import Places
from ...plumbing.spans import after_lines, columns, in_place

_POINTS = re.compile(rb"^[ \t]*NPOIN[ \t]*=[ \t]*(\d+)[^\n]*\n", re.MULTILINE | re.IGNORECASE)
_DIMENSION = re.compile(rb"^[ \t]*NDIME[ \t]*=[ \t]*([23])", re.MULTILINE | re.IGNORECASE)
_FORM = Text()


def places(path: Path) -> Places:
    """Of each zone in turn."""
    data = in_place(path.read_bytes(), b"%")
    parts = []
    for head in _POINTS.finditer(data):
        end = after_lines(data, head.end(), int(head[1]))
        stated = _DIMENSION.findall(data, 0, head.start())
        width = int(stated[-1]) if stated else 3
        parts.append(Places.of(path, _FORM, *columns(data, head.end(), end, 0, width)))
    return Places.joined(parts)
