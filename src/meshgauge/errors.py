"""Exceptions. The library raises these; only the command line prints and exits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

T = TypeVar("T")

MADE_BY = {
    "Mesh": "meshgauge.read makes one of a file, from_pyvista and from_meshio of what these hold",
    "Quality": "meshgauge.measure makes one of a mesh",
}
"""How a user comes by what functions take."""


class MeshgaugeError(Exception):
    """Base of every exception that meshgauge raises on purpose."""


class MeshError(MeshgaugeError, ValueError):
    """Arrays that do not make a mesh: index out of range, wrong node count, wrong shape, no cells."""


class ReadError(MeshgaugeError):
    """A file could not be read. The message names the file and says what to do."""


class WriteError(MeshgaugeError):
    """A file could not be written; nothing was left half-written and no input was touched."""


class ResourceError(MeshgaugeError, MemoryError):
    """Too little memory is free, or allowed, for what is asked."""


class MetricError(MeshgaugeError, ValueError):
    """No such metric, or it is not defined for what was asked."""


class OptionError(MeshgaugeError, ValueError):
    """An option has a value that it cannot have: no thread, no bin, summaries of two metrics to be merged."""


class RuleError(MeshgaugeError, ValueError):
    """A rule of the gate that cannot be understood; knows where in the text it goes wrong.

    Attributes
    ----------
    reason
        What is wrong there, and what was expected.
    rule
        The text of the rule.
    start, stop
        The part of it that is meant: ``rule[start:stop]``; empty at the end of the text.
    """

    def __init__(self, reason: str, rule: str, start: int, stop: int) -> None:
        at = f"at {rule[start:stop]!r}" if start < stop else "at its end"
        super().__init__(f"rule {rule!r}, {at}: {reason}")
        self.reason = reason
        self.rule = rule
        self.start = start
        self.stop = stop

    @property
    def pointed(self) -> str:
        """Two lines: the rule, and carets below the part that is meant."""
        return f"{self.rule}\n{' ' * self.start}{'^' * max(self.stop - self.start, 1)}"


class BaselineError(MeshgaugeError):
    """A stored report that cannot be read, or has nothing to compare with."""


@dataclass(frozen=True, slots=True)
class FailedFile:
    """A file that could not be read or measured, and why: what a report of many files has in its place."""

    path: str
    reason: str


def expect(value: object, kind: type[T]) -> T:
    """The value, if it is of that kind; raises `MeshError`, which says how one is made, if it is not."""
    if not isinstance(value, kind):
        raise MeshError(f"a {type(value).__name__} is no {kind.__name__}: {MADE_BY[kind.__name__]}")
    return value
