"""SU2 (.su2), of one zone or several. Own, because meshio mixes up the points of several zones."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ....errors import ReadError
from ....mesh import CellBlock, Mesh
from ....mesh.plane import seen_from
from ...plumbing.build import Cells, Kind, check_codes, gather
from ...plumbing.face_based import offsets_of
from ...plumbing.format import Format
from ...plumbing.merge import Part, merge_parts
from ...plumbing.text import Text
from . import write
from .nodes import nodes
from .places import places

_KINDS = {
    1: Kind("vertex", 1),
    3: Kind("line", 2),
    5: Kind("triangle", 3),
    9: Kind("quad", 4),
    10: Kind("tetra", 4),
    12: Kind("hexahedron", 8),
    13: Kind("wedge", 6),
    14: Kind("pyramid", 5),
}
_MARK = re.compile(rb"^\s*(NDIME|NZONE|NELEM|NPOIN)\s*=", re.MULTILINE)


def sniff(head: bytes, path: Path) -> bool:
    return _MARK.search(head) is not None


@dataclass(slots=True)
class _Zone:
    number: int
    dimension: int = 3
    points: NDArray[np.float64] | None = None
    blocks: list[tuple[str, int, Cells]] = field(default_factory=list)  # name, marker, cells


def read(path: Path) -> Mesh:
    """The elements of a zone, then those of its markers: a block each.

    Cell data ``su2:zone`` counts the zones from 1, ``su2:marker`` the markers of the file from 1; 0 is the inside.
    """
    text = Text(path, path.read_bytes(), b"%")
    zones, stated, markers, tag = [_Zone(1)], 1, 0, ""
    skipped: dict[str, None] = {}
    while line := text.line():
        key, is_key, value = (part.strip() for part in line.partition(b"="))
        if not is_key:
            raise text.fail(f"{line[:40].decode('utf-8', 'replace')!r} where a keyword and '=' are expected")
        match key.upper():
            case b"NZONE":
                stated = text.count("zones", value)
            case b"IZONE":
                if zones[-1].points is not None or zones[-1].blocks:
                    zones.append(_Zone(len(zones) + 1))
            case b"NDIME":
                zones[-1].dimension = _dimension(text, value)
            case b"NELEM":
                zones[-1].blocks.append(("", 0, _elements(text, value)))
            case b"NPOIN":
                zones[-1].points = _points(text, value, zones[-1].dimension)
            case b"MARKER_TAG":
                tag, markers = value.decode("utf-8", "replace"), markers + 1
            case b"MARKER_ELEMS":
                if tag.upper() == "SEND_RECEIVE":
                    _skip_send_receive(text, value)
                else:
                    zones[-1].blocks.append((tag, markers, _elements(text, value)))
            case _:  # NMARK, NCHUNK and keywords of the flow solver are one line each; FFD, NPERIODIC, ... have more
                first = text.row
                while (following := text.peek()) and b"=" not in following:
                    text.row += 1
                if text.row > first:
                    skipped[key.decode("utf-8", "replace")] = None
    if len(zones) != stated:
        raise ReadError(f"{path}: states {stated} zones, but holds {len(zones)}")
    mesh = _mesh(zones, path)
    if not skipped:
        return mesh
    return mesh.replace(notes=(*mesh.notes, f"Sections that hold no mesh were left out: {', '.join(skipped)}."))


def _dimension(text: Text, value: bytes) -> int:
    if value not in (b"2", b"3"):
        raise text.fail(f"NDIME= {value[:20].decode('utf-8', 'replace')}, expected 2 or 3")
    return int(value)


def _elements(text: Text, value: bytes) -> Cells:
    n, first = text.count("elements", value), text.row
    rows = text.ragged(n, "elements")
    if n and int(rows.sizes.min()) < 1:
        raise text.fail("an element without a type", first)
    codes = rows.values[rows.starts[:-1]]
    check_codes(codes, rows.sizes - 1, _KINDS, lambda what, row: text.fail(what, first + row), more=1)
    return gather(rows.values, rows.starts[:-1] + 1, codes, _KINDS)


def _points(text: Text, value: bytes, dimension: int) -> NDArray[np.float64]:
    rows = text.reals(text.count("points", value), dimension, "coordinates")
    return np.pad(rows, ((0, 0), (0, 3 - dimension)))


def _skip_send_receive(text: Text, value: bytes) -> None:
    n = text.count("elements", value)
    if text.peek().upper().startswith((b"SEND_TO", b"SEND_RECV")):
        text.line()
    text.lines(n, "elements")


def _mesh(zones: list[_Zone], path: Path) -> Mesh:
    parts, names, sizes, markers = [], [], [], []
    none = np.empty(0, np.int64)
    for zone in zones:
        if zone.points is None:
            raise ReadError(f"{path}: zone {zone.number} has no points (NPOIN)")
        parts.append(
            Part(
                name="",
                points=zone.points,
                types=np.concatenate([np.empty(0, np.uint8), *(c.types for _, _, c in zone.blocks)]),
                offsets=offsets_of(np.concatenate([none, *(np.diff(c.offsets) for _, _, c in zone.blocks)])),
                connectivity=np.concatenate([none, *(c.connectivity for _, _, c in zone.blocks)]),
            )
        )
        _check_ids(parts[-1], zone, path)
        for name, marker, cells in zone.blocks:
            names.append(name or f"zone {zone.number}")
            sizes.append(len(cells.types))
            markers.append(marker)
    mesh = merge_parts(parts, path=path)
    starts = np.concatenate([[0], np.cumsum(sizes)]).astype(int).tolist()
    blocks = [CellBlock(name, a, b) for name, a, b in zip(names, starts[:-1], starts[1:], strict=True) if b > a]
    data = {"su2:marker": np.repeat(np.array(markers, np.int32), sizes)}
    if len(zones) > 1:
        data["su2:zone"] = np.repeat(np.arange(1, len(zones) + 1, dtype=np.int32), [len(p.types) for p in parts])
    in_plane = all(zone.dimension == 2 for zone in zones)
    return seen_from(mesh.replace(blocks=tuple(blocks), cell_data=data), 1 if in_plane else mesh.up)


def _check_ids(part: Part, zone: _Zone, path: Path) -> None:
    """Before the zones are joined: an id beyond the last point of its zone would be a point of the next."""
    ids, n = part.connectivity, len(part.points)
    if len(ids) and not 0 <= int(ids.min()) <= int(ids.max()) < n:
        bad = int(ids[np.argmax((ids < 0) | (ids >= n))])
        raise ReadError(f"{path}: an element of zone {zone.number} refers to point {bad}, which is outside 0..{n - 1}")


SU2 = Format(
    "su2",
    "SU2",
    (".su2",),
    sniff,
    read,
    write=write.write,
    places=places,
    nodes=nodes,
    reduce=write.reduce,
    has_both_wedge_orders=True,
)
