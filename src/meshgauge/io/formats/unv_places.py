"""Where I-DEAS universal files hold the coordinates of nodes."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ..plumbing.numerals import Ints, Text
from ..plumbing.patch import Places
from ..plumbing.spans import columns, in_place

_MARK = re.compile(rb"^[ \t]*-1[ \t]*$", re.MULTILINE)
_NUMBER = re.compile(rb"\s*(\d+)[^\n]*\n")
_DOUBLE = Text(most=25, is_field=True, exponent="D", decimals=16, n_exponent=2)
_SINGLE = Text(most=13, is_field=True, exponent="E", decimals=5, n_exponent=2)


def places(path: Path) -> Places:
    """In data sets 2411 and 781, two lines a node, and 15, one."""
    data = in_place(path.read_bytes())
    marks = list(_MARK.finditer(data))
    parts = []
    for begin, end in zip(marks[::2], marks[1::2], strict=False):
        number = _NUMBER.match(data, begin.end())
        if number is None:
            continue
        if number[1] in (b"2411", b"781"):
            starts, ends = columns(data, number.end(), end.start(), 0, 3)
            labels = _integers(data, starts[::2, 0], ends[::2, 0])
            parts.append(_fields(path, data, starts[1::2], ends[1::2], labels, 0, _DOUBLE))
        elif number[1] == b"15":
            starts, ends = columns(data, number.end(), end.start(), 0, 7)
            labels = _integers(data, starts[:, 0], ends[:, 0])
            parts.append(_fields(path, data, starts[:, 4:], ends[:, 4:], labels, 40, _SINGLE))
    return Places.joined(parts)


def _integers(data: bytes, starts: Ints, ends: Ints) -> Ints:
    return np.array([int(data[a:b]) for a, b in zip(starts.tolist(), ends.tolist(), strict=True)], np.int64)


def _fields(path: Path, data: bytes, starts: Ints, ends: Ints, labels: Ints, first: int, form: Text) -> Places:
    """The columns of Fortran's format if the numbers end there; else the words as they stand."""
    breaks = np.concatenate([[-1], np.flatnonzero(np.frombuffer(data, np.uint8) == 10)])
    line = breaks[np.searchsorted(breaks, starts[:, 0]) - 1] + 1
    assert form.most is not None
    columns_end = line[:, None] + first + form.most * np.arange(1, 4)
    if np.array_equal(columns_end, ends):
        return Places.of(path, form, columns_end - form.most, columns_end, labels)
    return Places.of(path, Text(most=form.most, exponent=form.exponent), starts, ends, labels)
