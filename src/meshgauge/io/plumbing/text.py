"""Text files by lines: numbers parsed in bulk, every count checked against what is there, errors with the line."""

from __future__ import annotations

import re
import threading
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import ReadError
from ...kernels.text.driver import parse
from . import budget

_LOCK = threading.Lock()
"""The filter of warnings belongs to the whole process."""
_SHOWN = 40
"""Characters of a line that a message repeats."""


@dataclass(frozen=True, slots=True)
class Ragged:
    """Rows of numbers, one a line: row ``r`` is ``values[starts[r]:starts[r + 1]]``."""

    values: NDArray[Any]
    starts: NDArray[np.int64]

    @property
    def sizes(self) -> NDArray[np.int64]:
        return np.diff(self.starts)


class Text:
    """A text file, read from its first line to its last.

    Parameters
    ----------
    path
        Named in errors.
    data
        The bytes of the file.
    comment
        A mark (a byte) from which on the rest of a line is ignored.
    """

    def __init__(self, path: Path, data: bytes, comment: bytes = b"") -> None:
        self.path = path
        budget.draw("text", len(data), path.name)
        if comment and comment in data:
            data = re.sub(re.escape(comment) + rb"[^\n]*", b"", data)  # lines keep their numbers
        if b"\r" in data:
            data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
        self.data = data
        ends = np.flatnonzero(np.frombuffer(data, np.uint8) == 10) + 1
        if len(data) and not data.endswith(b"\n"):
            ends = np.append(ends, len(data))
        starts = np.concatenate([[0], ends[:-1]]).astype(np.int64) if len(ends) else ends
        filled = np.flatnonzero(_is_filled(data, starts))
        self._starts, self._ends, self._numbers = starts[filled], ends[filled], filled + 1
        self.row = 0

    @property
    def n_lines(self) -> int:
        """Lines that are not blank: there are no others for a reader."""
        return len(self._starts)

    @property
    def n_left(self) -> int:
        return max(self.n_lines - self.row, 0)

    def fail(self, what: str, row: int | None = None) -> ReadError:
        """The error to raise: the file, the line (the last one read, or ``row`` counted from 0) and what is wrong."""
        at = min(self.row - 1 if row is None else row, self.n_lines - 1)
        return ReadError(f"{self.path}, line {int(self._numbers[at]) if at >= 0 else 1}: {what}")

    @property
    def line_number(self) -> int:
        """Of the last line that was read, from 1."""
        return int(self._numbers[min(self.row, self.n_lines) - 1]) if self.n_lines and self.row else 1

    def peek(self) -> bytes:
        """The next line, stripped; empty at the end. It stays the next."""
        return self.rows(self.row, self.row + 1).strip()

    def line(self, what: str = "") -> bytes:
        """The next line; at the end of the file empty, or an error if ``what`` is expected."""
        text = self.peek()
        if not text and what:
            raise self.fail(f"the file ends where {what} is expected")
        self.row += 1
        return text

    def rows(self, first: int, last: int) -> bytes:
        """Lines ``first <= row < last`` as they stand in the file."""
        last = min(last, self.n_lines)
        return self.data[self._starts[first] : self._ends[last - 1]] if first < last else b""

    def row_at(self, position: int) -> int:
        """The line in which a byte stands."""
        return int(np.searchsorted(self._starts, position, side="right")) - 1

    def position(self) -> int:
        """The byte where the next line starts."""
        return int(self._starts[self.row]) if self.row < self.n_lines else len(self.data)

    def integers(self, what: str, least: int = 1) -> list[int]:
        """The integers of the next line, at least ``least`` of them."""
        text = self.line(what)
        try:
            values = [int(word) for word in text.split()]
        except ValueError:
            values = []
        if len(values) < least:
            raise self.fail(f"{text[:_SHOWN].decode('utf-8', 'replace')!r} where {what} is expected")
        return values

    def count(self, what: str, text: bytes | None = None) -> int:
        """A number of lines that follow: the first integer of the next line, or of ``text`` of the last one read."""
        if text is None:
            n = self.integers(f"the number of {what}")[0]
        else:
            words = text.split()
            try:
                n = int(words[0])
            except (ValueError, IndexError):
                shown = text[:_SHOWN].decode("utf-8", "replace")
                raise self.fail(f"{shown!r} where the number of {what} is expected") from None
        if not 0 <= n <= self.n_left:
            raise self.fail(f"{n} {what} are stated, but {self.n_left} lines follow")
        return n

    def lines(self, n: int, what: str) -> bytes:
        """The next ``n`` lines, the last of them ended."""
        if not 0 <= n <= self.n_left:
            raise self.fail(f"{n} {what} are stated, but {self.n_left} lines follow")
        block = self.rows(self.row, self.row + n)
        self.row += n
        return block if not n or block.endswith(b"\n") else block + b"\n"

    def ragged(self, n: int, what: str, kind: type = np.int64) -> Ragged:
        """The numbers of the next ``n`` lines, of one kind, as many a line as there are."""
        first = self.row
        block = self.lines(n, what)
        return Ragged(self._values(block, kind, what, first), _row_starts(block))

    def reals(self, n: int, width: int, what: str) -> NDArray[np.float64]:
        """The first ``width`` numbers of each of the next ``n`` lines: ``(n, width)``."""
        first = self.row
        block = self.lines(n, what)
        starts = _row_starts(block)
        values = self._values(block, np.float64, what, first)
        sizes = np.diff(starts)
        if n and len(values) != starts[-1]:
            raise self.fail(f"{what} hold something else than numbers", first)
        if n and int(sizes.min()) < width:
            at = int(np.argmin(sizes))
            raise self.fail(f"{int(sizes[at])} numbers where {what} have {width}", first + at)
        if n and int(sizes.max()) == int(sizes.min()):
            return np.ascontiguousarray(values.reshape(n, -1)[:, :width])
        return np.asarray(values[starts[:-1, None] + np.arange(width)])

    def _values(self, block: bytes, dtype: type, what: str, first: int) -> NDArray[Any]:
        try:
            return numbers(block, dtype)
        except NotNumbers as error:
            row = self.row_at(int(self._starts[first]) + error.at)
            raise self.fail(f"{what} hold something else than {_KIND[dtype]}: {error}", row) from None


