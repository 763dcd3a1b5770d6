"""Where words stand in a text: scanned with its bytes in their places, so that they can be put back there."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]


def in_place(data: bytes, comment: bytes = b"") -> bytes:
    """A text of the same length: comments, from a mark to the end of a line, are blank; lines end with one byte."""
    if b"\r" in data:
        data = data.replace(b"\r\n", b" \n").replace(b"\r", b"\n")
    if comment and comment in data:
        data = re.sub(re.escape(comment) + rb"[^\n]*", lambda match: b" " * len(match[0]), data)
    return data


def words(data: bytes, start: int, end: int, separator: bytes = b"") -> tuple[Ints, Ints]:
    """First byte of each word between two places, and the byte behind its last."""
    characters = np.frombuffer(data, np.uint8)[start:end]
    is_word = characters > 32
    if separator:
        is_word &= characters != separator[0]
    change = np.flatnonzero(np.diff(is_word, prepend=False, append=False))
    return (start + change[::2]).astype(np.int64), (start + change[1::2]).astype(np.int64)


def columns(data: bytes, start: int, end: int, first: int, width: int, separator: bytes = b"") -> tuple[Ints, Ints]:
    """Starts and ends ``(n, width)`` of some words of each line that is not blank, from the ``first`` on; -1 where a
    line has fewer."""
    starts, ends = words(data, start, end, separator)
    breaks = start + np.flatnonzero(np.frombuffer(data, np.uint8)[start:end] == 10)
    line = np.searchsorted(breaks, starts)
    firsts = np.flatnonzero(np.diff(line, prepend=-1))
    last = np.append(firsts[1:], len(starts))[:, None]
    at = firsts[:, None] + first + np.arange(width)
    is_there, at = at < last, np.minimum(at, len(starts) - 1)
    return np.where(is_there, starts[at], -1), np.where(is_there, ends[at], -1)


def after_lines(data: bytes, start: int, n: int) -> int:
    """The byte behind the next ``n`` lines that are not blank."""
    at = start
    length = 1 << 16
    while n > 0 and at < len(data):
        stop = data.rfind(b"\n", at, at + length) + 1
        stop = stop or data.find(b"\n", at + length) + 1 or len(data)
        if at + length >= len(data):
            stop = len(data)
        piece = np.frombuffer(data, np.uint8)[at:stop]
        ends = np.flatnonzero(piece == 10) + 1
        if not len(ends) or ends[-1] != len(piece):
            ends = np.append(ends, len(piece))
        begins = np.concatenate([[0], ends[:-1]])
        filled = np.flatnonzero(np.maximum.reduceat(piece, begins) > 32)
        if len(filled) >= n:
            return at + int(ends[filled[n - 1]])
        n, at, length = n - len(filled), stop, 2 * length
    return at
