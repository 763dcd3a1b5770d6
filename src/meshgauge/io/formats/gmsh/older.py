"""What older versions of Gmsh's format have of their own: nodes and elements of 1 and 4.0, names and nodes of 2.0."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....cells import BY_NAME
from ...plumbing.text import NotNumbers, numbers, words_per_line
from .cursor import Cursor, Ints, Run, kind_of, n_alike

Nodes = tuple[Ints, NDArray[np.float64]]
"""Tags and coordinates."""


def elements_1(cursor: Cursor) -> list[Run]:
    """Version 1: rows of tag, type, physical and geometrical tag, number of nodes, nodes."""
    (n,) = cursor.integers()
    values = cursor.text("ELM")
    runs, at, done = [], 0, 0
    while at + 5 <= len(values):
        kind, n_nodes = kind_of(cursor, int(values[at + 1])), int(values[at + 4])
        width = 5 + kind.n_nodes
        if n_nodes != kind.n_nodes or at + width > len(values):
            raise cursor.fail(f"an element of type {kind.name} has {n_nodes} nodes, expected {kind.n_nodes}")
        count = n_alike(values[at:], width, (1, 4))
        rows = values[at : at + count * width].reshape(count, width).astype(np.int64)
        runs.append(Run(kind, rows[:, 0], rows[:, 5:], rows[:, 2], rows[:, 3]))
        at, done = at + count * width, done + count
    if done != n or at != len(values):
        raise cursor.fail(f"{n} elements are stated, {done} read")
    return runs


def nodes_40(cursor: Cursor, section: str) -> Nodes:
    """Version 4.0: blocks of tag and dimension of an entity, whether its nodes are parametric, and how many follow."""
    values = cursor.text(section)
    tags, points, at = [np.empty(0, np.int64)], [np.empty((0, 3))], 2
    for _ in range(int(values[0])):
        _, dimension, parametric, n = (int(v) for v in values[at : at + 4])
        width = 4 + (dimension if parametric else 0)
        if n < 0 or not 0 <= dimension <= 3 or at + 4 + n * width > len(values):
            raise cursor.fail(f"a block of {n} nodes of {width} numbers")
        rows = values[at + 4 : at + 4 + n * width].reshape(n, width)
        tags.append(rows[:, 0].astype(np.int64))
        points.append(rows[:, 1:4])
        at += 4 + n * width
    if at != len(values):
        raise cursor.fail(f"the blocks of nodes hold {at} numbers, {len(values)} are given")
    return np.concatenate(tags), np.concatenate(points)


def parametric_nodes(cursor: Cursor, section: str) -> Nodes:
    """Versions 1 and 2: a line or record of tag, coordinates, dimension and tag of an entity, and its parameters.

    Of version 1 the entity and the parameters may be left out.
    """
    (n,) = cursor.integers()
    if cursor.is_binary:
        tags, points = (
            np.zeros(max(min(n, len(cursor.data)), 0), np.int64),
            np.zeros((max(min(n, len(cursor.data)), 0), 3)),
        )
        for i in range(n):
            tags[i] = cursor.raw("i4", 1)[0]
            points[i] = cursor.raw("f8", 3)
            dimension = int(cursor.raw("i4", 2)[0])
            cursor.raw("f8", dimension if dimension in (1, 2) else 0)
        return tags, points
    start = cursor.at
    cursor.skip(section)
    block = cursor.data[start : cursor.at]
    try:
        values = numbers(block, np.float64)
    except NotNumbers as error:
        raise cursor.is_other(section, error, start) from None
    sizes = words_per_line(block)
    sizes = sizes[sizes > 0]
    if len(sizes) != n or (n and int(sizes.min()) < 4):
        raise cursor.fail(f"{n} nodes are stated, {len(sizes)} lines given, or one is cut off")
    rows = values[(np.cumsum(sizes) - sizes)[:, None] + np.arange(4)]
    return rows[:, 0].astype(np.int64), np.ascontiguousarray(rows[:, 1:])


def complete_names(names: dict[str, NDArray[Any]], runs: Sequence[Run]) -> None:
    """Give names that state no dimension that of the highest cells with their tag."""
    for name, (tag, dimension) in names.items():
        if dimension < 0:
            having = [BY_NAME[run.kind.name].dimension for run in runs if (run.physical == tag).any()]
            names[name] = np.array([int(tag), max(having, default=3)])
