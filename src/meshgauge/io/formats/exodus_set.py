"""A set of elements added to Exodus files, behind those that there are."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..plumbing.added import CannotAdd
from ..plumbing.cell_set import CellSet
from ..plumbing.netcdf import variables
from ..plumbing.netcdf_adding import dimensions, with_variables
from . import spread

_SETS = "num_elem_sets"
_WIDTH = 33
"""Characters of a name, with the zero behind it."""


def add_set(old: Path, new: Path, chosen: CellSet) -> None:
    """Elements are counted from 1 in the order of the blocks, which is that of the mesh."""
    if len(spread.all_pieces(old)) > 1:
        raise CannotAdd("is spread over several files; join them first (epu)")
    there, of_variables = dimensions(old)
    n_sets = there.get(_SETS, 0)
    made: dict[str, tuple[tuple[str, ...], NDArray[Any]]] = {}
    with variables(old) as arrays:
        ours = {name: arrays[name] for name, of in of_variables.items() if of[:1] == (_SETS,) and name in arrays}
        held = {name: np.asarray(one.values()) for name, one in ours.items() if name != "els_names"}
        names = arrays["els_names"].text() if "els_names" in arrays else [""] * n_sets
    if chosen.name in names:
        raise CannotAdd(f"has a set {chosen.name} already")
    for name in ("els_status", "els_prop1"):
        held.setdefault(name, np.arange(1, n_sets + 1) if name == "els_prop1" else np.ones(n_sets))
    for name, values in held.items():
        added = {"els_status": 1, "els_prop1": int(values.max(initial=0)) + 1}.get(name, 0)
        made[name] = ((_SETS,), np.append(values, added).astype(np.int32))
    usual = "len_name" if "len_name" in there else "len_string"
    _, of_names = of_variables.get("els_names", ("", usual))
    length = there.get(of_names, _WIDTH)
    if max(map(len, [*names, chosen.name])) >= length:
        raise CannotAdd(f"holds names of {length - 1} characters only")
    raw = b"".join(name.encode().ljust(length, b"\0") for name in [*names, chosen.name])
    made["els_names"] = ((_SETS, of_names), np.frombuffer(raw, "S1").reshape(-1, length))
    size, elements = f"num_ele_els{n_sets + 1}", f"elem_els{n_sets + 1}"
    made[elements] = ((size,), (chosen.cells + 1).astype(np.int32))
    sizes = {_SETS: n_sets + 1, of_names: length, size: len(chosen.cells)}
    with_variables(old, new, sizes, made, {"els_prop1": {"name": "ID"}})
