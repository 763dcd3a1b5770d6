"""Copies of netCDF files with further variables: classic ones laid out anew, version 4 through h5py."""

from __future__ import annotations

import math
import mmap
import shutil
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .added import CannotAdd
from .netcdf import TYPES, Classic

Arrays = Mapping[str, tuple[tuple[str, ...], NDArray[Any]]]
"""By name of the variable: the names of its dimensions, and its values."""

_CODES = {"S1": 2, "i4": 4, "f8": 6}
_PURE = "This is a netCDF dimension but not a netCDF variable."


Texts = Mapping[str, Mapping[str, str]]
"""By name of the variable: texts by name of the attribute."""


def with_variables(
    old: Path, new: Path, sizes: Mapping[str, int], arrays: Arrays, attributes: Texts | None = None
) -> None:
    """Write a copy of a file.

    Parameters
    ----------
    old, new
        From where to where.
    sizes
        Dimensions that are made, or get another size: no variable but those of ``arrays`` may have them then. 0: the
        one along which records are.
    arrays
        Variables that are added, or take the place of others: of characters (S1), int32 or float64.
    attributes
        Of variables that are added; those that take the place of others keep theirs.

    Raises
    ------
    CannotAdd
        If the file is of a kind that cannot hold them.
    """
    with old.open("rb") as file:
        is_classic = file.read(3) == b"CDF"
    (_with_classic if is_classic else _with_hdf)(old, new, sizes, arrays, attributes or {})


def dimensions(path: Path) -> tuple[dict[str, int], dict[str, tuple[str, ...]]]:
    """The size of each dimension of a file, 0 of that of records; and the names of those of each variable."""
    with path.open("rb") as raw:
        if raw.read(3) == b"CDF":
            with mmap.mmap(raw.fileno(), 0, access=mmap.ACCESS_READ) as data:
                layout = _Layout(path, data)
            names = [name for name, _ in layout.dimensions]
            own = {entry.name: tuple(names[at] for at in entry.dimensions) for entry in layout.entries}
            return dict(layout.dimensions), own
    import h5py

    with h5py.File(path, "r") as file:
        scales = {name: item for name, item in _arrays(file) if item.is_scale}
        sizes = {name: 0 if item.maxshape[0] is None else item.shape[0] for name, item in scales.items()}
        return sizes, _dimensions_of(file)


def _arrays(file: Any) -> Iterator[tuple[str, Any]]:
    return ((name, item) for name, item in file.items() if hasattr(item, "is_scale"))


def _dimensions_of(file: Any) -> dict[str, tuple[str, ...]]:
    """Names of the dimensions of each variable that is none itself."""
    return {
        name: tuple(str(axis[0].name).rsplit("/", 1)[-1] for axis in item.dims)
        for name, item in _arrays(file)
        if item.ndim and all(len(axis) for axis in item.dims)
    }


@dataclass(slots=True)
class _Entry:
    """A variable of a classic file."""

    name: str
    dimensions: list[int]
    attributes: bytes
    kind: int
    begin: int
    values: NDArray[Any] | None = None  #: of a new one


