"""Numbers of a long text by kernels; None where a text is short, or where something in it needs a closer look."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Int64Array, read_only

COMPILED_FROM = 4 << 20
"""Bytes of text from which on kernels are faster: loading them takes a quarter of a second."""

_BLANK = np.zeros(256, np.bool_)
_BLANK[list(b" \t\n\r\v\f")] = True


def parse(text: bytes | memoryview, kind: type, brackets: bytes = b"") -> NDArray[Any] | None:
    """``(n,)`` the numbers of a text of nothing else, ``np.int64`` or ``np.float64``; each the nearest there is.

    Parameters
    ----------
    text
        Words with blanks between them; of reals with an ``e`` before the exponent.
    kind
        Of the numbers.
    brackets
        Bytes that are taken for blanks.
    """
    if len(text) < COMPILED_FROM:
        return None
    from . import numerals

    is_blank = _BLANK.copy()
    is_blank[list(brackets)] = True
    data, blanks = read_only(np.frombuffer(text, np.uint8)), read_only(is_blank)
    n = numerals.count_words(data, blanks)
    if kind is np.int64:
        whole = np.empty(n, np.int64)
        return whole if numerals.integers(data, blanks, whole) else None
    out, hard = np.empty(n), np.empty((n // 8 + 1, 3), np.int64)
    left = numerals.reals(data, blanks, read_only(numerals.POWERS), out, hard)
    if not 0 <= left <= len(hard):
        return None
    for at, first, last in hard[:left].tolist():
        out[at] = float(text[first:last])
    return out


def split_rows(flat: Int64Array, n_rows: int) -> tuple[Int64Array, Int64Array] | None:
    """Sizes of rows and their items, of rows that begin with their size; None if there are fewer, or more."""
    from . import numerals

    if n_rows > len(flat):
        return None
    sizes, items = np.empty(n_rows, np.int64), np.empty(len(flat) - n_rows, np.int64)
    wrong = numerals.split_rows(read_only(flat), sizes, items)
    return None if wrong >= 0 or int(sizes.sum()) != len(items) else (sizes, items)
