"""Abaqus's input files (.inp)."""

from __future__ import annotations

import re
from pathlib import Path

from ....mesh import Mesh
from ...plumbing import included
from ...plumbing.format import Format
from . import write as abaqus_write
from .nodes import nodes
from .places import places
from .read import MATERIAL, read

_MARK = re.compile(rb"^\*(heading|node|element|part|include|\*)", re.IGNORECASE | re.MULTILINE)


def sniff(head: bytes, path: Path) -> bool:
    return _MARK.search(head) is not None


def write(path: Path, mesh: Mesh) -> tuple[str, ...]:
    return abaqus_write.write(path, mesh, MATERIAL)


ABAQUS = Format(
    "abaqus", "Abaqus", (".inp",), sniff, read, write=write, places=places, nodes=nodes, included=included.abaqus,
    by_content=False,
)  # fmt: skip
