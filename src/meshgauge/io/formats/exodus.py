"""Exodus II (.exo, .e, .ex2): element blocks with their fields at a time step.

Own, because VTK's reader mixes up the nodes of 14-node pyramids and their like, and gives each block points of its own.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import ReadError
from ...mesh import Mesh
from ...mesh.labels import LABEL
from ..plumbing import face_based
from ..plumbing.added import Added
from ..plumbing.build import Ints, gather
from ..plumbing.format import HEAD, Format
from ..plumbing.ids import drop_counts
from ..plumbing.merge import Part, merge_parts
from ..plumbing.netcdf import Variable, variables
from ..plumbing.steps import Step, number_steps
from . import exodus_adding, exodus_nodes, exodus_pieces, exodus_places, exodus_set, spread
from .exodus_blocks import Block, block_name, blocks, kind_of, of_corners

_MARKS = (b"CDF\x01", b"CDF\x02", b"CDF\x05", b"\x89HDF\r\n\x1a\n")

_NONE = np.empty((0, 3))
"""Points of a block of its own: all refer to those of the file."""

_NAMES = (b"num_dim", b"num_nodes", b"num_el_blk", b"maximum_name_length", b"api_version")
"""Of dimensions and attributes that Exodus files begin with."""

_OWN = (".exo", ".e", ".ex2", ".exii")


def sniff(head: bytes, path: Path) -> bool:
    """By the mark of NetCDF for its own extensions, else also by its names: other programs write NetCDF too."""
    if not head.startswith(_MARKS):
        return False
    return path.suffix.lower() in _OWN or _is_exodus(head, path)


def _is_exodus(head: bytes, path: Path) -> bool:
    if not head.startswith(_MARKS[-1]):
        return sum(name in head for name in _NAMES) >= 3
    try:
        import h5py

        with h5py.File(path) as file:
            has_points = "coordx" in file or "coord" in file
            return has_points and any(key in file for key in ("eb_status", "eb_prop1", "connect1"))
    except (ImportError, OSError):
        return False


def steps(path: Path) -> tuple[Step, ...]:
    """Points and cells are the same at all: only data change."""
    with variables(path) as arrays:
        times = arrays["time_whole"].values().ravel().tolist() if "time_whole" in arrays else []
    return number_steps(times, geometries=[0] * len(times))


def read(path: Path, at: int) -> Mesh:
    """A block for each element block; cell data ``exodus:block`` is its number. Side and node sets are not cells.

    A piece of a mesh that is spread over files (``x.e.4.0``) is read with the others.
    """
    return spread.join(path, lambda file: _read(file, at))


def add(old: Path, new: Path, added: Added) -> None:
    """Variables of elements and nodes."""
    with variables(old) as arrays:
        sizes = [(block.number, block.n) for block in blocks(arrays, old)]
    exodus_adding.add(old, new, added, sizes)


def pieces(path: Path) -> tuple[Path, ...]:
    """The files that are read with one, if it is a piece of a mesh that is spread over files that are all there."""
    files = spread.all_pieces(path)
    if not files:
        return ()
    with path.open("rb") as file:
        return files if sniff(file.read(HEAD), path) else ()


def _read(path: Path, at: int) -> tuple[Mesh, bool]:
    """One file, and whether it numbers its nodes."""
    with variables(path) as arrays:
        has_numbers = "node_num_map" in arrays
        points, is_single = _points(arrays, path)
        parts = []
        for block in blocks(arrays, path):
            part = _part(block, arrays, points, path)
            part.cell_data = _fields(arrays, "elem", f"eb{block.number}", block.n, path, at, block.number)
            ids = arrays["eb_prop1"].values() if "eb_prop1" in arrays else np.empty(0, np.int64)
            number, part.name = block_name(block, ids)
            part.cell_data["exodus:block"] = np.full(len(part.types), number, np.int64)
            parts.append(part)
        if not parts:
            raise ReadError(f"{path}: has no element blocks")
        point_data = _fields(arrays, "nod", "", len(points), path, at)
        point_data |= _numbers(arrays, "node_num_map", len(points), path)
        cell_numbers = _numbers(arrays, "elem_num_map", sum(len(part.types) for part in parts), path)
    if not any(len(part.types) for part in parts):
        raise ReadError(f"{path}: its element blocks are empty")
    mesh = merge_parts(parts, path=path, points=points)
    mesh = mesh.replace(
        point_data=point_data,
        cell_data={**mesh.cell_data, **cell_numbers},
        stored="single" if is_single else "double",
    )
    return drop_counts(mesh), has_numbers


def _numbers(arrays: dict[str, Variable], name: str, n: int, path: Path) -> dict[str, NDArray[np.int64]]:
    """What the file calls its points or elements, as data: without a map they are counted from 1."""
    if name not in arrays:
        return {LABEL: np.arange(1, n + 1)}
    numbers = np.asarray(arrays[name].values(), np.int64).ravel()
    if len(numbers) != n:
        raise ReadError(f"{path}: {name} has {len(numbers)} numbers, expected {n}")
    return {LABEL: numbers}


def _points(arrays: dict[str, Variable], path: Path) -> tuple[NDArray[np.float64], bool]:
    """The points, and whether the file holds them in single precision."""
    if "coord" in arrays:
        columns = list(arrays["coord"].values())
    else:
        columns = [arrays[name].values() for name in ("coordx", "coordy", "coordz") if name in arrays]
    if not 1 <= len(columns) <= 3 or len({c.shape for c in columns}) != 1 or columns[0].ndim != 1:
        raise ReadError(
            f"{path}: has no coordinates (coordx, coordy, coordz or coord); it is no Exodus file, or not whole"
        )
    points = np.zeros((len(columns[0]), 3))
    for axis, column in enumerate(columns):
        points[:, axis] = column
    return points, columns[0].dtype.itemsize == 4


def _part(block: Block, arrays: dict[str, Variable], points: NDArray[np.float64], path: Path) -> Part:
    if block.element == "NFA":
        return _polyhedra(block, arrays, points, path)
    ids = np.asarray(block.connect.values(), np.int64)
    if block.element == "NSI":
        sizes = np.asarray(arrays[f"ebepecnt{block.number}"].values(), np.int64)
        ids = ids.ravel()
        if len(sizes) and (int(sizes.min()) < 3 or int(sizes.sum()) != len(ids)):
            raise ReadError(f"{path}: block {block.number}: its polygons do not have as many points as it states")
        part = Part("", _NONE, np.full(len(sizes), 7, np.uint8), face_based.offsets_of(sizes), ids - 1)
    else:
        if ids.ndim != 2:
            raise ReadError(f"{path}: block {block.number}: its connectivity has {ids.ndim} dimensions, expected 2")
        n, width = ids.shape
        kind = kind_of(block, width, path)
        cells = gather(ids.ravel() - 1, np.arange(n) * width, np.zeros(n, np.int64), {0: kind})
        part = Part("", _NONE, cells.types, cells.offsets, cells.connectivity)
        part.notes += of_corners(block, kind, width)
    _in_range(part.connectivity, len(points), f"{path}: block {block.number}: point")
    return part


def _polyhedra(block: Block, arrays: dict[str, Variable], points: NDArray[np.float64], path: Path) -> Part:
    """Cells by faces of the face blocks, which are counted through; faces do not say which side is outside."""
    keys = sorted((k for k in arrays if re.fullmatch(r"fbconn\d+", k)), key=lambda k: int(k[6:]))
    nodes = np.concatenate([np.asarray(arrays[k].values(), np.int64).ravel() for k in keys]) - 1
    sizes = np.concatenate([np.asarray(arrays["fbepecnt" + k[6:]].values(), np.int64).ravel() for k in keys])
    n_faces = np.asarray(arrays[f"ebepecnt{block.number}"].values(), np.int64).ravel()
    faces = np.asarray(block.connect.values(), np.int64).ravel() - 1
    for counts, items, least in ((sizes, nodes, 3), (n_faces, faces, 1)):
        if len(counts) and (int(counts.min()) < least or int(counts.sum()) != len(items)):
            raise ReadError(f"{path}: block {block.number}: its polyhedra do not have as many items as they state")
    _in_range(nodes, len(points), f"{path}: a face refers to point")
    _in_range(faces, len(sizes), f"{path}: block {block.number}: face")
    solids = face_based.solids(
        face_based.Faces(face_based.offsets_of(n_faces), faces, face_based.offsets_of(sizes), nodes), points
    )
    return Part("", _NONE, solids.types, solids.offsets, solids.connectivity, solids.polyhedra)


def _in_range(ids: Ints, n: int, what: str) -> None:
    wrong = (ids < 0) | (ids >= n)
    if wrong.any():
        raise ReadError(f"{what} {int(ids[np.argmax(wrong)]) + 1} is outside 1..{n}")


def _fields(
    arrays: dict[str, Variable], kind: str, suffix: str, n: int, path: Path, at: int, number: int = 0
) -> dict[str, NDArray[Any]]:
    """Fields on points or on the elements of a block, at a time step."""
    if f"name_{kind}_var" not in arrays:
        return {}
    data = {}
    together = arrays.get(f"vals_{kind}_var{suffix}")
    rows = together.values(at) if together is not None and together.shape[0] > at else None
    for index, name in enumerate(arrays[f"name_{kind}_var"].text(), 1):
        own = arrays.get(f"vals_{kind}_var{index}{suffix}")
        if own is not None and own.shape[0] > at:
            values = own.values(at)
        elif own is None and rows is not None:
            values = rows[index - 1]
        else:
            continue
        if values.shape != (n,):
            where = f" of block {number}" if number else ""
            raise ReadError(f"{path}: field {name!r}{where} has shape {values.shape}, expected ({n},)")
        data[name or f"field {index}"] = values
    return data


EXODUS = Format(
    "exodus",
    "Exodus II",
    _OWN,
    sniff,
    steps=steps,
    read_step=read,
    places=exodus_places.places,
    nodes=exodus_nodes.nodes,
    add=add,
    add_set=exodus_set.add_set,
    parts=spread.pieces,
    pieces=exodus_pieces.pieces,
)
