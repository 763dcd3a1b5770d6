"""OpenFOAM's polyMesh: ascii or binary, gzipped or not; a file .foam beside it names the case.

Own, because VTK's reader takes every time step and drops faces of polyhedra on request only; ours needs the five files.
"""

from __future__ import annotations

import gzip
import re
import zlib
from collections.abc import Callable
from contextvars import copy_context
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ....errors import ReadError
from ....files import sources
from ....kernels.path import is_compiled
from ....kernels.text.driver import split_rows
from ....kernels.threads import run
from ....mesh import Mesh
from ...plumbing import budget, face_based
from ...plumbing.budget import DENSEST
from ...plumbing.steps import Step, number_steps
from ...plumbing.text import NotNumbers, numbers

# None of these goes back over what it has passed: a file must not take time with the square of its size.
COMMENT = re.compile(rb"/\*.*?(?:\*/|\Z)|//[^\n]*", re.DOTALL)
_FIRST_COMMENT = re.compile(rb"\s*+(?:/\*.*?\*/|//[^\n]*)", re.DOTALL)
_HEADER = re.compile(rb"FoamFile\s*+\{")
_ENTRY = re.compile(rb"(?:[^;\"]|\"[^\"]*+(?:\"|\Z))++")
_KEY = re.compile(rb"\s*+(\w++)\s++(.*)", re.DOTALL)
COUNT = re.compile(rb"\s*(\d+)\s*([({])")
_PATCH = re.compile(rb"(?<![^\s{}()\";])([^\s{}()\";]++|\"[^\"]*+\")\s*+\{([^{}]*+)\}")
_STATED = re.compile(rb"n(Points|Cells|Faces|InternalFaces):\s*(\d+)")


@dataclass(frozen=True, slots=True)
class PolyMesh:
    """A polyMesh: of a case, a region or a processor."""

    name: str
    points: NDArray[np.float64]
    point_ids: NDArray[np.int64] | None  #: of a processor's piece, in the whole mesh; None if it does not say
    face_offsets: NDArray[np.int64]
    face_points: NDArray[np.int64]
    owner: NDArray[np.int64]
    neighbour: NDArray[np.int64]  #: -1 on the boundary
    n_cells: int
    patches: list[tuple[str, NDArray[np.int64]]]
    between: NDArray[np.int64]  #: faces beyond which another processor's piece is
    is_single: bool  #: whether its points are stored in single precision


def read(path: Path, at: int) -> Mesh:
    """The cells, and the faces of each patch as surface cells: a block each.

    ``path`` is a file in the folder of the case, or one in its polyMesh. A decomposed case and one of several regions
    are one mesh with a block for each. Zones of cells are not read.
    """
    states = steps(path)
    read_from = folders(path, states[at].name if states else "constant")
    pieces = [poly_mesh(name, folder) for name, folder in read_from]
    ids, points = _join_points(pieces)
    notes = notes_on(read_from, is_joined=ids is not None)
    face_starts = np.cumsum([0] + [len(p.owner) for p in pieces])
    cell_starts = np.cumsum([0] + [p.n_cells for p in pieces]).tolist()
    point_starts = np.cumsum([0] + [len(p.points) for p in pieces])
    owner, neighbour, face_points, zones = [], [], [], []
    patches: dict[str, list[NDArray[np.int64]]] = {}
    for i, piece in enumerate(pieces):
        is_first = i == 0  # its numbers stay: large arrays are not copied
        owner.append(piece.owner if is_first else piece.owner + cell_starts[i])
        others = piece.neighbour
        neighbour.append(others if is_first else np.where(others < 0, -1, others + cell_starts[i]))
        points_of = piece.face_points
        face_points.append(ids[i][points_of] if ids is not None else points_of + point_starts[i] if i else points_of)
        zones.append((piece.name, cell_starts[i], cell_starts[i + 1]))
        for name, faces in piece.patches:
            patches.setdefault(name, []).append(faces + face_starts[i])
    offsets, faces, is_neighbour = face_based.of_cells(cell_starts[-1], _joined(owner), _joined(neighbour))
    sizes = _joined([np.diff(piece.face_offsets) for piece in pieces])
    whole = face_based.Faces(offsets, faces, face_based.offsets_of(sizes), _joined(face_points), is_neighbour)
    sides = [(name, np.concatenate(parts)) for name, parts in patches.items()]
    mesh = face_based.mesh(path, points, whole, zones, sides, notes)
    return mesh.replace(stored="single") if any(piece.is_single for piece in pieces) else mesh


