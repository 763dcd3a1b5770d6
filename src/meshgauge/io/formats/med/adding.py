"""Fields added to MED files: of cells a part for each type, at one step, as MED's library writes them."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ...plumbing.added import Added, CannotAdd
from .cells import KINDS

_NO_PROFILE = "MED_NO_PROFILE_INTERNAL"
_EMPTY = np.bytes_("")
_WIDTH = 16
"""Characters of the name of a component."""


def add(old: Path, new: Path, added: Added) -> None:
    """Of every mesh of the file at its first step, in the order in which they are read."""
    import h5py

    shutil.copyfile(old, new)
    with h5py.File(new, "r+") as file:
        meshes = file["ENS_MAA"]
        if any("NOE" in group for group in meshes.values()):
            raise CannotAdd("is of MED's version 2; MED's medimport converts it")
        if len(meshes) > 1:
            raise CannotAdd("holds several meshes, and a field belongs to one")
        (name,) = meshes
        step = meshes[name][next(iter(meshes[name]))]
        fields = file.require_group("CHA")
        for key in {*added.cells, *added.points}.intersection(fields):
            del fields[key]
        if set(added.cells) & set(added.points):
            raise CannotAdd("would need fields of one name on cells and on points")
        for key, values in added.points_as_reals.items():
            _part(_field(fields, key, name, step), "NOE", values)
        for key, values in added.cells_as_reals.items():
            made, at = _field(fields, key, name, step), 0
            for code, n in _counts(step["MAI"]):
                _part(made, f"MAI.{code}", values[at : at + n])
                at += n


def _counts(types: Any) -> Iterator[tuple[str, int]]:
    """How many cells there are of each type, in the order of the mesh."""
    for code, group in types.items():
        if code in KINDS:
            yield code, group["NOD"].size // KINDS[code].n_nodes
        else:
            yield code, group["IFN" if code == "POE" else "INN"].size - 1


def _field(fields: Any, key: str, mesh: str, step: Any) -> Any:
    """A field of one number, at the one step that it has."""
    made = fields.create_group(key)
    for name, value in (("MAI", np.bytes_(mesh)), ("TYP", 6), ("UNI", np.bytes_(" " * _WIDTH)), ("UNT", _EMPTY),
                        ("NCO", 1), ("NOM", np.bytes_(key[:_WIDTH].ljust(_WIDTH)))):  # fmt: skip
        made.attrs.create(name, value)
    at = made.create_group(f"{-1:020d}{-1:020d}")
    at.attrs.create("PDT", 0.0)
    for name, value in (("NDT", -1), ("NOR", -1), ("RDT", step.attrs.get("NDT", -1)),
                        ("ROR", step.attrs.get("NOR", -1))):  # fmt: skip
        at.attrs.create(name, value)
    return at


def _part(step: Any, place: str, values: Any) -> None:
    """The numbers on all points, or on all cells of a type."""
    made = step.create_group(place)
    made.attrs.create("GAU", _EMPTY)
    made.attrs.create("PFL", np.bytes_(_NO_PROFILE))
    held = made.create_group(_NO_PROFILE)
    held.attrs.create("NBR", len(values))
    held.attrs.create("NGA", 1)
    held.attrs.create("GAU", _EMPTY)
    held.create_dataset("CO", data=values)
