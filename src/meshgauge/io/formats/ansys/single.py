"""Nodes and elements of ANSYS given one by one: the commands N, E, EN, EMORE and CDWRITE's unblocked form of them."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ....errors import ReadError
from ...plumbing.text import Text

_RELEASE = re.compile(r"R\d+\.\d+$", re.IGNORECASE)
_ATTRIBUTES = ("MAT", "TYPE", "REAL", "SECNUM")
_MOST = 20  # nodes of an element


@dataclass(slots=True)
class Singles:
    """What has been given one by one so far, and the attributes that the next element gets."""

    labels: list[int] = field(default_factory=list)
    points: list[tuple[float, float, float]] = field(default_factory=list)
    heads: list[list[int]] = field(default_factory=list)  # material, type, section, number, of its nodes
    nodes: list[list[int]] = field(default_factory=list)
    now: dict[str, int] = field(default_factory=lambda: dict.fromkeys(_ATTRIBUTES, 1))
    system: str = "0"
    last: int = 0

    def take(self, text: Text, words: list[str]) -> None:
        """A command, split at its commas; one that is none of these is passed over."""
        match words[0].upper():
            case "CSYS":
                self.system = words[1] if len(words) > 1 and words[1] else "0"
            case "N" if len(words) > 1:
                self._point(text, words[1:])
            case "E" | "EN" if len(words) > 1:
                self._element(text, words[1:], has_number=words[0].upper() == "EN")
            case "EMORE" if self.nodes:
                self._more(text, words[1:])
            case name if name in _ATTRIBUTES and len(words) > 1:
                self.now[name] = _integer(text, words[1], 1)

    def _point(self, text: Text, words: list[str]) -> None:
        if _RELEASE.match(words[0]):
            if len(words) < 3 or words[1].upper() != "LOC" or words[2] == "-1":
                return  # its rotation, or the end
            words = [words[2], *words[5:]]
        elif self.system not in ("0", ""):
            raise text.fail(f"a node in the coordinate system {self.system}, only the global one is read")
        x = [_real(text, word) for word in (*words[1:4], "", "", "")[:3]]
        self.labels.append(_integer(text, words[0], len(self.labels) + 1))
        self.points.append((x[0], x[1], x[2]))

    def _element(self, text: Text, words: list[str], *, has_number: bool) -> None:
        if _RELEASE.match(words[0]):
            if len(words) < 3 or words[2] == "-1":
                return
            if words[1].upper() == "NODE" and self.nodes:
                self._more(text, words[2:])
                return
            numbers = [_integer(text, word, 0) for word in (*words[2:], *[""] * 7)[:7]]
            _, material, kind, _, section, _, number = numbers
            self.heads.append([material, kind, section, number, 0])
            self.nodes.append([])
            self.last = max(self.last, number)
            return
        number = _integer(text, words[0], 0) if has_number else self.last + 1
        self.last = max(self.last, number)
        self.heads.append([self.now["MAT"], self.now["TYPE"], self.now["SECNUM"], number, 0])
        self.nodes.append([])
        self._more(text, words[1:] if has_number else words)

    def _more(self, text: Text, words: list[str]) -> None:
        own = self.nodes[-1]
        own += [_integer(text, word, 0) for word in words]
        while own and own[-1] == 0:
            own.pop()
        if len(own) > _MOST:
            raise text.fail(f"element {self.heads[-1][3]} has {len(own)} nodes, expected 1 to {_MOST}")
        self.heads[-1][4] = len(own)

    def arrays(self) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
        """Heads ``(n, 5)``, nodes ``(n, 20)``, labels and points."""
        table = np.zeros((len(self.nodes), _MOST), np.int64)
        for row, own in zip(table, self.nodes, strict=True):
            row[: len(own)] = own
        return (
            np.array(self.heads, np.int64).reshape(-1, 5),
            table,
            np.array(self.labels, np.int64),
            np.array(self.points, np.float64).reshape(-1, 3),
        )


def _integer(text: Text, word: str, default: int) -> int:
    if not word:
        return default
    try:
        number = float(word)  # 1. is written for 1 as well
    except ValueError:
        number = 0.5
    if number != int(number) if np.isfinite(number) else True:
        raise _odd(text, word, "an integer")
    if abs(number) >= 2**53:
        raise _odd(text, word, "a smaller integer")
    return int(number)


def _real(text: Text, word: str) -> float:
    try:
        return float(word.lower().replace("d", "e")) if word else 0.0
    except ValueError:
        raise _odd(text, word, "a number") from None


def _odd(text: Text, word: str, expected: str) -> ReadError:
    return text.fail(f"{word[:40]!r} where {expected} is expected")
