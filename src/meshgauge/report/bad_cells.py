"""The bad cells of a mesh, for a viewer or a solver: as a mesh of them alone, as a list, or as a set of elements."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..files import output
from ..mesh.labels import labels_of
from ..quality.measure import Quality
from ..status import Category, category, is_solid

SET = "MESHGAUGE_BAD"
"""What the set is called."""

_IN_A_ROW = 16
"""Numbers that a line of Abaqus has at most."""

Numbers = NDArray[np.int64]


def is_bad(quality: Quality) -> NDArray[np.bool_]:
    """``(n_cells,)`` True for solid cells whose status is not that of a valid one, undecided among them, or that are
    below poor."""
    status = quality.status
    with np.errstate(invalid="ignore"):
        is_good = quality.values >= quality.poor_limits()
    is_good &= np.equal(category(status, quality.mesh.purpose), Category.VALID)
    return np.asarray(is_solid(status) & ~is_good)


def is_list(path: Path) -> bool:
    """Whether numbers are written there, not a mesh: by the name."""
    return path.suffix.lower() in _LISTS


def write_list(path: Path, quality: Quality) -> int:
    """Write the numbers of the bad cells as the file of the mesh has them, or else their positions, from 0 (for Abaqus
    from 1).

    Parameters
    ----------
    path
        Where to: ``.txt`` gets a number a line, ``.inc`` an ``*ELSET`` of Abaqus, ``.cellSet`` a set of OpenFOAM, of
        positions.

    Returns
    -------
    int
        How many cells.

    Raises
    ------
    WriteError
        If the file cannot be written.
    """
    cells = np.flatnonzero(is_bad(quality))
    labels = labels_of(quality.mesh, "cell")
    kind = path.suffix.lower()
    if kind == ".cellset":
        numbers = cells
    elif labels is not None:
        numbers = labels[cells]
    else:  # a deck that is written of the mesh counts from 1
        numbers = cells + (kind == ".inc")
    output.write_text(path, _LISTS[kind](np.asarray(numbers, np.int64), path.stem))
    return len(cells)


def _plain(numbers: Numbers, name: str) -> str:
    return "".join(f"{number}\n" for number in numbers.tolist())


def _elset(numbers: Numbers, name: str) -> str:
    rows = [numbers[at : at + _IN_A_ROW].tolist() for at in range(0, len(numbers), _IN_A_ROW)]
    lines = [", ".join(map(str, row)) for row in rows]
    return "\n".join([f"*ELSET, ELSET={SET}", *lines]) + "\n"


def _cell_set(numbers: Numbers, name: str) -> str:
    head = f"FoamFile\n{{\n    version 2.0;\n    format ascii;\n    class cellSet;\n    object {name};\n}}\n"
    return f"{head}\n{len(numbers)}\n(\n{_plain(numbers, name)})\n"


_LISTS: dict[str, Callable[[Numbers, str], str]] = {".txt": _plain, ".inc": _elset, ".cellset": _cell_set}
"""By extension."""
