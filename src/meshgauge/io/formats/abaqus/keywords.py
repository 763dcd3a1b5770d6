"""The keywords of an Abaqus input file with their data lines, those of included files in their place."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....errors import ReadError
from ...plumbing import budget
from ...plumbing.includes import Includes
from ...plumbing.spans import in_place
from ...plumbing.text import marks_per_line, numbers, words_per_line

_COMMENT = re.compile(rb"^[ \t]*\*\*[^\n]*", re.MULTILINE)
_OPTION = re.compile(rb"\s*[A-Za-z]")
_KEYWORD = re.compile(rb"^[ \t]*\*[^\n]*", re.MULTILINE)
_LAST_COMMA = re.compile(rb",[ \t]*$", re.MULTILINE)
_READS_FILES = ("NODE", "ELEMENT")
"""Keywords whose data lines may stand in a file of their own (INPUT)."""


@dataclass(frozen=True, slots=True)
class Place:
    """A line of a file."""

    path: Path
    line: int

    def fail(self, what: str) -> ReadError:
        return ReadError(f"{self.path}, line {self.line}: {what}")


@dataclass(frozen=True, slots=True)
class Lines:
    """Lines that follow one another in a file, blanks and comments among them."""

    path: Path
    first: int
    data: bytes
    start: int = 0  #: the byte of the file where they begin

    def __iter__(self) -> Iterator[tuple[Place, list[str]]]:
        """The fields of each line that is not blank."""
        for number, raw in enumerate(self.data.split(b"\n"), self.first):
            text = raw.decode("utf-8", "replace").strip()
            if text:
                yield Place(self.path, number), split(text)


@dataclass(slots=True)
class Keyword:
    """A keyword line with its data lines."""

    place: Place
    name: str
    options: dict[str, str]
    data: list[Lines] = field(default_factory=list)

    def fail(self, what: str) -> ReadError:
        return self.place.fail(what)

    def refers(self, what: str) -> ReadError:
        """The error of a keyword that refers to something."""
        return self.fail(f"*{self.name} {what}")

    def option(self, name: str, default: str = "") -> str:
        return self.options.get(name, default)

    def rows(self) -> Iterator[tuple[Place, list[str]]]:
        """The place and the fields of each data line."""
        for lines in self.data:
            yield from lines

    def table(self, width: int, kind: type) -> NDArray[Any] | None:
        """The data lines at once, ``(n, width)``, if each has so many numbers between commas, and no more."""
        text = _LAST_COMMA.sub(b"", b"\n".join(lines.data for lines in self.data))
        words = text.replace(b",", b" ")
        n_words, n_commas = words_per_line(words), marks_per_line(text, b",")
        if ((n_words != width) & (n_words > 0) | (n_commas != width - 1) & (n_words + n_commas > 0)).any():
            return None
        try:
            flat = numbers(words, kind)
        except ValueError:
            return None
        return flat.reshape(-1, width) if len(flat) == n_words.sum() else None

    def reals(self) -> list[list[float]]:
        """The numbers of each line; an empty field is 0."""
        return [[real(place, word) for word in words] for place, words in self.rows()]


def real(place: Place, word: str) -> float:
    """A number; 0 for an empty field."""
    try:
        return float(word.replace("D", "e").replace("d", "e")) if word else 0.0
    except ValueError:
        raise place.fail(f"{word[:40]!r} where a number is expected{_parameters(word)}") from None


def integer(place: Place, word: str, default: int | None = None) -> int:
    """An integer, of at most 15 digits; ``default`` for an empty field."""
    if not word and default is not None:
        return default
    try:
        number = int(word)
    except ValueError:
        number = 2**53
    if abs(number) >= 2**53:
        raise place.fail(f"{word[:40]!r} where an integer is expected{_parameters(word)}")
    return number


def _parameters(word: str) -> str:
    """Why ``<L>`` is none."""
    return ": *PARAMETER is not followed, write the values out" if word.startswith("<") else ""


def split(text: str) -> list[str]:
    """Fields between commas, blanks and quotes taken off; a comma within quotes does not part."""
    if '"' not in text:
        return [word.strip() for word in text.split(",")]
    fields, is_open, start = [], False, 0
    for at, letter in enumerate(text):
        if letter == '"':
            is_open = not is_open
        elif letter == "," and not is_open:
            fields.append(text[start:at])
            start = at + 1
    fields.append(text[start:])
    return [word.strip().replace('"', "").strip() for word in fields]


def keywords(path: Path) -> list[Keyword]:
    """All keywords of a file, in order.

    Raises
    ------
    ReadError
        If an included file is missing or outside the folder of the file.
    """
    cards: list[Keyword] = []
    _gather(path, Includes(path), cards)
    return cards


def _gather(path: Path, includes: Includes, cards: list[Keyword]) -> None:
    data, breaks = _lines(path)
    heads = list(_KEYWORD.finditer(data))
    starts = [*(head.start() for head in heads), len(data)]
    _continue(cards, Lines(path, 1, data[: starts[0]]))
    at = 0
    for head, end in zip(heads, starts[1:], strict=True):
        text, at = head[0].decode("utf-8", "replace").strip(), head.end()
        while text.endswith(",") and at < end:  # a keyword line that is continued
            following = data[at + 1 : end].split(b"\n", 1)[0]
            if not _OPTION.match(following):  # data: the comma ends the keyword
                break
            at += 1 + len(following)
            text += following.decode("utf-8", "replace").strip()
        name, *options = split(text[1:])
        pairs = (option.partition("=") for option in options)
        place = Place(path, int(np.searchsorted(breaks, head.start())) + 1)
        keyword = Keyword(place, " ".join(name.upper().split()), {k.strip().upper(): v.strip() for k, _, v in pairs})
        rest = Lines(path, int(np.searchsorted(breaks, at)) + 1, data[at:end], at)
        if keyword.name == "INCLUDE":
            if not keyword.option("INPUT"):
                raise keyword.fail("*INCLUDE without INPUT")
            with includes.opened(keyword.option("INPUT"), keyword.fail) as target:
                _gather(target, includes, cards)
        else:
            cards.append(keyword)
            if keyword.name in _READS_FILES and keyword.option("INPUT"):
                with includes.opened(keyword.option("INPUT"), keyword.fail) as target:
                    keyword.data.append(Lines(target, 1, _lines(target)[0]))
        _continue(cards, rest)


def _continue(cards: list[Keyword], lines: Lines) -> None:
    """Add data lines to the keyword before, if there is one."""
    if cards and lines.data.strip():
        cards[-1].data.append(lines)


def _lines(path: Path) -> tuple[bytes, NDArray[np.int64]]:
    """The bytes of a file, each in its place, comments blank; and where its lines end."""
    data = path.read_bytes()
    budget.draw("text", len(data), path.name)
    data = _COMMENT.sub(lambda match: b" " * len(match[0]), in_place(data))
    return data, np.flatnonzero(np.frombuffer(data, np.uint8) == 10)
