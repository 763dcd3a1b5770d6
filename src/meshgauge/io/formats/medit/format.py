"""Medit's .mesh and .meshb (GMF).

Own reader, because meshio's needs a process of its own, and takes sections that it does not know for an end. Its writer
is used.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....mesh import Mesh
from ....mesh.regions import KEYS
from ...plumbing import meshio
from ...plumbing.format import Format
from . import read as medit_read

_MARK = re.compile(rb"^(?:\s|#[^\n]*\n)*MeshVersionFormatted\b")
_BINARY = (b"\x01\x00\x00\x00", b"\x00\x00\x00\x01")


def sniff(head: bytes, path: Path) -> bool:
    return _MARK.match(head) is not None or _is_binary(head)


def _is_binary(head: bytes) -> bool:
    """The number 1, a version from 1 to 4, and the keyword Dimension, 3."""
    if head[:4] not in _BINARY or len(head) < 12:
        return False
    one, version, keyword = np.frombuffer(head[:12], "<i4" if head[0] else ">i4").tolist()
    return bool(one == 1 and 1 <= version <= 4 and keyword == 3)


def read(path: Path) -> Mesh:
    with path.open("rb") as file:
        head = file.read(12)
    return medit_read.read(path, is_binary=_is_binary(head))


def write(path: Path, mesh: Mesh) -> tuple[str, ...]:
    """Ascii or, for .meshb, binary. Of the data one integer a point and a cell is kept: a reference or physical tag."""
    source = meshio.from_mesh(mesh)
    lost = []
    renamed: dict[str, str | None] = {"point": None, "cell": None}
    for what, data in (("point", source.point_data), ("cell", source.cell_data)):
        name = next((n for n in _REFERENCES if n in data and _is_integer(data[n])), None)
        values = data.get(name)
        data.clear()
        if name is not None:
            data["medit:ref"] = values
        if name not in (None, "medit:ref"):
            renamed[what] = name
            lost.append(f"The {what} data {name!r} became Medit's references.")
    named = mesh.replace(
        point_data=_without(mesh.point_data, renamed["point"]), cell_data=_without(mesh.cell_data, renamed["cell"])
    )
    return (*lost, *meshio.write_source(path, source, named, "medit"))


def _is_integer(values: Any) -> bool:
    """Of a point one integer, of a cell, by block, too."""
    blocks = values if isinstance(values, list) else [values]
    return all(block.ndim == 1 and block.dtype.kind in "iu" for block in blocks)


def _without(data: Mapping[str, NDArray[Any]], name: str | None) -> dict[str, NDArray[Any]]:
    return {k: v for k, v in data.items() if k != name}


_REFERENCES = ("medit:ref", *(key for key in KEYS if key != "medit:ref"))

MEDIT = Format("medit", "Medit", (".mesh", ".meshb"), sniff, read, write=write)
