"""Abaqus input files, written: cells in their order, an element set a region, sets and materials as they were read."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....cells import CELL_TYPES
from ....mesh import Mesh
from ....mesh.regions import told_regions
from ...plumbing import writing

_TYPES = {
    "tetra": "C3D4",
    "pyramid": "C3D5",
    "wedge": "C3D6",
    "hexahedron": "C3D8",
    "tetra10": "C3D10",
    "wedge15": "C3D15",
    "hexahedron20": "C3D20",
    "triangle": "S3",
    "quad": "S4",
    "triangle6": "STRI65",
    "quad8": "S8R",
    "line": "T3D2",
    "line3": "T3D3",
    "vertex": "MASS",
}
_LINE3 = [0, 2, 1]  # the middle stands between the ends
_PER_LINE = 16


def write(path: Path, mesh: Mesh, material: str) -> tuple[str, ...]:
    """Write a file; ``material`` is the name of the cell data that number materials."""
    mesh = writing.plain(mesh)
    writing.check_types(mesh, _TYPES)
    ids, names = told_regions(mesh) or (np.zeros(mesh.n_cells, np.int64), ("",))
    sets = _names(names) if names != ("",) else [""]
    told = {writing.REGION.upper(), *(name.upper() for name in names)}
    members = {k: v for k, v in mesh.cell_data.items() if _is_set(v) and k.upper() not in told}
    materials = mesh.field_data.get(f"{material}:names") if material in mesh.cell_data else None
    with path.open("w", encoding="utf-8") as file:
        file.write("*HEADING\n*NODE\n")
        numbers = range(1, mesh.n_points + 1)
        file.writelines(
            f"{n}, {x!r}, {y!r}, {z!r}\n" for n, (x, y, z) in zip(numbers, mesh.points.tolist(), strict=True)
        )
        for first, last in _runs(mesh, ids):
            name = CELL_TYPES[int(mesh.types[first])].name
            region = sets[int(ids[first])]
            file.write(f"*ELEMENT, TYPE={_TYPES[name]}" + (f", ELSET={region}\n" if region else "\n"))
            nodes = writing.nodes_of(mesh, np.arange(first, last)) + 1
            nodes = nodes[:, _LINE3] if name == "line3" else nodes
            for number, row in enumerate(nodes.tolist(), first + 1):
                file.write(_element(number, row))
        for name, values in members.items():
            file.write(_set(_names((name,))[0], np.flatnonzero(values) + 1))
        if materials is not None:
            for number, name in enumerate(materials.ravel().tolist(), 1):
                cells = np.flatnonzero(mesh.cell_data[material] == number) + 1
                label = _names((f"MATERIAL-{name}",))[0]
                file.write(_set(label, cells) + f"*SOLID SECTION, ELSET={label}, MATERIAL={_names((str(name),))[0]}\n")
    kept = [k for k, v in mesh.cell_data.items() if _is_set(v)] + _told(mesh, ids)
    kept += [material] if materials is not None else []
    renamed = [name for name, label in zip(names, sets, strict=False) if label and label != name]
    said = (f"Abaqus's names hold no commas or quotes: {', '.join(renamed[:8])} changed.",) if renamed else ()
    return (*said, *writing.lost(mesh, cell=kept, field=(*names, *(f"{k}:names" for k in kept))))


def _told(mesh: Mesh, ids: NDArray[np.int64]) -> list[str]:
    """Integer cell data that the regions tell as well, number by number."""
    found = []
    for name, values in mesh.cell_data.items():
        if values.ndim == 1 and values.dtype.kind in "iu" and len(values):
            keys, place = np.unique(values, return_inverse=True)
            n_pairs = len(np.unique(ids * len(keys) + place.reshape(-1)))
            if n_pairs == len(keys) == len(np.unique(ids)) > 1:
                found.append(name)
    return found


def _is_set(values: NDArray[Any]) -> bool:
    """True for bytes of 0 and 1: the members of a set."""
    return values.ndim == 1 and values.dtype in (np.uint8, np.bool_) and bool((values <= 1).all())


def _names(names: tuple[str, ...]) -> list[str]:
    """Names that an input file can hold, each another."""
    found: list[str] = []
    for name in names:
        label = re.sub(r"[,\"'=*\r\n]", "_", name).strip()[:80] or "SET"
        while label.upper() in (other.upper() for other in found):
            label = f"{label[:76]}-{len(found)}"
        found.append(label)
    return found


def _runs(mesh: Mesh, ids: NDArray[np.int64]) -> Iterator[tuple[int, int]]:
    """First and last of the cells of one type and region that follow one another."""
    keys = ids * 256 + mesh.types
    edges = [0, *(np.flatnonzero(np.diff(keys)) + 1).tolist(), len(keys)]
    return ((a, b) for a, b in itertools.pairwise(edges) if b > a)


def _element(number: int, nodes: list[int]) -> str:
    words = [str(number), *map(str, nodes)]
    lines = [", ".join(words[at : at + _PER_LINE]) for at in range(0, len(words), _PER_LINE)]
    return ",\n".join(lines) + "\n"


def _set(name: str, numbers: NDArray[np.int64]) -> str:
    flat = numbers.tolist()
    lines = [", ".join(map(str, flat[at : at + _PER_LINE])) for at in range(0, len(flat), _PER_LINE)]
    return f"*ELSET, ELSET={name}\n" + "".join(f"{line}\n" for line in lines)
