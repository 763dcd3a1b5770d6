"""A place in the bytes of one of Fluent's files, and what is read there."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ....errors import ReadError

_SECTION = re.compile(rb"\s*\(\s*(\d+)")
_HEAD = re.compile(rb"\s*\(([^()]*)\)\s*")
_TOKEN = re.compile(rb'"(?:[^"\\]|\\.?)*+(?:"|\Z)|[()]', re.DOTALL)  # a text without end goes to the end
END = b"End of Binary Section"


class Cursor:
    """A place in the bytes of the file."""

    def __init__(self, path: Path, data: bytes) -> None:
        self.path, self.data, self.at = path, data, 0

    def fail(self, what: str) -> ReadError:
        line = self.data.count(b"\n", 0, min(self.at, len(self.data))) + 1
        return ReadError(f"{self.path}, line {line}: {what}")

    def section(self) -> int | None:
        """The number of the next section; None at the end of the file."""
        match = _SECTION.match(self.data, self.at)
        if match is None:
            if self.data[self.at :].strip(b" \t\r\n\0"):
                raise self.fail("expected a section '(number ...)'")
            return None
        self.at = match.end()
        return int(match.group(1)[:9])

    def head(self) -> list[int]:
        """The hexadecimal numbers in parentheses that a section begins with."""
        match = _HEAD.match(self.data, self.at)
        if match is None:
            raise self.fail("expected '(zone first last ...)'")
        self.at = match.end()
        try:
            values = [int(word, 16) for word in match.group(1).split()]
        except ValueError:
            values = []
        if len(values) < 3 or max(values) > 1 << 40:
            raise self.fail(f"a section begins with {match.group(1)[:40].decode('utf-8', 'replace')!r}")
        return values

    def body(self) -> bytes | None:
        """The text in the parentheses that follow; None if the section ends instead."""
        if self.data[self.at : self.at + 1] != b"(":
            return None
        end = self.data.find(b")", self.at)
        if end < 0:
            raise self.fail("the file ends within a section; it is truncated")
        text = self.data[self.at + 1 : end]
        self.at = end + 1
        return text

    def raw(self, dtype: str, n: int) -> NDArray[np.generic]:
        """``n`` binary numbers."""
        kind = np.dtype(dtype)
        if n < 0 or self.at + n * kind.itemsize > len(self.data):
            raise self.fail(f"{n} binary numbers are stated, but the file ends before")
        values = np.frombuffer(self.data, kind, n, self.at)
        self.at += n * kind.itemsize
        return values

    def close(self, is_binary: bool = False) -> None:
        """Go behind the parenthesis that ends the section."""
        if is_binary:
            end = self.data.find(END, self.at)
            if end < 0:
                raise self.fail("a binary section has no end; the file is truncated")
            self.at = self.data.find(b")", end) + 1 or len(self.data)
            return
        depth = 1
        for token in _TOKEN.finditer(self.data, self.at):
            depth += {b"(": 1, b")": -1}.get(token.group(), 0)
            if depth == 0:
                self.at = token.end()
                return
        raise self.fail("the file ends within a section; it is truncated")
