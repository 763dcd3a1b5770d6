"""Where Medit's files hold the coordinates of vertices."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ....errors import ReadError
from ...plumbing.numerals import Raw, Text
from ...plumbing.patch import Places
from ...plumbing.spans import in_place, words
from .read import DIMENSION, SINGLE, VERTICES, WORD, binary_sections


def places(path: Path, *, is_binary: bool) -> Places:
    """In the section of vertices; of meshes in three dimensions only."""
    data = path.read_bytes()
    if is_binary:
        return _binary(path, data)
    data = in_place(data, b"#")
    form, dimension = Text(is_single=SINGLE.match(data) is not None), 3
    marks = list(WORD.finditer(data))
    for place, mark in enumerate(marks):
        end = marks[place + 1].start() if place + 1 < len(marks) else len(data)
        keyword = mark[0].decode("ascii").lower()
        if keyword in DIMENSION:
            dimension = int(data[mark.end() : end])
        elif keyword in VERTICES:
            starts, ends = (one[1:].reshape(-1, dimension + 1)[:, :dimension] for one in words(data, mark.end(), end))
            return Places.of(path, form, starts, ends)
    raise ReadError(f"{path}: has no vertices")


def _binary(path: Path, data: bytes) -> Places:
    for section in binary_sections(path, data):
        if section.code == VERTICES[1]:
            real, integer = section.real, section.integer
            n = int(np.frombuffer(data, integer, 1, section.start)[0])
            width = section.dimension
            row = section.start + integer.itemsize + np.arange(n) * (width * real.itemsize + integer.itemsize)
            starts = row[:, None] + real.itemsize * np.arange(width)
            return Places.of(path, Raw(real), starts, starts + real.itemsize)
    raise ReadError(f"{path}: has no vertices")
