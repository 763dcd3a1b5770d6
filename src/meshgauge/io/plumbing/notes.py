"""Sentences on what a file holds beside its cells."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ...look.style import plural
from ...mesh import Mesh
from ...mesh.interface import INTERFACE

_SHOWN = 8


def count_note(sentence: str, counts: Mapping[str, int]) -> tuple[str, ...]:
    """``Sentence: 3 SPRINGA, 1 MASS.``; nothing if nothing was counted."""
    given = sorted((name, n) for name, n in counts.items() if n)
    if not given:
        return ()
    more = f" and {len(given) - _SHOWN} other types" if len(given) > _SHOWN else ""
    return (f"{sentence}: {', '.join(f'{n:,} {name}' for name, n in given[:_SHOWN])}{more}.",)


def mark_interfaces(mesh: Mesh, is_interface: NDArray[np.bool_]) -> Mesh:
    """The mesh with its cohesive and gasket cells marked, and a note that counts them."""
    n = int(is_interface.sum())
    if not n:
        return mesh
    verb = "is" if n == 1 else "are"
    note = f"{plural(n, 'cohesive or gasket cell')} {verb} flat by design: kept, but not measured."
    data = {**mesh.cell_data, INTERFACE: is_interface.astype(np.uint8)}
    return mesh.replace(cell_data=data, notes=(*mesh.notes, note))
