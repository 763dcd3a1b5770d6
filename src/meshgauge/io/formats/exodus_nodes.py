"""Where Exodus files hold the nodes of elements."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ...errors import ReadError
from ..plumbing.netcdf import variables
from ..plumbing.patch_nodes import Nodes

_CONNECT = re.compile(r"connect(\d+)")
_SIDES = re.compile(r"(side_ss|elem_ss|edgconn|fbconn)\d+")


def nodes(path: Path) -> tuple[Nodes, ...]:
    """Of every block in turn.

    Raises
    ------
    ReadError
        If sets of sides name faces of elements by their local numbers, or the nodes of a block stand in pieces.
    """
    with variables(path) as arrays:
        sides = next((name for name in arrays if _SIDES.fullmatch(name)), None)
        if sides is not None:
            raise ReadError(
                f"{path}: {sides} names faces of elements by their local numbers, which are others once a cell is "
                "renumbered; give -o OUT in another format: a conversion, without sets of sides"
            )
        pieces = []
        blocks = sorted((int(match[1]), name) for name in arrays if (match := _CONNECT.fullmatch(name)))
        for _, name in blocks:
            variable = arrays[name]
            start, kind = variable.start, variable.kind
            if variable.dataset is not None:
                start = None if variable.dataset.chunks else variable.dataset.id.get_offset()
                kind = variable.dataset.dtype.str
            if start is None or len(variable.shape) != 2:
                raise ReadError(f"{path}: the array {name} is packed or in pieces; its cells cannot be renumbered")
            size = np.dtype(kind).itemsize
            starts = start + size * np.arange(variable.shape[0] * variable.shape[1]).reshape(variable.shape)
            pieces.append(Nodes(path, starts, starts + size, kind, first=1))
    return tuple(pieces)
