"""Where XDMF files hold the coordinates of points: as text in the file, as bytes beside it or in HDF5."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from xml.parsers import expat

import numpy as np

from ..plumbing import within
from ..plumbing.hdf_places import places_in
from ..plumbing.numerals import Raw, Text
from ..plumbing.patch import Places
from ..plumbing.spans import words

_ORDERS = {"little": "<", "big": ">", "native": "="}


@dataclass(frozen=True, slots=True)
class _Item:
    """A DataItem of a geometry: its attributes, and where its text begins and ends."""

    attributes: dict[str, str]
    begin: int
    end: int


def places(path: Path, at: int) -> Places:
    """Of the one geometry of a file, or of that of a time step if there is one for each.

    None if there are several for a step, or one is put together from others.
    """
    within.check_xml(path)
    data = path.read_bytes()
    items = _geometries(data)
    if not items or (len(items) > 1 and at >= len(items)):
        return Places.joined([])
    item = items[at if len(items) > 1 else 0]
    kinds = {name.lower(): value for name, value in item.attributes.items()}
    size = np.dtype(f"f{int(kinds.get('precision', '4'))}").itemsize
    n = int(np.prod([int(word) for word in kinds["dimensions"].split()])) // 3
    form = kinds.get("format", "XML").upper()
    if form == "XML":
        starts, ends = (one[: 3 * n].reshape(-1, 3) for one in words(data, item.begin, item.end))
        return Places.of(path, Text(is_single=size == 4), starts, ends)
    name = data[item.begin : item.end].decode().strip()
    if form == "HDF":
        import h5py

        file_name, _, array_name = name.partition(":")
        with h5py.File(path.parent / file_name, "r") as file:
            axes = [(file[array_name], 3 * np.arange(n) + axis) for axis in range(3)]
            return places_in(path.parent / file_name, axes)
    if form != "BINARY":
        return Places.joined([])
    order = _ORDERS.get(kinds.get("endian", "Native").lower(), "=")
    starts = int(kinds.get("seek", "0")) + size * np.arange(3 * n, dtype=np.int64).reshape(n, 3)
    return Places.of(path.parent / name, Raw(f"{order}f{size}"), starts, starts + size)


def _geometries(data: bytes) -> list[_Item]:
    """The single items of geometries of three coordinates a point, in their order; none if there is another."""
    found: list[_Item] = []
    opened: list[tuple[str, dict[str, str], int]] = []
    is_known = True
    parser = expat.ParserCreate()

    def start(name: str, attributes: dict[str, str]) -> None:
        nonlocal is_known
        opened.append((name, attributes, parser.CurrentByteIndex))
        if name == "Geometry":
            kind = next((value for key, value in attributes.items() if key.lower() in ("geometrytype", "type")), "XYZ")
            is_known &= kind.upper() == "XYZ" and "Reference" not in attributes

    def end(name: str) -> None:
        nonlocal is_known
        _, attributes, tag = opened.pop()
        if name != "DataItem" or not opened:
            return
        if opened[-1][0] == "Geometry":
            begin = data.index(b">", tag) + 1
            is_known &= "Reference" not in attributes and "ItemType" not in attributes
            found.append(_Item(attributes, begin, max(parser.CurrentByteIndex, begin)))

    parser.StartElementHandler, parser.EndElementHandler = start, end
    try:
        parser.Parse(data, True)
    except expat.ExpatError:
        return []
    return found if is_known else []
