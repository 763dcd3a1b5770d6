"""Variables of elements and nodes added to Exodus files, equal at all time steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..plumbing.added import Added, CannotAdd
from ..plumbing.netcdf import Variable, variables
from ..plumbing.netcdf_adding import dimensions, with_variables
from . import spread

_WIDTH = 33
"""Characters of a name, with the zero behind it."""


def add(old: Path, new: Path, added: Added, blocks: Sequence[tuple[int, int]]) -> None:
    """Behind the variables that there are; those of the same names get other values.

    Parameters
    ----------
    old, new, added
        As for all formats.
    blocks
        Number and size of each block of elements, in the order of the mesh.
    """
    if len(spread.all_pieces(old)) > 1:
        raise CannotAdd("is spread over several files; join them first (epu)")
    there, of_variables = dimensions(old)
    sizes: dict[str, int] = {"time_step": 0}
    made: dict[str, tuple[tuple[str, ...], NDArray[Any]]] = {}
    with variables(old) as arrays:
        times = arrays["time_whole"].values().ravel() if "time_whole" in arrays else np.empty(0)
        names = {kind: _names(arrays, kind) for kind in ("elem", "nod")}
        table = np.asarray(arrays["elem_var_tab"].values(), np.int32) if "elem_var_tab" in arrays else None
    if not len(times):
        made["time_whole"], times = (("time_step",), np.zeros(1)), np.zeros(1)
    n_names = len(names["elem"])
    n_blocks = max((number for number, _ in blocks), default=0)
    for kind, ours in (("elem", added.cells), ("nod", added.points)):
        names[kind] = every = list(dict.fromkeys([*names[kind], *ours]))
        usual = "len_name" if "len_name" in there else "len_string"
        _, of_names = of_variables.get(f"name_{kind}_var", ("", usual))
        length = there.get(of_names, _WIDTH)
        if max(map(len, every)) >= length:
            raise CannotAdd(f"holds names of {length - 1} characters only")
        sizes |= {f"num_{kind}_var": len(every), of_names: length}
        text = np.frombuffer(b"".join(name.encode().ljust(length, b"\0") for name in every), "S1").reshape(-1, length)
        made[f"name_{kind}_var"] = ((f"num_{kind}_var", of_names), text)
    held = np.zeros((n_blocks, len(names["elem"])), np.int32)
    held[:, :n_names] = 1 if table is None else table
    ours_at = [names["elem"].index(name) for name in added.cells]
    held[np.ix_([number - 1 for number, n in blocks if n], ours_at)] = 1
    made["elem_var_tab"] = (("num_el_blk", "num_elem_var"), held)
    for name, values in added.points_as_reals.items():
        key = f"vals_nod_var{names['nod'].index(name) + 1}"
        made[key] = (("time_step", "num_nodes"), np.broadcast_to(values, (len(times), len(values))))
    for name, values in added.cells_as_reals.items():
        at = 0
        for number, n in blocks:
            key = f"vals_elem_var{names['elem'].index(name) + 1}eb{number}"
            own = np.broadcast_to(values[at : at + n], (len(times), n))
            if n:
                made[key] = (("time_step", f"num_el_in_blk{number}"), own)
            at += n
    with_variables(old, new, sizes, made)


def _names(arrays: Mapping[str, Variable], kind: str) -> list[str]:
    return arrays[f"name_{kind}_var"].text() if f"name_{kind}_var" in arrays else []
