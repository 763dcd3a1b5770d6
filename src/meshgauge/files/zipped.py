"""Arrays of numbers as few bytes, for records that are written, see `plain_records`."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from .plain_records import NotPlain

Kind = Literal["u1", "u2", "u4", "i8", "f4", "f8"]

LEVEL = 1
"""Of zlib: higher ones take ten times as long and spare a tenth."""


MOST = 1 << 48
"""Numbers that an array may have; more are no array of a record."""


@dataclass(frozen=True, eq=False)
class Zipped:
    """An array of one axis, packed.

    Attributes
    ----------
    kind, n
        Of its numbers, as they are packed, and how many there are.
    are_steps
        They are the differences of numbers that ascend.
    data
        Packed by zlib.
    """

    kind: Kind
    n: int
    are_steps: bool
    data: NDArray[np.uint8]

    @classmethod
    def of(cls, values: NDArray[Any]) -> Zipped:
        """Integers of 0 or more, or real numbers, ``(n,)``."""
        if values.dtype.kind == "f":
            kind: Kind = "f4" if values.dtype.itemsize == 4 else "f8"
        else:
            kind = _kind_for(int(values.max(initial=0)))
        raw = np.ascontiguousarray(values, np.dtype(kind).newbyteorder("<"))
        return cls(kind, len(values), False, np.frombuffer(zlib.compress(raw.data.cast("B"), LEVEL), np.uint8))

    @classmethod
    def ascending(cls, ids: NDArray[Any]) -> Zipped:
        """Integers of 0 or more that ascend."""
        made = cls.of(np.diff(ids, prepend=ids.dtype.type(0)))
        return cls(made.kind, made.n, True, made.data)

    def array(self, n: int, *, below: int | None = None) -> NDArray[Any]:
        """The numbers, of which there have to be ``n``, integers as int64; all from 0 on and ``below`` a number, if
        that is given.

        Raises `NotPlain` if they are others; what is unpacked is never more than ``n`` numbers.
        """
        dtype = np.dtype(self.kind).newbyteorder("<")
        values: NDArray[Any] = np.frombuffer(self._bytes(n, dtype.itemsize), dtype)
        if dtype.kind == "f":
            return values.astype(dtype.newbyteorder("="))
        values = np.cumsum(values, dtype=np.int64) if self.are_steps else values.astype(np.int64)
        if below is not None and n and (int(values.min()) < 0 or int(values.max()) >= below):
            raise NotPlain(f"packed numbers are not from 0 to {below - 1}")
        return values

    def small(self, n: int) -> NDArray[np.uint8]:
        """The numbers, of which there have to be ``n``, all below 256."""
        if self.kind != "u1" or self.are_steps:
            raise NotPlain("packed numbers are not bytes")
        return np.frombuffer(self._bytes(n, 1), np.uint8)

    def _bytes(self, n: int, width: int) -> bytearray:
        if self.n != n or not 0 <= n <= MOST:
            raise NotPlain(f"{self.n} numbers are packed, not {n}")
        try:
            data = zlib.decompressobj().decompress(self.data.tobytes(), n * width + 1)
        except zlib.error as error:
            raise NotPlain("packed numbers are damaged") from error
        if len(data) != n * width:
            raise NotPlain(f"{len(data)} bytes are packed, not {n * width}")
        return bytearray(data)


def _kind_for(most: int) -> Kind:
    """The smallest kind of integers up to one."""
    return "u1" if most < 1 << 8 else "u2" if most < 1 << 16 else "u4" if most < 1 << 32 else "i8"