def _joined(arrays: list[NDArray[np.int64]]) -> NDArray[np.int64]:
    """One after another; a single one is not copied."""
    return arrays[0] if len(arrays) == 1 else np.concatenate(arrays)


def notes_on(read_from: list[tuple[str, Path]], *, is_joined: bool) -> tuple[str, ...]:
    """What is to be said of the polyMeshes that were read, by name and folder."""
    notes = []
    if any(_is_netgens(folder) for _, folder in read_from):
        notes.append("The file 'neighbor' was read for 'neighbour': Netgen calls it so, and OpenFOAM needs it renamed.")
    if not is_joined and len(read_from) > 1 and read_from[0][0].startswith("processor"):
        notes.append("The processors' pieces do not say which points they share (pointProcAddressing): not joined.")
    return tuple(notes)


def _join_points(pieces: list[PolyMesh]) -> tuple[list[NDArray[np.int64]] | None, NDArray[np.float64]]:
    """The id of each point of each piece, None if the pieces stay apart, and all points."""
    ids = [piece.point_ids for piece in pieces if piece.point_ids is not None]
    if len(ids) < len(pieces):
        own = [piece.points for piece in pieces]
        return None, own[0] if len(own) == 1 else np.concatenate(own)
    known, of_piece = np.unique(np.concatenate(ids), return_inverse=True)
    points = np.full((len(known), 3), np.nan)
    points[of_piece] = np.concatenate([piece.points for piece in pieces])
    return np.split(of_piece, np.cumsum([len(own) for own in ids])[:-1]), points


_NETGENS = "neighbor"
"""What Netgen calls the file of neighbours."""


def _is_netgens(folder: Path) -> bool:
    return _is_there(folder, _NETGENS) and not _is_there(folder, "neighbour")


def poly_mesh(name: str, folder: Path) -> PolyMesh:
    """One polyMesh, checked. Raises `ReadError`."""
    read = (
        lambda: (file := MeshFile(folder, "points"), file.points()),
        lambda: MeshFile(folder, "faces").faces(),
        lambda: (file := MeshFile(folder, "owner"), file.labels()),
        lambda: MeshFile(folder, _NETGENS if _is_netgens(folder) else "neighbour").labels(),
    )
    (points_file, points), (face_offsets, face_points), (owner_file, owner), neighbour = _side_by_side(*read)
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
    counts = np.bincount(owner, minlength=n_cells)
    counts += np.bincount(neighbour[neighbour >= 0], minlength=n_cells)
    if n_cells and int(counts.min()) < 4:
        cell = int(np.argmin(counts))
        raise ReadError(f"{folder}: cell {cell} has {int(counts[cell])} faces, expected 4 or more")
    ids = point_ids_of(folder, len(points)) if name.startswith("processor") else None
    patches, between = _patches(folder, n_faces)
    is_single = points_file.is_binary and points_file.scalar.itemsize == 4
    return PolyMesh(name, points, ids, face_offsets, face_points, owner, others, n_cells, patches, between, is_single)


def _side_by_side(*works: Callable[[], Any]) -> list[Any]:
    """What each gives, on threads; what they open and draw counts for the read that is under way."""
    contexts = [copy_context() for _ in works]
    return run(lambda at: contexts[at].run(works[at]), range(len(works)))


def point_ids_of(folder: Path, n_points: int) -> NDArray[np.int64] | None:
    """Where the points of a processor's piece are in the whole mesh, None if there is no such file."""
    own = present(folder, "faces").parent
    if not has_ids(folder):
        return None
    ids = MeshFile(own, "pointProcAddressing").labels()
    if len(ids) != n_points:
        raise ReadError(f"{folder / 'pointProcAddressing'}: does not fit the {n_points} points of the piece")
    return ids


def has_ids(folder: Path) -> bool:
    """Whether a processor's piece says where its points are in the whole mesh."""
    # Beside the faces that were read: another time may have other points.
    return _is_there(present(folder, "faces").parent, "pointProcAddressing")


def inside(folder: Path) -> Path | None:
    """The path in a folder by which its case is read, None if it holds none."""
    if folder.resolve().name == "polyMesh":
        return folder.resolve() / "points"
    is_case = any((folder / name).is_dir() for name in ("constant", "polyMesh")) or any(folder.glob("processor*[0-9]"))
    return folder / "case.foam" if is_case else None


