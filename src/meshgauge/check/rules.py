"""Rules of the gate, as records. `grammar` makes them from text."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from fractions import Fraction
from pathlib import Path
from typing import Literal

from .words import Word


class Level(StrEnum):
    """What becomes of a mesh that breaks a rule."""

    FAIL = "fail"
    WARN = "warn"


@dataclass(frozen=True, slots=True)
class Allowance:
    """How many of the cells may break a rule: a number, or a share of those the rule is about."""

    text: str = ""  #: as written: ``1%``, ``5``
    amount: Fraction = Fraction(0)  #: cells, or the share, 0 to 1
    is_share: bool = False

    def cells(self, n_cells: int) -> int:
        """The number of cells allowed out of so many. Exact: 1 % of 300 is 3, of 299 it is 2."""
        return int(self.amount * n_cells) if self.is_share else int(self.amount)

    def __str__(self) -> str:
        return f" @ {self.text}" if self.text else ""


@dataclass(frozen=True, slots=True)
class Numbers:
    """Cells by number: by those of the file, or by position from 0."""

    noun: Literal["element", "cell"]  #: ``element``: the file's own numbers; ``cell``: positions
    ranges: tuple[tuple[int, int], ...]  #: first and last of each

    def __str__(self) -> str:
        ranges = [str(a) if a == b else f"{a}-{b}" for a, b in self.ranges]
        return f"{self.noun}{'' if len(ranges) == 1 and '-' not in ranges[0] else 's'} {', '.join(ranges)}"


@dataclass(frozen=True, slots=True)
class Scope:
    """Which solid cells a rule is about: all, or those of some types, regions and numbers."""

    types: tuple[str, ...] = ()  #: names of shapes (every type measured with it) or of types; none: all
    regions: tuple[str, ...] = ()  #: names of regions, or patterns such as ``inlet*``; none: all
    numbers: Numbers | None = None  #: None: all

    def __str__(self) -> str:
        numbers = f" for {self.numbers}" if self.numbers is not None else ""
        types = f" for {', '.join(self.types)}" if self.types else ""
        regions = f" in {', '.join(map(_quote, self.regions))}" if self.regions else ""
        return types + numbers + regions


@dataclass(frozen=True, slots=True)
class Threshold:
    """``METRIC >= BOUND @ SHARE for TYPES in REGIONS``: a bound that the values of the cells keep."""

    metric: str
    comparison: str  #: ``>=``, ``>``, ``<=`` or ``<``
    bound: float
    bound_text: str  #: as written
    allowance: Allowance = Allowance()
    scope: Scope = Scope()
    level: Level = field(default=Level.FAIL, kw_only=True)

    def __str__(self) -> str:
        return f"{self.metric} {self.comparison} {self.bound_text}{self.allowance}{self.scope}"


@dataclass(frozen=True, slots=True)
class Nothing:
    """``nothing WORD @ SHARE for TYPES in REGIONS``: no cell is of a status."""

    word: Word
    allowance: Allowance = Allowance()
    scope: Scope = Scope()
    level: Level = field(default=Level.FAIL, kw_only=True)

    def __str__(self) -> str:
        return f"nothing {self.word.name}{self.allowance}{self.scope}"


@dataclass(frozen=True, slots=True)
class NoWorse:
    """``no worse than FILE within MARGIN``: J_ENS is as good as in a stored report."""

    file: str  #: as written
    margin: float = 0.0  #: by which values and shares may be worse
    margin_text: str = ""  #: as written
    folder: Path = Path()  #: where ``file`` is if it is relative
    level: Level = field(default=Level.FAIL, kw_only=True)

    @property
    def path(self) -> Path:
        """The stored report."""
        return self.folder / self.file

    def __str__(self) -> str:
        return f"no worse than {_quote(self.file)}{f' within {self.margin_text}' if self.margin_text else ''}"


Rule = Threshold | Nothing | NoWorse


def _quote(name: str) -> str:
    """A name as a rule has it: in quotes if it is not one word."""
    if name and not any(c.isspace() or c in "\"',@%<>=" for c in name):
        return name
    return f"'{name}'" if '"' in name else f'"{name}"'
