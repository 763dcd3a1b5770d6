"""Gmsh's .msh, versions 2.2 and 4.1, ascii and binary.

Own, because meshio 5.3 reads neither second-order wedges and pyramids nor, in version 2.2, element data on more than
one type of cells, and PyVista hands the format to it.
"""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ....cells import BY_NAME
from ....errors import ReadError
from ....look.style import number_of
from ....mesh import CellBlock, Mesh
from ....mesh.labels import own_labels
from ....mesh.mesh import GHOST_TYPE
from ...plumbing.ids import Index
from .cells import BY_ID, GmshType

_DIMENSIONS = ("point", "curve", "surface", "volume")


@dataclass(slots=True)
class _Run:
    """Elements of one type that follow one another in the file."""

    kind: GmshType
    tags: NDArray[np.int64]
    nodes: NDArray[np.int64]  # (n, n_nodes), node tags in Gmsh's order
    physical: NDArray[np.int64]
    geometrical: NDArray[np.int64]
    entity: tuple[int, int] | None = None


@dataclass(slots=True)
class _Content:
    """What the sections held."""

    node_tags: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    points: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 3)))
    runs: list[_Run] = field(default_factory=list)
    names: dict[str, NDArray[Any]] = field(default_factory=dict)
    groups: dict[tuple[int, int], list[int]] = field(default_factory=dict)
    node_data: dict[str, tuple[NDArray[np.int64], NDArray[np.float64]]] = field(default_factory=dict)
    element_data: dict[str, tuple[NDArray[np.int64], NDArray[np.float64]]] = field(default_factory=dict)
    ghosts: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    notes: list[str] = field(default_factory=list)


def read(path: Path, data: bytes) -> Mesh:
    """The mesh in the bytes of a file of version 2.2 or 4.1."""
    content = _sections(_Cursor(path, data))
    index = Index(content.node_tags)
    types, sizes, ids, blocks, start, curved = [], [], [], [], 0, 0
    for run in content.runs:
        n = len(run.nodes)
        place = index.of(run.nodes.ravel())
        if len(place) and place.min() < 0:
            bad = int(run.nodes.ravel()[np.argmin(place)])
            raise ReadError(f"{path}: an element of type {run.kind.name} refers to node {bad}, which does not exist")
        place = place.reshape(run.nodes.shape)
        ids.append((place[:, run.kind.order] if run.kind.order else place).ravel())
        types.append(np.full(n, BY_NAME[run.kind.name].vtk_id, np.uint8))
        sizes.append(np.full(n, run.kind.n_nodes, np.int64))
        if run.entity is not None and n:
            blocks.append(CellBlock(f"{_DIMENSIONS[run.entity[0]]} {run.entity[1]}", start, start + n))
        curved += n if run.kind.corners_only else 0
        start += n
    offsets = np.zeros(start + 1, np.int64)
    if sizes:
        np.cumsum(np.concatenate(sizes), out=offsets[1:])
    if curved:
        content.notes.append(
            f"{number_of(curved, 'cell is', 'cells are')} above second order: corners are in place, other nodes in "
            "Gmsh's order."
        )
    return Mesh(
        points=content.points,
        types=np.concatenate(types) if types else np.empty(0, np.uint8),
        offsets=offsets,
        connectivity=np.concatenate(ids) if ids else np.empty(0, np.int64),
        blocks=tuple(blocks),
        point_data={
            **{name: _spread(index, *pair) for name, pair in content.node_data.items()},
            **own_labels(content.node_tags),
        },
        cell_data=_cell_data(content),
        field_data=content.names,
        path=str(path),
        notes=tuple(content.notes),
        copy=False,
    )