def steps(path: Path) -> tuple[Step, ...]:
    """``constant`` and the folders of time steps with a mesh or with points of their own, of a case; else none."""
    roots = _roots(path)
    if not roots:
        return ()
    names = {
        folder.parents[len(tail.parts) - 1].name
        for root, tail in roots
        for folder in root.glob(f"*/{tail.as_posix()}")
        if TIME.fullmatch(folder.parents[len(tail.parts) - 1].name)
        and any(_is_there(folder, name) for name in ("points", "faces"))
    }
    times = sorted(names, key=float)
    if not times:
        return ()
    return number_steps([None, *map(float, times)], names=["constant", *times])


def _roots(path: Path) -> list[tuple[Path, Path]]:
    """Of a case: the folders that hold ``constant``, each with the way from an instance to its polyMesh."""
    case = path.parent
    mesh = Path("polyMesh")
    if case.name == "polyMesh" or (case / mesh).is_dir():
        return []
    if (case / "constant" / mesh).is_dir():
        return [(case, mesh)]
    processors = [p for p in case.glob("processor[0-9]*") if (p / "constant" / mesh).is_dir()]
    if processors:
        processors.sort(key=lambda folder: int(folder.name.removeprefix("processor")))
        return [(folder, mesh) for folder in processors]
    regions = sorted((case / "constant").glob("*/polyMesh"))
    return [(case, Path(folder.parent.name, mesh)) for folder in regions]


def folders(path: Path, instance: str) -> list[tuple[str, Path]]:
    """Name and folder of each polyMesh to read, of an instance: ``constant`` or a time."""
    if path.parent.name == "polyMesh":
        return [("cells", path.parent)]
    roots = _roots(path)
    if roots:
        return [(_name(root, tail), root / instance / tail) for root, tail in roots]
    if (path.parent / "polyMesh").is_dir():
        return [("cells", path.parent / "polyMesh")]
    if any(path.parent.glob("processors*")):
        raise ReadError(f"{path.parent}: the case is decomposed in collated files; run reconstructParMesh -constant")
    raise ReadError(f"{path}: there is no constant/polyMesh beside it")


def _name(root: Path, tail: Path) -> str:
    if len(tail.parts) > 1:
        return tail.parts[0]
    return root.name if re.fullmatch(r"processor\d+", root.name) else "cells"


TIME = re.compile(r"\d+(\.\d+)?(e[+-]?\d+)?", re.IGNORECASE)


def _header(data: bytes) -> tuple[int, int]:
    """Where the entries of the header begin, and what follows behind its brace; 0 if there is none."""
    header = _HEADER.search(data)
    end = data.find(b"}", header.end()) if header is not None else -1
    return (header.end(), end + 1) if header is not None and end >= 0 else (0, 0)


def _entries(data: bytes) -> dict[bytes, bytes]:
    """Keys and values, each ended by a semicolon that stands in no quotes."""
    matches = (_KEY.match(entry) for entry in _ENTRY.findall(data))
    return {match[1]: match[2].strip() for match in matches if match is not None}


