"""Tecplot's binary files as its data format guide describes them, for tests: every version from 101 to 112."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

TYPES = {"line": 1, "triangle": 2, "quad": 3, "tetra": 4, "hexahedron": 5}
KINDS = {"f4": 1, "f8": 2, "i4": 3, "i2": 4, "u1": 5}


@dataclass
class Zone:
    """``arrays`` one a variable, None for one that is shared or passive; ``shape`` of an ordered zone."""

    arrays: list[np.ndarray | None]
    cell: str = ""
    nodes: np.ndarray = field(default_factory=lambda: np.empty((0, 0), np.int64))
    shape: tuple[int, int, int] | None = None
    n_points: int = 0
    name: str = "zone"
    of_cells: Sequence[int] = ()
    shared: dict[int, int] = field(default_factory=dict)
    passive: Sequence[int] = ()
    nodes_of: int = -1
    strand: int = -1
    time: float = 0.0
    neighbours: bool = False
    links: Sequence[int] = ()
    mode: int = 0
    auxiliary: dict[str, str] = field(default_factory=dict)
    faces: tuple[Sequence[Sequence[int]], Sequence[int], Sequence[int]] | None = None
    n_cells: int = 0


def plt(
    path: Path,
    variables: Sequence[str],
    zones: Sequence[Zone],
    *,
    version: int = 112,
    order: str = "<",
    kind: str = "f8",
    point: bool = False,
    extra: bytes = b"",
    file_type: int = 0,
) -> Path:
    """``extra`` stands in the header behind the zones."""

    def ints(*values: int) -> bytes:
        return struct.pack(f"{order}{len(values)}i", *values)

    def text(words: str) -> bytes:
        return ints(*words.encode(), 0)

    def real(value: float) -> bytes:
        return struct.pack(f"{order}f", value)

    out = b"#!TDV" + str(version).encode() + ints(1)
    out += ints(file_type) if version >= 111 else b""
    out += text("a title") + ints(len(variables)) + b"".join(map(text, variables))
    for zone in zones:
        out += real(299.0) + text(zone.name) + (ints(-1) if version >= 107 else b"")
        out += ints(zone.strand) + struct.pack(f"{order}d", zone.time) if version >= 106 else b""
        code = 7 if zone.faces else TYPES.get(zone.cell, 0)
        out += ints(-1, code) + (ints(int(point)) if version < 112 else b"")
        out += ints(1, *(int(k in zone.of_cells) for k in range(len(variables)))) if zone.of_cells else ints(0)
        out += ints(int(zone.neighbours)) if version >= 108 else b""
        out += ints(len(zone.links) and 1) if zone.links else ints(0)
        out += ints(zone.mode) + (ints(0) if version >= 108 and code else b"") if zone.links else b""
        if zone.shape:
            out += ints(*zone.shape)
        elif zone.faces:
            rings = zone.faces[0]
            out += ints(zone.n_points, len(rings), sum(map(len, rings)), 0, 0, zone.n_cells, 0, 0, 0)
        else:
            out += ints(zone.n_points, len(zone.nodes) or zone.n_cells, 0, 0, 0)
        out += b"".join(ints(1) + text(k) + ints(0) + text(v) for k, v in zone.auxiliary.items()) + ints(0)
    out += extra + real(357.0)
    for zone in zones:
        n = len(variables)
        own = [k for k in range(n) if k not in zone.shared and k not in zone.passive]
        given = {k: np.asarray(zone.arrays[k]) for k in own}
        kinds = {k: kind if a.dtype.kind == "f" else a.dtype.str[1:] for k, a in given.items()}
        out += real(299.0) + ints(*(KINDS[kinds.get(k, kind)] for k in range(n)))
        if version >= 105:
            out += ints(1, *(int(k in zone.passive) for k in range(n))) if zone.passive else ints(0)
        out += ints(1, *(zone.shared.get(k, -1) for k in range(n))) if zone.shared else ints(0)
        out += ints(zone.nodes_of)
        if version >= 103:
            out += b"".join(struct.pack(f"{order}2d", a.min(), a.max()) for a in given.values())
        ready = [a.astype(order + kinds[k]) for k, a in given.items()]
        if point:
            out += b"".join(a[i : i + 1].tobytes() for i in range(len(ready[0])) for a in ready)
        else:
            out += b"".join(a.tobytes() for a in ready)
        if zone.faces:
            rings, left, right = zone.faces
            out += ints(*np.cumsum([0, *map(len, rings)])) + ints(*(p for ring in rings for p in ring))
            out += ints(*left) + ints(*right)
        elif zone.cell and zone.nodes_of < 0:
            out += ints(*zone.nodes.ravel().tolist())
            out += ints(*[-1] * len(zone.nodes) * 6) if zone.neighbours else b""
        out += ints(*zone.links)
    path.write_bytes(out)
    return path


def drawing(order: str = "<") -> bytes:
    """A text, a line of three points, labels, a record and auxiliary data, as they stand in a header."""

    def pack(form: str, *values: float) -> bytes:
        return struct.pack(order + form, *values)

    def text(words: str) -> bytes:
        return pack(f"{len(words) + 1}i", *words.encode(), 0)

    def three() -> bytes:
        return pack("3d", 1, 2, 3)

    a_text = pack("f2i", 499.0, 0, 0) + three() + pack("2i", 0, 1) + pack("d", 3) + pack("i", 0) + pack("2d", 1, 1)
    a_text += pack("2i", 0, 7) + pack("2d", 0, 1) + pack("3i", 0, 0, 0) + text("") + pack("i", 0) + text("words")
    a_line = pack("f3i", 399.0, 4, 0, 0) + three() + pack("4i", 0, 0, 0, 0) + pack("2i", 0, 0) + pack("2d", 2, 0.1)
    a_line += pack("3i", 72, 0, 0) + pack("2d", 5, 12) + text("") + pack("2i", 1, 0)
    a_line += pack("2i", 1, 3) + pack("9f", *range(9))
    square = pack("f3i", 399.0, 0, 0, 0) + three() + pack("4i", 0, 0, 0, 0) + pack("2i", 2, 0) + pack("2d", 2, 0.1)
    square += pack("3i", 72, 0, 0) + pack("2d", 5, 12) + text("") + pack("2i", 2, 0) + pack("d", 1)
    labels = pack("fi", 599.0, 2) + text("one") + text("two")
    record = pack("f", 699.0) + text("a record")
    more = pack("f", 799.0) + text("name") + pack("i", 0) + text("value")
    variable = pack("fi", 899.0, 0) + text("name") + pack("i", 0) + text("value")
    return a_text + a_line + square + labels + record + more + variable
