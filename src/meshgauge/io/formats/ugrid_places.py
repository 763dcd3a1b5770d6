"""Where UGRID's files hold the coordinates of points: behind seven numbers, in the encoding that the name tells."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..plumbing.numerals import Raw, Text
from ..plumbing.patch import Places
from ..plumbing.spans import in_place, words

_ENCODING = re.compile(r"\.(l?)([br])([48])(l?)\.ugrid$", re.IGNORECASE)
_N_HEAD = 7


@dataclass(frozen=True, slots=True)
class Encoding:
    """How the numbers of a binary file stand there."""

    real: str
    integer: str
    has_records: bool


def encoding_of(path: Path) -> Encoding | None:
    """None for ascii."""
    match = _ENCODING.search(path.name)
    if match is None:
        return None
    order = "<" if match[1] else ">"
    return Encoding(f"{order}f{match[3]}", f"{order}i{8 if match[4] else 4}", match[2].lower() == "r")


def places(path: Path) -> Places:
    encoding, data = encoding_of(path), path.read_bytes()
    if encoding is None:
        starts, ends = words(in_place(data), 0, len(data))
        stop = _N_HEAD + 3 * int(data[starts[0] : ends[0]])
        return Places.of(path, Text(), *(one[_N_HEAD:stop].reshape(-1, 3) for one in (starts, ends)))
    real, integer = np.dtype(encoding.real), np.dtype(encoding.integer)
    mark = 4 if encoding.has_records else 0  # Fortran's lengths, before and behind the head, and before the rest
    n = int(np.frombuffer(data, integer, 1, mark)[0])
    first = 3 * mark + _N_HEAD * integer.itemsize
    starts = first + real.itemsize * np.arange(3 * n).reshape(n, 3)
    return Places.of(path, Raw(real), starts, starts + real.itemsize)
