"""Rules from text.

    rule       = threshold | nothing | no-worse
    threshold  = METRIC (">=" | ">" | "<=" | "<") NUMBER { clause }
    nothing    = "nothing" WORD { clause }
    no-worse   = "no worse than" FILE [ "within" NUMBER ]
    clause     = "@" (NUMBER "%" | NUMBER ["cells"]) | "for" TYPE {"," TYPE} | "in" REGION {"," REGION}
               | "for" ("elements" | "cells") RANGE {"," RANGE}
    RANGE      = NUMBER | NUMBER "-" NUMBER

Names with blanks or commas stand in quotes. Clauses come in any order, each once.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Literal, NamedTuple, NoReturn

from ..cells import BY_NAME
from ..errors import RuleError
from ..look.bands import POOR_TEXT
from ..look.names import meant
from ..quality.metrics import METRICS
from ..surface_cells import ALL_SHAPES, shape_name
from .rules import Allowance, Level, Nothing, NoWorse, Numbers, Rule, Scope, Threshold
from .words import WORDS

Kind = Literal["string", "number", "comparison", "sign", "word", "end"]

TOKEN = re.compile(
    r"""\s*(?:
    (?P<string>"[^"]*"|'[^']*')
  | (?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?(?![^\s"'@%,<>=≥≤]))
  | (?P<comparison>[<>=!≥≤]+)
  | (?P<sign>[@%,])
  | (?P<word>[^\s"'@%,<>=≥≤]+)
  )""",
    re.VERBOSE,
)
COMPARISONS = {">=": ">=", "≥": ">=", ">": ">", "<=": "<=", "≤": "<=", "<": "<"}

TYPES = tuple(dict.fromkeys((*ALL_SHAPES, *(row.name for row in BY_NAME.values() if row.dimension >= 2))))
"""Names that ``for`` takes."""

NOUNS: dict[str, Literal["element", "cell"]] = {
    "element": "element", "elements": "element", "cell": "cell", "cells": "cell",
}  # fmt: skip
"""Words after ``for`` that numbers follow."""

_RANGE = re.compile(r"(\d{1,18})(?:-(\d{1,18}))?")


class _Token(NamedTuple):
    kind: Kind
    text: str
    start: int
    stop: int


def rule(text: str, *, level: Level | str = Level.FAIL, folder: Path = Path()) -> Rule:
    """A rule from its text: ``jens >= 0.2 @ 1% for tetra``, ``nothing invalid``, ``no worse than before.json``.

    Parameters
    ----------
    text
        See the grammar above.
    level
        ``fail`` or ``warn``.
    folder
        What the file of ``no worse than`` is relative to.

    Raises
    ------
    RuleError
        If the text is no rule; it points at the place.
    """
    rule = replace(_Parser(text).rule(), level=Level(level))
    return replace(rule, folder=folder) if isinstance(rule, NoWorse) else rule


class _Parser:
    def __init__(self, text: str) -> None:
        self.text = text
        self.tokens = self._tokens()
        self.at = 0

    def rule(self) -> Rule:
        first = self.next()
        if first.kind == "end":
            self.fail(first, f"a rule is missing, such as 'jens >= {POOR_TEXT} @ 1%' or 'nothing invalid'")
        if first.text == "nothing":
            return self.nothing()
        if first.text == "no":
            return self.no_worse()
        return self.threshold(first)

    def threshold(self, name: _Token) -> Threshold:
        if name.kind != "word" or name.text not in METRICS:
            known = [*METRICS, "nothing", "no"]
            self.fail(
                name,
                "expected a metric ('meshgauge metrics' lists them), 'nothing' or 'no worse than'"
                + _meant(name.text, known, prefix="verdict_"),
            )
        sign = self.next()
        if sign.text not in COMPARISONS:
            hint = {"=>": "; did you mean '>='?", "=<": "; did you mean '<='?"}.get(sign.text, "")
            self.fail(sign, f"expected >=, >, <= or <, after the metric{hint}")
        bound, value = self.number("a number to compare with")
        allowance, scope = self.clauses(name.text)
        return Threshold(name.text, COMPARISONS[sign.text], value, bound.text, allowance, scope)

    def nothing(self) -> Nothing:
        words = [self.next()]
        if (words[0].text, self.peek().text) == ("invalid", "inside"):
            words.append(self.next())
        name = " ".join(word.text for word in words)
        if name not in WORDS:
            self.fail(words[0], f"'nothing' is followed by one of {', '.join(WORDS)}{_meant(name, WORDS)}")
        allowance, scope = self.clauses(None)
        return Nothing(WORDS[name], allowance, scope)

    def no_worse(self) -> NoWorse:
        for expected in ("worse", "than"):
            word = self.next()
            if word.text != expected:
                self.fail(word, "expected 'no worse than FILE'; for no cells of a kind write 'nothing invalid'")
        file = self.next()
        if file.kind not in ("word", "string", "number") or not _name(file):
            self.fail(file, "expected the file of a stored report, as --write-baseline or 'report --json' give it")
        margin, text = 0.0, ""
        after = self.next()
        if after.text == "within":
            token, margin = self.number("by how much it may be worse, such as 0.01")
            if margin < 0:
                self.fail(token, "a margin is 0 or more")
            text = token.text
            after = self.next()
        if after.kind != "end":
            self.fail(after, "expected 'within NUMBER' or the end of the rule")
        return NoWorse(_name(file), margin, text)

    def clauses(self, metric: str | None) -> tuple[Allowance, Scope]:
        """What follows a condition, up to the end."""
        allowance: Allowance | None = None
        types: tuple[str, ...] = ()
        regions: tuple[str, ...] = ()
        numbers: Numbers | None = None
        while (token := self.next()).kind != "end":
            if token.text == "@" and allowance is None:
                allowance = self.allowance()
            elif token.text == "for" and self.peek().text in NOUNS and numbers is None:
                numbers = self.numbers(NOUNS[self.next().text])
            elif token.text == "for" and self.peek().text not in NOUNS and not types:
                types = tuple(self.type_name(name, metric) for name in self.names("the name of a cell type"))
            elif token.text == "in" and not regions:
                regions = tuple(_name(name) for name in self.names("the name of a region"))
            elif token.text in ("@", "for", "in"):
                self.fail(token, f"'{token.text}' is there twice")
            else:
                self.fail(token, "expected '@ 1%' (how many cells may break the rule), 'for TYPE' or 'in REGION'")
        return allowance or Allowance(), Scope(types, regions, numbers)

    def allowance(self) -> Allowance:
        token, value = self.number("a share such as 1%, or a number of cells")
        if value < 0:
            self.fail(token, "expected 0 or more")
        exact = Fraction(token.text)
        if self.peek().text == "%":
            self.next()
            if exact > 100:
                self.fail(token, "a share is at most 100%")
            return Allowance(f"{token.text}%", exact / 100, is_share=True)
        if self.peek().text in ("cell", "cells"):
            self.next()
        if exact.denominator != 1:
            self.fail(token, f"no whole number of cells; for a share write {100 * value:g}%")
        return Allowance(f"{int(exact)} cell{'' if exact == 1 else 's'}", exact)

    def numbers(self, noun: Literal["element", "cell"]) -> Numbers:
        """Numbers and ranges of them."""
        ranges = []
        for token in self.names("a number or a range, such as 7000 or 7000-7100"):
            match = _RANGE.fullmatch(token.text)
            if match is None or int(match[2] or match[1]) < int(match[1]):
                self.fail(token, "expected a number or a range, such as 7000 or 7000-7100")
            ranges.append((int(match[1]), int(match[2] or match[1])))
        return Numbers(noun, tuple(ranges))

    def names(self, what: str) -> list[_Token]:
        """One or more names with commas between."""
        tokens = []
        while True:
            token = self.next()
            if token.kind not in ("word", "string", "number") or not _name(token):
                self.fail(token, f"expected {what}")
            tokens.append(token)
            if self.peek().text != ",":
                return tokens
            self.next()

    def type_name(self, token: _Token, metric: str | None) -> str:
        name = _name(token)
        if name not in TYPES:
            self.fail(token, f"expected the name of a cell type{_meant(name, TYPES)}; there are: {_few(TYPES)}")
        if (
            metric is not None
            and metric != "jens"
            and not METRICS[metric].is_defined_for(shape_name(BY_NAME[name].vtk_id) or name)
        ):
            defined = METRICS[metric].known_shapes
            self.fail(token, f"{metric} is not defined for {name}; it is for {', '.join(defined)}")
        return name

    def number(self, what: str) -> tuple[_Token, float]:
        token = self.next()
        if token.kind != "number":
            self.fail(token, f"expected {what}")
        value = float(token.text)
        if not math.isfinite(value):
            self.fail(token, "the number is too large")
        return token, value

    def peek(self) -> _Token:
        return self.tokens[self.at]

    def next(self) -> _Token:
        token = self.tokens[self.at]
        self.at += token.kind != "end"
        return token

    def fail(self, token: _Token, reason: str) -> NoReturn:
        raise RuleError(reason, self.text, token.start, token.stop)

    def _tokens(self) -> list[_Token]:
        tokens: list[_Token] = []
        at, end = 0, len(self.text.rstrip())
        while at < end:
            match = TOKEN.match(self.text, at)
            if match is None:
                at += len(self.text[at:]) - len(self.text[at:].lstrip())
                raise RuleError("a quotation mark without its other", self.text, at, end)
            kind: Kind = match.lastgroup  # type: ignore[assignment]  # the groups are named so
            tokens.append(_Token(kind, match[kind], match.start(kind), match.end(kind)))
            at = match.end()
        return [*tokens, _Token("end", "", end, end)]


def _name(token: _Token) -> str:
    return token.text[1:-1] if token.kind == "string" else token.text


def _meant(name: str, known: Iterable[str], prefix: str = "") -> str:
    """A question, if something known looks much like the name."""
    known = list(known)
    if prefix and prefix + name in known:
        return f"; did you mean '{prefix}{name}'?"
    return meant(name, known)


def _few(names: Iterable[str], most: int = 6) -> str:
    names = list(names)
    return ", ".join(names[:most]) + (", ..." if len(names) > most else "")
