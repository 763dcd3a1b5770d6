"""The cards of a Nastran bulk data file: fields of 8 or 16 columns or between commas, continued, with includes."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ....errors import ReadError
from ...plumbing import budget
from ...plumbing.includes import Includes

_BEGIN = re.compile(r"BEGIN\s+(?:BULK\b\s*)?(?:(SUPER|AUXMODEL|MODULE)\s*=\s*(\w+))?", re.IGNORECASE)
_PER_LINE, _WIDTH, _WIDE = 8, 8, 16
_EXPONENT = re.compile(r"(?<=[\d.])([+-]\d+)$")  # 1.5-3 is 1.5e-3


@dataclass(slots=True)
class Card:
    """One card: its name in capitals, and the fields after it, blanks taken off."""

    path: Path
    line: int
    name: str
    fields: list[str]

    def fail(self, what: str) -> ReadError:
        return ReadError(f"{self.path}, line {self.line}: {self.name} {what}")

    def text(self, place: int) -> str:
        """A field, counted from 0 behind the name; empty where the card ends before."""
        return self.fields[place] if place < len(self.fields) else ""

    def integer(self, place: int, default: int | None = None) -> int:
        text = self.text(place)
        if not text and default is not None:
            return default
        try:
            return int(text)
        except ValueError:
            raise self.fail(f"has {text!r} in field {place + 1}, where an integer is expected") from None

    def real(self, place: int) -> float:
        text = self.text(place)
        if not text:
            return 0.0
        try:
            return float(text)
        except ValueError:
            pass
        try:
            return float(_EXPONENT.sub(r"e\1", text.lower().replace("d", "e")))
        except ValueError:
            raise self.fail(f"has {text!r} in field {place + 1}, where a number is expected") from None


def cards(path: Path) -> Iterator[Card]:
    """The cards of the bulk data, those of included files in their place.

    A card named ``BEGIN`` comes before the bulk data of a superelement; its field is the number of that.

    Raises
    ------
    ReadError
        If an included file is missing or outside the folder of the file.
    """
    card = None
    for file, number, raw in _bulk(path):
        line = raw.partition("$")[0].rstrip() if "$" in raw else raw.rstrip()
        if not line:
            continue
        begin = _BEGIN.match(line) if line[:5].upper() == "BEGIN" else None
        name, fields = _split(line) if begin is None else ("BEGIN", [begin[2] or ""])
        if name[:1] in ("", "+", "*"):  # a continuation: its first field is a mark, or blank
            if card is not None:
                card.fields += fields
            continue
        if card is not None:
            yield card
        card = Card(file, number, name.rstrip("*").upper(), fields)
    if card is not None:
        yield card


def _bulk(path: Path) -> Iterator[tuple[Path, int, str]]:
    """Lines from BEGIN BULK, or from the first if there is none, to ENDDATA."""
    lines = list(_lines(path, Includes(path)))
    first = next((n for n, (*_, text) in enumerate(lines) if _BEGIN.match(text.lstrip())), 0)
    for file, number, text in lines[first:]:
        if text[:7].upper() == "ENDDATA":
            return
        yield file, number, text


def _lines(path: Path, includes: Includes) -> Iterator[tuple[Path, int, str]]:
    data = path.read_bytes()
    budget.draw("text", len(data), path.name)
    lines = iter(enumerate(data.decode("utf-8", "replace").splitlines(), 1))
    for number, text in lines:
        if text[:7].upper() != "INCLUDE":
            yield path, number, text
            continue
        name = text[7:].strip()
        while name.count("'") == 1 or name.count('"') == 1:  # a name may go over several lines
            following = next(lines, None)
            if following is None:
                break
            name += following[1].strip()

        def fail(what: str, number: int = number) -> ReadError:
            return ReadError(f"{path}, line {number}: {what}")

        with includes.opened(name.strip(" '\""), fail) as target:
            yield from _lines(target, includes)


def _split(line: str) -> tuple[str, list[str]]:
    """Name and fields of one line; the last field of a line, the mark of its continuation, is left out."""
    if "," in line:
        name, *fields = (word.strip() for word in line.split(","))
        fields = fields[: _PER_LINE // 2 if "*" in name else _PER_LINE]
        return name, fields
    if "\t" in line:
        line = line.expandtabs(_WIDTH)
    name = line[:_WIDTH].strip()
    width, n = (_WIDE, _PER_LINE // 2) if "*" in name else (_WIDTH, _PER_LINE)
    end = _WIDTH + n * width
    line = line[:end]
    fields = [line[at : at + width].strip() for at in range(_WIDTH, len(line), width)]
    return name, fields + [""] * (n - len(fields))
