"""Nastran bulk data (.bdf, .dat, ...): GRID points in any coordinate system, elements, properties, superelements.

Own, because meshio takes the order of nodes of 20-node hexahedra and 15-node wedges for VTK's, and coordinates of
cylindrical and spherical systems for rectangular ones.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....errors import ReadError
from ....mesh import Mesh
from ....mesh.labels import LABEL
from ...plumbing import included
from ...plumbing.build import Cells, Ints, Kind, gather
from ...plumbing.format import Format
from ...plumbing.ids import Index, pad_labels
from ...plumbing.merge import Part, merge_parts
from ...plumbing.nodes import Reals, fill_middles
from ...plumbing.notes import count_note, mark_interfaces
from .cards import Card, cards
from .elements import ELEMENTS, INTERFACES, NO_CELLS, POINTS_FIRST, SOLIDS
from .nodes import nodes
from .places import places
from .systems import KINDS as SYSTEMS
from .systems import Systems

_MARK = re.compile(
    rb"^(BEGIN[ \t]+BULK|CEND|(GRID|CTETRA|CHEXA|CPENTA)\*?[ \t]*[ ,\t0-9])", re.IGNORECASE | re.MULTILINE
)
_MATERIAL = ("PSOLID", "PLSOLID", "PSHELL", "PBAR", "PBARL", "PROD", "PBEAM", "PBEAML", "PTUBE", "PSHEAR", "PBEND")
"""Properties whose second field is a material."""
_EXTENSIONS = (".bdf", ".fem", ".nas", ".nastran", ".dat", ".blk", ".pch")


def sniff(head: bytes, path: Path) -> bool:
    """Extensions that are Nastran's alone are believed."""
    return path.suffix.lower() in _EXTENSIONS[:4] or _MARK.search(head) is not None


@dataclass(slots=True)
class _Bulk:
    """The bulk data of the model, or of one superelement."""

    name: str = ""
    labels: list[int] = field(default_factory=list)
    systems_of: list[int] = field(default_factory=list)
    points: list[tuple[float, float, float]] = field(default_factory=list)
    grids: list[Card] = field(default_factory=list)
    system: int = 0  #: of points that name none
    systems: dict[int, tuple[Card, int]] = field(default_factory=dict)
    elements: list[tuple[Card, Kind, int, list[int]]] = field(default_factory=list)  #: with the property
    materials: dict[int, int] = field(default_factory=dict)
    beside: Counter[str] = field(default_factory=Counter)
    straight: Counter[str] = field(default_factory=Counter)


def read(path: Path) -> Mesh:
    """Cell data ``nastran:property`` and, where properties name them, ``nastran:material``.

    Springs, masses, rigid elements and surfaces of heat are no cells: a note counts them. Files that are included are
    read if they are in the folder of the file or below it. Each superelement is a block, with points of its own.
    """
    bulks = [_Bulk()]
    for card in cards(path):
        if card.name == "BEGIN":
            if card.text(0):
                bulks.append(_Bulk(f"superelement {card.text(0)}"))
        else:
            _take(card, bulks[-1])
    if not any(bulk.elements for bulk in bulks):
        raise ReadError(f"{path}: no elements were found in it")
    made = [_part(bulk, path) for bulk in bulks if bulk.elements or bulk.labels]
    mesh = merge_parts([part for part, _ in made], path=path)
    beside = sum((bulk.beside for bulk in bulks), Counter[str]())
    straight = sum((bulk.straight for bulk in bulks), Counter[str]())
    notes = (
        *count_note("Surfaces with nodes on some of their edges only were read by their corners", straight),
        *count_note("Springs, gaps, masses, rigid elements and the like are no cells and were left out", beside),
    )
    data = dict(mesh.cell_data)
    if _MATERIALS in data:
        data[_MATERIALS] = np.nan_to_num(data[_MATERIALS]).astype(np.int64)  # of superelements without materials
    mesh = mesh.replace(cell_data=data, notes=(*mesh.notes, *notes))
    return mark_interfaces(mesh, np.concatenate([is_interface for _, is_interface in made]))


_MATERIALS = "nastran:material"


def _take(card: Card, bulk: _Bulk) -> None:
    name = card.name
    if name == "GRID":
        bulk.labels.append(card.integer(0))
        bulk.systems_of.append(card.integer(1, -1))
        bulk.points.append((card.real(2), card.real(3), card.real(4)))
        bulk.grids.append(card)
    elif name in ELEMENTS:
        _element(card, bulk)
    elif name == "GRDSET":
        bulk.system = card.integer(1, 0)
    elif name in SYSTEMS:
        for place in (0, 4) if name.startswith("CORD1") and card.text(4) else (0,):
            bulk.systems[card.integer(place)] = (card, place)
    elif name in _MATERIAL and card.text(1):
        bulk.materials[card.integer(0)] = card.integer(1)
    elif name.startswith("C") and not name.startswith("CORD"):
        if not name.startswith(NO_CELLS):
            raise card.fail("is a card that is not known, and may be an element")
        bulk.beside[name] += 1
    elif name.startswith(("RBE", "RBAR", "RROD", "RTRPLT", "RSPLINE", "RJOINT", "RSSCON", "PLOTEL")):
        bulk.beside[name] += 1