class _Layout(Classic):
    """The header of a classic file, to be written again."""

    def __init__(self, path: Path, data: mmap.mmap) -> None:
        super().__init__(path, data)
        self.n_records = self.number()
        self.dimensions = [(self.name(), self.number()) for _ in range(self.items(10))]
        self.of_file = self._raw_attributes()
        self.entries = [self._entry() for _ in range(self.items(11))]
        if self.n_records >= 1 << (8 * self.count - 1):
            raise CannotAdd("does not say how many records it has")

    def _raw_attributes(self) -> bytes:
        begin = self.at
        self.attributes()
        return self.data[begin : self.at]

    def _entry(self) -> _Entry:
        name = self.name()
        ids = [self.number() for _ in range(self.number())]
        attributes, kind = self._raw_attributes(), self.number(4)
        self.number()
        return _Entry(name, ids, attributes, kind, self.number(4 if self.version == 1 else 8))

    def is_record(self, entry: _Entry) -> bool:
        return bool(entry.dimensions) and self.dimensions[entry.dimensions[0]][1] == 0

    def n_bytes(self, entry: _Entry) -> int:
        """Of all, or of one record."""
        shape = [self.dimensions[at][1] for at in entry.dimensions]
        return math.prod(shape[1:] if self.is_record(entry) else shape) * np.dtype(TYPES[entry.kind]).itemsize

    def raw_number(self, value: int, width: int = 0) -> bytes:
        return value.to_bytes(width or self.count, "big")

    def raw_name(self, text: str) -> bytes:
        raw = text.encode()
        return self.raw_number(len(raw)) + raw + bytes(-len(raw) % 4)

    def raw_texts(self, texts: Mapping[str, str]) -> bytes:
        """Attributes of texts."""
        if not texts:
            return bytes(4 + self.count)
        number, name = self.raw_number, self.raw_name
        rows = (name(key) + number(_CODES["S1"], 4) + name(text) for key, text in texts.items())
        return number(12, 4) + number(len(texts)) + b"".join(rows)

    def header(self, begins: list[int]) -> bytes:
        """All that stands before the arrays."""
        number, name = self.raw_number, self.raw_name
        largest = (1 << (8 * self.count)) - 1
        parts = [self.data[:4], number(self.n_records)]
        parts += [number(10, 4), number(len(self.dimensions))]
        parts += [name(text) + number(size) for text, size in self.dimensions]
        parts += [self.of_file, number(11, 4), number(len(self.entries))]
        for entry, begin in zip(self.entries, begins, strict=True):
            size = self.n_bytes(entry)
            parts += [name(entry.name), number(len(entry.dimensions)), *map(number, entry.dimensions)]
            parts += [entry.attributes, number(entry.kind, 4), number(min(size + -size % 4, largest))]
            parts.append(number(begin, 4 if self.version == 1 else 8))
        return b"".join(parts)


def _with_classic(old: Path, new: Path, sizes: Mapping[str, int], arrays: Arrays, attributes: Texts) -> None:
    with old.open("rb") as raw, mmap.mmap(raw.fileno(), 0, access=mmap.ACCESS_READ) as data:
        layout = _Layout(old, data)
        records = [entry for entry in layout.entries if layout.is_record(entry)]
        lengths = [layout.n_bytes(entry) for entry in records]
        step = lengths[0] if len(records) == 1 else sum(n + -n % 4 for n in lengths)
        held = {entry.name: layout.n_bytes(entry) for entry in layout.entries}
        n_records = layout.n_records
        _put(layout, sizes, arrays, attributes)
        if layout.n_records > n_records and any(
            entry.values is None and layout.is_record(entry) for entry in layout.entries
        ):
            raise CannotAdd("has fields, but no time step")

        def source(entry: _Entry, record: int) -> Iterator[bytes]:
            if entry.values is not None:
                values = entry.values[record] if layout.is_record(entry) else entry.values
                yield np.ascontiguousarray(values, TYPES[entry.kind]).tobytes()
            else:
                begin = entry.begin + record * step
                yield data[begin : begin + held[entry.name]]
            yield bytes(-layout.n_bytes(entry) % 4)

        order = sorted(layout.entries, key=layout.is_record)  # those of records stand behind the others
        at = len(layout.header([0] * len(layout.entries)))
        begins = {}
        for entry in order:
            begins[entry.name] = at
            at += layout.n_bytes(entry) + -layout.n_bytes(entry) % 4
        if layout.version == 1 and at >= 1 << 31:
            raise CannotAdd("would be too large for its version of netCDF (classic)")
        with new.open("wb") as file:
            file.write(layout.header([begins[entry.name] for entry in layout.entries]))
            for entry in order:
                if not layout.is_record(entry):
                    file.writelines(source(entry, 0))
            for record in range(layout.n_records):
                for entry in order:
                    if layout.is_record(entry):
                        file.writelines(source(entry, record))


