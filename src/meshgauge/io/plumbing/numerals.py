"""How a file holds a number: as characters, in a field of some width or not, or as bytes."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import DTypeLike, NDArray

Reals = NDArray[np.float64]
Ints = NDArray[np.int64]

_FORTRAN = re.compile(rb"([0-9.])([+-][0-9]+)$")
_EXPONENT = re.compile(rb"[0-9.]([eEdD])")
_MOST_DIGITS = 17
_LONGEST = 20
"""Characters of the longest text of a number from 0.1 on: a sign, 0, the point and 17 digits."""

_AT_ONCE = 1 << 16
"""Numbers that are read from their characters at a time."""


class Form(Protocol):
    """How numbers are held at some places of a file."""

    def values(self, data: bytes, starts: Ints, ends: Ints) -> Reals:
        """The numbers that stand between bytes of a file, ``(n,)``; NaN where there is none."""
        ...

    def rounded(self, values: Reals) -> Reals:
        """``(n,)`` numbers as they read back once they are written."""
        ...


@runtime_checkable
class Writing(Form, Protocol):
    """A form whose numbers are bytes in the places of others."""

    def written(self, values: Reals, old: Callable[[int], bytes]) -> list[bytes]:
        """The bytes of each number, in the place of those that stood there, which ``old`` gives for a row."""
        ...


@dataclass(frozen=True, slots=True)
class Raw:
    """Numbers as they are in memory."""

    dtype: DTypeLike

    def values(self, data: bytes, starts: Ints, ends: Ints) -> Reals:
        kind = np.dtype(self.dtype)
        if len(starts) and (np.diff(starts) == kind.itemsize).all():
            return np.frombuffer(data, kind, len(starts), int(starts[0])).astype(np.float64)
        at = starts[:, None] + np.arange(kind.itemsize)
        values: NDArray[Any] = np.frombuffer(data, np.uint8)[at].view(kind).reshape(len(starts))
        return values.astype(np.float64)

    def rounded(self, values: Reals) -> Reals:
        return values.astype(self.dtype).astype(np.float64)

    def encoded(self, values: Reals) -> bytes:
        """All numbers one after another."""
        return values.astype(self.dtype).tobytes()


@dataclass(frozen=True, slots=True)
class Text:
    """Numbers as characters.

    Attributes
    ----------
    most
        Characters that a number may have; None: as many as bring it back to the last bit.
    is_field
        True if a number stands in a field of ``most`` characters, blanks around it.
    exponent
        The letter before an exponent, where the number that stood there had none; "" in fields of Nastran.
    decimals
        If not None, numbers are written as 1.234e-05, with so many decimals (fewer if that is too long).
    n_exponent
        Digits of the exponent, at least.
    is_single
        True if the numbers are read in single precision.
    """

    most: int | None = None
    is_field: bool = False
    exponent: str = "e"
    decimals: int | None = None
    n_exponent: int = 1
    is_single: bool = False

    def values(self, data: bytes, starts: Ints, ends: Ints) -> Reals:
        values = np.empty(len(starts))
        characters = np.frombuffer(data, np.uint8)
        for first in range(0, len(starts), _AT_ONCE):
            some = slice(first, first + _AT_ONCE)
            values[some] = self._values(data, characters, starts[some], ends[some])
        return values

    def _values(self, data: bytes, characters: NDArray[np.uint8], starts: Ints, ends: Ints) -> Reals:
        width = int((ends - starts).max(initial=1))
        at = starts[:, None] + np.arange(width)
        words = np.where(at < ends[:, None], characters[np.minimum(at, len(characters) - 1)], 0).astype(np.uint8)
        try:
            return words.view(f"S{width}").ravel().astype(np.float64)
        except ValueError:  # exponents of Fortran, fields without a number
            spans = zip(starts.tolist(), ends.tolist(), strict=True)
            return np.array([self._value(data[start:end]) for start, end in spans], np.float64)

    def rounded(self, values: Reals) -> Reals:
        if self.is_single:
            return values.astype(np.float32).astype(np.float64)
        if self.most is None:
            return values
        result = values.copy()
        others = np.flatnonzero(~self._is_plain(values))
        result[others] = [float(self._digits(value)[0]) for value in values[others].tolist()]
        return result

    def written(self, values: Reals, old: Callable[[int], bytes]) -> list[bytes]:
        texts: list[bytes] = "\n".join(map(repr, values.tolist())).encode().split(b"\n") if len(values) else []
        for row in range(len(values)) if self.is_field else np.flatnonzero(~self._is_plain(values)).tolist():
            texts[row] = self._written(float(values[row]), old(row))
        return texts

    def _is_plain(self, values: Reals) -> NDArray[np.bool_]:
        """``(n,)`` True where Python's text of a number, which has no exponent, is the format's and fits into it."""
        if self.decimals is not None or self.is_single or not self.exponent or (self.most or _LONGEST) < _LONGEST:
            return np.zeros(len(values), bool)
        sizes = np.abs(values)
        return np.asarray((sizes >= 0.1) & (sizes < 1e15))

    def _written(self, value: float, before: bytes) -> bytes:
        had = _EXPONENT.search(before)
        letter = had[1].decode() if had is not None and self.exponent else self.exponent
        text = self._digits(value)[1].replace("e", letter).encode()
        if not self.is_field:
            return text
        return text.ljust(len(before)) if before[-1:].isspace() else text.rjust(len(before))

    def _value(self, text: bytes) -> float:
        try:
            return float(text)
        except ValueError:
            pass
        text = text.strip()
        if not text:
            return 0.0 if self.is_field else np.nan
        try:
            return float(_FORTRAN.sub(rb"\1e\2", text.replace(b"D", b"e").replace(b"d", b"e")))
        except ValueError:
            return np.nan

    def _digits(self, value: float) -> tuple[str, str]:
        """A number as Python reads it, and as it is written, with ``e`` in the place of the letter."""
        most = self.most or 64
        if self.decimals is None:
            plain = str(np.float32(value)) if self.is_single else repr(value)
            text = self._shown(plain)
            if len(text) <= most:
                return plain, text
        fixed = self._fitting(value, "f", most) if self.decimals is None else None
        scientific = self._fitting(value, "e", most)
        both = [one for one in (fixed, scientific) if one is not None]
        return min(both, key=lambda one: abs(float(one[0]) - value))

    def _fitting(self, value: float, kind: str, most: int) -> tuple[str, str] | None:
        """With as many digits as there is room for; None if there is none."""
        for digits in range(min(_MOST_DIGITS if self.decimals is None else self.decimals, most), -1, -1):
            plain = f"{value:.{digits}{kind}}"
            text = self._shown(plain if "." in plain else plain.replace("e", ".e") if "e" in plain else f"{plain}.")
            if len(text) <= most:
                return plain, text
        return None

    def _shown(self, plain: str) -> str:
        """With a point, and an exponent and zeros before the point as the format has them."""
        mantissa, has_exponent, exponent = plain.partition("e")
        if "." not in mantissa:
            mantissa += ".0" if self.most is None else "."
        if not self.exponent:  # Nastran's fields are short, and need neither the zero nor the letter
            mantissa = re.sub(r"^(-?)0\.(?=\d)", r"\1.", mantissa)
        if not has_exponent:
            return mantissa
        letter = "e" if self.exponent else ""
        sign = "-" if exponent.startswith("-") else "+"
        return f"{mantissa}{letter}{sign}{abs(int(exponent)):0{self.n_exponent}d}"
