"""NetCDF files: classic (versions 1, 2 and 5) by a small reader of our own, version 4 through h5py."""

from __future__ import annotations

import math
import mmap
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import ReadError
from . import budget, within
from .budget import DENSEST
from .made_rows import BoxRows
from .pieces import FileRows, HdfRows, ReadWhole, Rows, hdf_rows, row_bytes

TYPES = {1: "i1", 2: "S1", 3: ">i2", 4: ">i4", 5: ">f4", 6: ">f8", 7: "u1", 8: ">u2", 9: ">u4", 10: ">i8", 11: ">u8"}
"""How numbers of each type stand in classic files."""


@dataclass(frozen=True, slots=True)
class Variable:
    """An array of the file, read when ``values`` is called: all of it, or one row of its first axis."""

    shape: tuple[int, ...]
    attributes: Mapping[str, Any]
    values: Callable[..., NDArray[Any]]
    start: int | None = None  #: the first byte of a classic file's array that is in one piece
    kind: str = ""  #: how the numbers of such an array are held
    dataset: Any = None  #: of h5py
    steps: tuple[int, int] = (0, 0)  #: of a classic file's array: its first byte, and bytes between its rows

    def rows(self, path: Path, at: int | None = None) -> Rows:
        """Where the array stands, or one row of its first axis.

        Raises
        ------
        ReadError
            If the file ends before.
        ReadWhole
            If it is not to be had some rows at a time.
        """
        shape = self.shape if at is None else self.shape[1:]
        if self.dataset is not None:
            own = hdf_rows(self.dataset, 0, self.shape[0])
            if at is None:
                return own
            if isinstance(own, FileRows):
                return replace(own, offset=own.offset + at * row_bytes(own), shape=shape)
            assert isinstance(own, HdfRows)
            return BoxRows(own.path, own.name, (at, 0), (1, shape[0]), own.dtype)
        if at is None and self.start is None:
            raise ReadWhole("an array stands in records")
        dtype, begin = np.dtype(self.kind), self.steps[0] + (at or 0) * self.steps[1]
        if begin + math.prod(shape) * dtype.itemsize > path.stat().st_size:
            raise ReadError(f"{path}: not a whole netCDF file: an array of shape {shape} at byte {begin}")
        return FileRows(str(path.absolute()), begin, dtype, shape)

    def text(self) -> list[str]:
        """An array of characters as strings, one a row."""
        rows = np.atleast_2d(self.values())
        return [b"".join(np.asarray(row, "S1").tolist()).split(b"\0")[0].decode("utf-8", "replace") for row in rows]


@contextmanager
def variables(path: Path, *, held: bool = True) -> Iterator[dict[str, Variable]]:
    """The variables of a file, by name. Their values must be read within the context. Not ``held``: not as a whole.

    Raises
    ------
    ReadError
        If the file is not whole, or an array states more than its file can hold.
    """
    with path.open("rb") as file:
        magic = file.read(4)
    if magic[:3] == b"CDF":
        with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            yield Classic(path, data).variables()
        return
    import h5py

    try:
        with h5py.File(path, "r") as root:
            within.check_hdf(path, root, held=held)
            size = path.stat().st_size
            yield {name: _hdf(path, item, size) for name, item in root.items() if isinstance(item, h5py.Dataset)}
    except (OSError, KeyError, RuntimeError) as error:
        raise ReadError(f"{path}: not a whole HDF5 file: {error}") from error


def _hdf(path: Path, item: Any, size: int) -> Variable:
    def values(first: int | None = None) -> NDArray[Any]:
        shape = item.shape if first is None else item.shape[1:]
        if math.prod(shape) * item.dtype.itemsize > size * DENSEST:
            raise ReadError(f"{path}: array {item.name!r} of shape {item.shape} cannot be in a file of {size} bytes")
        return np.asarray(item[...] if first is None else item[first])

    return Variable(
        tuple(item.shape), {k: _plain(v) for k, v in item.attrs.items() if k in ("elem_type",)}, values, dataset=item
    )


def _plain(value: Any) -> Any:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else value


