"""Abaqus input files (.inp): parts, instances, includes, generated nodes and elements, sets and sections.

Own, because no reader at hand knows pyramids (C3D5), instances, generated elements or continued lines.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....errors import ReadError
from ....mesh import CellBlock, Mesh
from ....mesh.labels import LABEL
from ...plumbing import budget, meshio
from ...plumbing.build import Cells, Ints, gather
from ...plumbing.ids import Index, pad_labels
from ...plumbing.merge import Part, merge_parts
from ...plumbing.nodes import fill_middles
from ...plumbing.notes import count_note, mark_interfaces
from . import generate
from .deck import Deck, Reals, Section, take_elements, take_nodes, take_set
from .keywords import Keyword, Place, keywords
from .types import element_type

_SECTIONS = ("SOLID SECTION", "SHELL SECTION", "MEMBRANE SECTION", "COHESIVE SECTION", "GASKET SECTION")
_REFUSED = ("NMAP",)
"""Keywords that move nodes in ways that are not followed."""

MATERIAL = "abaqus:material"
_EMPTY = (np.empty((0, 3)), np.empty(0, np.uint8), np.zeros(1, np.int64), np.empty(0, np.int64))


@dataclass(slots=True)
class _Instance:
    name: str
    part: Deck
    own: Deck
    place: Place
    moves: list[list[float]] = field(default_factory=list)


@dataclass(slots=True)
class _Model:
    """The parts of a file and where it has them."""

    outside: Deck = field(default_factory=Deck)
    parts: dict[str, Deck] = field(default_factory=dict)
    instances: list[_Instance] = field(default_factory=list)
    has_fluid_surfaces: bool = False

    @property
    def decks(self) -> list[tuple[Deck, Deck, _Instance | None]]:
        """What the mesh is made of, in its order: a deck, that of the sets beside its own, and where it stands."""
        outside = self.outside
        decks: list[tuple[Deck, Deck, _Instance | None]] = []
        if outside.sections or outside.nodes.labels or not (self.instances or self.parts):
            decks.append((outside, outside, None))
        decks += [(one.own if one.own.nodes.labels else one.part, one.own, one) for one in self.instances]
        if not self.instances:
            decks += [(part, part, None) for part in self.parts.values()]
        return decks

    def deck_of(self, keyword: Keyword, here: Deck) -> Deck:
        """The deck that a set is of: that of an instance, if the set names one."""
        name = keyword.option("INSTANCE").upper()
        return next((one.own for one in self.instances if name and one.name.upper() == name), here)


def read(path: Path) -> Mesh:
    """A block for each element set that *ELEMENT names, of each instance.

    Cell data: ``abaqus:material`` numbers the materials of the solid sections from 1 (0 is none), with their names in
    field data; each other element set is data of 0 and 1 by its name. Couplings, springs and user elements are no
    cells: a note counts them.
    """
    model = model_of(keywords(path))
    whole = [_cells(deck, extra, path, deck.name if one is None else one.name, one) for deck, extra, one in model.decks]
    decks = [model.outside, *model.parts.values(), *(one.own for one in model.instances)]
    return _mesh(whole, decks, path)


def model_of(given: list[Keyword]) -> _Model:
    """What the keywords say, one after another."""
    model = _Model(has_fluid_surfaces=any(keyword.name == "FLUID PROPERTY" for keyword in given))
    here, instance = model.outside, None
    for keyword in given:
        name = keyword.option("NAME")
        match keyword.name:
            case "PART":
                here = model.parts.setdefault(name.upper(), Deck(name))
            case "END PART":
                here = model.outside
            case "INSTANCE":
                part = model.parts.get(keyword.option("PART").upper())
                if part is None:
                    raise keyword.fail(f"there is no part {keyword.option('PART')!r}")
                instance = _Instance(name, part, Deck(name), keyword.place, keyword.reals())
                here = instance.own
            case "END INSTANCE":
                if instance is not None:
                    model.instances.append(instance)
                here, instance = model.outside, None
            case "SYSTEM" if any(word for _, words in keyword.rows() for word in words):
                raise keyword.fail("coordinates in a *SYSTEM of their own cannot be read")
            case _:
                _take(keyword, model, here)
    return model


def _take(keyword: Keyword, model: _Model, deck: Deck) -> None:
    if keyword.name in _REFUSED:
        raise keyword.fail(f"*{keyword.name} is not followed; write the nodes out")
    if generate.take(keyword, deck):
        return
    if keyword.name == "NODE":
        take_nodes(keyword, deck)
    elif keyword.name == "ELEMENT":
        made = element_type(keyword.option("TYPE"), has_fluid_surfaces=model.has_fluid_surfaces)
        take_elements(keyword, deck, made)
    elif keyword.name == "ELSET":
        deck = model.deck_of(keyword, deck)
        take_set(keyword, deck.elsets, keyword.option("ELSET"), sum(len(s.labels) for s in deck.sections))
    elif keyword.name == "NSET" and "ELSET" not in keyword.options:
        deck = model.deck_of(keyword, deck)
        take_set(keyword, deck.nsets, keyword.option("NSET"), sum(map(len, deck.nodes.labels)))
    elif keyword.name in _SECTIONS:
        deck.materials[keyword.option("ELSET").upper()] = keyword.option("MATERIAL", keyword.option("COMPOSITE"))


@dataclass(slots=True)
class _Cells:
    """Cells of a part or an instance, and the section of each block."""

    part: Part
    sections: list[Section]
    materials: list[str]  #: names; cell data `MATERIAL` of the part count them from 1


def _cells(deck: Deck, extra: Deck, path: Path, name: str = "", moved: _Instance | None = None) -> _Cells:
    """Points and cells of a part, moved to where an instance has it."""
    if deck.unknown:
        what = ", ".join(f"{n} of type {kind!r}" for kind, n in deck.unknown.items())
        raise ReadError(f"{path}: has elements of types that are not known: {what}")
    labels, points = deck.nodes.joined()
    if not deck.sections and not len(labels):
        return _Cells(Part("", *_EMPTY), [], [])
    index = Index(labels)
    types, sizes, nodes = [np.empty(0, np.uint8)], [np.empty(0, np.int64)], [np.empty(0, np.int64)]
    for section in deck.sections:
        n, width = section.nodes.shape
        places = index.of(section.nodes.ravel())
        is_wrong = (places < 0) & (section.nodes.ravel() != 0)  # 0 is a node that the deck leaves out
        if is_wrong.any():
            at = int(np.argmax(is_wrong))
            element, bad = int(section.labels[at // width]), int(section.nodes.flat[at])
            raise ReadError(
                f"{path}: element {element} ({section.kind.name}) refers to node {bad}, which does not exist"
            )
        cells = gather(places, np.arange(n) * width, np.zeros(n, np.int64), {0: section.kind})
        types.append(cells.types)
        sizes.append(np.diff(cells.offsets))
        nodes.append(cells.connectivity)
    ends = np.concatenate([[0], np.cumsum(np.concatenate(sizes))]).astype(np.int64)
    whole = Cells(np.concatenate(types), ends, np.concatenate(nodes))
    elements = np.concatenate([np.empty(0, np.int64), *(section.labels for section in deck.sections)])
    points, notes = fill_middles(points, whole)
    if len(whole.connectivity) and whole.connectivity.min() < 0:
        at = int(np.searchsorted(ends, np.argmin(whole.connectivity), side="right")) - 1
        raise ReadError(f"{path}: element {int(elements[at])} lacks a node that is no middle of an edge")
    if moved is not None:
        budget.draw("generated", len(points) + len(elements), f"the instance {name!r}", moved.place.fail)
    placed = points if moved is None else _move(points, moved)
    made = Part(name, placed, whole.types, whole.offsets, whole.connectivity, notes=list(notes))
    data, materials = _sets(deck, extra, elements)
    made.cell_data = {**data, LABEL: elements}
    made.point_data = {LABEL: pad_labels(labels, len(points))}
    return _Cells(made, deck.sections, materials)


def _sets(deck: Deck, extra: Deck, labels: Ints) -> tuple[dict[str, NDArray[Any]], list[str]]:
    """Which elements are in each set, and of which material each is; the names of the materials."""
    elements = Index(labels)
    data: dict[str, NDArray[Any]] = {}
    elsets = dict(deck.elsets)
    if extra is not deck:
        for name, members in extra.elsets.items():
            elsets[name] = [*elsets.get(name, []), *members]
    materials = {**deck.materials, **extra.materials}
    numbers = {name: number for number, name in enumerate(sorted({*materials.values()} - {""}), 1)}
    material = np.zeros(elements.n, np.int64)
    kept = set(sorted(elsets)[: meshio.MAX_SETS])
    for name, members in elsets.items():
        if name not in kept and name not in materials:
            data[name] = np.empty(0, np.uint8)  # it is left out, but counted: names times elements may be too many
            continue
        budget.draw("mesh", elements.n, f"the set {name!r}")
        member = np.zeros(elements.n, np.uint8)
        at = elements.of(np.concatenate([np.empty(0, np.int64), *members]))
        member[at[at >= 0]] = 1
        if name in materials:
            material[member == 1] = numbers.get(materials[name], 0)
        data[name] = member
    if numbers:
        data[MATERIAL] = material
    return data, list(numbers)


def _move(points: Reals, instance: _Instance) -> Reals:
    """Points translated, then rotated about an axis through two points by an angle in degrees."""
    moves = instance.moves
    if moves and len(moves[0]) <= 3:
        points = points + np.array((*moves[0], 0.0, 0.0, 0.0)[:3])
    if len(moves) > 1:
        if len(moves[1]) != 7:
            raise instance.place.fail(f"the rotation of an instance has {len(moves[1])} numbers, expected 7")
        points = generate.rotate(points, np.array(moves[1][:3]), np.array(moves[1][3:6]), moves[1][6], instance.place)
    return points


def _mesh(whole: list[_Cells], decks: list[Deck], path: Path) -> Mesh:
    parts = [one.part for one in whole]
    blocks, at = [], 0
    for one in whole:
        for section in one.sections:
            size = len(section.labels)
            if size:
                label = ": ".join(word for word in (one.part.name, section.elset) if word)
                budget.draw("made", len(label), "the names of blocks")
                blocks.append(CellBlock(label, at, at + size))
                at += size
    apart = sum((deck.apart for deck in decks), Counter[str]())
    notes = count_note("Couplings, gaps, springs and user elements are no cells and were left out", apart)
    if at == 0:
        raise ReadError(f"{path}: no elements were found in it{'' if not apart else ': ' + notes[0]}")
    used = [np.unique(one.part.cell_data.get(MATERIAL, _EMPTY[3])).tolist() for one in whole]
    names = sorted({one.materials[k - 1] for one, numbers in zip(whole, used, strict=True) for k in numbers if k})
    budget.draw_names(names, "the names of materials")
    sets = sorted({name for p in parts for name in p.cell_data} - {MATERIAL, LABEL})
    for one in whole:
        part, n, own = one.part, len(one.part.types), one.part.cell_data
        part.cell_data = {k: own.get(k, np.zeros(n, np.uint8)) for k in sets[: meshio.MAX_SETS]}
        part.cell_data[LABEL] = own.get(LABEL, np.zeros(n, np.int64))
        if names:
            numbers = [0, *(names.index(name) + 1 if name in names else 0 for name in one.materials)]
            part.cell_data[MATERIAL] = np.array(numbers, np.int64)[own.get(MATERIAL, np.zeros(n, np.int64))]
    mesh = merge_parts(parts, path=path, field_data={f"{MATERIAL}:names": np.array(names)} if names else None)
    more = max(len(sets) - meshio.MAX_SETS, 0)
    notes += (f"{more} of {len(sets)} element sets were left out.",) if more else ()
    lesser = sum((deck.lesser for deck in decks), Counter[str]())
    notes += count_note("Nodes in faces are given of some elements only; those were read without", lesser)
    is_interface = np.concatenate([np.full(len(s.labels), s.is_interface) for one in whole for s in one.sections])
    return mark_interfaces(mesh.replace(blocks=tuple(blocks), notes=(*mesh.notes, *notes)), is_interface)
