"""Medit's .mesh and .meshb (GMF).

Own, because meshio's reader needs a process of its own, and takes sections that it does not know for an end.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ....mesh import Mesh
from ...plumbing.format import Format
from ...plumbing.patch import Places
from ...plumbing.patch_faces import Faces
from ...plumbing.patch_nodes import Nodes
from . import read as medit_read
from .nodes import nodes
from .places import places
from .write import write

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
    return medit_read.read(path, is_binary=_is_binary(_head(path)))


def _places(path: Path) -> Places:
    return places(path, is_binary=_is_binary(_head(path)))


def _nodes(path: Path) -> tuple[Nodes | Faces, ...]:
    return nodes(path, is_binary=_is_binary(_head(path)))


def _head(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(12)


MEDIT = Format("medit", "Medit", (".mesh", ".meshb"), sniff, read, write=write, places=_places, nodes=_nodes)