class Classic:
    """The header of a classic file, and its arrays where they stand."""

    def __init__(self, path: Path, data: mmap.mmap) -> None:
        self.path, self.data, self.at = path, data, 4
        self.version = data[3]
        if self.version not in (1, 2, 5):
            raise self.fail(f"version {self.version} is not known")
        self.count = 8 if self.version == 5 else 4

    def fail(self, what: str) -> ReadError:
        return ReadError(f"{self.path}: not a whole netCDF file: {what}")

    def number(self, width: int = 0) -> int:
        width = width or self.count
        self.at += width
        if self.at > len(self.data):
            raise self.fail("its header is cut off")
        return int.from_bytes(self.data[self.at - width : self.at], "big")

    def name(self) -> str:
        return self._padded(self.number()).decode("utf-8", "replace")

    def _padded(self, n: int) -> bytes:
        if n > len(self.data) - self.at:
            raise self.fail("its header is cut off")
        text = self.data[self.at : self.at + n]
        self.at += n + -n % 4
        return text

    def items(self, mark: int) -> int:
        """The number of items of a list of dimensions (10), variables (11) or attributes (12)."""
        tag, n = self.number(4), self.number()
        if tag not in (0, mark) or n > len(self.data):
            raise self.fail(f"a list of {n} items with the mark {tag}, expected {mark}")
        return n

    def attributes(self) -> dict[str, Any]:
        attributes: dict[str, Any] = {}
        for _ in range(self.items(12)):
            name, kind, n = self.name(), self.number(4), self.number()
            if kind not in TYPES:
                raise self.fail(f"attribute {name!r} is of type {kind}")
            raw = self._padded(n * np.dtype(TYPES[kind]).itemsize)
            if kind == 2:
                attributes[name] = raw.rstrip(b"\0").decode("utf-8", "replace")
        return attributes

    def variables(self) -> dict[str, Variable]:
        n_records = self.number()
        dimensions = []
        for _ in range(self.items(10)):
            self.name()
            dimensions.append(self.number())
        self.attributes()
        entries = []
        for _ in range(self.items(11)):
            name, rank = self.name(), self.number()
            if rank > len(dimensions):
                raise self.fail(f"variable {name!r} has {rank} dimensions")
            ids = [self.number() for _ in range(rank)]
            if any(i >= len(dimensions) for i in ids):
                raise self.fail(f"variable {name!r} has a dimension that does not exist")
            attributes, kind = self.attributes(), self.number(4)
            self.number()  # its size, which is of 32 bits and may have overflowed
            begin = self.number(4 if self.version == 1 else 8)
            if kind not in TYPES:
                raise self.fail(f"variable {name!r} is of type {kind}")
            shape = [dimensions[i] for i in ids]
            is_record = bool(shape) and shape[0] == 0
            entries.append((name, attributes, np.dtype(TYPES[kind]), shape, is_record, begin))
        sizes = [math.prod(s[1:]) * d.itemsize for _, _, d, s, is_record, _ in entries if is_record]
        step = sizes[0] if len(sizes) == 1 else sum(n + -n % 4 for n in sizes)
        if step and n_records > len(self.data) // step:
            n_records = 0 if n_records >= 1 << (8 * self.count - 1) else n_records
        return {
            name: Variable(
                (n_records, *shape[1:]) if is_record else tuple(shape),
                attributes,
                self._values(
                    name, dtype, (n_records, *shape[1:]) if is_record else tuple(shape), begin, is_record, step
                ),
                None if is_record else begin,
                dtype.str,
                steps=(begin, step if is_record else math.prod(shape[1:]) * dtype.itemsize),
            )
            for name, attributes, dtype, shape, is_record, begin in entries
        }

    def _values(
        self, name: str, dtype: np.dtype[Any], shape: tuple[int, ...], begin: int, is_record: bool, step: int
    ) -> Callable[..., NDArray[Any]]:
        def part(start: int, n: int) -> NDArray[Any]:
            if start + n * dtype.itemsize > len(self.data):
                raise self.fail(f"array {name!r} of shape {shape} at byte {start} of {len(self.data)}")
            budget.draw("stored", n * dtype.itemsize, f"array {name!r}", self.fail)
            values = np.frombuffer(self.data[start : start + n * dtype.itemsize], dtype, n)
            return values.astype(dtype.newbyteorder("="), copy=False)

        def values(first: int | None = None) -> NDArray[Any]:
            row = math.prod(shape[1:])
            if first is not None:
                stride = step if is_record else row * dtype.itemsize
                return part(begin + first * stride, row).reshape(shape[1:])
            if is_record:
                rows = [part(begin + i * step, row) for i in range(shape[0])]
                return np.concatenate([np.empty(0, dtype.newbyteorder("=")), *rows]).reshape(shape)
            return part(begin, math.prod(shape)).reshape(shape)

        return values
