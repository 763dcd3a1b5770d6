"""Where a Nastran deck, and what it includes, hold the coordinates of GRID points."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...plumbing.numerals import Form, Reals, Text
from ...plumbing.patch import Places
from .cards import Card, cards
from .systems import KINDS as SYSTEMS
from .systems import System, Systems

_SMALL, _LARGE = 8, 16
_NO_SPAN = (-1, -1)

Span = tuple[int, int]


@dataclass(frozen=True, slots=True)
class _Grid(Text):
    """Fields of a GRID card in some system; narrow ones become those of a GRID* where they do not do."""

    system: System | None = None

    @property
    def wide(self) -> Text:
        return Text(most=max(_LARGE, self.most or 0), exponent="")

    def widened(self, line: bytes, point: Reals, changes: NDArray[np.bool_]) -> bytes:
        """The line as two; the characters of what does not change stay, and so does a comment."""
        text, mark, comment = line.partition(b"$")
        end = line[len(line.rstrip(b"\r\n")) :]
        is_free = b"," in text
        fields = _split(text)
        for axis in np.flatnonzero(changes).tolist():
            fields[2 + axis] = self.wide.written(point[axis : axis + 1], lambda _: b"")[0]
        first, second = fields[:4], fields[4:]
        if is_free:
            lines = [b",".join([b"GRID*", *first]), b",".join([b"*", *second])]
        else:
            lines = [b"GRID*".ljust(_SMALL) + b"".join(one.rjust(_LARGE) for one in first)]
            lines.append(b"*".ljust(_SMALL) + b"".join(one.rjust(_LARGE) for one in second))
        rest = (b" " + mark + comment.rstrip(b"\r\n")) if mark else b""
        return lines[0] + (b"\r\n" if end == b"\r\n" else b"\n") + lines[1] + rest + end


def _split(text: bytes) -> list[bytes]:
    """The fields behind the name, without blanks at the end; at least the three coordinates."""
    text = text.rstrip()
    if b"," in text:
        fields = [word.strip() for word in text.split(b",")[1:]]
    else:
        fields = [text[at : at + _SMALL].strip() for at in range(_SMALL, len(text), _SMALL)]
    return fields + [b""] * (5 - len(fields))


def places(path: Path) -> Places:
    """Of points that define no system: a field keeps its width."""
    grids: dict[Path, list[Card]] = defaultdict(list)
    given: dict[int, tuple[Card, int]] = {}
    fixed: set[int] = set()
    usual, has_parts = 0, False
    for card in cards(path):
        if card.name == "GRID":
            grids[card.path].append(card)
        elif card.name == "GRDSET":
            usual = card.integer(1, 0)
        elif card.name == "BEGIN":
            has_parts |= bool(card.text(0))
        elif card.name in SYSTEMS:
            at = (0, 4) if card.name.startswith("CORD1") else (0,)
            given.update({card.integer(place): (card, place) for place in at if card.text(place)})
            fixed.update(card.integer(place + k) for place in at for k in (1, 2, 3) if len(at) > 1 and card.text(place))
    points = {card.integer(0): card for own in grids.values() for card in own}

    def point(label: int, asks: Card) -> Reals:
        if label not in points:
            raise asks.fail(f"refers to point {label}, which does not exist")
        card = points[label]
        own = np.array([[card.real(2 + k) for k in range(3)]])
        return np.asarray(systems.of(card.integer(1, usual), asks).basic(own)[0])

    systems = Systems(given, point)
    parts = []
    for file, own in grids.items():
        numbers = [card.integer(1, usual) for card in own]
        # Systems of superelements may have the numbers of others.
        kept = [card for card, number in zip(own, numbers, strict=True) if number >= 0 and not (number and has_parts)]
        of_cards = [systems.of(number, card) if (number := card.integer(1, usual)) else None for card in kept]
        parts.append(_of_file(file, kept, of_cards))
    whole = Places.joined(parts)
    return whole if whole.labels is None else whole.without(np.isin(whole.labels, list(fixed)))


def _of_file(path: Path, grids: list[Card], systems: list[System | None]) -> Places:
    lines = path.read_bytes().splitlines(keepends=True)
    begins = np.cumsum([0, *map(len, lines)]).tolist()
    forms: dict[Form, int] = {}
    spans, kinds, whole = [], [], []
    for card, system in zip(grids, systems, strict=True):
        form, own = _fields(lines, begins, card.line - 1)
        form = replace(form, system=system)
        spans.append(own)
        whole.append(_line(lines, begins, card.line - 1))
        kinds.append(forms.setdefault(form, len(forms)))
    table = np.array(spans, np.int64).reshape(-1, 3, 2)
    return Places(
        tuple((path, form) for form in forms),
        table[:, :, 0],
        table[:, :, 1],
        np.array(kinds, np.int64),
        np.array([card.integer(0) for card in grids], np.int64),
        lines=np.array(whole, np.int64).reshape(-1, 2),
    )


def _line(lines: list[bytes], begins: list[int], at: int) -> Span:
    """The line of a GRID card in narrow fields that stands in it as a whole, its end included."""
    text = lines[at].partition(b"$")[0]
    following = lines[after][:_SMALL].strip() if (after := _next(lines, at)) < len(lines) else b"ENDDATA"
    goes_on = not following or following[:1] in b"+*,"
    if b"*" in text[:_SMALL].partition(b",")[0] or b"\t" in text or goes_on or len(_split(text)) > 8:
        return _NO_SPAN
    return begins[at], begins[at] + len(lines[at])


def _fields(lines: list[bytes], begins: list[int], at: int) -> tuple[_Grid, list[Span]]:
    """The three fields of a GRID, which may go on in the next line that is not a comment; and how numbers are held."""
    line = lines[at].partition(b"$")[0].rstrip()
    is_large = b"*" in line[:_SMALL].partition(b",")[0]
    width = _LARGE if is_large else _SMALL
    if b"," in line:
        return _free(lines, begins, at, width)
    own = [_field(lines, begins, at, 2 + k, width) for k in range(2 if is_large else 3)]
    if is_large:
        own.append(_field(lines, begins, _next(lines, at), 0, width))
    return _Grid(most=width, is_field=True, exponent=""), own


def _field(lines: list[bytes], begins: list[int], at: int, place: int, width: int) -> Span:
    """A field of columns; none if the line ends before, or columns are those of tabs."""
    if at >= len(lines):
        return _NO_SPAN
    line = lines[at].partition(b"$")[0].rstrip(b"\r\n")
    start = _SMALL + place * width
    if b"\t" in line or b"," in line or len(line) < start + width:
        text = line[start:]
        if b"\t" in line or b"," in line or not text.strip():
            return _NO_SPAN
        return begins[at] + start, begins[at] + len(line)  # the last field of a line need not be filled
    return begins[at] + start, begins[at] + start + width


def _free(lines: list[bytes], begins: list[int], at: int, width: int) -> tuple[_Grid, list[Span]]:
    """Fields between commas."""
    words = _words(lines[at], begins[at])
    own = words[3 : 5 if width == _LARGE else 6]
    if width == _LARGE and (following := _next(lines, at)) < len(lines):
        own += _words(lines[following], begins[following])[1:2]
    own = [*own, *[_NO_SPAN] * 3][:3]
    longest = max(end - start for start, end in own)
    return _Grid(most=max(width, longest), exponent=""), own


def _words(line: bytes, begin: int) -> list[Span]:
    spans, at = [], begin
    for word in line.partition(b"$")[0].rstrip().split(b","):
        start = at + len(word) - len(word.lstrip())
        spans.append((start, start + len(word.strip())) if word.strip() else _NO_SPAN)
        at += len(word) + 1
    return spans


def _next(lines: list[bytes], at: int) -> int:
    """The next line that holds something."""
    at += 1
    while at < len(lines) and not lines[at].partition(b"$")[0].strip():
        at += 1
    return at


def fields_of(lines: list[bytes], begins: list[int], at: int, n: int) -> list[Span]:
    """The first ``n`` fields of a card behind its name, those of lines that continue it among them."""
    spans: list[Span] = []
    while len(spans) < n and at < len(lines):
        line = lines[at].partition(b"$")[0].rstrip()
        is_large = b"*" in line[:_SMALL].partition(b",")[0]
        width, each = (_LARGE, 4) if is_large else (_SMALL, 8)
        if b"," in line:
            own = _words(lines[at], begins[at])[1 : 1 + each]
            spans += [*own, *[_NO_SPAN] * each][:each]
        else:
            spans += [_field(lines, begins, at, place, width) for place in range(each)]
        at = _next(lines, at)
    return spans[:n]
