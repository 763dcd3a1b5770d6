"""Writing Gmsh's .msh, version 2.2: the version that most programs read.

Binary where nodes count from 1, else text: meshio reads binary nodes of no other numbers. With data of cells of several
types it is version 4.1, of which meshio knows which cells they belong to.
"""

from __future__ import annotations

import itertools
import re
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ....cells import CELL_TYPES, type_name
from ....errors import WriteError
from ....mesh import Mesh
from ....mesh.labels import LABEL
from ....mesh.regions import KEYS, named_regions
from ...plumbing import writing
from .cells import BY_CELL

Ints = NDArray[np.int64]
TAGS = ("gmsh:physical", "gmsh:geometrical")
_LARGEST = 2**31 - 1


def write(path: Path, mesh: Mesh) -> tuple[str, ...]:
    """Write the mesh; sentences that say what the format could not hold.

    Nodes and elements have the labels of the mesh, where it has any.
    """
    if max(mesh.n_points, mesh.n_cells) >= _LARGEST:
        raise WriteError(f"{path}: version 2.2 of Gmsh's format numbers at most {_LARGEST} nodes and elements")
    if _is_of_several(mesh) and any(name != LABEL and not is_tag(name, one) for name, one in mesh.cell_data.items()):
        from .write_set import write_version_4  # which stands on this module

        return write_version_4(path, mesh)
    lost: list[str] = []
    groups = groups_of(mesh)
    points = writing.numbers(mesh.point_data, mesh.n_points, _LARGEST)
    cells = writing.numbers(mesh.cell_data, mesh.n_cells, _LARGEST)
    as_text = not np.array_equal(points, np.arange(1, mesh.n_points + 1))
    with path.open("wb") as file:
        file.write(b"$MeshFormat\n2.2 0 8\n" if as_text else b"$MeshFormat\n2.2 1 8\n" + np.int32(1).tobytes() + b"\n")
        file.write(b"$EndMeshFormat\n")
        write_names(file, mesh, groups, lost)
        nodes = np.empty(mesh.n_points, [("tag", np.int32), ("x", np.float64, 3)])
        nodes["tag"] = points
        nodes["x"] = mesh.points
        file.write(f"$Nodes\n{mesh.n_points}\n".encode() + _table(nodes, as_text) + b"\n$EndNodes\n")
        file.write(f"$Elements\n{mesh.n_cells}\n".encode())
        _elements(file, path, mesh, groups, points, cells, as_text)
        file.write(b"\n$EndElements\n")
        for name, values in mesh.point_data.items():
            if name != LABEL or not np.array_equal(values, points):
                write_view(file, "NodeData", name, values, points, lost, as_text)
        for name, values in mesh.cell_data.items():
            if not (is_tag(name, values) or (name == LABEL and np.array_equal(values, cells))):
                write_view(file, "ElementData", name, values, cells, lost, as_text)
    return tuple(lost)


def _is_of_several(mesh: Mesh) -> bool:
    """Whether cells are of several types."""
    return mesh.n_cells > 0 and bool((mesh.types != mesh.types[0]).any() or (np.diff(np.diff(mesh.offsets)) != 0).any())


def is_tag(name: str, values: NDArray[np.generic]) -> bool:
    return name in TAGS and values.ndim == 1 and values.dtype.kind in "iu"


def _fits_quotes(name: str) -> bool:
    """Whether a name can stand between quotation marks: behind a backslash the last would be part of the name."""
    return '"' not in name and not name.endswith("\\")


@dataclass(frozen=True, slots=True)
class _Groups:
    """Physical groups: the tag of each cell, and the name of each dimension and tag."""

    tags: NDArray[np.int32]
    names: dict[tuple[int, int], str]
    source: frozenset[str] = frozenset()
    """Field data that the names were taken from."""


_NUMBERED = re.compile(r"\S.* (\d{1,9})")
_NONE = {f"no {key.split(':')[-1]}" for key in KEYS}
"""What `named_regions` calls cells that are in none."""


def groups_of(mesh: Mesh) -> _Groups:
    """Those of the mesh; of other formats its regions. Regions that are numbers only ("material 3") keep them."""
    given = mesh.cell_data.get(TAGS[0])
    if given is not None and is_tag(TAGS[0], given):
        return _Groups(given.astype(np.int32), {})
    regions = named_regions(mesh)
    if regions is None:
        return _Groups(np.zeros(mesh.n_cells, np.int32), {})
    ids, names = regions
    numbered = [_NUMBERED.fullmatch(name) for name in names]
    own = [int(match[1]) for match in numbered if match is not None]
    if len(set(own)) != len(names):
        tag = itertools.count(1)
        own = [0 if name in _NONE else next(tag) for name in names]
    elif 0 in own:  # which means none here
        own[own.index(0)] = max(own) + 1
    dimension = np.array([CELL_TYPES[t].dimension if t in CELL_TYPES else 0 for t in range(256)])[mesh.types]
    pairs = np.unique(np.stack([dimension, ids]), axis=1).T.tolist()
    made: dict[tuple[int, int], str] = {}
    for d, region in pairs:
        if own[region]:
            made[d, own[region]] = names[region].replace('"', "'").rstrip("\\") or f"region {own[region]}"
    return _Groups(np.array(own, np.int32)[ids], made, frozenset(writing.named_by(mesh, names)))