def _put(layout: _Layout, sizes: Mapping[str, int], arrays: Arrays, attributes: Texts) -> None:
    """Change dimensions and variables."""
    places = {name: at for at, (name, _) in enumerate(layout.dimensions)}
    for name, size in sizes.items():
        if name not in places:
            if size == 0 and any(n == 0 for _, n in layout.dimensions):
                raise CannotAdd("has records of another kind than time steps")
            places[name] = len(layout.dimensions)
            layout.dimensions.append((name, size))
        elif layout.dimensions[places[name]][1] != size:
            others = [e.name for e in layout.entries if places[name] in e.dimensions and e.name not in arrays]
            if others:
                raise CannotAdd(f"holds its fields in one array, {others[0]}")
            layout.dimensions[places[name]] = (name, size)
    known = {entry.name: entry for entry in layout.entries}
    for name, (dimensions, values) in arrays.items():
        ids, kind = [places[one] for one in dimensions], _CODES[values.dtype.str[1:]]
        raw = known[name].attributes if name in known else layout.raw_texts(attributes.get(name, {}))
        made = _Entry(name, ids, raw, kind, 0, values)
        if layout.is_record(made):
            layout.n_records = max(layout.n_records, len(values))
        if name in known:
            layout.entries[layout.entries.index(known[name])] = made
        else:
            layout.entries.append(made)


def _with_hdf(old: Path, new: Path, sizes: Mapping[str, int], arrays: Arrays, texts: Texts) -> None:
    import h5py

    shutil.copyfile(old, new)
    with h5py.File(new, "r+") as file:
        scales = {name: item for name, item in _arrays(file) if item.is_scale}
        others = [(of, len(file[name])) for name, of in _dimensions_of(file).items() if of and name not in arrays]
        attributes = {name: _own(file[name].attrs) for name in arrays if name in file}
        for name in attributes:
            _remove(file, name)
        for name, size in sizes.items():
            if name in scales and (size == 0 or scales[name].shape == (size,)):
                continue
            number = scales[name].attrs.get(_DIMENSION) if name in scales else None
            if name in scales:
                if len(scales[name].attrs.get("REFERENCE_LIST", ())):
                    raise CannotAdd(f"holds its fields in arrays of the dimension {name}")
                del file[name]
            _dimension(file, name, size, number)
        for name, (dimensions, values) in arrays.items():
            is_record = sizes.get(dimensions[0]) == 0
            if is_record and any(of[0] == dimensions[0] and n < len(values) for of, n in others):
                raise CannotAdd("has fields, but no time step")
            how: dict[str, Any] = {"maxshape": (None, *values.shape[1:])} if is_record else {}
            if is_record:
                how["chunks"] = (1, *(max(n, 1) for n in values.shape[1:]))
            made = file.create_dataset(name, data=values, **how)
            for axis, dimension in enumerate(dimensions):
                if made is not file[dimension]:
                    made.dims[axis].attach_scale(file[dimension])
            for key, text in texts.get(name, {}).items() if name not in attributes else ():
                made.attrs[key] = np.bytes_(text)
            for key, value in attributes.get(name, {}).items():
                made.attrs[key] = value


_DIMENSION = "_Netcdf4Dimid"
_LINKS = {"DIMENSION_LIST", "REFERENCE_LIST", "CLASS", "NAME", "_Netcdf4Coordinates"}


def _own(attributes: Any) -> dict[str, Any]:
    """Attributes of a variable but those that link it to its dimensions."""
    return {key: value for key, value in attributes.items() if key not in _LINKS}


def _remove(file: Any, name: str) -> None:
    """Delete a variable, and what its dimensions say of it."""
    for axis in file[name].dims:
        for scale in axis.values():
            axis.detach_scale(scale)
    del file[name]


def _dimension(file: Any, name: str, size: int, number: Any) -> None:
    """A dimension as netCDF's library writes it: an array without values."""
    numbers = [item.attrs[_DIMENSION] for item in file.values() if _DIMENSION in item.attrs]
    how = {"maxshape": (None,), "chunks": (1024,)} if size == 0 else {}
    made = file.create_dataset(name, (size,), ">f4", **how)
    made.make_scale(f"{_PURE}{size:10d}")
    if number is not None or numbers:
        made.attrs[_DIMENSION] = np.int32(number if number is not None else max(numbers) + 1)
