"""OpenFOAM's cases: a file .foam in the folder names one, or the folder itself."""

from __future__ import annotations

from pathlib import Path

from ...plumbing.format import Format
from .pieces import pieces, takes
from .places import places
from .read import TIME, read, steps

_MADE = ("processor", "postProcessing", "VTK")
"""How names of folders begin that are made from a mesh and its fields."""


def sniff(head: bytes, path: Path) -> bool:
    return path.suffix.lower() == ".foam" or b"FoamFile" in head


def is_of_the_old_mesh(name: str) -> bool:
    """What in a case is of the mesh as it was: times but the first, and what is made from them."""
    return (TIME.fullmatch(name) is not None and float(name) > 0) or name.startswith(_MADE)


OPENFOAM = Format(
    "openfoam",
    "OpenFOAM",
    (".foam",),
    sniff,
    steps=steps,
    read_step=read,
    step_places=places,
    pieces=pieces,
    takes=takes,
    is_stale=is_of_the_old_mesh,
)
