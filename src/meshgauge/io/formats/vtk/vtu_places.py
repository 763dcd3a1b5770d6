"""Where .vtu files hold the coordinates of points: as text, as bytes, or in an array that is packed or in base64."""

from __future__ import annotations

import base64
import itertools
import re
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from ....errors import WriteError
from ...plumbing.numerals import Ints, Raw, Reals
from ...plumbing.patch import Places
from .places import NONE, row_places, text_places
from .vtu_raw import DTYPES

_OFFSET = re.compile(rb"(\boffset\s*=\s*[\"'])(\d+)([\"'])")
_NOT_WHOLE = (expat.ExpatError, ValueError, KeyError, IndexError)
"""Errors of what VTK did not write. (`binascii.Error` is a `ValueError`.)"""
_COMPRESSORS = {f"vtk{name}DataCompressor" for name in ("ZLib", "LZ4", "LZMA")}


def places(path: Path, at: int) -> Places:
    """Of the points of each piece, at a time step."""
    data = path.read_bytes()
    try:
        layout = _Layout(data)
    except _NOT_WHOLE:
        return NONE
    parts = [_of_array(path, layout, number) for number in layout.of_step(at)]
    return Places.joined(parts) if parts and all(part is not NONE for part in parts) else NONE


def _of_array(path: Path, layout: _Layout, number: int) -> Places:
    array = layout.points[number]
    kind = array.attributes.get("type", "")
    if kind not in ("Float32", "Float64") or array.attributes.get("NumberOfComponents") != "3":
        return NONE
    if array.attributes.get("format") == "ascii":
        begin, end, is_single = array.begin, array.end, kind == "Float32"
        return text_places(path, layout.data, begin, end, array.n, is_single=is_single)
    dtype = layout.order + DTYPES[kind]
    if layout.is_plain(array):
        return row_places(path, Raw(dtype), layout.at(array) + layout.header.itemsize, array.n)
    try:
        layout.unpacked(array)
    except _NOT_WHOLE:
        return NONE
    starts = np.arange(3 * array.n, dtype=np.int64).reshape(-1, 3)
    return Places.of(path, Packed(number, dtype), starts, starts + 1)


@dataclass(frozen=True, slots=True)
class Packed:
    """Numbers in an array of points that is packed or in base64: a place is that in the array.

    Attributes
    ----------
    number
        Which of the arrays of points of the file.
    dtype
        Of its numbers.
    """

    number: int
    dtype: str

    def values(self, data: bytes, starts: Ints, ends: Ints) -> Reals:
        layout = _Layout(data)
        numbers = np.frombuffer(layout.unpacked(layout.points[self.number]).content, self.dtype)
        return numbers[starts].astype(np.float64)

    def rounded(self, values: Reals) -> Reals:
        return values.astype(self.dtype).astype(np.float64)

    def put(self, path: Path, starts: Ints, values: Reals) -> None:
        """Change numbers of the array: blocks without any keep their bytes, and what stands behind moves along."""
        try:
            layout = _Layout(path.read_bytes())
            array = layout.points[self.number]
            packed = layout.unpacked(array)
            numbers = np.frombuffer(packed.content, self.dtype).copy()
            numbers[starts] = values
        except _NOT_WHOLE as error:
            raise WriteError(f"{path}: is no longer the file that was read: {error}") from error
        path.write_bytes(layout.replaced(array, packed, numbers.tobytes()))


@dataclass(frozen=True, eq=False)
class _Array:
    """A DataArray: its attributes, where its tag begins, where its content begins and ends, and its points."""

    attributes: dict[str, str]
    tag: int
    begin: int
    end: int
    n: int

    @property
    def is_appended(self) -> bool:
        return self.attributes.get("format") == "appended"

    @property
    def n_bytes(self) -> int:
        """Of its numbers as they are in memory."""
        return 3 * self.n * np.dtype(DTYPES[self.attributes["type"]]).itemsize


@dataclass(frozen=True, eq=False)
class _Unpacked:
    """The bytes of an array, those of the file between two places that hold them, and its packed blocks."""

    content: bytes
    start: int
    stop: int
    is_joined: bool = False  #: the count and the bytes are encoded together
    block: int = 0  #: bytes of a block; 0: not packed
    blocks: list[bytes] = field(default_factory=list)


