"""Nastran bulk data (.bdf, .dat's relatives): GRID points in any coordinate system, elements, properties, materials.

Own, because meshio takes the order of nodes of 20-node hexahedra and 15-node wedges for VTK's, and coordinates of
cylindrical and spherical systems for rectangular ones.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ....errors import ReadError
from ....mesh import Mesh
from ...plumbing.build import Ints, Kind, gathered
from ...plumbing.format import Format, anything
from ...plumbing.ids import Index
from .cards import Card, cards
from .systems import KINDS as SYSTEMS
from .systems import Systems

_HEX20 = (*range(12), 16, 17, 18, 19, 12, 13, 14, 15)  # upright edges stand before the upper ones
_WEDGE15 = (*range(9), 12, 13, 14, 9, 10, 11)
_TETRA = (Kind("tetra", 4), Kind("tetra10", 10))
_PYRAMID = (Kind("pyramid", 5), Kind("pyramid13", 13))
_WEDGE = (Kind("wedge", 6), Kind("wedge15", 15, _WEDGE15))
_HEXAHEDRON = (Kind("hexahedron", 8), Kind("hexahedron20", 20, _HEX20))
_SOLIDS = (_TETRA, _PYRAMID, _WEDGE, _HEXAHEDRON)
_TRIANGLE = (Kind("triangle", 3), Kind("triangle6", 6))
_QUAD = (Kind("quad", 4), Kind("quad8", 8))
_LINE = (Kind("line", 2),)
_ELEMENTS: dict[str, tuple[Kind, ...]] = {
    **dict.fromkeys(("CTETRA",), _TETRA),
    **dict.fromkeys(("CPYRAM", "CPYRA"), _PYRAMID),
    **dict.fromkeys(("CPENTA", "CPENTCZ", "CIFPENT"), _WEDGE),
    **dict.fromkeys(("CHEXA", "CHEXCZ", "CIFHEX"), _HEXAHEDRON),
    **dict.fromkeys(("CTRIA3", "CTRIAR"), _TRIANGLE[:1]),
    "CTRIA6": _TRIANGLE,
    **dict.fromkeys(("CQUAD4", "CQUADR", "CSHEAR"), _QUAD[:1]),
    "CQUAD8": _QUAD,
    "CQUAD": (*_QUAD, Kind("quad9", 9)),
    **dict.fromkeys(("CBAR", "CBEAM", "CBEND", "CROD", "CTUBE", "CONROD", "CGAP", "CBUSH"), _LINE),
}
_POINTS_FIRST = ("CONROD",)  # no property stands before the points
_NO_CELLS = ("CORD", "CELAS", "CDAMP", "CMASS", "CONM", "CVISC", "CHBDY", "CONV", "CWELD", "CFAST", "CSEAM", "CBUSH1D",
             "CBUSH2D", "CAABSF", "CHACAB", "CHACBR", "CAERO", "CREEP", "CSSCHD", "CSUPER", "CSUPEXT", "CYJOIN",
             "CYSUP", "CYAX", "CLOAD", "CMFREE", "CRAC", "CRIG", "CSPR", "CFLUID", "CSLOT", "CTAB", "COUP", "CSET",
             "CDUM", "CGEN", "CINTC", "CMREBA", "CAMPAIGN", "CONTRLT", "CONCTL", "COHE", "COMPUDS")  # fmt: skip
_MATERIAL = ("PSOLID", "PLSOLID", "PSHELL", "PBAR", "PBARL", "PROD", "PBEAM", "PBEAML", "PTUBE", "PSHEAR", "PBEND")
"""Properties whose second field is a material."""
_SHOWN = 8


@dataclass(slots=True)
class _Found:
    labels: list[int] = field(default_factory=list)
    systems_of: list[int] = field(default_factory=list)
    points: list[tuple[float, float, float]] = field(default_factory=list)
    grids: list[Card] = field(default_factory=list)
    system: int = 0  # of points that name none
    systems: dict[int, tuple[Card, int]] = field(default_factory=dict)
    elements: list[tuple[Card, Kind, int, list[int]]] = field(default_factory=list)  # with the property
    materials: dict[int, int] = field(default_factory=dict)
    beside: Counter[str] = field(default_factory=Counter)
    straight: int = 0


def read(path: Path) -> Mesh:
    """Cell data ``nastran:property`` and, where properties name them, ``nastran:material``.

    Elements that lack some of the nodes at the middles of their edges are read by their corners. Springs, masses, rigid
    elements and surfaces of heat are no cells: a note counts them. Files that are included are read if they are in the
    folder of the file or below it.
    """
    found = _Found()
    for card in cards(path):
        _take(card, found)
    if not found.elements:
        raise ReadError(f"{path}: no elements were found in it")
    return _mesh(found, path)


def _take(card: Card, found: _Found) -> None:
    name = card.name
    if name == "GRID":
        found.labels.append(card.integer(0))
        found.systems_of.append(card.integer(1, -1))
        found.points.append((card.real(2), card.real(3), card.real(4)))
        found.grids.append(card)
    elif name in _ELEMENTS:
        _element(card, found)
    elif name == "GRDSET":
        found.system = card.integer(1, 0)
    elif name in SYSTEMS:
        for place in (0, 4) if name.startswith("CORD1") and card.text(4) else (0,):
            found.systems[card.integer(place)] = (card, place)
    elif name in _MATERIAL and card.text(1):
        found.materials[card.integer(0)] = card.integer(1)
    elif name.startswith("C") and not name.startswith("CORD"):
        if not name.startswith(_NO_CELLS):
            raise card.fail("is a card that is not known, and may be an element")
        found.beside[name] += 1
    elif name.startswith(("RBE", "RBAR", "RROD", "RTRPLT", "PLOTEL")):
        found.beside[name] += 1


def _element(card: Card, found: _Found) -> None:
    """By as many points as the card has; one that lacks some nodes at the middles of its edges has its corners."""
    first = 1 if card.name in _POINTS_FIRST else 2
    kinds = _ELEMENTS[card.name]
    largest = kinds[-1].n_nodes
    words = [card.text(place) for place in range(first, first + largest)]
    nodes = [_node(card, first + k) if word else 0 for k, word in enumerate(words)]
    if kinds in _SOLIDS and card.text(first + largest).isdigit():
        raise card.fail(f"{card.text(0)} has more than {largest} points")
    if card.name == "CBUSH" and not nodes[1]:  # a spring to the ground
        found.beside[card.name] += 1
        return
    n = max((k for k, node in enumerate(nodes, 1) if node), default=0)
    kind = next((kind for kind in kinds if kind.n_nodes >= n), kinds[-1])
    if not all(nodes[: kind.n_nodes]):
        if not all(nodes[: kinds[0].n_nodes]):
            raise card.fail(f"{card.text(0)} has {n} points, expected {' or '.join(str(k.n_nodes) for k in kinds)}")
        kind = kinds[0]
        found.straight += 1
    number = 0 if card.name in _POINTS_FIRST else card.integer(1, card.integer(0))
    found.elements.append((card, kind, number, nodes[: kind.n_nodes]))


def _node(card: Card, place: int) -> int:
    node = card.integer(place)
    if node < 0:
        raise card.fail(f"refers to point {node}")
    return node


def _mesh(found: _Found, path: Path) -> Mesh:
    labels = _whole(found.labels, path)
    index = Index(labels)
    if index.has_duplicates:
        raise ReadError(f"{path}: a point (GRID) is given twice")
    points = _basic(found, index, path)
    kinds = sorted({kind.name: kind for _, kind, _, _ in found.elements}.values(), key=lambda kind: kind.n_nodes)
    codes = {kind.name: code for code, kind in enumerate(kinds)}
    ids = _whole([node for *_, nodes in found.elements for node in nodes], path)
    places = index.of(ids)
    sizes = np.array([len(nodes) for *_, nodes in found.elements], np.int64)
    if (places < 0).any():
        at = int(np.argmax(places < 0))
        card = found.elements[int(np.searchsorted(np.cumsum(sizes), at, side="right"))][0]
        raise card.fail(f"{card.text(0)} refers to point {int(ids[at])}, which does not exist")
    made = gathered(
        places,
        np.cumsum(sizes) - sizes,
        np.array([codes[kind.name] for _, kind, _, _ in found.elements], np.int64),
        dict(enumerate(kinds)),
    )
    properties = _whole([number for _, _, number, _ in found.elements], path)
    data = {"nastran:property": properties}
    if any(int(number) in found.materials for number in np.unique(properties)):
        keys, inverse = np.unique(properties, return_inverse=True)
        of_key = _whole([found.materials.get(int(key), 0) for key in keys], path)
        data["nastran:material"] = of_key[inverse.reshape(-1)]
    return Mesh(
        points,
        made.types,
        made.offsets,
        made.connectivity,
        cell_data=data,
        path=str(path),
        notes=tuple(_notes(found)),
        copy=False,
    )


def _notes(found: _Found) -> list[str]:
    notes = []
    if found.straight:
        notes.append(f"{found.straight} elements have nodes on some of their edges only; their corners are read.")
    if found.beside:
        what = ", ".join(f"{n} {name}" for name, n in sorted(found.beside.items())[:_SHOWN])
        notes.append(f"Springs, masses, rigid elements and the like are no cells and were left out: {what}.")
    return notes


def _whole(numbers: list[int], path: Path) -> Ints:
    try:
        return np.array(numbers, np.int64)
    except OverflowError:
        raise ReadError(f"{path}: a number is too large: {max(numbers, key=abs)}") from None


def _basic(found: _Found, index: Index, path: Path) -> NDArray[np.float64]:
    """Points in the basic coordinate system."""
    given = np.array(found.points, np.float64).reshape(-1, 3)
    number = np.array([found.system if n < 0 else n for n in found.systems_of], np.int64)
    points = given.copy()

    def point(label: int, asks: Card) -> NDArray[np.float64]:
        place = int(index.of(np.array([label], np.int64))[0])
        if place < 0:
            raise asks.fail(f"refers to point {label}, which does not exist")
        return np.asarray(systems.of(int(number[place]), asks).basic(given[place : place + 1])[0])

    systems = Systems(found.systems, point)
    for key in np.unique(number).tolist():
        if key:
            mine = np.flatnonzero(number == key)
            points[mine] = systems.of(key, found.grids[int(mine[0])]).basic(given[mine])
    return points


NASTRAN = Format("nastran", "Nastran", (".bdf", ".fem", ".nas", ".nastran"), anything, read, by_content=False)
