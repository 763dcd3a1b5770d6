"""One zone of a CGNS file: its points, its cells, and the name of the region of each."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....cells import CELL_TYPES, IS_SOLID
from ....mesh.labels import LABEL
from ....mesh.polyhedra import Polyhedra
from ...plumbing import budget, face_based
from ...plumbing.build import Cells, Ints, Kind, gather
from ...plumbing.merge import Part
from ..structured import structured_part
from .cells import KINDS, MIXED, NFACE, NGON
from .tree import Node

CARTESIAN = ("CoordinateX", "CoordinateY", "CoordinateZ")
_CYLINDRICAL = ("CoordinateR", "CoordinateTheta", "CoordinateZ")
_NONE = np.empty(0, np.int64)
_SPARSEST = 64
"""Numbers of elements for each element there is: sections may leave gaps."""


@dataclass(slots=True)
class Zone:
    part: Part
    blocks: list[tuple[str, int, int]]
    shape: tuple[int, ...] = ()  #: points along each axis, in the file's order, if it is structured
    notes: list[str] = field(default_factory=list)


@dataclass(slots=True)
class _Section:
    """Elements of one section: their first number, and for faces and polyhedra their items."""

    name: str
    code: int
    first: int
    n: int
    cells: Cells | None = None
    offsets: Ints = field(default_factory=lambda: _NONE)
    items: Ints = field(default_factory=lambda: _NONE)
    parents: Ints | None = None


def zones(base: Node) -> list[Zone]:
    """Read those of a base. Raises `ReadError`."""
    dimension, families = of_base(base)
    return [zone(node, dimension, families) for node in base.children("Zone_t")]


def of_base(base: Node) -> tuple[int, dict[str, str]]:
    """The dimension of the cells of a base, and what its families are called. Raises `ReadError`."""
    dimensions = base.integers()
    if len(dimensions) != 2 or not 1 <= int(dimensions[0]) <= int(dimensions[1]) <= 3:
        raise base.fail(f"states the dimensions {dimensions.tolist()}")
    families = {}
    for family in base.children("Family_t"):
        parent = family.first("FamilyName_t")  # Gmsh: the physical group of an entity
        families[family.name] = parent.text().rsplit("/", 1)[-1] if parent is not None else family.name
    return int(dimensions[0]), families


@dataclass(frozen=True, slots=True)
class Head:
    """What a zone states.

    Attributes
    ----------
    label
        What its cells are called that no boundary lists.
    shape
        Points along each axis, in the file's order; of cells in no order one number.
    """

    label: str
    is_structured: bool
    shape: tuple[int, ...]
    notes: tuple[str, ...]


def head(node: Node, dimension: int, families: dict[str, str]) -> Head:
    """Read it. Raises `ReadError`."""
    kind = node.child("ZoneType")
    is_structured = kind is None or kind.text() in ("", "Structured")
    sizes = node.values().reshape(-1, dimension if is_structured else 1).astype(np.int64)
    shape = tuple(int(n) for n in sizes[0]) if is_structured else (int(np.prod(sizes[0])),)
    notes = [f"Zone {node.name!r} states no type: taken as structured."] if kind is None else []
    n_grids = len(list(node.children("GridCoordinates_t")))
    if n_grids > 1:
        notes.insert(0, f"Zone {node.name!r} has {n_grids} sets of coordinates; the first was read.")
    return Head(_family(node, families) or node.name, is_structured, shape, tuple(notes))


def zone(node: Node, dimension: int, families: dict[str, str]) -> Zone:
    """Read a zone.

    Raises
    ------
    ReadError
        If an array is missing or does not fit what the zone states.
    """
    known = head(node, dimension, families)
    notes = list(known.notes)
    points = _points(node, known)
    if known.is_structured:
        part = structured_part(known.label, known.shape, points)
        blocks = [(known.label, 0, len(part.types))]
    else:
        sections = _sections(node)
        part, codes, names = _unstructured(node, sections, points, families)
        blocks = [(names[code] or known.label, start, stop) for code, start, stop in runs(codes)]
        part.name = known.label
    _solutions(node, part, notes)
    return Zone(part, blocks, known.shape if known.is_structured else (), notes)


def _family(node: Node, families: dict[str, str]) -> str:
    child = node.first("FamilyName_t")
    name = child.text() if child is not None else ""
    return families.get(name, name)


def coordinates(node: Node, known: Head) -> tuple[dict[str, Node], list[tuple[int, int]]]:
    """The arrays of coordinates by name, and the points beyond the zone at both ends of each axis."""
    grids = list(node.children("GridCoordinates_t"))
    if not grids:
        raise node.fail("has no coordinates (GridCoordinates_t)")
    arrays = {child.name: child for child in grids[0].children("DataArray_t")}
    rind = grids[0].first("Rind_t")
    edges = rind.integers() if rind is not None else np.zeros(2 * len(known.shape), np.int64)
    if len(edges) != 2 * len(known.shape) or (edges < 0).any():
        raise grids[0].fail(f"has {edges.tolist()} for its rind")
    if not {"CoordinateR", "CoordinateTheta"} <= set(arrays) and not set(arrays) & set(CARTESIAN):
        raise grids[0].fail(f"has the coordinates {', '.join(arrays) or 'none'}, expected {', '.join(CARTESIAN)}")
    return arrays, [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def _points(node: Node, known: Head) -> NDArray[np.floating[Any]]:
    arrays, edges = coordinates(node, known)
    shape = known.shape

    def column(name: str) -> NDArray[np.floating[Any]]:
        values = arrays[name].values()
        expected = tuple(n + a + b for n, (a, b) in zip(shape, edges, strict=True))[::-1]
        if values.shape != expected or values.dtype.kind not in "fiu":
            raise arrays[name].fail(f"has shape {values.shape[::-1]}, expected {expected[::-1]}")
        inner = tuple(slice(a, a + n) for n, (a, _) in zip(shape, edges, strict=True))[::-1]
        return values[inner].ravel()

    n = int(np.prod(shape))
    if {"CoordinateR", "CoordinateTheta"} <= set(arrays):
        r, angle = column("CoordinateR"), column("CoordinateTheta")
        if "degree" in " ".join(_units(arrays["CoordinateTheta"])).lower():
            angle = np.radians(angle)
        z = column("CoordinateZ") if "CoordinateZ" in arrays else np.zeros(n)
        return np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)
    given = [name for name in CARTESIAN if name in arrays]
    columns = [column(name) for name in given]
    points = np.zeros((n, 3), np.result_type(*columns, np.float32))
    for name, values in zip(given, columns, strict=True):
        points[:, CARTESIAN.index(name)] = values
    return points


def _units(node: Node) -> Iterator[str]:
    for child in node.children("DimensionalUnits_t"):
        yield child.text()


def _sections(node: Node) -> list[_Section]:
    sections = [_section(child) for child in node.children("Elements_t")]
    if not sections:
        raise node.fail("has no elements (Elements_t)")
    sections.sort(key=lambda section: section.first)
    return sections


def section_head(node: Node) -> tuple[int, int, int, Node]:
    """Type, first number and number of elements of a section, and the node of their nodes. Raises `ReadError`."""
    head, bounds = node.integers(), node.child("ElementRange")
    connectivity = node.child("ElementConnectivity")
    if not len(head) or bounds is None or connectivity is None:
        raise node.fail("has no type, range or connectivity")
    ends = bounds.integers()
    if len(ends) != 2 or ends[0] < 1 or ends[1] < ends[0] - 1:
        raise node.fail(f"has elements {ends.tolist()}")
    return int(head[0]), int(ends[0]), int(ends[1] - ends[0] + 1), connectivity


def _section(node: Node) -> _Section:
    code, first, n, connectivity = section_head(node)
    made = _Section(node.name, code, first, n)
    ids, offsets = connectivity.integers(), node.child("ElementStartOffset")
    if made.n > len(ids):
        raise node.fail(f"states {made.n} elements, but has {len(ids)} items")
    starts = offsets.integers() if offsets is not None else None
    if made.code in (NGON, NFACE):
        made.offsets, made.items = _lists(node, ids, starts, made.n)
        parents = node.child("ParentElements")
        made.parents = parents.integers().reshape(2, -1) if parents is not None else None
        return made
    if made.code == MIXED:
        codes, at = _mixed(node, ids, starts, made.n)
    else:
        width = kind(node, made.code).n_nodes
        if len(ids) != made.n * width:
            raise node.fail(f"has {len(ids)} nodes of {made.n} elements of {width}")
        codes, at = np.full(made.n, made.code, np.int64), np.arange(made.n) * width
    made.cells = gather(ids - 1, at, codes, KINDS)
    return made


def kind(node: Node, code: int) -> Kind:
    """What elements of a type are. Raises `ReadError`."""
    if code not in KINDS:
        raise node.fail(f"is of elements of type {code}, which is not known")
    return KINDS[code]


def _lists(node: Node, ids: Ints, starts: Ints | None, n: int) -> tuple[Ints, Ints]:
    """Offsets and items of faces or polyhedra; before version 4 each list began with its length."""
    if starts is None:
        places, at = np.empty(n, np.int64), 0
        for k in range(n):
            if at >= len(ids):
                raise node.fail(f"has items of {k} elements, states {n}")
            places[k] = at
            at += 1 + max(int(ids[at]), 0)
        if at != len(ids):
            raise node.fail(f"has {len(ids)} items, {at} expected")
        sizes = ids[places]
        return face_based.offsets_of(sizes), np.delete(ids, places)
    if len(starts) != n + 1 or starts[0] != 0 or starts[-1] != len(ids) or (np.diff(starts) < 0).any():
        raise node.fail(f"has offsets that do not fit {n} elements of {len(ids)} items")
    return starts, ids


def _mixed(node: Node, ids: Ints, starts: Ints | None, n: int) -> tuple[Ints, Ints]:
    """Type and position of the first node of each element; each begins with its type."""
    if starts is None:
        places, at = np.empty(n, np.int64), 0
        for k in range(n):
            if at >= len(ids):
                raise node.fail(f"has {k} elements, states {n}")
            places[k] = at
            at += 1 + kind(node, int(ids[at])).n_nodes
    else:
        if len(starts) != n + 1 or (starts[:-1] < 0).any() or (starts[:-1] >= len(ids)).any():
            raise node.fail(f"has offsets that do not fit {n} elements of {len(ids)} items")
        places, at = starts[:-1], len(ids)
    codes = ids[places]
    for code in np.unique(codes).tolist():
        kind(node, code)
    sizes = np.array([KINDS[int(c)].n_nodes if int(c) in KINDS else 0 for c in range(64)])[codes]
    if at != len(ids) or (places + 1 + sizes > len(ids)).any() or int((1 + sizes).sum()) != len(ids):
        raise node.fail(f"has {len(ids)} items, which do not fit its {n} elements")
    return codes, places + 1


def _unstructured(
    node: Node, sections: list[_Section], points: NDArray[Any], families: dict[str, str]
) -> tuple[Part, Ints, list[str]]:
    """Cells of all sections in the order of their numbers, the place of the name of the region of each, the names."""
    if any(a.first + a.n > b.first for a, b in itertools.pairwise(sections)):
        raise node.fail("its sections have elements of the same numbers")
    last = last_number(node, [(section.first, section.n) for section in sections])
    listed, names = boundaries(node, last, families)
    faces = [section for section in sections if section.code == NGON]
    made: list[tuple[Cells, Polyhedra | None, Ints]] = []
    for section in sections:
        numbers = np.arange(section.first, section.first + section.n)
        if section.cells is not None:
            made.append((section.cells, None, numbers))
        elif section.code == NFACE:
            made.append((*_polyhedra(node, section, faces, points), numbers))
        elif listed[numbers].any():
            chosen = np.flatnonzero(listed[numbers])
            made.append((_polygons(section, chosen), None, numbers[chosen]))
    if faces and not any(section.code == NFACE for section in sections):
        made.append(_by_parents(node, faces, points))
    types = np.concatenate([np.empty(0, np.uint8), *(cells.types for cells, _, _ in made)])
    sizes = np.concatenate([_NONE, *(np.diff(cells.offsets) for cells, _, _ in made)])
    connectivity = np.concatenate([_NONE, *(cells.connectivity for cells, _, _ in made)])
    wrong = (connectivity < 0) | (connectivity >= len(points))
    if wrong.any():
        bad = int(connectivity[np.argmax(wrong)]) + 1
        raise node.fail(f"an element refers to point {bad}, which is outside 1..{len(points)}")
    part = Part("", points, types, face_based.offsets_of(sizes), connectivity, _join([(c, p) for c, p, _ in made]))
    part.notes += curved({CELL_TYPES[int(t)].name for t in np.unique(types)})
    numbers = np.concatenate([_NONE, *(numbers for *_, numbers in made)])
    part.cell_data[LABEL] = numbers
    part.point_data[LABEL] = np.arange(1, len(points) + 1)
    return part, np.where(numbers <= last, listed[np.minimum(numbers, last)], 0), names


def last_number(node: Node, sections: list[tuple[int, int]]) -> int:
    """The number behind the last of all elements, by the first and how many there are. Raises `ReadError`."""
    last = max(first + n for first, n in sections)
    if last > _SPARSEST * (sum(n for _, n in sections) + 1000):  # a number more is a byte of memory more
        raise node.fail(f"its elements are numbered up to {last - 1}, far beyond how many they are")
    return last


def curved(names: set[str]) -> list[str]:
    """A note on cells of which the corners alone are in place; pyramids of 14 nodes are not among them."""
    some = sorted(name for name in names if name.startswith(("higher_order", "lagrange_")))
    some = [name for name in some if name != "lagrange_pyramid"]
    return [f"Of {', '.join(some)} cells the corners are in place, the other nodes as filed."] if some else []


def _join(made: list[tuple[Cells, Polyhedra | None]]) -> Polyhedra | None:
    if all(poly is None for _, poly in made):
        return None
    n_faces, sizes, items, numbers = [], [_NONE], [_NONE], [_NONE]
    for cells, poly in made:
        if poly is None:
            n_faces.append(np.zeros(len(cells.types), np.int64))
            continue
        n_faces.append(np.diff(poly.cell_offsets))
        sizes.append(np.diff(poly.face_offsets))
        items.append(np.asarray(poly.face_points))
        assert poly.labels is not None  # as `face_based.solids` makes them
        numbers.append(np.asarray(poly.labels, np.int64))
    flat = np.concatenate(sizes)
    return Polyhedra(
        cell_offsets=face_based.offsets_of(np.concatenate(n_faces)),
        cell_faces=np.arange(len(flat)),
        face_offsets=face_based.offsets_of(flat),
        face_points=np.concatenate(items),
        labels=np.concatenate(numbers),
    )


def _all_faces(node: Node, faces: list[_Section]) -> tuple[Ints, Ints, Ints]:
    """Offsets and points of the faces of all sections, and the number of each."""
    sizes = np.concatenate([_NONE, *(np.diff(section.offsets) for section in faces)])
    if len(sizes) and int(sizes.min()) < 3:
        raise node.fail("a face has less than three points")
    numbers = np.concatenate([_NONE, *(np.arange(s.first, s.first + s.n) for s in faces)])
    return face_based.offsets_of(sizes), np.concatenate([_NONE, *(section.items for section in faces)]) - 1, numbers


def _check(node: Node, ids: Ints, n: int, what: str) -> Ints:
    wrong = (ids < 0) | (ids >= n)
    if wrong.any():
        raise node.fail(f"{what} {int(ids[np.argmax(wrong)]) + 1}, which does not exist")
    return ids


def _polyhedra(
    node: Node, cells: _Section, faces: list[_Section], points: NDArray[Any]
) -> tuple[Cells, Polyhedra | None]:
    """A face of positive number has its normal out of the cell, one of negative number into it."""
    offsets, items, numbers = _all_faces(node, faces)
    _check(node, items, len(points), "a face refers to point")
    order = np.full(int(numbers.max()) + 2 if len(numbers) else 1, -1, np.int64)
    order[numbers] = np.arange(len(numbers))
    asked = np.abs(cells.items)
    of_cells = np.where(asked < len(order), order[np.minimum(asked, len(order) - 1)], -1)
    if (of_cells < 0).any():
        raise node.fail(f"a polyhedron refers to face {asked[np.argmin(of_cells)]}, which does not exist")
    given = face_based.Faces(cells.offsets, of_cells, offsets, items, cells.items < 0, numbers)
    solids = face_based.solids(given, points)
    return Cells(solids.types, solids.offsets, solids.connectivity), solids.polyhedra


def _by_parents(node: Node, faces: list[_Section], points: NDArray[Any]) -> tuple[Cells, Polyhedra | None, Ints]:
    """Cells known only as parents of faces: the first has the normal outside, the second inside, 0 is none."""
    if any(section.parents is None or section.parents.shape[1] != section.n for section in faces):
        raise node.fail("has faces (NGON_n), but neither cells (NFACE_n) nor the parents of all faces")
    offsets, items, of_faces = _all_faces(node, faces)
    _check(node, items, len(points), "a face refers to point")
    left, right = (np.concatenate([s.parents[k] for s in faces if s.parents is not None]) for k in (0, 1))
    numbers = np.unique(np.concatenate([left, right]))
    numbers = numbers[numbers > 0]
    place = [np.where(side > 0, np.searchsorted(numbers, side), -1) for side in (left, right)]
    cell_offsets, cell_faces, is_second = face_based.of_cells(len(numbers), *place)
    given = face_based.Faces(cell_offsets, cell_faces, offsets, items, is_second, of_faces)
    cells = face_based.solids(given, points)
    return Cells(cells.types, cells.offsets, cells.connectivity), cells.polyhedra, numbers


def _polygons(section: _Section, chosen: Ints) -> Cells:
    sizes = np.diff(section.offsets)[chosen]
    items = section.items[face_based.spans(section.offsets[chosen], sizes)] - 1
    return Cells(face_based.surface_types(sizes), face_based.offsets_of(sizes), items)


def boundaries(node: Node, last: int, families: dict[str, str]) -> tuple[Ints, list[str]]:
    """For each number of an element the place of its name: the family that a boundary or group (BC_t) gives it.

    Of several the last counts; place 0 is that of no name.
    """
    listed, names = np.zeros(last + 1, np.int64), [""]
    for group in node.children("ZoneBC_t"):
        for boundary in group.children("BC_t"):
            location = boundary.child("GridLocation")
            is_of_points = location is None or location.text() == "Vertex"
            label = _family(boundary, families) or boundary.name
            for name in ("PointRange", "PointList", "ElementRange", "ElementList"):
                given = boundary.child(name)
                if given is None or (is_of_points and name.startswith("Point")):
                    continue
                numbers = given.integers()
                if name.endswith("Range"):
                    budget.draw("made", 8 * max(min(int(numbers[-1]), last) - int(numbers[0]), 0), boundary.name)
                    numbers = np.arange(max(int(numbers[0]), 1), min(int(numbers[-1]), last) + 1)
                if label not in names:
                    names.append(label)
                listed[numbers[(numbers > 0) & (numbers <= last)]] = names.index(label)
    return listed, names


def runs(codes: Ints) -> list[tuple[int, int, int]]:
    """Runs of one value: the value, where it begins and ends."""
    edges = [0, *(np.flatnonzero(np.diff(codes)) + 1).tolist(), len(codes)]
    return [(int(codes[a]), a, b) for a, b in itertools.pairwise(edges) if b > a]


def solution_arrays(node: Node, left_out: list[str]) -> Iterator[tuple[str, str, Node]]:
    """Where, the name and the arrays of the first solution on points and the first on cells; names of the others."""
    seen: set[str] = set()
    for solution in node.children("FlowSolution_t"):
        place = solution.child("GridLocation")
        where = place.text() if place is not None else "Vertex"
        if where not in ("Vertex", "CellCenter") or where in seen:
            left_out.append(solution.name)
            continue
        seen.add(where)
        for array in solution.children("DataArray_t"):
            yield where, solution.name, array


def left_out_note(names: list[str]) -> str:
    """What is to be said of solutions that were left out."""
    return f"Solutions were left out: {', '.join(names[:8])}."


def _solutions(node: Node, part: Part, notes: list[str]) -> None:
    """Those of cells belong to the solid ones."""
    solid = np.flatnonzero(IS_SOLID[part.types]) if IS_SOLID[part.types].any() else np.arange(len(part.types))
    left_out: list[str] = []
    for where, solution, array in solution_arrays(node, left_out):
        n = len(part.points) if where == "Vertex" else len(solid)
        values = array.values().ravel()
        if len(values) != n or values.dtype.kind not in "fiu":
            left_out.append(f"{solution}/{array.name}")
        elif where == "Vertex":
            part.point_data[array.name] = values
        else:
            whole = np.full(len(part.types), np.nan) if len(solid) < len(part.types) else values
            whole[solid] = values
            part.cell_data[array.name] = whole
    if left_out:
        notes.append(left_out_note(left_out))
    notes.extend(part.notes)
