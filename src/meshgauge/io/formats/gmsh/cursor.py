"""A place in the bytes of one of Gmsh's files, and what is read there: what the readers of all its versions share."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ....errors import ReadError
from ...plumbing import budget
from ...plumbing.text import NotNumbers, numbers
from .cells import BY_ID, GmshType

Ints = NDArray[np.int64]


@dataclass(slots=True)
class Run:
    """Elements of one type that follow one another in the file."""

    kind: GmshType
    tags: NDArray[np.int64]
    nodes: NDArray[np.int64]  # (n, n_nodes), node tags in Gmsh's order
    physical: NDArray[np.int64]
    geometrical: NDArray[np.int64]
    entity: tuple[int, int] | None = None


class Cursor:
    """A place in the bytes of the file; reads lines, and numbers as text or as they are in memory."""

    def __init__(self, path: Path, data: bytes) -> None:
        budget.draw("text", len(data), path.name)
        self.path, self.data, self.at = path, data, 0
        self.is_binary, self.order, self.size_t = False, "<", 8
        self.version = ""

    def fail(self, what: str) -> ReadError:
        return ReadError(f"{self.path}: not a whole Gmsh file: {what}")

    def line(self) -> str:
        """The next line that is not blank; empty at the end of the file."""
        while self.at < len(self.data):
            end = self.data.find(b"\n", self.at)
            end = len(self.data) if end < 0 else end
            text = self.data[self.at : end].strip()
            self.at = end + 1
            if text:
                return text.decode("utf-8", "replace")
        return ""

    def integers(self) -> list[int]:
        return [int(word) for word in self.line().split()]

    def few(self) -> int:
        """A number of header lines, of which no view has more than a handful."""
        (n,) = self.integers()
        if not 0 <= n <= 100:
            raise self.fail(f"{n} header lines are stated")
        return n

    def raw(self, dtype: DTypeLike, n: int) -> NDArray[Any]:
        """``n`` items of binary data."""
        kind = np.dtype(dtype).newbyteorder(self.order)  # type: ignore[arg-type]
        end = self.at + n * kind.itemsize
        if n < 0 or end > len(self.data):
            raise self.fail(f"{n} items of {kind.itemsize} bytes are stated at byte {self.at} of {len(self.data)}")
        values = np.frombuffer(self.data, kind, n, self.at)
        self.at = end
        return values

    def sizes(self, n: int) -> list[int]:
        """``n`` numbers of the type size_t."""
        return [int(v) for v in self.raw(f"u{self.size_t}", n)]

    def text(self, section: str) -> NDArray[np.float64]:
        """All numbers up to the end of the section."""
        end = self._end(section)
        try:
            values: NDArray[np.float64] = numbers(self.data[self.at : end], np.float64)
        except NotNumbers as error:
            raise self.is_other(section, error, self.at) from None
        self.at = end
        return values

    def is_other(self, section: str, error: NotNumbers, start: int) -> ReadError:
        """The error of a section, which begins at a byte, of something else than numbers."""
        line = error.line(self.data, start)
        what = f"not a whole Gmsh file: section {section} holds something else than numbers: {error}"
        return ReadError(f"{self.path}, line {line}: {what}")

    def skip(self, section: str) -> None:
        self.at = self._end(section)

    def _end(self, section: str) -> int:
        at = self.data.find(end_mark(section).encode(), self.at)
        if at < 0:
            raise self.fail(f"section {section} has no end")
        return at


def end_mark(section: str) -> str:
    """The line that ends a section; of version 1 ``$ENDNOD``."""
    return f"$END{section}" if section.isupper() else f"$End{section}"


def kind_of(cursor: Cursor, gmsh_id: int) -> GmshType:
    if gmsh_id not in BY_ID:
        raise cursor.fail(f"element type {gmsh_id} is not known")
    return BY_ID[gmsh_id]


def n_alike(values: NDArray[np.float64], width: int, columns: tuple[int, int] = (1, 2)) -> int:
    """How many rows of this width follow one another with the type and the number of tags or nodes of the first."""
    a, b = columns
    most, count = len(values) // width, 1
    while count < most:
        step = min(count, most - count)  # doubling, so that short runs cost little
        rows = values[count * width : (count + step) * width].reshape(step, width)
        same = (rows[:, a] == values[a]) & (rows[:, b] == values[b])
        if not same.all():
            return count + int(np.argmin(same))
        count += step
    return count
