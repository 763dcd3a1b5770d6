"""Text of numbers, parsed. What a kernel is not sure of it leaves to its caller, so that no value is ever another."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arrays import BoolArray, Float64Array, Int64Array, UInt8Array
from ..jit import kernel

MOST_DIGITS = 18
"""Of an integer that fits into 64 bits whatever its digits are."""

EXACT = 1 << 53
"""Whole numbers up to here are doubles."""

POWERS = 10.0 ** np.arange(23)
"""Powers of ten that are doubles. One product or quotient of two doubles is rounded once, hence right (W. D. Clinger,
How to read floating point numbers accurately, PLDI 1990)."""


@kernel
def count_words(text: UInt8Array, is_blank: BoolArray) -> int:
    """How many words stand in a text; ``is_blank`` ``(256,)`` says what is between them."""
    n, was_blank = 0, True
    for at in range(len(text)):
        blank = is_blank[text[at]]
        n += was_blank and not blank
        was_blank = blank
    return n


@kernel
def integers(text: UInt8Array, is_blank: BoolArray, out: Int64Array) -> bool:
    """Receive the integers of a text of ``len(out)`` words; False if one is none, or has many digits."""
    at, end = 0, len(text)
    for n in range(len(out)):
        while is_blank[text[at]]:
            at += 1
        sign = text[at]
        if sign == 43 or sign == 45:
            at += 1
        first, value = at, np.int64(0)
        while at < end and not is_blank[text[at]]:
            digit = np.int64(text[at]) - 48
            if digit < 0 or digit > 9 or at - first == MOST_DIGITS:
                return False
            value = 10 * value + digit
            at += 1
        if at == first:
            return False
        out[n] = -value if sign == 45 else value
    return True


@kernel
def reals(
    text: UInt8Array, is_blank: BoolArray, powers: Float64Array, out: Float64Array, hard: NDArray[np.int64]
) -> int:
    """Receive the numbers of a text of ``len(out)`` words; returns how many were left, -1 if one is no plain number.

    Parameters
    ----------
    text, is_blank
        The text, and which bytes are between its words.
    powers
        `POWERS`.
    out
        Receives the nearest double to each number, as every reader of text does.
    hard
        ``(n, 3)``; receives place, first byte and last of each number that one operation does not round rightly: of too
        many digits, or too large or small. The kernel stops when it is full.
    """
    at, end, left = 0, len(text), 0
    for n in range(len(out)):
        while is_blank[text[at]]:
            at += 1
        start = at
        sign = text[at]
        if sign == 43 or sign == 45:
            at += 1
        whole, digits, seen, power, behind = np.int64(0), 0, 0, np.int64(0), 0
        while at < end and not is_blank[text[at]]:
            c = np.int64(text[at])
            if 48 <= c <= 57:
                seen += 1
                if whole > 0 or c > 48:
                    digits += 1
                if digits <= MOST_DIGITS:
                    whole = 10 * whole + c - 48
                power -= behind
            elif c == 46 and behind == 0:
                behind = 1
            else:
                break
            at += 1
        if seen == 0:
            return -1
        if at < end and not is_blank[text[at]]:
            c = np.int64(text[at])
            if c != 101 and c != 69:
                return -1
            at += 1
            minus = False
            if at < end and (text[at] == 43 or text[at] == 45):
                minus = text[at] == 45
                at += 1
            exponent, first = np.int64(0), at
            while at < end and not is_blank[text[at]]:
                c = np.int64(text[at])
                if c < 48 or c > 57:
                    return -1
                if exponent < 100_000:
                    exponent = 10 * exponent + c - 48
                at += 1
            if at == first:
                return -1
            power += -exponent if minus else exponent
        if digits > MOST_DIGITS or whole > EXACT or power < -22 or power > 22:
            if left == len(hard):
                return left + 1
            hard[left, 0], hard[left, 1], hard[left, 2] = n, start, at
            left += 1
            continue
        value = np.float64(whole)
        value = value * powers[power] if power >= 0 else value / powers[-power]
        out[n] = -value if sign == 45 else value
    return left


@kernel
def split_rows(flat: Int64Array, sizes: Int64Array, items: Int64Array) -> int:
    """Take rows apart that each begin with the number of their items; returns the row that is not whole, -1 if all are.

    Parameters
    ----------
    flat
        Rows one after another.
    sizes
        ``(n_rows,)``; receives the number of items of each.
    items
        ``(len(flat) - n_rows,)``; receives the items.
    """
    at, end, to = 0, len(flat), 0
    for row in range(len(sizes)):
        if at >= end:
            return row
        size = flat[at]
        if size < 0 or size > end - at - 1 or size > len(items) - to:
            return row
        sizes[row] = size
        for k in range(size):
            items[to + k] = flat[at + 1 + k]
        to += size
        at += size + 1
    return -1
