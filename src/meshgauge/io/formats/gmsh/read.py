"""Gmsh's .msh of all versions, ascii and binary; what is peculiar to 1 and 4.0 stands in `older`.

Own, because meshio 5.3 reads neither second-order wedges and pyramids nor, in version 2.2, element data on more than
one type of cells, takes entities of version 4.0 for parametric nodes, and PyVista hands the format to it.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....cells import BY_NAME
from ....errors import ReadError
from ....look.style import number_of
from ....mesh import CellBlock, Mesh
from ....mesh.labels import LABEL
from ....mesh.mesh import GHOST_TYPE
from ...plumbing import budget
from ...plumbing.ids import Index, drop_counts
from ...plumbing.meshio import MAX_SETS
from . import older
from .cells import NO_GROUP, GmshType
from .cursor import Cursor, Run, end_mark, kind_of, n_alike

_DIMENSIONS = ("point", "curve", "surface", "volume")


@dataclass(slots=True)
class _Content:
    """What the sections held."""

    node_tags: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    points: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 3)))
    runs: list[Run] = field(default_factory=list)
    names: dict[str, NDArray[Any]] = field(default_factory=dict)
    none: set[tuple[int, int]] = field(default_factory=set)
    groups: dict[tuple[int, int], list[int]] = field(default_factory=dict)
    node_data: dict[str, tuple[NDArray[np.int64], NDArray[np.float64]]] = field(default_factory=dict)
    element_data: dict[str, tuple[NDArray[np.int64], NDArray[np.float64]]] = field(default_factory=dict)
    ghosts: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    notes: list[str] = field(default_factory=list)


def read(path: Path, data: bytes) -> Mesh:
    """The mesh in the bytes of a file."""
    content = _sections(Cursor(path, data))
    older.complete_names(content.names, content.runs)
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
    mesh = Mesh(
        points=content.points,
        types=np.concatenate(types) if types else np.empty(0, np.uint8),
        offsets=offsets,
        connectivity=np.concatenate(ids) if ids else np.empty(0, np.int64),
        blocks=tuple(blocks),
        point_data={
            **{name: _spread(index, *pair) for name, pair in content.node_data.items()},
            LABEL: np.asarray(content.node_tags, np.int64),
        },
        cell_data=_cell_data(content),
        field_data=content.names,
        path=str(path),
        notes=tuple(content.notes),
        copy=False,
    )
    return drop_counts(mesh)


def _spread(index: Index, tags: NDArray[np.int64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values by tag on all items, NaN where there are none."""
    budget.draw("made", 8 * index.n * math.prod(values.shape[1:]), "a view")
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
        left = max(len(content.names) - MAX_SETS, 0)
        content.notes += [f"{left} of {len(content.names)} physical groups were left out."] if left else []
        for name, (tag, dimension) in list(content.names.items())[:MAX_SETS]:
            budget.draw("mesh", sum(len(run.nodes) for run in content.runs), f"the group {name!r}")
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
    return {**data, LABEL: np.asarray(tags, np.int64)}


def _sections(cursor: Cursor) -> _Content:
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
        if cursor.line() != end_mark(section):
            raise cursor.fail(f"section {section} does not end where its numbers do")
    if not ({"Nodes", "Elements"} <= seen or {"NOD", "ELM"} <= seen or {"ParametricNodes", "Elements"} <= seen):
        raise cursor.fail("it has no nodes or no elements")
    return content


