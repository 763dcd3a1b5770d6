"""Where Gmsh's files hold the coordinates of nodes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...plumbing.numerals import Ints, Raw, Text
from ...plumbing.patch import Places
from ...plumbing.spans import columns, words
from .cursor import Cursor
from .read import take_format


def places(path: Path) -> Places:
    """In the section of nodes, of any version, ascii or binary."""
    cursor = Cursor(path, path.read_bytes())
    while line := cursor.line():
        section = line[1:]
        if section == "MeshFormat":
            take_format(cursor)
        elif section in ("Nodes", "NOD", "ParametricNodes"):
            return _nodes(cursor, section)
        else:
            cursor.skip(section)
        cursor.line()
    raise cursor.fail("it has no nodes")


def _nodes(cursor: Cursor, section: str) -> Places:
    is_new = cursor.version.startswith("4")
    if cursor.is_binary:
        starts, labels = _binary_4(cursor) if is_new else _binary_2(cursor, has_entities=section == "ParametricNodes")
        return Places.of(cursor.path, Raw(f"{cursor.order}f8"), starts, starts + 8, labels)
    if not is_new:
        cursor.integers()
        start = cursor.at
        cursor.skip(section)
        starts, ends = columns(cursor.data, start, cursor.at, 0, 4)
        labels = _labels(cursor.data, starts[:, 0], ends[:, 0])
        return Places.of(cursor.path, Text(), starts[:, 1:], ends[:, 1:], labels)
    start = cursor.at
    values = cursor.text(section)
    tags, rows = _rows_40(values) if cursor.version == "4.0" else _rows_41(values)
    first, last = words(cursor.data, start, cursor.at)
    return Places.of(cursor.path, Text(), first[rows], last[rows], values[tags].astype(np.int64))


def _labels(data: bytes, starts: Ints, ends: Ints) -> Ints:
    return np.array([int(data[a:b]) for a, b in zip(starts.tolist(), ends.tolist(), strict=True)], np.int64)


def _rows_40(values: np.ndarray) -> tuple[Ints, Ints]:
    """Which of the numbers of the section are tags ``(n,)``, and which are coordinates ``(n, 3)``."""
    tags, at = [np.empty(0, np.int64)], 2
    for _ in range(int(values[0])):
        _, dimension, parametric, n = (int(v) for v in values[at : at + 4])
        width = 4 + (dimension if parametric else 0)
        tags.append(at + 4 + width * np.arange(n))
        at += 4 + n * width
    whole = np.concatenate(tags)
    return whole, whole[:, None] + np.arange(1, 4)


def _rows_41(values: np.ndarray) -> tuple[Ints, Ints]:
    tags, rows, at = [np.empty(0, np.int64)], [np.empty(0, np.int64)], 4
    for _ in range(int(values[0])):
        dimension, _, parametric, n = (int(v) for v in values[at : at + 4])
        width = 3 + (dimension if parametric else 0)
        tags.append(at + 4 + np.arange(n))
        rows.append(at + 4 + n + width * np.arange(n))
        at += 4 + n + n * width
    return np.concatenate(tags), np.concatenate(rows)[:, None] + np.arange(3)


def _binary_2(cursor: Cursor, *, has_entities: bool) -> tuple[Ints, Ints]:
    """First bytes ``(n, 3)`` and tags."""
    (n,) = cursor.integers()
    at, tags = np.zeros(n, np.int64), np.zeros(n, np.int64)
    if not has_entities:
        at = cursor.at + 4 + 28 * np.arange(n)
        tags = cursor.raw([("tag", "i4"), ("x", "f8", 3)], n)["tag"].astype(np.int64)
        return at[:, None] + 8 * np.arange(3), tags
    for k in range(n):
        tags[k] = cursor.raw("i4", 1)[0]
        at[k] = cursor.at
        cursor.raw("f8", 3)
        dimension = int(cursor.raw("i4", 2)[0])
        cursor.raw("f8", dimension if dimension in (1, 2) else 0)
    return at[:, None] + 8 * np.arange(3), tags


def _binary_4(cursor: Cursor) -> tuple[Ints, Ints]:
    starts, tags = [np.empty(0, np.int64)], [np.empty(0, np.int64)]
    for _ in range(cursor.sizes(4)[0]):
        dimension, _, parametric = (int(v) for v in cursor.raw("i4", 3))
        n = cursor.sizes(1)[0]
        tags.append(cursor.raw(f"u{cursor.size_t}", n).astype(np.int64))
        width = 3 + (dimension if parametric else 0)
        starts.append(cursor.at + 8 * width * np.arange(n))
        cursor.raw("f8", n * width)
    return np.concatenate(starts)[:, None] + 8 * np.arange(3), np.concatenate(tags)