_KIND: dict[type, str] = {np.int64: "integers", np.float64: "numbers"}
_INTEGER = re.compile(rb"[+-]?\d+")
_WORD = re.compile(rb"\S+")


class NotNumbers(ValueError):
    """Something else in a text of numbers: the word, in quotes, and its first byte in the text."""

    def __init__(self, text: bytes, dtype: type) -> None:
        self.at, word = next(_others(text, dtype), (0, b""))
        super().__init__(repr(word[:_SHOWN].decode("utf-8", "replace")))

    def line(self, data: bytes, start: int = 0) -> int:
        """The line of the word in a file, from 1, in which the text begins at some byte."""
        return data.count(b"\n", 0, start + self.at) + 1


def _others(text: bytes, dtype: type) -> Iterator[tuple[int, bytes]]:
    """First byte of each word that is no number, and the word."""
    for word in _WORD.finditer(text):
        if not (_INTEGER.fullmatch(word[0]) if dtype is np.int64 else _is_real(word[0])):
            yield word.start(), word[0]


def _is_real(word: bytes) -> bool:
    try:
        float(word.replace(b"D", b"e").replace(b"d", b"e"))
    except ValueError:
        return False
    return True


_BRACKETS = b"(){}"
WITHOUT_BRACKETS = bytes.maketrans(_BRACKETS, b" " * len(_BRACKETS))
"""For ``bytes.translate``."""


def numbers(text: bytes | memoryview, dtype: type, *, brackets: bool = False) -> NDArray[Any]:
    """All numbers of a text of nothing else, or with round and curly ``brackets`` between them.

    Raises
    ------
    NotNumbers
        If there is something else in it.
    """
    parsed = parse(text, dtype, _BRACKETS if brackets else b"")
    if parsed is not None:
        budget.draw("made", parsed.nbytes, "numbers")
        return parsed
    text = bytes(text)
    if brackets:
        text = text.translate(WITHOUT_BRACKETS)
    given = text
    if not text.strip():
        return np.empty(0, dtype)
    if dtype is np.float64 and re.search(rb"[dD]", text):
        text = re.sub(rb"[dD]", b"e", text)  # exponents of Fortran
    with _LOCK, warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            values: NDArray[Any] = np.fromstring(text.decode("ascii"), dtype, sep=" ")
        except (DeprecationWarning, ValueError):
            raise NotNumbers(given, dtype) from None
    budget.draw("made", values.nbytes, "numbers")
    return values


_REPEATED = re.compile(rb"(?<!\d)(\d++)\*(\S+)")


def write_out_repeated(text: bytes, fail: budget.Fail) -> bytes:
    """The text with ``3*0.5``, as Fortran writes three equal numbers, written out."""
    if b"*" not in text:
        return text
    n_bytes = sum(int(m[1]) * (len(m[2]) + 1) for m in _REPEATED.finditer(text))
    budget.draw("made", n_bytes, "repeated numbers", fail)
    return _REPEATED.sub(lambda m: (m[2] + b" ") * int(m[1]), text)


def _is_filled(data: bytes, starts: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which lines hold more than blanks."""
    if not len(starts):
        return np.zeros(0, bool)
    return np.asarray(np.maximum.reduceat(np.frombuffer(data, np.uint8), starts) > 32)


def words_per_line(block: bytes) -> NDArray[np.int64]:
    """How many words stand on each line, of those that are blank too."""
    characters = np.frombuffer(block, np.uint8)
    blank = characters <= 32
    is_start = ~blank
    is_start[1:] &= blank[:-1]
    return _per_line(characters, np.flatnonzero(is_start))


def marks_per_line(block: bytes, mark: bytes) -> NDArray[np.int64]:
    """How often a character stands on each line, of those that are blank too."""
    characters = np.frombuffer(block, np.uint8)
    return _per_line(characters, np.flatnonzero(characters == mark[0]))


def _per_line(characters: NDArray[np.uint8], at: NDArray[np.intp]) -> NDArray[np.int64]:
    """How many of some positions, ascending, are on each line; nothing behind the last end of a line is one more."""
    ends = np.flatnonzero(characters == 10)
    if len(characters) and (not len(ends) or ends[-1] != len(characters) - 1):
        ends = np.append(ends, len(characters))
    return np.diff(np.searchsorted(at, ends), prepend=0).astype(np.int64)


def _row_starts(block: bytes) -> NDArray[np.int64]:
    """Where the words of each line of a block that is not blank start in the row of all words."""
    sizes = words_per_line(block)
    return np.concatenate([[0], np.cumsum(sizes[sizes > 0])]).astype(np.int64)
