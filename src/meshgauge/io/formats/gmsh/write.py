"""Writing Gmsh's .msh, version 2.2, binary: the version that most programs read."""

from __future__ import annotations

from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ....cells import type_name
from ....errors import WriteError
from ....mesh import Mesh
from .cells import BY_CELL

_TAGS = ("gmsh:physical", "gmsh:geometrical")
_SAME = {"voxel": ("hexahedron", (0, 1, 3, 2, 4, 5, 7, 6)), "pixel": ("quad", (0, 1, 3, 2))}
_LARGEST = 2**31 - 1


def write(path: Path, mesh: Mesh) -> tuple[str, ...]:
    """Write the mesh; sentences that say what the format could not hold."""
    if max(mesh.n_points, mesh.n_cells) >= _LARGEST:
        raise WriteError(f"{path}: version 2.2 of Gmsh's format numbers at most {_LARGEST} nodes and elements")
    lost: list[str] = []
    with path.open("wb") as file:
        file.write(b"$MeshFormat\n2.2 1 8\n" + np.int32(1).tobytes() + b"\n$EndMeshFormat\n")
        _names(file, mesh, lost)
        nodes = np.empty(mesh.n_points, [("tag", np.int32), ("x", np.float64, 3)])
        nodes["tag"] = np.arange(1, mesh.n_points + 1)
        nodes["x"] = mesh.points
        file.write(f"$Nodes\n{mesh.n_points}\n".encode() + nodes.tobytes() + b"\n$EndNodes\n")
        file.write(f"$Elements\n{mesh.n_cells}\n".encode())
        _elements(file, path, mesh)
        file.write(b"\n$EndElements\n")
        for name, values in mesh.point_data.items():
            _view(file, "NodeData", name, values, lost)
        for name, values in mesh.cell_data.items():
            if not _is_tag(name, values):
                _view(file, "ElementData", name, values, lost)
    return tuple(lost)


def _is_tag(name: str, values: NDArray[np.generic]) -> bool:
    return name in _TAGS and values.ndim == 1 and values.dtype.kind in "iu"


def _names(file: BinaryIO, mesh: Mesh, lost: list[str]) -> None:
    """Field data of two integers, a tag and a dimension, name physical groups."""
    groups = {}
    for name, values in mesh.field_data.items():
        if values.shape == (2,) and values.dtype.kind in "iu" and 0 <= int(values[1]) <= 3 and '"' not in name:
            groups[name] = (int(values[1]), int(values[0]))
        else:
            lost.append(f"Gmsh's format could not hold the field data {name!r}.")
    if groups:
        lines = "".join(f'{d} {tag} "{name}"\n' for name, (d, tag) in groups.items())
        file.write(f"$PhysicalNames\n{len(groups)}\n{lines}$EndPhysicalNames\n".encode())


def _elements(file: BinaryIO, path: Path, mesh: Mesh) -> None:
    """A block for each run of cells of one type and size."""
    sizes = np.diff(mesh.offsets)
    breaks = np.flatnonzero((np.diff(mesh.types) != 0) | (np.diff(sizes) != 0)) + 1
    starts = [0, *breaks.tolist()] if mesh.n_cells else []
    none = np.zeros(mesh.n_cells, np.int32)
    tags = [mesh.cell_data[k] if _is_tag(k, mesh.cell_data.get(k, np.empty(0))) else none for k in _TAGS]
    for start, stop in zip(starts, [*starts[1:], mesh.n_cells], strict=False):
        name, n_nodes = type_name(mesh.types[start]), int(sizes[start])
        name, order = _SAME.get(name, (name, ()))
        kind = BY_CELL.get((name, n_nodes))
        if kind is None:
            raise WriteError(f"{path}: cells of type {name} with {n_nodes} nodes cannot be written in Gmsh's format")
        nodes = mesh.connectivity[mesh.offsets[start] : mesh.offsets[stop]].reshape(stop - start, n_nodes)
        turned = np.argsort(kind.order) if kind.order else (list(order) or slice(None))
        rows = np.empty((stop - start, 3 + n_nodes), np.int32)
        rows[:, 0] = np.arange(start + 1, stop + 1)
        rows[:, 1], rows[:, 2] = tags[0][start:stop], tags[1][start:stop]
        rows[:, 3:] = nodes[:, turned] + 1
        file.write(np.array([kind.gmsh_id, stop - start, 2], np.int32).tobytes() + rows.tobytes())


def _view(file: BinaryIO, section: str, name: str, values: NDArray[np.generic], lost: list[str]) -> None:
    what = "point" if section == "NodeData" else "cell"
    flat = values.reshape(len(values), -1) if len(values) else values.reshape(0, 1)
    width = flat.shape[1]
    if values.dtype.kind not in "fiub" or width > 9 or width < 1 or '"' in name or "\n" in name:
        lost.append(f"Gmsh's format could not hold the {what} data {name!r}.")
        return
    full = next(w for w in (1, 3, 9) if w >= width)
    if full != width:
        lost.append(f"The {what} data {name!r} were padded with zeros from {width} to {full} components.")
    rows = np.zeros(len(flat), [("tag", np.int32), ("value", np.float64, (full,))])
    rows["tag"] = np.arange(1, len(flat) + 1)
    rows["value"][:, :width] = flat
    head = f'${section}\n1\n"{name}"\n1\n0.0\n3\n0\n{full}\n{len(flat)}\n'
    file.write(head.encode() + rows.tobytes() + f"\n$End{section}\n".encode())
