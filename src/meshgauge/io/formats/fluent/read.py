"""Fluent's meshes (.msh, .cas: ascii and binary; .msh.h5, .cas.h5): cells put together from their faces.

Own, because VTK's reader repeats the cells for every zone of faces, and hangs or aborts on some files.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ....errors import ReadError
from ....look.style import number_of
from ....mesh import Mesh
from ...plumbing import budget, face_based
from ...plumbing.format import Format
from ...plumbing.text import NotNumbers, numbers
from ..vtk.hdf import MAGIC
from .cursor import END, Cursor
from .hdf import OF_TWO_DIMENSIONS, Arrays
from .places import places

_MARK = re.compile(rb"\A\s*\(\s*\d+\s")
_HDF = (".cas.h5", ".msh.h5")
_INTERIOR = 2
_PARENT_ZONE = 32


def sniff(head: bytes, path: Path) -> bool:
    return _MARK.match(head) is not None or (head.startswith(MAGIC) and path.name.lower().endswith(_HDF))


@dataclass(slots=True)
class _Content:
    dimension: int = 3
    points: list[tuple[int, NDArray[np.float64]]] = field(default_factory=list)
    cells: list[tuple[int, int, int, int]] = field(default_factory=list)  # zone, first, last, type
    faces: list[tuple[int, int, int, list[int], list[int]]] = field(
        default_factory=list
    )  # zone, first, kind, sizes, ids
    names: dict[int, str] = field(default_factory=dict)
    parents: list[tuple[int, int]] = field(default_factory=list)
    stated: dict[int, int] = field(default_factory=dict)
    is_single: bool = False  #: whether points are stored in single precision


def read(path: Path) -> Mesh:
    """The cells of a 3D mesh, and the faces of each boundary zone as surface cells; a block a zone.

    Of cells refined into others the smaller ones are read, with hanging nodes as further corners of polyhedra.
    """
    data = path.read_bytes()
    if data.startswith(MAGIC):
        arrays = Arrays(path)
        is_single = any(values.dtype.itemsize == 4 for _, values in arrays.points)
        return _mesh(_Content(3, arrays.points, arrays.cells, arrays.faces, arrays.names, is_single=is_single), path)
    cursor, content = Cursor(path, data), _Content()
    while (number := cursor.section()) is not None:
        is_binary, kind, has_body = number >= 2000, number % 1000, True
        if kind == 2 and not is_binary:
            word = cursor.data[cursor.at : cursor.at + 20].split(b")")[0].strip()
            content.dimension = int(word) if word.isdigit() else 0
            if content.dimension == 2:
                raise ReadError(f"{path}: {OF_TWO_DIMENSIONS}")
        if kind == 10:
            has_body = _points(cursor, content, is_binary, "<f8" if number >= 3000 else "<f4")
        elif kind == 12:
            zone, first, last, *more = cursor.head()
            has_body = cursor.data[cursor.at : cursor.at + 1] == b"("
            if zone == 0:
                content.stated[12] = last
            else:
                content.cells.append((zone, first, last, more[0] if more else 1))
        elif kind == 13:
            _face_zone(cursor, content, is_binary)
            continue
        elif kind in (39, 45):
            _name(cursor, content)
        elif kind == 59:
            head = cursor.head()
            content.parents.append((head[0], head[1]))
        cursor.close(is_binary and has_body)
    return _mesh(content, path)


def _points(cursor: Cursor, content: _Content, is_binary: bool, dtype: str) -> bool:
    """Keep the points of a section; False if it only states how many there are."""
    zone, first, last, *_ = cursor.head()
    n = last - first + 1
    if zone == 0:
        content.stated[10] = last
        return False
    if is_binary:
        if cursor.data[cursor.at : cursor.at + 1] != b"(":
            raise cursor.fail("points have no coordinates")
        cursor.at += 1
        values = cursor.raw(dtype, n * content.dimension).astype(np.float64)
        content.is_single |= dtype == "<f4"
    else:
        body = cursor.body()
        try:
            values = numbers(body or b"", np.float64)
        except NotNumbers as error:
            cursor.at -= len(body or b"") + 1 - error.at
            raise cursor.fail(f"coordinates hold something else than numbers: {error}") from None
    if content.dimension != 3 or n < 0 or len(values) != 3 * n:
        raise cursor.fail(
            f"{len(values)} numbers for {n} points of {content.dimension} coordinates, expected 3D points"
        )
    content.points.append((first, values.reshape(-1, 3)))
    return True


def _face_zone(cursor: Cursor, content: _Content, is_binary: bool) -> None:
    """Each face: in mixed zones how many points, then these, then two cells; its normal points to the first of them."""
    head = cursor.head()
    zone, first, last = head[:3]
    kind = head[3] if len(head) > 3 else _INTERIOR
    width = head[4] if len(head) > 4 else 0
    if zone == 0:
        content.stated[13] = last
        cursor.close()
        return
    if is_binary:
        if cursor.data[cursor.at : cursor.at + 1] != b"(":
            raise cursor.fail("a zone of faces is empty")
        end = cursor.data.find(END, cursor.at)
        cursor.at += 1
        tokens = cursor.raw("<i4", max(end - cursor.at, 0) // 4).tolist()
        cursor.close(True)
    else:
        body = cursor.body() or b""
        try:
            tokens = [int(word, 16) for word in body.split()]
        except ValueError:
            other = re.search(rb"(?<!\S)(?![0-9a-fA-F]+(?!\S))\S+", body)
            word = b"" if other is None else other[0][:40]
            cursor.at -= len(body) + 1 - (0 if other is None else other.start())
            shown = repr(word.decode("utf-8", "replace"))
            raise cursor.fail(f"faces hold something else than hexadecimal numbers: {shown}") from None
        cursor.close()
    budget.draw("made", 8 * len(tokens), f"zone {zone}", cursor.fail)
    sizes: list[int] = []
    ids: list[int] = []
    n, at, is_mixed = last - first + 1, 0, width in (0, 5)
    if n < 0 or n > len(tokens):
        raise cursor.fail(f"{n} faces are stated, but {len(tokens)} numbers follow")
    for _ in range(n):
        size = (tokens[at] if at < len(tokens) else 0) if is_mixed else width
        at += is_mixed
        if size == 0 and is_mixed and at + 2 <= len(tokens):  # of interfaces that do not conform: of no cell
            sizes.append(0)
            ids.extend((0, 0))
            at += 2
            continue
        if size == 2:
            raise ReadError(f"{cursor.path}: {OF_TWO_DIMENSIONS}")
        if not 3 <= size <= len(tokens) - at - 2:
            raise cursor.fail(f"a face of {size} points, or one that is cut off")
        sizes.append(size)
        ids.extend(tokens[at : at + size + 2])
        at += size + 2
    content.faces.append((zone, first, kind, sizes, ids))


def _name(cursor: Cursor, content: _Content) -> None:
    match = re.compile(rb"\s*\(\s*(\d+)\s+\S+\s+([^\s()]+)").match(cursor.data, cursor.at)
    if match:
        content.names[int(match.group(1)[:9])] = match.group(2).decode("utf-8", "replace")


def _mesh(content: _Content, path: Path) -> Mesh:
    points = _joined_points(content, path)
    cells = sorted(c for c in content.cells if c[3] not in (0, _PARENT_ZONE))
    cells.sort(key=lambda c: c[1])
    n_stated = max([last for _, _, last, _ in content.cells], default=0)
    if not cells or not content.faces:
        raise ReadError(f"{path}: has no cells or no faces; it holds no mesh, or is not whole")
    sizes = np.array([s for zone in content.faces for s in zone[3]], np.int64)
    flat = np.array([i for zone in content.faces for i in zone[4]], np.int64)
    ends = np.cumsum(sizes + 2)
    starts = ends - sizes - 2
    if len(flat) and (flat.min() < 0 or n_stated > len(flat)):
        raise ReadError(f"{path}: states {n_stated} cells, but has {len(sizes)} faces")
    ids = flat[face_based.spans(starts, sizes)] - 1
    if len(ids) and not 0 <= int(ids.min()) <= int(ids.max()) < len(points):
        bad = int(ids[np.argmax((ids < 0) | (ids >= len(points)))]) + 1
        raise ReadError(f"{path}: a face refers to point {bad}, which is outside 1..{len(points)}")
    pair = np.stack([flat[ends - 2], flat[ends - 1]])
    if pair.size and int(pair.max()) > n_stated:
        raise ReadError(f"{path}: a face refers to cell {int(pair.max())}, which is outside 1..{n_stated}")
    place = np.full(n_stated + 1, -1, np.int64)  # of each cell of the file among those that are read
    zones, at = [], 0
    for zone, first, last, _ in cells:
        if not 1 <= first <= last + 1 or (place[first : last + 1] >= 0).any():
            raise ReadError(f"{path}: zone {zone} states the cells {first} to {last}, which others have too")
        place[first : last + 1] = np.arange(at, at + last + 1 - first)
        zones.append((content.names.get(zone, f"zone {zone}"), at, at + last + 1 - first))
        at += last + 1 - first
    face_ids = np.concatenate([np.arange(z[1], z[1] + len(z[3])) for z in content.faces])
    for first, last in content.parents:
        budget.draw("made", len(face_ids), "faces refined into others")
        pair[:, (face_ids >= first) & (face_ids <= last)] = 0
    offsets, faces, is_second = face_based.of_cells(at, place[pair[0]], place[pair[1]])
    whole = face_based.Faces(offsets, faces, face_based.offsets_of(sizes), ids, ~is_second, face_ids)
    patches, begin = [], 0
    for zone, _, kind, own, _ in content.faces:
        if kind != _INTERIOR:
            own_faces = np.arange(begin, begin + len(own))
            patches.append((content.names.get(zone, f"zone {zone}"), own_faces[(pair[:, own_faces] > 0).any(axis=0)]))
        begin += len(own)
    lacking = int(np.count_nonzero(np.diff(offsets) < 4))
    if lacking:
        raise ReadError(f"{path}: {lacking} of {at} cells have fewer than four faces; the file is not whole")
    mesh = face_based.mesh(path, points, whole, zones, patches)
    if content.is_single:
        mesh = mesh.replace(stored="single")
    n_empty = int(np.count_nonzero(sizes == 0))
    if not n_empty:
        return mesh
    note = f"{number_of(n_empty, 'face without points was', 'faces without points were')} left out."
    return mesh.replace(notes=(*mesh.notes, note))


def _joined_points(content: _Content, path: Path) -> NDArray[np.float64]:
    content.points.sort(key=lambda pair: pair[0])
    at = 1
    for first, values in content.points:
        if first != at:
            raise ReadError(f"{path}: point {at} is missing: a zone of points begins at {first}")
        at += len(values)
    return np.concatenate([np.empty((0, 3)), *(values for _, values in content.points)])


FLUENT = Format("fluent", "Fluent", (".cas", ".msh"), sniff, read, places=places)
