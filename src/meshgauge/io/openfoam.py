"""OpenFOAM's polyMesh: ascii or binary, gzipped or not; a file .foam beside it names the case.

Own, because VTK's reader takes every time step and drops faces of polyhedra on request only; ours needs the five files.
"""

from __future__ import annotations

import gzip
import os
import re
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ..errors import ReadError
from ..mesh import Mesh
from . import _faces
from ._format import Format
from ._text import numbers

_COMMENT = re.compile(rb"/\*.*?\*/|//[^\n]*", re.DOTALL)
_HEADER = re.compile(rb"FoamFile\s*\{(.*?)\}", re.DOTALL)
_ENTRY = re.compile(rb"(\w+)\s+(\"[^\"]*\"|[^;]*);")
_COUNT = re.compile(rb"\s*(\d+)\s*([({])")
_PATCH = re.compile(rb"([^\s{}()\";]+|\"[^\"]*\")\s*\{([^{}]*)\}")
_STATED = re.compile(rb"n(Points|Cells|Faces|InternalFaces):\s*(\d+)")
_LARGEST_UNPACKED = 1100  # bytes of zlib's output a byte of its input


def sniff(head: bytes, path: Path) -> bool:
    return path.suffix.lower() == ".foam" or b"FoamFile" in head


def read(path: Path) -> Mesh:
    """The cells, and the faces of each patch as surface cells: a block each.

    ``path`` is a file in the folder of the case, or one in its polyMesh. Zones of cells are blocks of their own names
    only where they follow one another; time steps are not read.
    """
    folder = _folder(path)
    points = _File(folder, "points").points()
    face_offsets, face_points = _File(folder, "faces").faces()
    owner_file = _File(folder, "owner")
    owner = owner_file.labels()
    neighbour = _File(folder, "neighbour").labels()
    n_faces = len(face_offsets) - 1
    if len(owner) != n_faces or len(neighbour) > n_faces:
        raise ReadError(f"{folder}: {n_faces} faces have {len(owner)} owners and {len(neighbour)} neighbours")
    if len(face_points) and not 0 <= int(face_points.min()) <= int(face_points.max()) < len(points):
        raise ReadError(f"{folder / 'faces'}: a face refers to a point outside 0..{len(points) - 1}")
    n_cells = int(max(owner.max(initial=-1), neighbour.max(initial=-1))) + 1
    if n_cells > n_faces or (len(owner) and int(owner.min()) < 0) or (len(neighbour) and int(neighbour.min()) < -1):
        raise ReadError(f"{folder / 'owner'}: names cell {n_cells - 1}, which {n_faces} faces cannot bound")
    owner_file.check({"Points": len(points), "Cells": n_cells, "Faces": n_faces})
    others = np.full(n_faces, -1, np.int64)
    others[: len(neighbour)] = neighbour
    offsets, faces, is_neighbour = _faces.of_cells(n_cells, owner, others)
    if n_cells and int(np.diff(offsets).min()) < 4:
        cell = int(np.argmin(np.diff(offsets)))
        raise ReadError(f"{folder}: cell {cell} has {int(np.diff(offsets)[cell])} faces, expected 4 or more")
    whole = _faces.Faces(offsets, faces, face_offsets, face_points, is_neighbour)
    return _faces.mesh(path, points, whole, [("cells", 0, n_cells)], _patches(folder, n_faces))


def inside(folder: Path) -> Path | None:
    """The path in a folder by which its case is read, None if it holds none."""
    if folder.resolve().name == "polyMesh":
        return folder.resolve() / "points"
    is_case = any(os.path.isdir(folder / name) for name in ("constant", "polyMesh", "processor0"))
    return folder / "case.foam" if is_case else None


def _folder(path: Path) -> Path:
    """The folder polyMesh of a case."""
    if path.parent.name == "polyMesh":
        return path.parent
    for folder in (path.parent / "constant" / "polyMesh", path.parent / "polyMesh"):
        if folder.is_dir():
            return folder
    if (path.parent / "processor0").is_dir():
        raise ReadError(f"{path}: the case is decomposed; run reconstructParMesh, or name a file in processor0/")
    regions = sorted(p.parent.name for p in (path.parent / "constant").glob("*/polyMesh"))
    if regions:
        where = f"constant/{regions[0]}/polyMesh/points"
        raise ReadError(f"{path}: the case has the regions {', '.join(regions)}; name one by a file in it: {where}")
    raise ReadError(f"{path}: there is no constant/polyMesh beside it")


