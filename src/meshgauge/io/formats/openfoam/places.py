"""Where a case of OpenFOAM holds its points: ascii, binary or gzipped, in every piece of a decomposed one."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...plumbing.numerals import Raw, Text
from ...plumbing.patch import Places, contents
from ...plumbing.spans import words
from ...plumbing.text import WITHOUT_BRACKETS
from .read import COMMENT, COUNT, MeshFile, folders, point_ids_of, present, steps


def places(path: Path, at: int) -> Places:
    """Of each region in turn, or of all processors: a point that several of these have stands in each."""
    states = steps(path)
    named = folders(path, states[at].name if states else "constant")
    parts = [_of_file(folder) for _, folder in named]
    ids = [
        point_ids_of(folder, len(part.starts)) if name.startswith("processor") else None
        for (name, folder), part in zip(named, parts, strict=True)
    ]
    whole = Places.joined(parts)
    given = [one for one in ids if one is not None]
    if len(given) < len(parts):
        return whole
    _, of_piece = np.unique(np.concatenate(given), return_inverse=True)
    return whole.each_once(of_piece.reshape(-1).astype(np.int64))


def _of_file(folder: Path) -> Places:
    file = MeshFile(folder, "points")
    path = present(folder, "points")
    path = path if path.is_file() else path.with_name(f"{path.name}.gz")
    data = contents(path)
    begin = data.index(b"}", data.index(b"FoamFile")) + 1
    if not file.is_binary:
        data = COMMENT.sub(lambda match: b" " * len(match[0]), data[:begin] + data[begin:])
    else:
        begin = file.at
    count = COUNT.match(data, begin)
    none = np.full((0, 3), -1, np.int64)
    if count is None or count[2] == b"{":
        return Places.of(path, Text(), none, none)
    n = int(count[1])
    if file.is_binary:
        size = file.scalar.itemsize
        starts = count.end() + size * np.arange(3 * n).reshape(n, 3)
        return Places.of(path, Raw(file.scalar), starts, starts + size)
    spans = words(data.translate(WITHOUT_BRACKETS), count.end(), len(data))
    starts, ends = (one[: 3 * n].reshape(n, 3) for one in spans)
    return Places.of(path, Text(), starts, ends)
