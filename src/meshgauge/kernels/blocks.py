"""Which blocks, or items, of an array some ids name, and where they stand once only these are there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .jit import inlined, kernel

Ids = NDArray[np.int64]


@kernel
def shift(ids: Ids, by: int) -> tuple[int, int]:
    """Take a number from each id, in place; the least and the greatest of what is left. There is one id or more."""
    least, greatest = ids[0] - by, ids[0] - by
    for i in range(len(ids)):
        left = ids[i] - by
        ids[i] = left
        least = min(least, left)
        greatest = max(greatest, left)
    return least, greatest


@kernel
def mark(ids: Ids, n: int, shift: int, touched: NDArray[np.uint8]) -> int:
    """Set ``touched`` to 1 for each block of ``2**shift`` items that one of the ids lies in.

    Returns the position of the first id that is none of ``n`` items; -1 if there is none.
    """
    for i in range(len(ids)):
        if not 0 <= ids[i] < n:
            return i
        touched[ids[i] >> shift] = 1
    return -1


@kernel
def place(ids: Ids, shift: int, moves: Ids, out: Ids) -> None:
    """``out = ids + moves[ids >> shift]``."""
    for i in range(len(ids)):
        out[i] = ids[i] + moves[ids[i] >> shift]


@inlined
def _n_bits(word: np.uint64) -> np.uint64:
    """The number of bits that are set."""
    word = word - ((word >> np.uint64(1)) & np.uint64(0x5555555555555555))
    word = (word & np.uint64(0x3333333333333333)) + ((word >> np.uint64(2)) & np.uint64(0x3333333333333333))
    word = (word + (word >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return (word * np.uint64(0x0101010101010101)) >> np.uint64(56)


@kernel
def gather(ids: Ids, words: NDArray[np.uint64], before: Ids) -> int:
    """Set a bit in ``words``, which are 0, for each id; count those ``before`` each word, of which there is one more.

    Returns the number of different ids. All ids are those of items.
    """
    for i in range(len(ids)):
        words[ids[i] >> 6] |= np.uint64(1) << np.uint64(ids[i] & 63)
    before[0] = 0
    for word in range(len(words)):
        before[word + 1] = before[word] + np.int64(_n_bits(words[word]))
    return int(before[len(words)])


@kernel
def ranks(ids: Ids, words: NDArray[np.uint64], before: Ids, out: Ids) -> None:
    """The position of each id among those that are set, ascending."""
    for i in range(len(ids)):
        word, bit = ids[i] >> 6, np.uint64(ids[i] & 63)
        out[i] = before[word] + np.int64(_n_bits(words[word] & ((np.uint64(1) << bit) - np.uint64(1))))


@kernel
def listed(words: NDArray[np.uint64], out: Ids) -> None:
    """The ids that are set, ascending."""
    at = 0
    for word in range(len(words)):
        rest = words[word]
        while rest:
            low = rest & (~rest + np.uint64(1))
            out[at] = (word << 6) + np.int64(_n_bits(low - np.uint64(1)))
            at += 1
            rest ^= low