class MeshFile:
    """One file of a polyMesh: its header, and its lists."""

    def __init__(self, folder: Path, name: str) -> None:
        self.path = present(folder, name)
        data = file_bytes(self.path)
        start, end = _header(data)
        if end == 0:
            raise ReadError(f"{self.path}: has no header FoamFile")
        self.entries = {
            k.decode(): v.strip(b'" ').decode("utf-8", "replace") for k, v in _entries(data[start : end - 1]).items()
        }
        self.is_binary = self.entries.get("format") == "binary"
        arch = self.entries.get("arch", "")
        self.order = ">" if "MSB" in arch else "<"
        self.label = np.dtype(self.order + ("i8" if "label=64" in arch else "i4"))
        self.scalar = np.dtype(self.order + ("f4" if "scalar=32" in arch else "f8"))
        self.data, self.at = data, end
        while (comment := _FIRST_COMMENT.match(self.data, self.at)) is not None:
            self.at = comment.end()
        if not self.is_binary and (mark := data.find(b"/", self.at)) >= 0:
            self.data = data[:mark] + COMMENT.sub(b" ", data[mark:])

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
        count = COUNT.match(self.data, self.at)
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
        """All numbers from here on; the text is not kept."""
        rest = memoryview(self.data)[self.at :]
        self.data, self.at = b"", 0
        try:
            return numbers(rest, np.float64 if kind.kind == "f" else np.int64, brackets=True)
        except NotNumbers as error:
            raise self.fail(f"holds something else than numbers: {error}") from None

    def points(self) -> NDArray[np.float64]:
        return self._list(self.scalar, 3).astype(np.float64, copy=self.is_binary).reshape(-1, 3)

    def labels(self) -> NDArray[np.int64]:
        return self._list(self.label, 1).astype(np.int64, copy=self.is_binary)

    def faces(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Offsets and points of the faces."""
        if self.is_binary:
            offsets, points = self.labels(), self.labels()
            if (
                not len(offsets)
                or offsets[0] != 0
                or int(offsets[-1]) != len(points)
                or (offsets[1:] < offsets[:-1]).any()
            ):
                raise self.fail("the offsets of its faces do not run from 0 to the number of their points")
            return offsets, points
        count = COUNT.match(self.data, self.at)
        if count is None:
            raise self.fail("does not begin with the number of faces")
        self.at = count.end()
        flat = self._numbers(np.dtype(np.int64)).astype(np.int64, copy=False)
        n_faces = int(count.group(1))
        rows = split_rows(flat, n_faces) if is_compiled(n_faces) else None
        if rows is not None and (rows[0] >= 3).all():
            return face_based.offsets_of(rows[0]), rows[1]
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
        if len(sizes) != n_faces:
            raise self.fail(f"states {n_faces} faces, but holds {len(sizes)}")
        n = np.array(sizes, np.int64)
        return face_based.offsets_of(n), flat[face_based.spans(np.array(firsts, np.int64), n)]


def present(folder: Path, name: str) -> Path:
    """Where a file of a polyMesh is: a time in which only points move has the others from before."""
    if _is_there(folder, name):
        return folder / name
    for instance in (folder.parent, folder.parent.parent):  # the latter of a region
        if TIME.fullmatch(instance.name):
            tail = folder.relative_to(instance)
            times = [p for p in instance.parent.iterdir() if TIME.fullmatch(p.name)]
            earlier = [p for p in times if float(p.name) < float(instance.name)]
            earlier.sort(key=lambda p: float(p.name), reverse=True)
            for other in (*earlier, instance.parent / "constant"):
                if _is_there(other / tail, name):
                    return other / tail / name
    return folder / name


def _is_there(folder: Path, name: str) -> bool:
    return any((folder / f"{name}{suffix}").is_file() for suffix in ("", ".gz"))


def path_of(folder: Path, name: str) -> Path:
    """The file of a polyMesh, gzipped or not, where it is present."""
    path = present(folder, name)
    return path if path.is_file() else path.with_name(f"{path.name}.gz")


def file_bytes(path: Path) -> bytes:
    packed = path.with_name(path.name + ".gz")
    sources.note(path if path.is_file() else packed)
    if path.is_file():
        data = path.read_bytes()
        if not data.startswith(b"\x1f\x8b"):
            return data
        packed = path
    if not packed.is_file():
        raise ReadError(f"{path}: no such file; the polyMesh is not whole")
    try:
        most = packed.stat().st_size * DENSEST
        with gzip.open(packed, "rb") as file:
            return file.read(most)
    except (OSError, EOFError, zlib.error) as error:
        raise ReadError(f"{packed}: not a whole gzip file: {error}") from error


def _patches(folder: Path, n_faces: int) -> tuple[list[tuple[str, NDArray[np.int64]]], NDArray[np.int64]]:
    """Name and faces of each patch; faces beyond which another processor's piece is."""
    data = COMMENT.sub(b" ", file_bytes(present(folder, "boundary")))
    _, start = _header(data)
    patches = []
    between: list[NDArray[np.int64]] = []
    for name, body in _PATCH.findall(data[start:]):
        entries = _entries(body)
        try:
            n, first = int(entries[b"nFaces"]), int(entries[b"startFace"])
        except (KeyError, ValueError):
            raise ReadError(f"{folder / 'boundary'}: a patch has no nFaces or no startFace") from None
        if not 0 <= first <= first + n <= max(n_faces, first):
            raise ReadError(f"{folder / 'boundary'}: a patch has the faces {first} to {first + n} of {n_faces}")
        if entries.get(b"type", b"").startswith(b"processor"):
            if entries[b"type"] == b"processor":  # the next piece is beyond, not only by a rotation or shift
                between.append(np.arange(first, first + n))
            continue
        called = name.strip(b'"').decode("utf-8", "replace")
        budget.draw("made", 8 * n, f"patch {called!r}")  # several may have the same faces
        patches.append((called, np.arange(first, first + n)))
    return patches, np.concatenate([np.empty(0, np.int64), *between])
