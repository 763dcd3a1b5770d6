"""The element blocks of an Exodus file, and what their elements are."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from ...cells import BY_NAME
from ...errors import ReadError
from ..plumbing.build import Kind
from ..plumbing.netcdf import Variable

_HEX20 = (*range(12), 16, 17, 18, 19, 12, 13, 14, 15)  # upright edges stand before the upper ones
_WEDGE15 = (*range(9), 12, 13, 14, 9, 10, 11)
KINDS = {
    "TET": {4: Kind("tetra", 4), 10: Kind("tetra10", 10)},
    "PYR": {5: Kind("pyramid", 5), 13: Kind("pyramid13", 13), 14: Kind("lagrange_pyramid", 14)},
    "WED": {6: Kind("wedge", 6), 15: Kind("wedge15", 15, _WEDGE15), 18: Kind("wedge18", 18, (*_WEDGE15, 15, 16, 17))},
    "HEX": {
        8: Kind("hexahedron", 8),
        20: Kind("hexahedron20", 20, _HEX20),
        27: Kind("hexahedron27", 27, (*_HEX20, 23, 24, 25, 26, 21, 22, 20)),
    },
    "TRI": {3: Kind("triangle", 3), 6: Kind("triangle6", 6), 7: Kind("triangle7", 7)},
    "QUA": {4: Kind("quad", 4), 8: Kind("quad8", 8), 9: Kind("quad9", 9)},
    "BAR": {2: Kind("line", 2), 3: Kind("line3", 3)},
    "SPH": {1: Kind("vertex", 1)},
}
_FAMILIES = {
    "TET": "higher_order_tetra",
    "PYR": "higher_order_pyramid",
    "WED": "higher_order_wedge",
    "HEX": "higher_order_hexahedron",
    "TRI": "lagrange_triangle",
    "QUA": "lagrange_quad",
}
"""Of other numbers of nodes no more is known than that the corners come first."""
_SAME = {"BEA": "BAR", "TRU": "BAR", "EDG": "BAR", "CIR": "SPH", "POI": "SPH", "NOD": "SPH"}


@dataclass(slots=True)
class Block:
    """One element block."""

    number: int
    name: str  #: empty if it has none
    element: str  #: the first three letters of its type, upper case
    n: int
    connect: Variable


def blocks(arrays: Mapping[str, Variable], path: Path) -> list[Block]:
    """All of a file, in the order of their numbers. Raises `ReadError`."""
    names = arrays["eb_names"].text() if "eb_names" in arrays else []
    made = []
    for key, variable in arrays.items():
        match = re.fullmatch(r"connect(\d+)", key)
        if match is None:
            continue
        number = int(match.group(1)[:9])
        element = str(variable.attributes.get("elem_type", "")).upper().replace("SHELL", "QUAD")[:3]
        counts = f"ebepecnt{number}"
        n = arrays[counts].shape[0] if counts in arrays else variable.shape[0]
        name = names[number - 1] if 0 < number <= len(names) else ""
        made.append(Block(number, name, _SAME.get(element, element), n, variable))
    made.sort(key=lambda b: b.number)
    faces = [b for b in made if b.element == "NFA"]
    if faces and not any(re.fullmatch(r"fbconn\d+", key) for key in arrays):
        raise ReadError(f"{path}: has polyhedra, but no faces")
    return made


def kind_of(block: Block, width: int, path: Path) -> Kind:
    """What its elements of so many nodes are. Raises `ReadError`."""
    kind = KINDS.get(block.element, {}).get(width)
    if kind is not None:
        return kind
    row = BY_NAME.get(_FAMILIES.get(block.element, ""))
    if row is None or width < (row.shape.n_nodes if row.shape is not None else row.n_corners):
        name = block.connect.attributes.get("elem_type", "")
        raise ReadError(f"{path}: block {block.number}: elements {name!r} of {width} nodes are not known")
    return Kind(row.name, width)


def block_name(block: Block, ids: NDArray[Any]) -> tuple[int, str]:
    """The number of a block, of those of all blocks, and what it is called."""
    number = int(ids[block.number - 1]) if len(ids) >= block.number else block.number
    return number, block.name or f"block {number}"


def of_corners(block: Block, kind: Kind, width: int) -> list[str]:
    """A note, if no more is known of its elements than that the corners come first."""
    if kind in KINDS.get(block.element, {}).values() or not block.n:
        return []
    return [f"Of {kind.name} cells of {width} nodes the corners are in place, the others as filed."]