class _File:
    """One file of a polyMesh: its header, and its lists."""

    def __init__(self, folder: Path, name: str) -> None:
        self.path = folder / name
        data = _bytes(self.path)
        header = _HEADER.search(data)
        if header is None:
            raise ReadError(f"{self.path}: has no header FoamFile")
        self.entries = {
            k.decode(): v.strip(b'" ').decode("utf-8", "replace") for k, v in _ENTRY.findall(header.group(1))
        }
        self.is_binary = self.entries.get("format") == "binary"
        arch = self.entries.get("arch", "")
        self.order = ">" if "MSB" in arch else "<"
        self.label = np.dtype(self.order + ("i8" if "label=64" in arch else "i4"))
        self.scalar = np.dtype(self.order + ("f4" if "scalar=32" in arch else "f8"))
        self.data, self.at = data[header.end() :], 0
        if not self.is_binary:
            self.data = _COMMENT.sub(b" ", self.data)
        else:
            while (comment := re.compile(rb"\s*(/\*.*?\*/|//[^\n]*)", re.DOTALL).match(self.data, self.at)) is not None:
                self.at = comment.end()

    def fail(self, what: str) -> ReadError:
        return ReadError(f"{self.path}: {what}")

    def check(self, counted: dict[str, int]) -> None:
        """Raise if the header states other numbers than were read."""
        for key, n in _STATED.findall(self.entries.get("note", "").encode()):
            have = counted.get(key.decode())
            if have is not None and have != int(n):
                raise self.fail(f"states {int(n)} {key.decode().lower()}, but {have} were read")

    def _list(self, dtype: DTypeLike, width: int) -> NDArray[np.generic]:
        """The next list: its size, then its items in parentheses, or one for all in braces."""
        count = _COUNT.match(self.data, self.at)
        if count is None or int(count.group(1)) > len(self.data):
            if self.data[self.at :].split()[:1] in ([b"0"], [b"0()"], [b"()"]):
                return np.empty(0, dtype)
            raise self.fail("does not begin with the size of its list, or is not whole")
        n, kind = int(count.group(1)), np.dtype(dtype)
        self.at = count.end()
        if self.is_binary and count.group(2) == b"(":
            size = n * width * kind.itemsize
            if self.at + size > len(self.data):
                raise self.fail(f"states {n} items, but ends before")
            values = np.frombuffer(self.data, kind, n * width, self.at)
            self.at += size
            if self.data[self.at : self.at + 1] != b")":
                raise self.fail(f"the list of {n} items does not end where it should")
            self.at += 1
            return values
        values = self._numbers(kind)
        if count.group(2) == b"{" and len(values) == width:
            values = np.tile(values, n)
        if len(values) != n * width:
            raise self.fail(f"states {n} items of {width}, but holds {len(values)} numbers")
        return values

    def _numbers(self, kind: np.dtype[np.generic]) -> NDArray[np.generic]:
        """All numbers from here on."""
        rest = self.data[self.at :].translate(_BRACKETS)
        try:
            return numbers(rest, np.float64 if kind.kind == "f" else np.int64)
        except ValueError:
            raise self.fail("holds something else than numbers") from None

    def points(self) -> NDArray[np.float64]:
        return self._list(self.scalar, 3).astype(np.float64).reshape(-1, 3)

    def labels(self) -> NDArray[np.int64]:
        return self._list(self.label, 1).astype(np.int64)

    def faces(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Offsets and points of the faces."""
        if self.is_binary:
            offsets, points = self.labels(), self.labels()
            if not len(offsets) or offsets[0] != 0 or int(offsets[-1]) != len(points) or (np.diff(offsets) < 0).any():
                raise self.fail("the offsets of its faces do not run from 0 to the number of their points")
            return offsets, points
        count = _COUNT.match(self.data)
        if count is None:
            raise self.fail("does not begin with the number of faces")
        self.at = count.end()
        flat = self._numbers(np.dtype(np.int64)).astype(np.int64)
        values, at = flat.tolist(), 0
        sizes: list[int] = []
        firsts: list[int] = []
        while at < len(values):
            size = values[at]
            if not 3 <= size < len(values) - at:
                raise self.fail(f"face {len(sizes)} states {size} points, expected 3 or more, and all of them")
            sizes.append(size)
            firsts.append(at + 1)
            at += size + 1
        if len(sizes) != int(count.group(1)):
            raise self.fail(f"states {int(count.group(1))} faces, but holds {len(sizes)}")
        n = np.array(sizes, np.int64)
        return _faces.offsets_of(n), flat[_faces.spans(np.array(firsts, np.int64), n)]


_BRACKETS = bytes.maketrans(b"(){}", b"    ")


def _bytes(path: Path) -> bytes:
    packed = path.with_name(path.name + ".gz")
    if path.is_file():
        data = path.read_bytes()
        if not data.startswith(b"\x1f\x8b"):
            return data
        packed = path
    if not packed.is_file():
        raise ReadError(f"{path}: no such file; the polyMesh is not whole")
    try:
        most = packed.stat().st_size * _LARGEST_UNPACKED
        with gzip.open(packed, "rb") as file:
            return file.read(most)
    except (OSError, EOFError, zlib.error) as error:
        raise ReadError(f"{packed}: not a whole gzip file: {error}") from error


def _patches(folder: Path, n_faces: int) -> list[tuple[str, NDArray[np.int64]]]:
    """Name and faces of each patch."""
    data = _COMMENT.sub(b" ", _bytes(folder / "boundary"))
    header = _HEADER.search(data)
    found = []
    for name, body in _PATCH.findall(data[header.end() if header else 0 :]):
        entries = dict(_ENTRY.findall(body))
        try:
            n, first = int(entries[b"nFaces"]), int(entries[b"startFace"])
        except (KeyError, ValueError):
            raise ReadError(f"{folder / 'boundary'}: a patch has no nFaces or no startFace") from None
        if not 0 <= first <= first + n <= max(n_faces, first):
            raise ReadError(f"{folder / 'boundary'}: a patch has the faces {first} to {first + n} of {n_faces}")
        found.append((name.strip(b'"').decode("utf-8", "replace"), np.arange(first, first + n)))
    return found


OPENFOAM = Format("openfoam", "OpenFOAM", (".foam",), sniff, read)
