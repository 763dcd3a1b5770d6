"""The bad cells of a mesh, for a person, a viewer or a solver: as a list, a table, or a set of elements."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..cells import type_name
from ..files import output
from ..look.bands import PoorBelow
from ..mesh.labels import labels_of
from ..mesh.regions import regions
from ..quality.measure import Quality
from ..quality.poor import limits_of_cells
from ..status import STATUSES, Category, Purpose, Status, category, is_solid
from .csv import FORMULA

SET, NUMBER = "MESHGAUGE_BAD", 9999
"""What the set is called, and its number in Nastran."""

_IN_A_ROW, _IN_A_LINE, _IN_A_CARD = 16, 72, 8
"""Numbers that a line of Abaqus has at most, characters that one of Nastran's case control has, fields of a card."""

Numbers = NDArray[np.int64]


def is_bad(quality: Quality) -> NDArray[np.bool_]:
    """``(n_cells,)`` True for solid cells whose status is not that of a valid one, undecided among them, or that are
    below poor."""
    return among(quality.mesh.types, quality.status, quality.values, quality.poor_below, quality.mesh.purpose)


def among(
    types: NDArray[np.uint8],
    status: NDArray[np.uint8],
    values: NDArray[np.float64],
    poor_below: PoorBelow,
    purpose: Purpose,
) -> NDArray[np.bool_]:
    """`is_bad` of some cells, by their types, status and J_ENS."""
    with np.errstate(invalid="ignore"):
        is_good = values >= limits_of_cells(types, poor_below)
    is_good &= np.equal(category(status, purpose), Category.VALID)
    return np.asarray(is_solid(status) & ~is_good)


def is_list(path: Path) -> bool:
    """Whether numbers are written there, not a mesh: by the name."""
    return path == output.STANDARD_OUTPUT or path.suffix.lower() in _LISTS


