"""The elements of .vtu files that tell where arrays stand, and arrays that are packed or in base64 as bytes."""

from __future__ import annotations

import base64
import itertools
import re
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from .vtu_raw import DTYPES

_OFFSET = re.compile(rb"(\boffset\s*=\s*[\"'])(\d+)([\"'])")
NOT_WHOLE = (expat.ExpatError, ValueError, KeyError, IndexError)
"""Errors of what VTK did not write. (`binascii.Error` is a `ValueError`.)"""
BLOCK = 1 << 15
"""Bytes of a block, as VTK packs them."""
_COMPRESSORS = {f"vtk{name}DataCompressor" for name in ("ZLib", "LZ4", "LZMA")}


@dataclass(frozen=True, eq=False)
class Array:
    """A DataArray: its attributes, where its tag begins, where its content begins and ends, and its points."""

    attributes: dict[str, str]
    tag: int
    begin: int
    end: int
    n: int
    width: int = 3

    @property
    def is_appended(self) -> bool:
        return self.attributes.get("format") == "appended"

    @property
    def n_bytes(self) -> int:
        """Of its numbers as they are in memory."""
        return self.width * self.n * np.dtype(DTYPES[self.attributes["type"]]).itemsize


@dataclass(slots=True)
class Group:
    """PointData or CellData of a piece: its tag, where its content ends, and its arrays (of several steps, one by one).

    With each stands the byte behind its element.
    """

    tag: int
    end: int = -1
    arrays: list[tuple[Array, int]] = field(default_factory=list)


@dataclass(slots=True)
class Piece:
    """A piece: its attributes, its tag, and its groups by name."""

    attributes: dict[str, str]
    tag: int
    groups: dict[str, Group] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Unpacked:
    """The bytes of an array, those of the file between two places that hold them, and its packed blocks."""

    content: bytes
    start: int
    stop: int
    is_joined: bool = False  #: the count and the bytes are encoded together
    block: int = 0  #: bytes of a block; 0: not packed
    blocks: list[bytes] = field(default_factory=list)


class Layout:
    """The elements of a file that tell where its points and data stand.

    Raises `expat.ExpatError` if it is no XML, `ValueError` or `KeyError` if it is none that VTK writes.
    """

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.points: list[Array] = []
        self.pieces: list[Piece] = []
        self.moves = False  #: points or cells are others at each time step
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
        at = self._parser.CurrentByteIndex
        if name == "Piece":
            self.pieces.append(Piece(attributes, at))
        if name in ("PointData", "CellData") and self.pieces:
            self.pieces[-1].groups.setdefault(name, Group(at))
        parent = self._open[-1][0] if self._open else ""
        self.moves |= "TimeStep" in attributes and parent in ("Points", "Cells")
        self._open.append((name, attributes, at))

    def _end(self, name: str) -> None:
        _, attributes, tag = self._open.pop()
        parent = self._open[-1][0] if self._open else ""
        group = self.pieces[-1].groups.get(name, None) if self.pieces else None
        if group is not None and group.tag == tag:
            group.end = self._parser.CurrentByteIndex
        if parent in ("PointData", "CellData") and self.pieces:
            begin, stop = self.data.index(b">", tag) + 1, self._parser.CurrentByteIndex
            has_end = self.data[begin - 2 : begin] != b"/>"  # else its only tag is its end
            n = int(self.pieces[-1].attributes[f"NumberOf{parent[:-4]}s"])
            array = Array(attributes, tag, begin, max(stop, begin), n, int(attributes.get("NumberOfComponents", 1)))
            end = self.data.index(b">", stop) + 1 if has_end else begin
            self.pieces[-1].groups[parent].arrays.append((array, end))
        if name != "DataArray" or parent != "Points":
            return
        piece = self._open[-2][1]
        begin = self.data.index(b">", tag) + 1
        end = max(self._parser.CurrentByteIndex, begin)
        self.points.append(Array(attributes, tag, begin, end, int(piece["NumberOfPoints"])))

    def of_step(self, at: int) -> list[int]:
        """Which of the arrays of points are those of a time step: they name it, or none."""
        return [
            number
            for number, array in enumerate(self.points)
            if str(at) in array.attributes.get("TimeStep", str(at)).split()
        ]

    def is_plain(self, array: Array) -> bool:
        """Whether it stands in the file as it is in memory, behind its length."""
        return not self._is_text(array) and not self.compressor

    def _is_text(self, array: Array) -> bool:
        """Whether it stands in the file in base64."""
        return not (array.is_appended and self.encoding == "raw")

    def at(self, array: Array) -> int:
        """Where what is appended of an array begins."""
        return self.appended + int(array.attributes["offset"])

    @cached_property
    def _compression(self) -> Any:
        from vtkmodules import vtkIOCore

        return getattr(vtkIOCore, self.compressor)()

    def extent(self, array: Array) -> tuple[int, int]:
        """The bytes of an array that is appended. Raises one of `NOT_WHOLE` if these do not hold what it should."""
        start = self.at(array)
        if not self.is_plain(array):
            made = self.unpacked(array)
            return made.start, made.stop
        size = self.header.itemsize
        if int(np.frombuffer(self.data[start : start + size], self.header)[0]) != array.n_bytes:
            raise ValueError
        return start, start + size + array.n_bytes

    def unpacked(self, array: Array) -> Unpacked:
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
        return Unpacked(whole, start, stop, block=block, blocks=blocks)

    def _in_base64(self, start: int, n: int) -> Unpacked:
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
        return Unpacked(held[size:], start, stop, is_joined)

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

    def packed_blocks(self, content: bytes) -> list[bytes]:
        """Blocks of some bytes, packed as those of the file are."""
        return [self._with_packing(content[at : at + BLOCK]) for at in range(0, len(content), BLOCK)]

    def encoded(self, content: bytes, *, is_text: bool, old: Unpacked | None = None) -> bytes:
        """The bytes of an array as they stand in a file; blocks that an old one has keep their bytes."""
        count = np.array([len(content)], self.header).tobytes()
        parts = [count + content] if old is not None and old.is_joined else [count, content]
        if self.compressor:
            block = old.block if old is not None else BLOCK
            made = []
            for number, at in enumerate(range(0, len(content), block)):
                part = content[at : at + block]
                is_same = old is not None and old.content[at : at + block] == part
                made.append(old.blocks[number] if old is not None and is_same else self._with_packing(part))
            counts = np.array([len(made), block, len(content) % block, *map(len, made)], self.header)
            parts = [counts.tobytes(), b"".join(made)]
        return b"".join(map(base64.b64encode, parts)) if is_text else b"".join(parts)

    def replaced(self, array: Array, old: Unpacked, new: bytes) -> bytes:
        """The file with other bytes of an array, of the same number."""
        text = self.encoded(new, is_text=self._is_text(array), old=old)
        head, tail = self.data[: old.start], self.data[old.stop :]
        longer = len(text) - (old.stop - old.start)
        if array.is_appended and longer:

            def shifted(match: re.Match[bytes]) -> bytes:
                offset = int(match[2])
                moved = offset + longer if self.appended + offset > old.start else offset
                return match[1] + str(moved).encode() + match[3]

            head = _OFFSET.sub(shifted, head[: self.appended]) + head[self.appended :]
        return head + text + tail