def _spread(index: Index, tags: NDArray[np.int64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values by tag on all items, NaN where there are none."""
    spread = np.full((index.n, *values.shape[1:]), np.nan)
    at = index.of(tags)
    spread[at[at >= 0]] = values[at >= 0]
    return spread


def _cell_data(content: _Content) -> dict[str, NDArray[Any]]:
    if not content.runs:
        return {}
    data: dict[str, NDArray[Any]] = {
        "gmsh:physical": np.concatenate([run.physical for run in content.runs]),
        "gmsh:geometrical": np.concatenate([run.geometrical for run in content.runs]),
    }
    if any(len(tags) > 1 for tags in content.groups.values()):
        # One number a cell is not enough: each named group becomes data of 0 and 1.
        for name, (tag, dimension) in content.names.items():
            member = [
                np.full(
                    len(r.nodes),
                    r.entity is not None and r.entity[0] == dimension and tag in content.groups.get(r.entity, ()),
                )
                for r in content.runs
            ]
            data[name] = np.concatenate(member).astype(np.uint8)
    tags = np.concatenate([run.tags for run in content.runs])
    if len(content.ghosts):
        data[GHOST_TYPE] = np.isin(tags, content.ghosts).astype(np.uint8)
    index = Index(tags)
    for name, pair in content.element_data.items():
        data[name] = _spread(index, *pair)
    return {**data, **own_labels(tags)}


class _Cursor:
    """A place in the bytes of the file; reads lines, and numbers as text or as they are in memory."""

    def __init__(self, path: Path, data: bytes) -> None:
        self.path, self.data, self.at = path, data, 0
        self.is_binary, self.order, self.size_t = False, "<", 8
        self.version = ""

    def fail(self, what: str) -> ReadError:
        return ReadError(f"{self.path}: not a whole Gmsh file: {what}")

    def line(self) -> str:
        """The next line that is not blank; empty at the end of the file."""
        while self.at < len(self.data):
            end = self.data.find(b"\n", self.at)
            end = len(self.data) if end < 0 else end
            text = self.data[self.at : end].strip()
            self.at = end + 1
            if text:
                return text.decode("utf-8", "replace")
        return ""

    def integers(self) -> list[int]:
        return [int(word) for word in self.line().split()]

    def few(self) -> int:
        """A number of header lines, of which no view has more than a handful."""
        (n,) = self.integers()
        if not 0 <= n <= 100:
            raise self.fail(f"{n} header lines are stated")
        return n

    def raw(self, dtype: DTypeLike, n: int) -> NDArray[Any]:
        """``n`` items of binary data."""
        kind = np.dtype(dtype).newbyteorder(self.order)  # type: ignore[arg-type]
        end = self.at + n * kind.itemsize
        if n < 0 or end > len(self.data):
            raise self.fail(f"{n} items of {kind.itemsize} bytes are stated at byte {self.at} of {len(self.data)}")
        values = np.frombuffer(self.data, kind, n, self.at)
        self.at = end
        return values

    def sizes(self, n: int) -> list[int]:
        """``n`` numbers of the type size_t."""
        return [int(v) for v in self.raw(f"u{self.size_t}", n)]

    def text(self, section: str) -> NDArray[np.float64]:
        """All numbers up to the end of the section."""
        end = self.data.find(b"$End" + section.encode(), self.at)
        if end < 0:
            raise self.fail(f"section {section} has no end")
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                values = np.fromstring(self.data[self.at : end].decode("ascii"), np.float64, sep=" ")
            except (DeprecationWarning, ValueError, UnicodeDecodeError):
                raise self.fail(f"section {section} holds something else than numbers") from None
        self.at = end
        return values

    def skip(self, section: str) -> None:
        end = self.data.find(b"$End" + section.encode(), self.at)
        if end < 0:
            raise self.fail(f"section {section} has no end")
        self.at = end


def _sections(cursor: _Cursor) -> _Content:
    content = _Content()
    seen = set()
    while line := cursor.line():
        if not line.startswith("$"):
            raise cursor.fail(f"expected the start of a section, not {line[:40]!r}")
        section = line[1:]
        seen.add(section)
        try:
            _section(cursor, section, content)
        except (ValueError, IndexError, OverflowError) as error:
            raise cursor.fail(f"section {section}: {error}") from error
        if cursor.line() != f"$End{section}":
            raise cursor.fail(f"section {section} does not end where its numbers do")
    if not {"Nodes", "Elements"} <= seen:
        raise cursor.fail("it has no nodes or no elements")
    return content


def _section(cursor: _Cursor, section: str, content: _Content) -> None:
    new = cursor.version.startswith("4")
    if section == "MeshFormat":
        _format(cursor)
    elif section == "PhysicalNames":
        for _ in range(cursor.integers()[0]):
            match = re.match(r'(\d+)\s+(-?\d+)\s+"(.*)"', cursor.line())
            if match is None:
                raise cursor.fail('a physical name is not of the form: dimension tag "name"')
            content.names[match.group(3)] = np.array([int(match.group(2)), int(match.group(1))])
    elif section == "Entities" and new:
        content.groups.update(_entities_binary(cursor) if cursor.is_binary else _entities_text(cursor))
    elif section == "Nodes":
        content.node_tags, content.points = (_nodes_4 if new else _nodes_2)(cursor)
    elif section == "Elements":
        if new:
            content.runs = _elements_4(cursor, content.groups)
        else:
            content.runs = _elements_2_binary(cursor) if cursor.is_binary else _elements_2_text(cursor)
    elif section == "GhostElements" and new:
        content.ghosts = _ghosts(cursor)
    elif section in ("NodeData", "ElementData"):
        _view(cursor, section, content)
    else:
        if section not in ("Comments", "Periodic", "Parametrizations", "GhostElements", "PartitionedEntities"):
            content.notes.append(f"Section {section} of the Gmsh file was left out.")
        cursor.skip(section)


def _format(cursor: _Cursor) -> None:
    version, binary, size = cursor.line().split()[:3]
    cursor.version, cursor.is_binary, cursor.size_t = version, binary == "1", int(size)
    if version not in ("2", "2.1", "2.2", "4.1") or cursor.size_t not in (4, 8):
        raise cursor.fail(f"version {version} with numbers of {size} bytes is not known (2.2 and 4.1 with 8 are)")
    if cursor.is_binary:
        cursor.order = "<" if cursor.data[cursor.at : cursor.at + 4] == b"\x01\0\0\0" else ">"
        if int(cursor.raw("i4", 1)[0]) != 1:
            raise cursor.fail("the mark of its byte order is missing")


def _nodes_2(cursor: _Cursor) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    (n,) = cursor.integers()
    if cursor.is_binary:
        rows = cursor.raw([("tag", "i4"), ("x", "f8", 3)], n)
        return rows["tag"].astype(np.int64), np.ascontiguousarray(rows["x"], np.float64)
    values = cursor.text("Nodes")
    if len(values) != 4 * n:
        raise cursor.fail(f"{n} nodes are stated, {len(values)} numbers given")
    table = values.reshape(n, 4)
    return table[:, 0].astype(np.int64), np.ascontiguousarray(table[:, 1:])


def _nodes_4(cursor: _Cursor) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    tags, points = [np.empty(0, np.int64)], [np.empty((0, 3))]
    values = np.empty(0) if cursor.is_binary else cursor.text("Nodes")
    n_blocks = cursor.sizes(4)[0] if cursor.is_binary else int(values[0])
    at = 4
    for _ in range(n_blocks):
        if cursor.is_binary:
            dimension, _, parametric = (int(v) for v in cursor.raw("i4", 3))
            n = cursor.sizes(1)[0]
            own_tags = cursor.raw(f"u{cursor.size_t}", n).astype(np.int64)
            width = 3 + (dimension if parametric else 0)
            own = cursor.raw("f8", n * width)
        else:
            dimension, _, parametric, n = (int(v) for v in values[at : at + 4])
            width = 3 + (dimension if parametric else 0)
            if n < 0 or width < 3:
                raise cursor.fail(f"a block of {n} nodes of {width} numbers")
            own_tags = values[at + 4 : at + 4 + n].astype(np.int64)
            own = values[at + 4 + n : at + 4 + n + n * width]
            at += 4 + n + n * width
        tags.append(own_tags)
        points.append(own.reshape(n, width)[:, :3])
    if not cursor.is_binary and at != len(values):
        raise cursor.fail(f"the blocks of nodes hold {at} numbers, {len(values)} are given")
    return np.concatenate(tags), np.concatenate(points).astype(np.float64, copy=False)


def _kind(cursor: _Cursor, gmsh_id: int) -> GmshType:
    if gmsh_id not in BY_ID:
        raise cursor.fail(f"element type {gmsh_id} is not known")
    return BY_ID[gmsh_id]


def _run_2(kind: GmshType, rows: NDArray[Any], n_tags: int) -> _Run:
    """Rows of: tag of the element, ``n_tags`` tags (the first two are physical and geometrical), nodes."""
    none = np.zeros(len(rows), np.int64)
    tags = rows[:, : 1 + n_tags].astype(np.int64)
    return _Run(
        kind=kind,
        tags=tags[:, 0],
        nodes=rows[:, 1 + n_tags :].astype(np.int64),
        physical=tags[:, 1] if n_tags > 0 else none,
        geometrical=tags[:, 2] if n_tags > 1 else none,
    )


def _elements_2_binary(cursor: _Cursor) -> list[_Run]:
    (n,) = cursor.integers()
    runs, done = [], 0
    while done < n:
        gmsh_id, count, n_tags = (int(v) for v in cursor.raw("i4", 3))
        kind = _kind(cursor, gmsh_id)
        width = 1 + n_tags + kind.n_nodes
        if count < 1 or n_tags < 0:
            raise cursor.fail(f"a block of {count} elements with {n_tags} tags")
        runs.append(_run_2(kind, cursor.raw("i4", count * width).reshape(count, width), n_tags))
        done += count
    return _join_runs(runs)


def _join_runs(runs: list[_Run]) -> list[_Run]:
    """Neighbouring runs of one type as one: Gmsh writes a header for every single element."""
    groups: list[list[_Run]] = []
    for run in runs:
        if groups and groups[-1][0].kind is run.kind:
            groups[-1].append(run)
        else:
            groups.append([run])
    return [
        g[0]
        if len(g) == 1
        else _Run(
            kind=g[0].kind,
            tags=np.concatenate([r.tags for r in g]),
            nodes=np.concatenate([r.nodes for r in g]),
            physical=np.concatenate([r.physical for r in g]),
            geometrical=np.concatenate([r.geometrical for r in g]),
        )
        for g in groups
    ]


def _elements_2_text(cursor: _Cursor) -> list[_Run]:
    (n,) = cursor.integers()
    values = cursor.text("Elements")
    runs, at, done = [], 0, 0
    while at + 3 <= len(values):
        kind, n_tags = _kind(cursor, int(values[at + 1])), int(values[at + 2])
        width = 3 + n_tags + kind.n_nodes
        if n_tags < 0 or at + width > len(values):
            raise cursor.fail("an element is cut off")
        count = _alike(values[at:], width)
        rows = values[at : at + count * width].reshape(count, width)
        runs.append(_run_2(kind, np.delete(rows, (1, 2), axis=1), n_tags))
        at, done = at + count * width, done + count
    if done != n or at != len(values):
        raise cursor.fail(f"{n} elements are stated, {done} found")
    return _join_runs(runs)


def _alike(values: NDArray[np.float64], width: int) -> int:
    """How many rows of this width follow one another with the type and the number of tags of the first."""
    most, count = len(values) // width, 1
    while count < most:
        step = min(count, most - count)  # doubling, so that short runs cost little
        rows = values[count * width : (count + step) * width].reshape(step, width)
        same = (rows[:, 1] == values[1]) & (rows[:, 2] == values[2])
        if not same.all():
            return count + int(np.argmin(same))
        count += step
    return count


def _elements_4(cursor: _Cursor, groups: dict[tuple[int, int], list[int]]) -> list[_Run]:
    runs = []
    values = np.empty(0) if cursor.is_binary else cursor.text("Elements")
    n_blocks = cursor.sizes(4)[0] if cursor.is_binary else int(values[0])
    at = 4
    for _ in range(n_blocks):
        if cursor.is_binary:
            dimension, tag, gmsh_id = (int(v) for v in cursor.raw("i4", 3))
            n = cursor.sizes(1)[0]
            kind = _kind(cursor, gmsh_id)
            rows = cursor.raw(f"u{cursor.size_t}", n * (1 + kind.n_nodes)).reshape(n, -1)
        else:
            dimension, tag, gmsh_id, n = (int(v) for v in values[at : at + 4])
            kind = _kind(cursor, gmsh_id)
            if n < 0:
                raise cursor.fail(f"a block of {n} elements")
            rows = values[at + 4 : at + 4 + n * (1 + kind.n_nodes)].reshape(n, 1 + kind.n_nodes)
            at += 4 + n * (1 + kind.n_nodes)
        if not 0 <= dimension <= 3:
            raise cursor.fail(f"an entity of dimension {dimension}")
        physical = (groups.get((dimension, tag)) or [0])[0]
        runs.append(
            _Run(
                kind=kind,
                tags=rows[:, 0].astype(np.int64),
                nodes=rows[:, 1:].astype(np.int64),
                physical=np.full(n, physical, np.int64),
                geometrical=np.full(n, tag, np.int64),
                entity=(dimension, tag),
            )
        )
    if not cursor.is_binary and at != len(values):
        raise cursor.fail(f"the blocks of elements hold {at} numbers, {len(values)} are given")
    return runs


def _entities_text(cursor: _Cursor) -> dict[tuple[int, int], list[int]]:
    values = cursor.text("Entities")
    groups, at = {}, 4
    for dimension, n in enumerate(values[:4].astype(int).tolist()):
        for _ in range(n):
            tag, at = int(values[at]), at + (4 if dimension == 0 else 7)
            n_groups = int(values[at])
            groups[dimension, tag] = values[at + 1 : at + 1 + n_groups].astype(int).tolist()
            at += 1 + n_groups
            if dimension:
                at += 1 + int(values[at])
    return groups


def _entities_binary(cursor: _Cursor) -> dict[tuple[int, int], list[int]]:
    groups = {}
    for dimension, n in enumerate(cursor.sizes(4)):
        for _ in range(n):
            tag = int(cursor.raw("i4", 1)[0])
            cursor.raw("f8", 3 if dimension == 0 else 6)
            groups[dimension, tag] = cursor.raw("i4", cursor.sizes(1)[0]).astype(int).tolist()
            if dimension:
                cursor.raw("i4", cursor.sizes(1)[0])
    return groups


def _ghosts(cursor: _Cursor) -> NDArray[np.int64]:
    """Tags of the elements that are here as copies: of a partition that has none of its own in this file.

    The section names for each element its partition and those that have it as a ghost. A file of one partition holds
    the ghosts beside its own elements; a file of all holds every element once.
    """
    tags, owners, holders = [], [], set()
    if cursor.is_binary:
        for _ in range(cursor.sizes(1)[0]):
            tags.append(cursor.sizes(1)[0])
            owners.append(int(cursor.raw("i4", 1)[0]))
            holders.update(cursor.raw("i4", cursor.sizes(1)[0]).tolist())
    else:
        values, at = cursor.text("GhostElements").astype(np.int64).tolist(), 1
        for _ in range(values[0]):
            tag, owner, n = values[at : at + 3]
            tags.append(tag)
            owners.append(owner)
            holders.update(values[at + 3 : at + 3 + n])
            at += 3 + n
        if at != len(values):
            raise cursor.fail(f"{values[0]} ghost elements are stated, {len(values)} numbers given")
    return np.array([tag for tag, owner in zip(tags, owners, strict=True) if owner not in holders], np.int64)


def _view(cursor: _Cursor, section: str, content: _Content) -> None:
    """A view: strings, reals and integers as text, then a tag and its values for each item."""
    strings = [cursor.line() for _ in range(cursor.few())]
    for _ in range(cursor.few()):
        cursor.line()
    numbers = [cursor.integers()[0] for _ in range(cursor.few())]
    if not strings or len(numbers) < 3:
        raise cursor.fail(f"{section} has no name or no size")
    name, (_, width, n) = strings[0].strip('"'), numbers[:3]
    if cursor.is_binary:
        rows = cursor.raw([("tag", "i4"), ("value", "f8", (width,))], n)
        tags, values = rows["tag"].astype(np.int64), rows["value"].astype(np.float64)
    else:
        flat = cursor.text(section)
        if len(flat) != n * (1 + width):
            raise cursor.fail(f"{section} {name!r} states {n} items of {width}, {len(flat)} numbers given")
        table = flat.reshape(n, 1 + width)
        tags, values = table[:, 0].astype(np.int64), table[:, 1:]
    data = content.node_data if section == "NodeData" else content.element_data
    if name in data:
        content.notes.append(f"Of several steps of the view {name!r} the first was read.")
    else:
        data[name] = (tags, values[:, 0] if width == 1 else values)