def write_names(file: BinaryIO, mesh: Mesh, made: _Groups, lost: list[str]) -> None:
    """Names of physical groups: field data of two integers, a tag and a dimension, or those that were made."""
    groups = {}
    for name, values in mesh.field_data.items():
        if name in made.source:
            continue
        if values.shape == (2,) and values.dtype.kind in "iu" and 0 <= int(values[1]) <= 3 and _fits_quotes(name):
            groups[name] = (int(values[1]), int(values[0]))
        else:
            lost.append(f"Gmsh's format could not hold the field data {name!r}.")
    rows = [(d, tag, name) for name, (d, tag) in groups.items()] + [(*key, name) for key, name in made.names.items()]
    if rows:
        lines = "".join(f'{d} {tag} "{name}"\n' for d, tag, name in rows)
        file.write(f"$PhysicalNames\n{len(rows)}\n{lines}$EndPhysicalNames\n".encode())


def _elements(
    file: BinaryIO, path: Path, mesh: Mesh, groups: _Groups, points: Ints, cells: Ints, as_text: bool
) -> None:
    """A block for each run of cells of one type and size, by the numbers of points and cells."""
    mesh = writing.plain(mesh)
    sizes = np.diff(mesh.offsets)
    breaks = np.flatnonzero((np.diff(mesh.types) != 0) | (np.diff(sizes) != 0)) + 1
    starts = [0, *breaks.tolist()] if mesh.n_cells else []
    entities = mesh.cell_data.get(TAGS[1], np.empty(0))
    tags = [groups.tags, entities if is_tag(TAGS[1], entities) else np.zeros(mesh.n_cells, np.int32)]
    for start, stop in zip(starts, [*starts[1:], mesh.n_cells], strict=False):
        name, n_nodes = type_name(mesh.types[start]), int(sizes[start])
        kind = BY_CELL.get((name, n_nodes))
        if kind is None:
            raise WriteError(f"{path}: cells of type {name} with {n_nodes} nodes cannot be written in Gmsh's format")
        nodes = mesh.connectivity[mesh.offsets[start] : mesh.offsets[stop]].reshape(stop - start, n_nodes)
        turned = np.argsort(kind.order) if kind.order else slice(None)
        rows = np.empty((stop - start, 3 + n_nodes), np.int32)
        rows[:, 0] = cells[start:stop]
        rows[:, 1], rows[:, 2] = tags[0][start:stop], tags[1][start:stop]
        rows[:, 3:] = points[nodes[:, turned]]
        if as_text:
            first = np.column_stack([rows[:, 0], np.full((stop - start, 2), (kind.gmsh_id, 2))])
            file.write(writing.rows(np.column_stack([first, rows[:, 1:]])).encode())
        else:
            file.write(np.array([kind.gmsh_id, stop - start, 2], np.int32).tobytes() + rows.tobytes())


def write_view(
    file: BinaryIO, section: str, name: str, values: NDArray[np.generic], tags: Ints, lost: list[str], as_text: bool
) -> None:
    what = "point" if section == "NodeData" else "cell"
    flat = values.reshape(len(values), -1) if len(values) else values.reshape(0, 1)
    width = flat.shape[1]
    if values.dtype.kind not in "fiub" or width > 9 or width < 1 or not _fits_quotes(name):
        lost.append(f"Gmsh's format could not hold the {what} data {name!r}.")
        return
    full = next(w for w in (1, 3, 9) if w >= width)
    if full != width:
        lost.append(f"The {what} data {name!r} were padded with zeros from {width} to {full} components.")
    rows = np.zeros(len(flat), [("tag", np.int32), ("value", np.float64, (full,))])
    rows["tag"] = tags
    rows["value"][:, :width] = flat
    head = f'${section}\n1\n"{name}"\n1\n0.0\n3\n0\n{full}\n{len(flat)}\n'
    file.write(head.encode() + _table(rows, as_text) + f"\n$End{section}\n".encode())


def _table(rows: NDArray[np.void], as_text: bool) -> bytes:
    """Rows of a number and coordinates or values."""
    if not as_text:
        return rows.tobytes()
    number, values = (rows[name].tolist() for name in rows.dtype.names or ())
    return "".join(f"{n} {' '.join(map(repr, row))}\n" for n, row in zip(number, values, strict=True)).encode()
