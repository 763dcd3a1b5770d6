"""The keywords of an LS-DYNA file with their lines, those of included files in their place."""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....errors import ReadError
from ...plumbing import budget, columns
from ...plumbing.includes import Includes
from ...plumbing.spans import in_place

_KEYWORD = re.compile(rb"^\*[^\n]*", re.MULTILINE)
_NAME = re.compile(r"\*\s*(\w+)\s*([+\-%]?)")
_LONG = re.compile(r"\bLONG\s*=\s*([YKS])", re.IGNORECASE)
_I10 = re.compile(r"\bI10\s*=\s*Y", re.IGNORECASE)
_LONG_WIDTH, _I10_WIDTH = 20, 10


@dataclass(frozen=True, slots=True)
class Card:
    """A keyword with its lines, comments and blank ones among them."""

    path: Path
    line: int
    name: str  #: upper case, without the star
    width: int  #: of a column: 8, 10 or 20 characters
    data: bytes
    start: int  #: the byte of the file where the lines begin

    def fail(self, what: str, line: int | None = None) -> ReadError:
        return ReadError(f"{self.path}, line {self.line if line is None else line}: *{self.name} {what}")

    def numbered(self, *, blank: bool = False) -> tuple[list[bytes], list[int]]:
        """Lines that are no comments, and their numbers in the file; ``blank``: the blank ones too."""
        rows = self.data.split(b"\n")
        kept = [n for n, row in enumerate(rows) if not row.startswith(b"$") and (blank or row.strip())]
        return [rows[n].rstrip() for n in kept], [self.line + 1 + n for n in kept]

    def table(self, lines: list[bytes], numbers: list[int], widths: list[int], kind: type) -> NDArray[Any]:
        """``(n_lines, n_widths)`` numbers in columns of these widths, or between commas; 0 where a field is blank."""
        ends = list(accumulate(widths))
        plain = [_in_columns(line, widths) if b"," in line else line for line in lines]
        places = [(end - width, width) for end, width in zip(ends, widths, strict=True)]
        budget.draw("made", len(lines) * (8 * len(widths) + ends[-1]), f"*{self.name}", self.fail)
        try:
            return columns.table(plain, places, kind)
        except (ValueError, OverflowError):
            raise self._fail_at(plain, numbers, places, kind) from None

    def _fail_at(self, lines: list[bytes], numbers: list[int], places: list[tuple[int, int]], kind: type) -> ReadError:
        """The error that names the first line with something else than a number."""
        for line, number in zip(lines, numbers, strict=True):
            for start, width in places:
                word = line[start : start + width].strip()
                try:
                    columns.table([line], [(start, width)], kind)
                except (ValueError, OverflowError):
                    why = ": parameters are not followed, write the values out" if b"&" in word else ""
                    shown = word[:40].decode("utf-8", "replace")
                    what = "a number" if kind is np.float64 else "an integer"
                    return self.fail(f"has {shown!r} where {what} is expected{why}", number)
        return self.fail("holds something else than numbers")


def _in_columns(line: bytes, widths: list[int]) -> bytes:
    """A line of fields between commas, as one in columns."""
    fields = [field.strip() for field in line.split(b",")]
    return b"".join(field.rjust(width)[-width:] if len(field) <= width else b"?" * width
                    for field, width in zip(fields, widths, strict=False))  # fmt: skip


def cards(path: Path) -> list[Card]:
    """All keywords of a file up to ``*END``, in order.

    Raises
    ------
    ReadError
        If an included file is missing or outside the folder of the file, or is included in a way that is not followed.
    """
    made: list[Card] = []
    _gather(path, Includes(path), made)
    return made


def _gather(path: Path, includes: Includes, made: list[Card]) -> None:
    data = in_place(path.read_bytes())
    budget.draw("text", len(data), path.name)
    breaks = np.flatnonzero(np.frombuffer(data, np.uint8) == 10)
    heads = list(_KEYWORD.finditer(data))
    ends = [*(head.start() for head in heads), len(data)][1:]
    usual = 8
    for head, end in zip(heads, ends, strict=True):
        text = head[0].decode("utf-8", "replace")
        match = _NAME.match(text)
        if match is None:
            continue
        name, mark = match[1].upper(), match[2]
        if name == "END":
            return
        if name == "KEYWORD":
            long = _LONG.search(text)
            usual = _LONG_WIDTH if long and long[1] in "Yy" else _I10_WIDTH if _I10.search(text) else 8
        width = {"+": _LONG_WIDTH, "-": 8, "%": _I10_WIDTH}.get(mark, usual)
        card = Card(
            path,
            int(np.searchsorted(breaks, head.start())) + 1,
            name,
            width,
            data[head.end() + 1 : end],
            head.end() + 1,
        )
        if name == "INCLUDE":
            for file in _files(card):
                with includes.opened(file, card.fail) as target:
                    _gather(target, includes, made)
        elif name.startswith("INCLUDE_") and not name.startswith("INCLUDE_PATH"):
            raise card.fail("is not followed; join the files first")
        else:
            made.append(card)


def _files(card: Card) -> list[str]:
    """The names below an ``*INCLUDE``; one that ends with `` +`` goes on in the next line."""
    names, open_name = [], ""
    for line in card.numbered()[0]:
        text = line.decode("utf-8", "replace").strip()
        if text.endswith(" +"):
            open_name += text[:-2].rstrip()
        else:
            names.append(open_name + text)
            open_name = ""
    return names
