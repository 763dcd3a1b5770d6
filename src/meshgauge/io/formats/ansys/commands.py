"""The commands of an ANSYS input: parted at ``$``, with simple parameters, those of other files in their place."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ....errors import ReadError
from ...plumbing.includes import Includes
from ...plumbing.text import Text

_LONGEST = 200  # characters of an expression
_OPENS = ("*DO", "*DOWHILE", "*IF")
_CLOSES = ("*ENDDO", "*ENDIF")
_OPERATORS: dict[type[ast.AST], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}


@dataclass(slots=True)
class Parameters:
    """Names that stand for numbers; None for one whose value is not followed."""

    values: dict[str, float | None] = field(default_factory=dict)

    def set(self, name: str, word: str) -> None:
        """Without a value the parameter is deleted, as the first lines of every archive do."""
        if word.strip():
            self.values[name.strip().upper()] = self.value(word.strip())
        else:
            self.values.pop(name.strip().upper(), None)

    def value(self, word: str) -> float | None:
        """A number, a parameter, or an expression of them; None if it is none of these."""
        if not 0 < len(word) <= _LONGEST:
            return None
        try:
            if word[0] in "+-.0123456789":
                number = float(word.lower().replace("d", "e"))
                return number if np.isfinite(number) else None
        except ValueError:
            pass  # an expression that begins with a number
        try:
            value = self._evaluated(ast.parse(word.strip(), mode="eval").body)
        except (SyntaxError, ValueError, ArithmeticError, TypeError, RecursionError):
            return None
        return value if value is not None and np.isfinite(value) else None

    def _evaluated(self, node: ast.AST) -> float | None:
        if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
            return float(node.value)
        if isinstance(node, ast.Name):
            return self.values.get(node.id.upper())
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.UAdd | ast.USub):
            value = self._evaluated(node.operand)
            return None if value is None else -value if isinstance(node.op, ast.USub) else value
        if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
            a, b = self._evaluated(node.left), self._evaluated(node.right)
            if a is None or b is None:
                return None
            value = _OPERATORS[type(node.op)](a, b)
            return value if isinstance(value, float) else None
        return None


@dataclass(slots=True)
class Command:
    """A command with its fields, the name first and in capitals; numbers in fields may be parameters."""

    text: Text
    words: list[str]
    parameters: Parameters
    inside: str  #: the loop or condition that it stands in, for messages; empty outside

    @property
    def name(self) -> str:
        return self.words[0]

    def fail(self, what: str) -> ReadError:
        return self.text.fail(what)

    def refers(self, what: str) -> ReadError:
        """The error of a command that refers to something."""
        return self.fail(f"{self.name} {what}")

    def word(self, place: int) -> str:
        """A field, counted from 1 behind the name; empty where the command ends before."""
        return self.words[place] if place < len(self.words) else ""

    def integer(self, place: int, default: int = 0) -> int:
        word = self.word(place)
        if not word:
            return default
        value = self.parameters.value(word)
        if value is None or value != int(value):
            raise self._odd(word, "an integer")
        if abs(value) >= 2**53:
            raise self._odd(word, "a smaller integer")
        return int(value)

    def real(self, place: int) -> float:
        word = self.word(place)
        value = self.parameters.value(word) if word else 0.0
        if value is None:
            raise self._odd(word, "a number")
        return value

    def _odd(self, word: str, expected: str) -> ReadError:
        return self.fail(f"{self.name}: {word[:40]!r} where {expected} is expected")


def commands(path: Path) -> Iterator[Command]:
    """The commands of a file; a block of numbers that follows one is for the caller to read from ``command.text``.

    Raises
    ------
    ReadError
        If a file that is read in is missing or outside the folder.
    """
    yield from _commands(path, Includes(path), Parameters())


def _commands(path: Path, includes: Includes, parameters: Parameters) -> Iterator[Command]:
    text = Text(path, path.read_bytes())
    open_blocks: list[str] = []
    while line := text.line():
        for part in _parts(line.decode("utf-8", "replace")):
            words = [word.strip() for word in part.split(",")]
            words[0] = words[0].upper()
            name = words[0]
            if name == "/EOF":
                return
            if name == "*CREATE":  # a macro is not run where it is written
                while (inner := text.line()) and not inner.upper().startswith(b"*END"):
                    pass
            elif name in _OPENS and (name != "*IF" or words[-1].upper() == "THEN"):
                open_blocks.append(f"{name} of line {text.line_number}")
            elif name in _CLOSES:
                del open_blocks[-1:]
            elif name == "*SET" and len(words) > 2:
                parameters.set(words[1], words[2])
            elif name in ("*GET", "*DIM", "*VGET", "*ASK") and len(words) > 1:
                parameters.values[words[1].upper()] = None
            elif "=" in name and "," not in part and name.partition("=")[0].strip().isidentifier():
                parameters.set(*part.split("=", 1))
            elif name in ("/INPUT", "/INP", "CDREAD"):
                at = 2 if name == "CDREAD" else 1
                command = Command(text, words, parameters, open_blocks[-1] if open_blocks else "")
                if command.inside:
                    raise command.fail(f"{name} in {command.inside}: loops and conditions are not followed")
                extension = command.word(at + 1).strip("'\"")
                target = command.word(at).strip("'\"") + (f".{extension}" if extension else "")
                with includes.opened(target, command.fail) as other:
                    yield from _commands(other, includes, parameters)
            else:
                yield Command(text, words, parameters, open_blocks[-1] if open_blocks else "")


def _parts(line: str) -> list[str]:
    """The commands of a line; what stands behind ``!`` is a comment, and so are /COM, /TITLE and C***."""
    start = line.lstrip()[:6].upper()
    if start.startswith(("/COM", "/TITLE", "/TITL", "C***", "/STITL")):
        return []
    if "'" in line and "$" in line.partition("!")[0]:
        return [line.partition("!")[0]]
    return [part.strip() for part in line.partition("!")[0].split("$") if part.strip()]
