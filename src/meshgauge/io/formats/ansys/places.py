"""Where an ANSYS archive holds the coordinates of nodes: in blocks; those that are given one by one have no place."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ....errors import ReadError
from ...plumbing.numerals import Form, Ints, Text
from ...plumbing.patch import Places
from ...plumbing.spans import in_place
from .columns import END, items

_BLOCK = re.compile(rb"^[ \t]*NBLOCK[ \t]*,[^\n]*\n([^\n]*)\n", re.MULTILINE | re.IGNORECASE)
_GENERATES = re.compile(rb"^[ \t]*(NGEN|FILL|NSYM|NMODIF|NSCALE)[ \t]*,", re.MULTILINE | re.IGNORECASE)
_REAL = re.compile(rb"[eg](\d+)\.(\d+)(?:e(\d+))?", re.IGNORECASE)


def places(path: Path) -> Places:
    """Of every NBLOCK of the file itself.

    Raises
    ------
    ReadError
        If nodes are generated from others, or changed one by one.
    """
    data = in_place(path.read_bytes())
    generates = _GENERATES.search(data)
    if generates is not None:
        line = data.count(b"\n", 0, generates.start()) + 1
        name = generates[1].decode().upper()
        raise ReadError(f"{path}, line {line}: {name} makes nodes of others, which have no place of their own")
    parts = []
    for head in _BLOCK.finditer(data):
        real = _REAL.search(head[1])
        given = items(head[1].decode("utf-8", "replace"))
        if real is None or not given:
            raise ReadError(f"{path}: NBLOCK has the format {head[1][:40]!r}, which is not known")
        width, decimals, n_exponent = int(real[1]), int(real[2]), int(real[3] or 2)
        form = Text(most=width, is_field=True, exponent="E", decimals=decimals, n_exponent=n_exponent)
        first = sum(n * size for n, kind, size in given if kind == "i")
        end = END.search(data, head.end())
        parts.append(_block(path, data, head.end(), end.start() if end else len(data), given[0][2], first, width, form))
    return Places.joined(parts)


def _block(path: Path, data: bytes, start: int, stop: int, label: int, first: int, width: int, form: Form) -> Places:
    """The lines of a block; a coordinate that a line ends before has no place."""
    labels, spans, at = [], [], start
    for line in data[start:stop].split(b"\n"):
        if line.strip():
            labels.append(int(line[:label]))
            ends = [first + (k + 1) * width for k in range(3)]
            spans.append([(at + end - width, at + end) if end <= len(line.rstrip()) else (-1, -1) for end in ends])
        at += len(line) + 1
    table: Ints = np.array(spans, np.int64).reshape(-1, 3, 2)
    return Places.of(path, form, table[:, :, 0], table[:, :, 1], np.array(labels, np.int64))