def _section(cursor: Cursor, section: str, content: _Content) -> None:
    new = cursor.version.startswith("4")
    if section == "MeshFormat":
        take_format(cursor)
    elif section == "PhysicalNames":
        for _ in range(cursor.integers()[0]):
            match = re.match(r'(?:(\d+)\s+)?(-?\d+)\s+"(.*)"', cursor.line())
            if match is None:
                raise cursor.fail('a physical name is not of the form: dimension tag "name"')
            dimension = -1 if match[1] is None else int(match[1])  # version 2.0 states none
            if match[3] == NO_GROUP:
                content.none.add((dimension, int(match[2])))
            else:
                content.names[match[3]] = np.array([int(match[2]), dimension])
    elif section == "Entities" and new:
        groups = _entities_binary(cursor) if cursor.is_binary else _entities_text(cursor)
        for (dimension, entity), tags in groups.items():
            content.groups[dimension, entity] = [tag for tag in tags if (dimension, tag) not in content.none]
    elif section == "NOD" or (section == "ParametricNodes" and not new):
        content.node_tags, content.points = older.parametric_nodes(cursor, section)
    elif section == "ELM":
        content.runs = _join_runs(older.elements_1(cursor))
    elif section == "Nodes":
        nodes = older.nodes_40 if cursor.version == "4.0" else _nodes_4 if new else _nodes_2
        content.node_tags, content.points = nodes(cursor, section)
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


def take_format(cursor: Cursor) -> None:
    """Note the version, and whether the file is binary."""
    version, binary, size = cursor.line().split()[:3]
    cursor.version, cursor.is_binary, cursor.size_t = f"{float(version):.1f}", binary == "1", int(size)
    if cursor.version not in ("2.0", "2.1", "2.2", "4.0", "4.1") or cursor.size_t not in (4, 8):
        raise cursor.fail(f"version {version} with numbers of {size} bytes is not known (2.0 to 4.1 with 8 are)")
    if cursor.version == "4.0" and cursor.is_binary:
        raise cursor.fail("binary files of version 4.0 are not read; Gmsh writes them as another version")
    if cursor.is_binary:
        cursor.order = "<" if cursor.data[cursor.at : cursor.at + 4] == b"\x01\0\0\0" else ">"
        if int(cursor.raw("i4", 1)[0]) != 1:
            raise cursor.fail("the mark of its byte order is missing")


def _nodes_2(cursor: Cursor, section: str) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    (n,) = cursor.integers()
    if cursor.is_binary:
        rows = cursor.raw([("tag", "i4"), ("x", "f8", 3)], n)
        return rows["tag"].astype(np.int64), np.ascontiguousarray(rows["x"], np.float64)
    values = cursor.text(section)
    if len(values) != 4 * n:
        raise cursor.fail(f"{n} nodes are stated, {len(values)} numbers given")
    table = values.reshape(n, 4)
    return table[:, 0].astype(np.int64), np.ascontiguousarray(table[:, 1:])


def _nodes_4(cursor: Cursor, section: str) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    tags, points = [np.empty(0, np.int64)], [np.empty((0, 3))]
    values = np.empty(0) if cursor.is_binary else cursor.text(section)
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


def _run_2(kind: GmshType, rows: NDArray[Any], n_tags: int) -> Run:
    """Rows of: tag of the element, ``n_tags`` tags (the first two are physical and geometrical), nodes."""
    none = np.zeros(len(rows), np.int64)
    tags = rows[:, : 1 + n_tags].astype(np.int64)
    return Run(
        kind=kind,
        tags=tags[:, 0],
        nodes=rows[:, 1 + n_tags :].astype(np.int64),
        physical=tags[:, 1] if n_tags > 0 else none,
        geometrical=tags[:, 2] if n_tags > 1 else none,
    )


def _elements_2_binary(cursor: Cursor) -> list[Run]:
    (n,) = cursor.integers()
    runs, done = [], 0
    while done < n:
        gmsh_id, count, n_tags = (int(v) for v in cursor.raw("i4", 3))
        kind = kind_of(cursor, gmsh_id)
        width = 1 + n_tags + kind.n_nodes
        if count < 1 or n_tags < 0:
            raise cursor.fail(f"a block of {count} elements with {n_tags} tags")
        runs.append(_run_2(kind, cursor.raw("i4", count * width).reshape(count, width), n_tags))
        done += count
    return _join_runs(runs)


