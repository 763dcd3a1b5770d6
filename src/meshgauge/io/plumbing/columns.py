"""Lines of numbers in columns of stated widths, often without a blank between them, as Fortran writes them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

_CHUNK = 1 << 17


def table(lines: Sequence[bytes], columns: Sequence[tuple[int, int]], kind: type) -> NDArray[Any]:
    """``(n_lines, n_columns)`` numbers of one kind; 0 where a line ends before, or is blank.

    Parameters
    ----------
    lines
        Without their ends.
    columns
        Start and width of each.
    kind
        ``np.int64`` or ``np.float64``, whose exponents may be Fortran's.

    Raises
    ------
    ValueError, OverflowError
        If a column holds something else.
    """
    out: NDArray[Any] = np.zeros((len(lines), len(columns)), kind)
    at = 0
    while at < len(columns):  # columns of one width together
        (start, width), n = columns[at], 1
        while at + n < len(columns) and columns[at + n] == (start + n * width, width):
            n += 1
        _fill(out[:, at : at + n], lines, start, width, kind)
        at += n
    return out


def _fill(out: NDArray[Any], lines: Sequence[bytes], first: int, width: int, kind: type) -> None:
    n = out.shape[1]
    end = first + n * width
    for start in range(0, len(lines), _CHUNK):
        part = np.array([line[first:end] for line in lines[start : start + _CHUNK]], f"S{n * width}")
        padded = part.view(np.uint8).reshape(len(part), n * width)
        padded = np.where(padded == 0, 32, padded).astype(np.uint8)
        fields = padded.reshape(len(part), n, width)
        blank = (fields <= 32).all(axis=2)
        fields[blank, -1] = ord("0")
        if kind is np.float64:
            fields[(fields == ord("D")) | (fields == ord("d"))] = ord("E")
        out[start : start + len(part)] = np.ascontiguousarray(fields).view(f"S{width}")[..., 0].astype(kind)