class _Layout:
    """The elements of a file that tell where its points stand.

    Raises `expat.ExpatError` if it is no XML, `ValueError` or `KeyError` if it is none that VTK writes.
    """

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.points: list[_Array] = []
        self.appended = -1
        self.encoding = ""
        self._open: list[tuple[str, dict[str, str], int]] = []
        self.root: dict[str, str] = {}
        opening = re.search(rb"<AppendedData\b[^>]*>\s*_", data)
        stop = opening.end() if opening else len(data)
        if b"<!" in data[: stop if opening else 4096]:
            raise ValueError
        self._parser = expat.ParserCreate()
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.Parse(data[:stop], False)
        if opening:
            self.appended = stop
        self.order = {"LittleEndian": "<", "BigEndian": ">"}[self.root.get("byte_order", "LittleEndian")]
        self.header = np.dtype(self.order + DTYPES[self.root.get("header_type", "UInt32")])
        self.compressor = self.root.get("compressor", "")
        if self.compressor and self.compressor not in _COMPRESSORS:
            raise ValueError

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        if name == "VTKFile":
            self.root = attributes
        if name == "AppendedData":
            self.encoding = attributes.get("encoding", "base64")
        self._open.append((name, attributes, self._parser.CurrentByteIndex))

    def _end(self, name: str) -> None:
        _, attributes, tag = self._open.pop()
        if name != "DataArray" or not self._open or self._open[-1][0] != "Points":
            return
        piece = self._open[-2][1]
        begin = self.data.index(b">", tag) + 1
        end = max(self._parser.CurrentByteIndex, begin)
        self.points.append(_Array(attributes, tag, begin, end, int(piece["NumberOfPoints"])))

    def of_step(self, at: int) -> list[int]:
        """Which of the arrays of points are those of a time step: they name it, or none."""
        return [
            number
            for number, array in enumerate(self.points)
            if str(at) in array.attributes.get("TimeStep", str(at)).split()
        ]

    def is_plain(self, array: _Array) -> bool:
        """Whether it stands in the file as it is in memory, behind its length."""
        return not self._is_text(array) and not self.compressor

    def _is_text(self, array: _Array) -> bool:
        """Whether it stands in the file in base64."""
        return not (array.is_appended and self.encoding == "raw")

    def at(self, array: _Array) -> int:
        """Where what is appended of an array begins."""
        return self.appended + int(array.attributes["offset"])

    @cached_property
    def _compression(self) -> Any:
        from vtkmodules import vtkIOCore

        return getattr(vtkIOCore, self.compressor)()

    def unpacked(self, array: _Array) -> _Unpacked:
        """The bytes of an array."""
        is_text = self._is_text(array)
        start = self.at(array) if array.is_appended else array.begin
        while not array.is_appended and self.data[start : start + 1].isspace():
            start += 1
        size = self.header.itemsize
        if not self.compressor:
            return self._in_base64(start, array.n_bytes)

        def taken(at: int, n: int) -> tuple[bytes, int]:
            length = 4 * (-(-n // 3)) if is_text else n
            held = self.data[at : at + length]
            return (base64.b64decode(held, validate=True)[:n] if is_text else held), at + length

        n_blocks = int(np.frombuffer(taken(start, 3 * size)[0][:size], self.header)[0])
        if not 0 <= n_blocks <= len(self.data):
            raise ValueError
        counts, at = taken(start, (3 + n_blocks) * size)
        _, block, last, *packed = np.frombuffer(counts, self.header).astype(np.int64).tolist()
        held, stop = taken(at, sum(packed))
        ends = np.cumsum([0, *packed]).tolist()
        blocks = [held[a:b] for a, b in itertools.pairwise(ends)]
        sizes = [last if last and number == n_blocks - 1 else block for number in range(n_blocks)]
        if sum(sizes) != array.n_bytes:
            raise ValueError
        whole = b"".join(self._without_packing(one, n) for one, n in zip(blocks, sizes, strict=True))
        return _Unpacked(whole, start, stop, block=block, blocks=blocks)

    def _in_base64(self, start: int, n: int) -> _Unpacked:
        """Of bytes behind their count, which VTK encodes by itself and others together with them."""
        size = self.header.itemsize
        alone = 4 * (-(-size // 3))
        is_joined = self.data[start + alone - 1 : start + alone] != b"="
        stop = start + (4 * (-(-(size + n) // 3)) if is_joined else alone + 4 * (-(-n // 3)))
        text = self.data[start:stop]
        if is_joined:
            held = base64.b64decode(text, validate=True)
        else:
            held = base64.b64decode(text[:alone], validate=True) + base64.b64decode(text[alone:], validate=True)
        if len(held) != size + n or int(np.frombuffer(held[:size], self.header)[0]) != n:
            raise ValueError
        return _Unpacked(held[size:], start, stop, is_joined)

    def _without_packing(self, packed: bytes, n: int) -> bytes:
        from vtkmodules.util.numpy_support import vtk_to_numpy

        made = self._compression.Uncompress(packed, len(packed), n)
        whole = vtk_to_numpy(made).tobytes() if made is not None else b""
        if len(whole) != n:
            raise ValueError
        return whole

    def _with_packing(self, data: bytes) -> bytes:
        from vtkmodules.util.numpy_support import vtk_to_numpy

        made = self._compression.Compress(data, len(data))
        packed: NDArray[np.uint8] = vtk_to_numpy(made)
        return packed.tobytes()

    def replaced(self, array: _Array, old: _Unpacked, new: bytes) -> bytes:
        """The file with other bytes of an array, of the same number."""
        count = np.array([len(new)], self.header).tobytes()
        parts = [count + new] if old.is_joined else [count, new]
        if self.compressor:
            cuts = range(0, len(new), old.block)
            made = [
                packed
                if old.content[a : a + old.block] == new[a : a + old.block]
                else self._with_packing(new[a : a + old.block])
                for a, packed in zip(cuts, old.blocks, strict=True)
            ]
            last = len(new) % old.block
            counts = np.array([len(made), old.block, last, *map(len, made)], self.header)
            parts = [counts.tobytes(), b"".join(made)]
        text = b"".join(map(base64.b64encode, parts)) if self._is_text(array) else b"".join(parts)
        head, tail = self.data[: old.start], self.data[old.stop :]
        longer = len(text) - (old.stop - old.start)
        if array.is_appended and longer:

            def shifted(match: re.Match[bytes]) -> bytes:
                offset = int(match[2])
                moved = offset + longer if self.appended + offset > old.start else offset
                return match[1] + str(moved).encode() + match[3]

            head = _OFFSET.sub(shifted, head[: self.appended]) + head[self.appended :]
        return head + text + tail
