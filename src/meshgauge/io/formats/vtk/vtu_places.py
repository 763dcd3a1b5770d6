"""Where .vtu files hold the coordinates of points: as text, as bytes, or in an array that is packed or in base64."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ....errors import WriteError
from ...plumbing.numerals import Ints, Raw, Reals
from ...plumbing.patch import Places
from .places import NONE, row_places, text_places
from .vtu_layout import NOT_WHOLE, Layout
from .vtu_raw import DTYPES


def places(path: Path, at: int) -> Places:
    """Of the points of each piece, at a time step."""
    data = path.read_bytes()
    try:
        layout = Layout(data)
    except NOT_WHOLE:
        return NONE
    parts = [_of_array(path, layout, number) for number in layout.of_step(at)]
    return Places.joined(parts) if parts and all(part is not NONE for part in parts) else NONE


def _of_array(path: Path, layout: Layout, number: int) -> Places:
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
    except NOT_WHOLE:
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
        layout = Layout(data)
        numbers = np.frombuffer(layout.unpacked(layout.points[self.number]).content, self.dtype)
        return numbers[starts].astype(np.float64)

    def rounded(self, values: Reals) -> Reals:
        return values.astype(self.dtype).astype(np.float64)

    def put(self, path: Path, starts: Ints, values: Reals) -> None:
        """Change numbers of the array: blocks without any keep their bytes, and what stands behind moves along."""
        try:
            layout = Layout(path.read_bytes())
            array = layout.points[self.number]
            packed = layout.unpacked(array)
            numbers = np.frombuffer(packed.content, self.dtype).copy()
            numbers[starts] = values
        except NOT_WHOLE as error:
            raise WriteError(f"{path}: is no longer the file that was read: {error}") from error
        path.write_bytes(layout.replaced(array, packed, numbers.tobytes()))
