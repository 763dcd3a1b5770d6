"""Where the .node file of TetGen's and RF's meshes holds the coordinates of points."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..plumbing.numerals import Text
from ..plumbing.patch import Places
from ..plumbing.spans import after_lines, columns, in_place


def places(path: Path) -> Places:
    """Behind the number of each point, a line each."""
    file = path.with_suffix(".node")
    data = in_place(file.read_bytes(), b"#")
    begin = after_lines(data, 0, 1)
    end = after_lines(data, begin, int(data[:begin].split()[0]))
    starts, ends = columns(data, begin, end, 0, 4)
    spans = zip(starts[:, 0].tolist(), ends[:, 0].tolist(), strict=True)
    labels = np.array([int(float(data[a:b])) for a, b in spans], np.int64)
    return Places.of(file, Text(), starts[:, 1:], ends[:, 1:], labels)
