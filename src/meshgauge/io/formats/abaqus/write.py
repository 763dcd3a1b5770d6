"""Abaqus input files, written: cells in their order, an element set a region, sets and materials as they were read."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....cells import BY_NAME, CELL_TYPES
from ....mesh import Mesh
from ....mesh.interface import INTERFACE, is_interface
from ....mesh.labels import LABEL
from ....mesh.regions import named_regions
from ...plumbing import writing

_TYPES = {
    "tetra": "C3D4",
    "pyramid": "C3D5",
    "wedge": "C3D6",
    "hexahedron": "C3D8",
    "tetra10": "C3D10",
    "wedge15": "C3D15",
    "hexahedron20": "C3D20",
    "hexahedron27": "C3D27",
    "wedge18": "C3D15V",
    "triangle": "S3",
    "quad": "S4",
    "triangle6": "STRI65",
    "quad8": "S8R",
    "line": "T3D2",
    "line3": "T3D3",
    "vertex": "MASS",
}
_WEDGE12 = BY_NAME["wedge12"].vtk_id
_COHESIVE = {"wedge": "COH3D6", "hexahedron": "COH3D8", "wedge12": "GK3D12M"}
_ORDER = {"line3": (0, 2, 1), "hexahedron27": (*range(20), 26, 24, 25, 22, 21, 23, 20)}
"""Where the order of nodes is not VTK's: for each node of Abaqus its place in VTK's cell."""
_PLAIN = re.compile(r"[A-Za-z_][A-Za-z0-9_.-]*")
_PER_LINE = 16
_LARGEST = 999_999_999


def write(path: Path, mesh: Mesh, material: str) -> tuple[str, ...]:
    """Write a file; ``material`` is the name of the cell data that number materials.

    Nodes and elements have the labels of the mesh, where it has any; cohesive cells are cohesive elements again.
    """
    mesh = writing.plain(mesh)
    interface = is_interface(mesh)
    is_cohesive = interface if interface is not None else np.zeros(mesh.n_cells, bool)
    writing.check_types(mesh, {**_TYPES, **({"wedge12": ""} if is_cohesive[mesh.types == _WEDGE12].all() else {})})
    ids, names = named_regions(mesh) or (np.zeros(mesh.n_cells, np.int64), ("",))
    sets = _names(names) if names != ("",) else [""]
    of_regions = {writing.REGION.upper(), *(name.upper() for name in names)}
    apart = (*of_regions, INTERFACE.upper())
    members = {k: v for k, v in mesh.cell_data.items() if _is_set(v) and k.upper() not in apart}
    materials = mesh.field_data.get(f"{material}:names") if material in mesh.cell_data else None
    points = writing.numbers(mesh.point_data, mesh.n_points, _LARGEST)
    cells = writing.numbers(mesh.cell_data, mesh.n_cells, _LARGEST)
    with path.open("w", encoding="utf-8") as file:
        file.write("*HEADING\n*NODE\n")
        file.writelines(
            f"{n}, {x!r}, {y!r}, {z!r}\n" for n, (x, y, z) in zip(points.tolist(), mesh.points.tolist(), strict=True)
        )
        for first, last in _runs(mesh, ids, is_cohesive):
            name = CELL_TYPES[int(mesh.types[first])].name
            kind = _COHESIVE.get(name, _TYPES.get(name)) if is_cohesive[first] else _TYPES[name]
            region = sets[int(ids[first])]
            file.write(f"*ELEMENT, TYPE={kind}" + (f", ELSET={_quoted(region)}\n" if region else "\n"))
            nodes = points[writing.nodes_of(mesh, np.arange(first, last))]
            nodes = nodes[:, list(_ORDER[name])] if name in _ORDER else nodes
            for number, row in zip(cells[first:last].tolist(), nodes.tolist(), strict=True):
                file.write(_element(number, row))
        for name, values in members.items():
            file.write(_set(_names((name,))[0], cells[np.flatnonzero(values)]))
        if materials is not None:
            for number, name in enumerate(materials.ravel().tolist(), 1):
                label = _names((f"MATERIAL-{name}",))[0]
                file.write(_set(label, cells[mesh.cell_data[material] == number]))
                own = _quoted(_names((str(name),))[0])
                file.write(f"*SOLID SECTION, ELSET={_quoted(label)}, MATERIAL={own}\n")
    kept = [k for k, v in mesh.cell_data.items() if _is_set(v)] + _in_regions(mesh, ids)
    kept += [material] if materials is not None else []
    kept += [LABEL] if np.array_equal(cells, mesh.cell_data.get(LABEL, ())) else []
    kept_points = [LABEL] if np.array_equal(points, mesh.point_data.get(LABEL, ())) else []
    renamed = [name for name, label in zip(names, sets, strict=False) if label and label != name]
    notes = (f"Abaqus's names hold no commas or quotes: {', '.join(renamed[:8])} changed.",) if renamed else ()
    return (
        *notes,
        *writing.loss_notes(mesh, point=kept_points, cell=kept, field=(*names, *(f"{k}:names" for k in kept))),
    )


def _in_regions(mesh: Mesh, ids: NDArray[np.int64]) -> list[str]:
    """Integer cell data that the regions tell as well, number by number."""
    names = []
    for name, values in mesh.cell_data.items():
        if values.ndim == 1 and values.dtype.kind in "iu" and len(values):
            keys, place = np.unique(values, return_inverse=True)
            n_pairs = len(np.unique(ids * len(keys) + place.reshape(-1)))
            if n_pairs == len(keys) == len(np.unique(ids)) > 1:
                names.append(name)
    return names


def _is_set(values: NDArray[Any]) -> bool:
    """True for bytes of 0 and 1: the members of a set."""
    return values.ndim == 1 and values.dtype in (np.uint8, np.bool_) and bool((values <= 1).all())


def _names(names: tuple[str, ...]) -> list[str]:
    """Names that an input file can hold, each another."""
    labels: list[str] = []
    taken: set[str] = set()
    for name in names:
        label = plain = re.sub(r"[,\"'=*\r\n]", "_", name).strip()[:80] or "SET"
        number = len(labels)
        while label.upper() in taken:
            label, number = f"{plain[:70]}-{number}", number + 1
        taken.add(label.upper())
        labels.append(label)
    return labels


def _quoted(label: str) -> str:
    """A name between quotation marks, where Abaqus needs them: with blanks, or if it begins with no letter."""
    return label if _PLAIN.fullmatch(label) else f'"{label}"'


def _runs(mesh: Mesh, ids: NDArray[np.int64], is_cohesive: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """First and last of the cells of one type and region that follow one another."""
    keys = (ids * 2 + is_cohesive) * 256 + mesh.types
    edges = [0, *(np.flatnonzero(np.diff(keys)) + 1).tolist(), len(keys)]
    return ((a, b) for a, b in itertools.pairwise(edges) if b > a)


def _element(number: int, nodes: list[int]) -> str:
    words = [str(number), *map(str, nodes)]
    lines = [", ".join(words[at : at + _PER_LINE]) for at in range(0, len(words), _PER_LINE)]
    return ",\n".join(lines) + "\n"


def _set(name: str, numbers: NDArray[np.int64]) -> str:
    flat = numbers.tolist()
    lines = [", ".join(map(str, flat[at : at + _PER_LINE])) for at in range(0, len(flat), _PER_LINE)]
    return f"*ELSET, ELSET={_quoted(name)}\n" + "".join(f"{line}\n" for line in lines)
