"""Where formats of text hold points in a section, a line each: Netgen, FLAC3D, AVS UCD, HEDRA and Elmer."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ..plumbing.numerals import Text
from ..plumbing.patch import Places
from ..plumbing.spans import after_lines, columns, in_place

_POINTS = re.compile(rb"^[ \t]*points\s+(\d+)[ \t]*\n", re.MULTILINE)
_COMMENT_LINE = re.compile(rb"^[ \t]*#[^\n]*", re.MULTILINE)
_GRID_POINTS = re.compile(rb"(?:^[ \t]*G[ \t]+\d+[ \t][^\n]*\n?)+", re.MULTILINE)


def netgen(path: Path) -> Places:
    data = in_place(path.read_bytes())
    return _after(path, _COMMENT_LINE.sub(lambda match: b" " * len(match[0]), data), _POINTS)


def flac3d(path: Path) -> Places:
    """Lines of G, a number and the coordinates."""
    data = in_place(path.read_bytes())
    return Places.joined(
        [
            Places.of(path, Text(), *columns(data, head.start(), head.end(), 2, 3))
            for head in _GRID_POINTS.finditer(data)
        ]
    )


def avs(path: Path) -> Places:
    """Behind the line of counts, a number and the coordinates a line."""
    data = in_place(path.read_bytes(), b"#")
    begin = after_lines(data, 0, 1)
    end = after_lines(data, begin, int(data[:begin].split()[0]))
    return Places.of(path, Text(), *columns(data, begin, end, 1, 3))


def hedra(path: Path) -> Places:
    """Behind the line of counts, the coordinates a line."""
    data = in_place(path.read_bytes())
    begin = after_lines(data, 0, 1)
    end = after_lines(data, begin, int(data[:begin].split()[0]))
    return Places.of(path, Text(), *columns(data, begin, end, 0, 3))


def elmer(path: Path) -> Places:
    """In the file of nodes: number, partition and coordinates a line; a node of several parts stands in each."""
    from .elmer import stems

    parts = [_elmer_nodes(stem.with_name(f"{stem.name}.nodes")) for stem in stems(path)]
    whole = Places.joined(parts)
    if len(parts) == 1 or whole.labels is None:
        return whole
    return whole.each_once(np.unique(whole.labels, return_inverse=True)[1].reshape(-1).astype(np.int64))


def _elmer_nodes(file: Path) -> Places:
    data = in_place(file.read_bytes())
    starts, ends = columns(data, 0, len(data), 0, 5)
    spans = zip(starts[:, 0].tolist(), ends[:, 0].tolist(), strict=True)
    labels = np.array([int(data[a:b]) for a, b in spans], np.int64)
    return Places.of(file, Text(), starts[:, 2:], ends[:, 2:], labels)


def _after(path: Path, data: bytes, mark: re.Pattern[bytes]) -> Places:
    head = mark.search(data)
    if head is None:
        return Places.of(path, Text(), *np.empty((2, 0, 3), np.int64))
    return Places.of(path, Text(), *columns(data, head.end(), after_lines(data, head.end(), int(head[1])), 0, 3))