def _join_runs(runs: list[Run]) -> list[Run]:
    """Neighbouring runs of one type as one: Gmsh writes a header for every single element."""
    groups: list[list[Run]] = []
    for run in runs:
        if groups and groups[-1][0].kind is run.kind:
            groups[-1].append(run)
        else:
            groups.append([run])
    return [
        g[0]
        if len(g) == 1
        else Run(
            kind=g[0].kind,
            tags=np.concatenate([r.tags for r in g]),
            nodes=np.concatenate([r.nodes for r in g]),
            physical=np.concatenate([r.physical for r in g]),
            geometrical=np.concatenate([r.geometrical for r in g]),
        )
        for g in groups
    ]


def _elements_2_text(cursor: Cursor) -> list[Run]:
    (n,) = cursor.integers()
    values = cursor.text("Elements")
    runs, at, done = [], 0, 0
    while at + 3 <= len(values):
        kind, n_tags = kind_of(cursor, int(values[at + 1])), int(values[at + 2])
        width = 3 + n_tags + kind.n_nodes
        if n_tags < 0 or at + width > len(values):
            raise cursor.fail("an element is cut off")
        count = n_alike(values[at:], width)
        rows = values[at : at + count * width].reshape(count, width)
        runs.append(_run_2(kind, np.delete(rows, (1, 2), axis=1), n_tags))
        at, done = at + count * width, done + count
    if done != n or at != len(values):
        raise cursor.fail(f"{n} elements are stated, {done} found")
    return _join_runs(runs)


def _elements_4(cursor: Cursor, groups: dict[tuple[int, int], list[int]]) -> list[Run]:
    runs = []
    values = np.empty(0) if cursor.is_binary else cursor.text("Elements")
    n_blocks = cursor.sizes(4)[0] if cursor.is_binary else int(values[0])
    at = 2 if cursor.version == "4.0" else 4
    for _ in range(n_blocks):
        if cursor.is_binary:
            dimension, tag, gmsh_id = (int(v) for v in cursor.raw("i4", 3))
            n = cursor.sizes(1)[0]
            kind = kind_of(cursor, gmsh_id)
            rows = cursor.raw(f"u{cursor.size_t}", n * (1 + kind.n_nodes)).reshape(n, -1)
        else:
            dimension, tag, gmsh_id, n = (int(v) for v in values[at : at + 4])
            if cursor.version == "4.0":  # there the tag stands first
                dimension, tag = tag, dimension
            kind = kind_of(cursor, gmsh_id)
            if n < 0:
                raise cursor.fail(f"a block of {n} elements")
            rows = values[at + 4 : at + 4 + n * (1 + kind.n_nodes)].reshape(n, 1 + kind.n_nodes)
            at += 4 + n * (1 + kind.n_nodes)
        if not 0 <= dimension <= 3:
            raise cursor.fail(f"an entity of dimension {dimension}")
        physical = (groups.get((dimension, tag)) or [0])[0]
        runs.append(
            Run(
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


def _entities_text(cursor: Cursor) -> dict[tuple[int, int], list[int]]:
    values = cursor.text("Entities")
    groups, at = {}, 4
    for dimension, n in enumerate(values[:4].astype(int).tolist()):
        for _ in range(n):
            has_point = dimension == 0 and cursor.version != "4.0"  # else a box
            tag, at = int(values[at]), at + (4 if has_point else 7)
            n_groups = int(values[at])
            groups[dimension, tag] = values[at + 1 : at + 1 + n_groups].astype(int).tolist()
            at += 1 + n_groups
            if dimension:
                at += 1 + int(values[at])
    return groups


def _entities_binary(cursor: Cursor) -> dict[tuple[int, int], list[int]]:
    groups = {}
    for dimension, n in enumerate(cursor.sizes(4)):
        for _ in range(n):
            tag = int(cursor.raw("i4", 1)[0])
            cursor.raw("f8", 3 if dimension == 0 else 6)
            groups[dimension, tag] = cursor.raw("i4", cursor.sizes(1)[0]).astype(int).tolist()
            if dimension:
                cursor.raw("i4", cursor.sizes(1)[0])
    return groups


def _ghosts(cursor: Cursor) -> NDArray[np.int64]:
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


def _view(cursor: Cursor, section: str, content: _Content) -> None:
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
