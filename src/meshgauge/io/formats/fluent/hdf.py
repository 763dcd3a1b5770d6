"""Fluent's meshes in HDF5 (.cas.h5, .msh.h5, "Common Fluids Format"): zones of points, cells and faces as arrays."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....errors import MeshgaugeError, ReadError
from ...plumbing import within
from ...plumbing.budget import DENSEST
from ...plumbing.face_based import offsets_of, spans

OF_TWO_DIMENSIONS = "is a mesh of two dimensions, which has no solid cells"

_FACE = tuple[int, int, int, list[int], list[int]]
_CELL = tuple[int, int, int, int]


class Arrays:
    """The first mesh of a file, in the terms of the text format.

    Attributes
    ----------
    points
        First number and coordinates ``(n, 3)`` of each zone.
    cells
        Zone, first and last number, and 1.
    faces
        Zone, first number, kind, sizes, and for each face its points and the two cells.
    names
        Of zones.
    """

    def __init__(self, path: Path) -> None:
        import h5py

        self.path, self.size = path, path.stat().st_size
        try:
            with h5py.File(path, "r") as file:
                within.check_hdf(path, file)
                meshes = file["meshes"]
                self._read(meshes[sorted(meshes, key=lambda key: (len(key), key))[0]])
        except MeshgaugeError:
            raise
        except (OSError, KeyError, ValueError, TypeError, IndexError, AttributeError, RuntimeError) as error:
            raise ReadError(f"{path}: not a whole Fluent file in HDF5: {' '.join(str(error).split())}") from error

    def _read(self, mesh: Any) -> None:
        if self._number(mesh.attrs.get("dimension", 3)) != 3:
            raise ReadError(f"{self.path}: {OF_TWO_DIMENSIONS}")
        for what in ("cells", "faces"):
            if len(mesh[what].get("tree", ())):
                raise ReadError(f"{self.path}: has {what} refined into others ({what}/tree), which are not read")
        coords = mesh["nodes"]["coords"]
        self.points = [(self._first(coords[k]), self._array(coords[k]).reshape(-1, 3)) for k in self._sections(coords)]
        self.names: dict[int, str] = {}
        self.cells: list[_CELL] = [
            (zone, first, last, 1) for zone, first, last, _ in self._zones(mesh["cells"]["zoneTopology"])
        ]
        lists = mesh["faces"]["nodes"]
        keys = self._sections(lists)
        sizes = np.concatenate([self._array(lists[key]["nnodes"]) for key in keys]).astype(np.int64).ravel()
        nodes = np.concatenate([self._array(lists[key]["nodes"]) for key in keys]).astype(np.int64).ravel()
        if len(sizes) and (((sizes < 3) & (sizes != 0)).any() or int(sizes.sum()) != len(nodes)):
            raise ReadError(f"{self.path}: its faces do not have as many points as they state")
        pair = [self._cells_of(mesh["faces"][key], len(sizes)) for key in ("c0", "c1")]
        for cells in pair:
            cells[sizes == 0] = 0  # of interfaces that do not conform: of no cell
        starts = offsets_of(sizes)
        self.faces: list[_FACE] = []
        for zone, first, last, kind in sorted(self._zones(mesh["faces"]["zoneTopology"]), key=lambda z: z[1]):
            if not 1 <= first <= last + 1 <= len(sizes) + 1:
                raise ReadError(f"{self.path}: zone {zone} has the faces {first} to {last} of {len(sizes)}")
            own = np.arange(first - 1, last)
            flat = nodes[spans(starts[own], sizes[own])]
            ends = np.repeat(np.cumsum(sizes[own]), 2)
            flat = np.insert(flat, ends, np.stack([pair[0][own], pair[1][own]], axis=1).ravel())
            self.faces.append((zone, first, kind, sizes[own].tolist(), flat.tolist()))

    def _zones(self, group: Any) -> list[tuple[int, int, int, int]]:
        """Number, first, last and kind of each zone; their names are kept."""
        columns = [self._array(group[key]).astype(np.int64).ravel() for key in ("id", "minId", "maxId")]
        kinds = self._array(group["zoneType"]).astype(np.int64).ravel() if "zoneType" in group else columns[0] * 0
        if len({len(column) for column in (*columns, kinds)}) != 1:
            raise ReadError(f"{self.path}: {group.name} has columns of several lengths")
        texts = self._array(group["name"]).ravel().tolist() if "name" in group else []
        joined = b";".join(t if isinstance(t, bytes) else str(t).encode() for t in texts).split(b"\0")[0]
        names = joined.decode("utf-8", "replace").split(";")
        if len(names) == len(kinds):
            self.names.update(zip(columns[0].tolist(), names, strict=True))
        return list(zip(*(column.tolist() for column in (*columns, kinds)), strict=True))

    def _cells_of(self, group: Any, n: int) -> NDArray[np.int64]:
        """The cell on one side of each face, 0 where there is none."""
        cells = np.zeros(n, np.int64)
        at = 0
        for key in self._sections(group):
            values = self._array(group[key]).astype(np.int64).ravel()
            first = self._number(group[key].attrs.get("minId", at + 1)) - 1
            if first < 0 or first + len(values) > n:
                raise ReadError(f"{self.path}: {group[key].name} has {len(values)} faces from {first + 1}, of {n}")
            cells[first : first + len(values)] = values
            at = first + len(values)
        return cells

    def _sections(self, group: Any) -> list[str]:
        """Names of sections, which are numbers, in the order of what they hold."""
        return sorted((key for key in group if key.isdigit()), key=lambda key: (self._first(group[key]), int(key)))

    def _first(self, item: Any) -> int:
        """The first number of what a section holds."""
        return self._number(item.attrs.get("minId", 1))

    def _array(self, item: Any) -> NDArray[Any]:
        if math.prod(item.shape) * item.dtype.itemsize > self.size * DENSEST:
            raise ReadError(
                f"{self.path}: array {item.name!r} of shape {item.shape} is in no file of {self.size} bytes"
            )
        return np.asarray(item[...])

    @staticmethod
    def _number(value: Any) -> int:
        return int(np.ravel(value)[0])