def _element(card: Card, bulk: _Bulk) -> None:
    """By as many points as the card has; a solid that lacks some nodes at the middles of its edges has 0 there."""
    first = 1 if card.name in POINTS_FIRST else 2
    kinds = ELEMENTS[card.name]
    largest = kinds[-1].n_nodes
    words = [card.text(place) for place in range(first, first + largest)]
    nodes = [_node(card, first + k) if word else 0 for k, word in enumerate(words)]
    if kinds in SOLIDS and card.text(first + largest).isdigit():
        raise card.fail(f"{card.text(0)} has more than {largest} points")
    n = max((k for k, node in enumerate(nodes, 1) if node), default=0)
    kind = next((kind for kind in kinds if kind.n_nodes >= n), kinds[-1])
    if not all(nodes[: kind.n_nodes]):
        corners = [nodes[place] for place in (kind.order or range(n))[: kinds[0].n_nodes]]
        if len(corners) < kinds[0].n_nodes or not all(corners):
            raise card.fail(f"{card.text(0)} has {n} points, expected {' or '.join(str(k.n_nodes) for k in kinds)}")
        if kinds not in SOLIDS:
            kind, nodes = Kind(kinds[0].name, kinds[0].n_nodes), corners
            bulk.straight[card.name] += 1
    number = 0 if card.name in POINTS_FIRST else card.integer(1, card.integer(0))
    bulk.elements.append((card, kind, number, nodes[: kind.n_nodes]))


def _node(card: Card, place: int) -> int:
    node = card.integer(place)
    if node < 0:
        raise card.fail(f"refers to point {node}")
    return node


def _part(bulk: _Bulk, path: Path) -> tuple[Part, NDArray[np.bool_]]:
    """Points and cells, and which of the cells are interfaces."""
    labels = _whole(bulk.labels, path)
    index = Index(labels)
    if index.has_duplicates:
        raise ReadError(f"{path}: a point (GRID) is given twice{' in ' * bool(bulk.name)}{bulk.name}")
    cells = _cells(bulk, index, path)
    points, notes = fill_middles(_basic(bulk, index, path), cells)
    properties = _whole([number for _, _, number, _ in bulk.elements], path)
    data: dict[str, NDArray[Any]] = {
        LABEL: _whole([card.integer(0) for card, *_ in bulk.elements], path),
        "nastran:property": properties,
    }
    if any(int(number) in bulk.materials for number in np.unique(properties)):
        keys, inverse = np.unique(properties, return_inverse=True)
        of_key = _whole([bulk.materials.get(int(key), 0) for key in keys], path)
        data[_MATERIALS] = of_key[inverse.reshape(-1)]
    part = Part(bulk.name, points, cells.types, cells.offsets, cells.connectivity, cell_data=data, notes=list(notes))
    part.point_data = {LABEL: pad_labels(labels, len(points))}
    return part, np.array([card.name in INTERFACES for card, *_ in bulk.elements], bool)


def _cells(bulk: _Bulk, index: Index, path: Path) -> Cells:
    """All elements; -1 for a node that one leaves out."""
    elements = bulk.elements
    kinds = sorted({kind for _, kind, _, _ in elements}, key=lambda kind: (kind.n_nodes, kind.name, kind.order))
    codes = {kind: code for code, kind in enumerate(kinds)}
    ids = _whole([node for *_, nodes in elements for node in nodes], path)
    places = index.of(ids)
    sizes = np.array([len(nodes) for *_, nodes in elements], np.int64)
    wrong = (places < 0) & (ids != 0)
    if wrong.any():
        at = int(np.argmax(wrong))
        card = elements[int(np.searchsorted(np.cumsum(sizes), at, side="right"))][0]
        raise card.fail(f"{card.text(0)} refers to point {int(ids[at])}, which does not exist")
    of_cells = np.array([codes[kind] for _, kind, _, _ in elements], np.int64)
    return gather(places, np.cumsum(sizes) - sizes, of_cells, dict(enumerate(kinds)))


def _whole(numbers: list[int], path: Path) -> Ints:
    try:
        return np.array(numbers, np.int64)
    except OverflowError:
        raise ReadError(f"{path}: a number is too large: {max(numbers, key=abs)}") from None


def _basic(bulk: _Bulk, index: Index, path: Path) -> Reals:
    """Points in the basic coordinate system."""
    given = np.array(bulk.points, np.float64).reshape(-1, 3)
    number = np.array([bulk.system if n < 0 else n for n in bulk.systems_of], np.int64)
    points = given.copy()

    def point(label: int, asks: Card) -> Reals:
        place = int(index.of(np.array([label], np.int64))[0])
        if place < 0:
            raise asks.fail(f"refers to point {label}, which does not exist")
        return np.asarray(systems.of(int(number[place]), asks).basic(given[place : place + 1])[0])

    systems = Systems(bulk.systems, point)
    for key in np.unique(number).tolist():
        if key:
            mine = np.flatnonzero(number == key)
            points[mine] = systems.of(key, bulk.grids[int(mine[0])]).basic(given[mine])
    return points


NASTRAN = Format("nastran", "Nastran", _EXTENSIONS, sniff, read, places=places, nodes=nodes, included=included.nastran)