def write_list(path: Path, quality: Quality) -> int:
    """Write the numbers of the bad cells as the file of the mesh has them, or else their positions, from 0 (for Abaqus
    and Nastran from 1).

    Parameters
    ----------
    path
        Where to: ``.txt`` and standard output (``-``) get a number a line, ``.csv`` a table, ``.inc`` an ``*ELSET`` of
        Abaqus, ``.set`` a SET of Nastran's case control, ``.bdf`` and ``.nas`` a SET3 of its bulk data, ``.cellSet`` a
        set of OpenFOAM, of positions.

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
    if path.suffix.lower() == ".csv":
        ids, names = regions(quality.mesh)
        write_table(path, Listed(quality, ids, names), cells)
    else:
        labels = labels_of(quality.mesh, "cell")
        write_numbers(path, cells, None if labels is None else labels[cells])
    return len(cells)


def write_numbers(path: Path, cells: Numbers, labels: Numbers | None) -> None:
    """Write a list, but for a table, of cells by their positions, and the file's own numbers of them, if it has any.

    Raises `WriteError` if the file cannot be written.
    """
    kind = path.suffix.lower() or ".txt"
    if kind == ".cellset":
        numbers = cells
    elif labels is not None:
        numbers = labels
    else:  # a deck that is written of the mesh counts from 1
        numbers = cells + (kind in _FROM_ONE)
    output.write_text(path, _LISTS[kind](np.asarray(numbers, np.int64), path.stem))


@dataclass(frozen=True, eq=False)
class Listed:
    """Cells that are listed in a table.

    Attributes
    ----------
    quality
        Of cells of a mesh, those that are listed among them.
    regions, names
        The region of each of these, and the names of all.
    cells, points
        Ids in the mesh of these cells, ascending, and of their points; None: it is of all.
    """

    quality: Quality
    regions: Numbers
    names: tuple[str, ...]
    cells: Numbers | None = None
    points: Numbers | None = None


def write_table(path: Path, listed: Listed, chosen: Numbers) -> None:
    """Write a row a cell, by ids in the mesh: its names, what it is, its worst node, its centre and its region.

    Raises `WriteError` if the file cannot be written.
    """
    quality, names = listed.quality, listed.names
    mesh = quality.mesh
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(COLUMNS)
    labels = labels_of(mesh, "cell")
    places = chosen if listed.cells is None else np.searchsorted(listed.cells, chosen)
    for cell, at in zip(chosen.tolist(), places.tolist(), strict=True):
        status = Status(int(quality.status[at]))
        node = quality.worst_node(at) if STATUSES[status].is_measured else None
        with np.errstate(invalid="ignore", over="ignore"):
            centre = mesh.points[mesh.nodes(at)].mean(axis=0, dtype=np.float64)
        label = None if labels is None or labels[at] < 0 else int(labels[at])
        worst: tuple[float | None, ...] = (None,) * 6
        if node is not None:
            point = node.point if listed.points is None else int(listed.points[node.point])
            worst = (node.node, point, node.point_label, *node.coordinates)
        name = names[listed.regions[at]] if len(names) > 1 else ""
        region = f"'{name}" if name.startswith(FORMULA) else name
        value = float(quality.values[at])
        row = (cell, label, type_name(mesh.types[at]), STATUSES[status].name, value, *worst, *centre.tolist(), region)
        writer.writerow("" if one is None or one != one else one for one in row)
    output.write_text(path, stream.getvalue())


COLUMNS = (
    *("cell", "cell_label", "type", "status", "jens", "node", "point", "point_label"),
    *("x", "y", "z", "centre_x", "centre_y", "centre_z", "region"),
)
"""Of the table: ``x``, ``y``, ``z`` are of the worst node, the centre is the mean of the nodes."""


def _plain(numbers: Numbers, name: str) -> str:
    return "".join(f"{number}\n" for number in numbers.tolist())


def _elset(numbers: Numbers, name: str) -> str:
    rows = [numbers[at : at + _IN_A_ROW].tolist() for at in range(0, len(numbers), _IN_A_ROW)]
    lines = [", ".join(map(str, row)) for row in rows]
    return "\n".join([f"*ELSET, ELSET={SET}", *lines]) + "\n"


def _case_set(numbers: Numbers, name: str) -> str:
    """``SET 9999 = 1, 2,`` and so on: a comma at its end continues a line."""
    if not len(numbers):
        return f"$ {SET}: no cells\n"
    lines, line = [f"$ {SET}"], f"SET {NUMBER} ="
    for at, number in enumerate(numbers.tolist()):
        word = f" {number}" + ("," if at < len(numbers) - 1 else "")
        if len(line) + len(word) > _IN_A_LINE:
            lines.append(line)
            line = " "
        line += word
    return "\n".join([*lines, line]) + "\n"


def _bulk_set(numbers: Numbers, name: str) -> str:
    """A SET3 of elements in free fields."""
    if not len(numbers):
        return f"$ {SET}: no cells\n"
    fields = [f"{NUMBER}", "ELEM", *map(str, numbers.tolist())]
    rows = [fields[at : at + _IN_A_CARD] for at in range(0, len(fields), _IN_A_CARD)]
    return f"$ {SET}\n" + "".join(f"{'' if n else 'SET3'},{','.join(row)}\n" for n, row in enumerate(rows))


def _cell_set(numbers: Numbers, name: str) -> str:
    head = f"FoamFile\n{{\n    version 2.0;\n    format ascii;\n    class cellSet;\n    object {name};\n}}\n"
    return f"{head}\n{len(numbers)}\n(\n{_plain(numbers, name)})\n"


_LISTS: dict[str, Callable[[Numbers, str], str]] = {
    ".txt": _plain,
    ".csv": _plain,  # a table, which has more than numbers
    ".inc": _elset,
    ".set": _case_set,
    ".bdf": _bulk_set,
    ".nas": _bulk_set,
    ".cellset": _cell_set,
}
"""By extension."""

_FROM_ONE = (".inc", ".set", ".bdf", ".nas")
