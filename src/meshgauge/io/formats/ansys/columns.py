"""Blocks of numbers in columns of a stated width, often without a blank between them, as Fortran writes them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import accumulate
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...plumbing import budget
from ...plumbing import columns as fixed
from ...plumbing.text import Text

END = re.compile(rb"^[ \t]*(?:-1[ \t]*$|[A-Za-z/*!])", re.MULTILINE)
_ITEM = re.compile(r"\s*+(\d{0,4}+)\s*+([iaefg])\s*+(\d{1,4}+)[\w.]*+\s*+", re.IGNORECASE)
_WIDEST = 64  # characters of a number
_MOST = 100  # columns


@dataclass(frozen=True, slots=True)
class Block:
    """The lines of a block, and where its columns are.

    Attributes
    ----------
    lines
        Those that are not blank.
    first
        Which line of the text the first is, from 0.
    integers, reals
        Start and width of each column of whole numbers, which come first, and of the others.
    """

    text: Text
    lines: list[bytes]
    first: int
    integers: list[tuple[int, int]]
    reals: list[tuple[int, int]]

    def table(self, columns: list[tuple[int, int]], kind: type) -> NDArray[Any]:
        """``(n_lines, n_columns)`` numbers; 0 where a line ends before, or is blank."""
        characters = sum(width for _, width in columns)  # of each line, blanks put where it ends before
        budget.draw("made", len(self.lines) * (8 * len(columns) + characters), "a block", self.text.fail)
        try:
            return fixed.table(self.lines, columns, kind)
        except (ValueError, OverflowError):
            what = f"{'numbers' if kind is np.float64 else 'integers'} of {columns[0][1]} columns"
            bad = next((row for row, line in enumerate(self.lines) if _is_other(line, columns, kind)), 0)
            shown = self.lines[bad].strip()[:40].decode("utf-8", "replace")
            raise self.text.fail(f"something else than {what}: {shown!r}", self.first + bad) from None


def _is_other(line: bytes, columns: list[tuple[int, int]], kind: type) -> bool:
    try:
        fixed.table([line], columns, kind)
    except (ValueError, OverflowError):
        return True
    return False


def read_block(text: Text) -> Block:
    """A format such as (3i9,6e21.13e3) or (1i7,2i9,6e21.13e3), and the lines of numbers after it.

    Raises
    ------
    ReadError
        If there is no format, or its columns have no possible width.
    """
    given = text.line("the format of a block").decode("utf-8", "replace")
    columns_given = items(given)
    if not columns_given:
        raise text.fail(f"{given[:40]!r} where the format of a block is expected, as (19i9)")
    widths = [width for n, _, width in columns_given for _ in range(n)]
    kinds = [kind for n, kind, _ in columns_given for _ in range(n)]
    if not widths or len(widths) > _MOST or not 0 < min(widths) <= max(widths) <= _WIDEST:
        raise text.fail(f"the format {given[:40]!r} has columns of no possible width")
    starts = [0, *accumulate(widths)]
    columns = list(zip(starts, widths, strict=False))
    n_integers = next((k for k, kind in enumerate(kinds) if kind in "efg"), len(kinds))
    end = END.search(text.data, text.position())
    last = text.row_at(end.end() - 1) if end else text.n_lines
    first = text.row
    block = text.lines(max(last - text.row, 0), "lines of a block").split(b"\n")
    lines = [line.rstrip() for line in block if line.strip()]
    return Block(text, lines, first, columns[:n_integers], columns[n_integers:])


def items(given: str) -> list[tuple[int, str, int]]:
    """Count, letter and width of each item of a format; none if it is no format."""
    inner = given.strip()
    if not inner.startswith("(") or ")" not in inner:
        return []
    given_items = []
    for word in inner[1 : inner.index(")")].split(","):
        match = _ITEM.fullmatch(word)
        if match is None:
            return []
        given_items.append((min(int(match[1] or 1), _MOST + 1), match[2].lower(), int(match[3])))
    return given_items
