"""How a file holds a number: as characters, in a field of some width or not, or as bytes."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import DTypeLike, NDArray

Reals = NDArray[np.float64]
Ints = NDArray[np.int64]

_FORTRAN = re.compile(rb"([0-9.])([+-][0-9]+)$")
_EXPONENT = re.compile(rb"[0-9.]([eEdD])")
_MOST_DIGITS = 17


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

    def written(self, values: Reals, old: Iterable[bytes]) -> Iterator[bytes]:
        """The bytes of each number, in the place of those that stood there."""
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
        spans = zip(starts.tolist(), ends.tolist(), strict=True)
        return np.array([self._value(data[start:end]) for start, end in spans], np.float64)

    def rounded(self, values: Reals) -> Reals:
        if self.is_single:
            return values.astype(np.float32).astype(np.float64)
        if self.most is None:
            return values
        return np.array([float(self._digits(value)[0]) for value in values.tolist()], np.float64)

    def written(self, values: Reals, old: Iterable[bytes]) -> Iterator[bytes]:
        for value, before in zip(values.tolist(), old, strict=True):
            had = _EXPONENT.search(before)
            letter = had[1].decode() if had is not None and self.exponent else self.exponent
            text = self._digits(value)[1].replace("e", letter).encode()
            if not self.is_field:
                yield text
            else:
                yield text.ljust(len(before)) if before[-1:].isspace() else text.rjust(len(before))

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
