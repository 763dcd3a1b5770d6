"""Cells given by their faces: polyhedra, and the four standard cells recognised among them.

A cell with the faces of a tetra, pyramid, wedge or hexahedron becomes one; any other stays a polyhedron. All vectorised
over the cells of one kind.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...cells import BY_NAME, HEXAHEDRON, POLYHEDRON, PYRAMID, TETRA, WEDGE, Shape
from ...kernels.path import is_compiled
from ...kernels.polyhedra import standard_driver as driver
from ...mesh import CellBlock, Mesh
from ...mesh.polyhedra import Polyhedra

Ints = NDArray[np.int64]

_STANDARD = (TETRA, PYRAMID, WEDGE, HEXAHEDRON)
"""What cells of faces are recognised as."""

_LAYOUTS = tuple((BY_NAME[shape.name].vtk_id, shape.n_nodes, shape.faces, shape.reversal) for shape in _STANDARD)


@dataclass(frozen=True, slots=True)
class Faces:
    """Cells by faces, faces by points: all offsets start at 0.

    Attributes
    ----------
    cell_offsets, cell_faces
        Faces of each cell.
    face_offsets, face_points
        Points around each face.
    inward
        For each entry of ``cell_faces``: True where the face's points run so that its normal points into the cell.
        None if the file does not say: then the faces of each cell are turned so that every edge is used once in each
        direction, and all of them so that the volume is positive.
    numbers
        The number of each face in the file; None: counted from 0.
    """

    cell_offsets: Ints
    cell_faces: Ints
    face_offsets: Ints
    face_points: Ints
    inward: NDArray[np.bool_] | None = None
    numbers: Ints | None = None


@dataclass(frozen=True, slots=True)
class Solids:
    """What became of the cells: arrays as in `Mesh`."""

    types: NDArray[np.uint8]
    offsets: Ints
    connectivity: Ints
    polyhedra: Polyhedra | None


CHUNK = 1 << 15
"""Cells that are looked at in one go: what is needed beside them then stays in the processor's cache."""


def spans(starts: Ints, sizes: Ints) -> Ints:
    """Positions ``starts[i] .. starts[i] + sizes[i] - 1``, one range after another."""
    ends = np.cumsum(sizes)
    total = int(ends[-1]) if len(ends) else 0
    return np.asarray(np.arange(total) + np.repeat(starts - (ends - sizes), sizes), np.int64)


def offsets_of(sizes: Ints) -> Ints:
    offsets = np.zeros(len(sizes) + 1, np.int64)
    np.cumsum(sizes, out=offsets[1:])
    return offsets


def sizes_of(faces: Faces, some: Ints) -> Ints:
    """How many points some faces have."""
    return np.asarray(faces.face_offsets[some + 1] - faces.face_offsets[some])


def solids(faces: Faces, points: NDArray[np.floating], *, n_deciding: int | None = None) -> Solids:
    """Standard cells where the faces are theirs, polyhedra elsewhere. Ids must be in range. Of some cells of a mesh all
    that it has decide how they are looked at."""
    n_cells = len(faces.cell_offsets) - 1
    if is_compiled(n_cells if n_deciding is None else n_deciding, is_once=True):
        return _compiled_solids(faces, points)
    parts = [_solids(_some(faces, start, start + CHUNK), points) for start in range(0, n_cells, CHUNK)]
    if len(parts) < 2:
        return parts[0] if parts else _solids(faces, points)
    types, offsets, connectivity = (
        np.concatenate([one.types for one in parts]),
        _joined([one.offsets for one in parts]),
        np.concatenate([one.connectivity for one in parts]),
    )
    if all(one.polyhedra is None for one in parts):
        return Solids(types, offsets, connectivity, None)
    none = np.empty(0, np.int64)
    every = [
        one.polyhedra
        or Polyhedra(np.zeros(len(one.types) + 1, np.int64), none, np.zeros(1, np.int64), none, labels=none)
        for one in parts
    ]
    polyhedra = Polyhedra(
        cell_offsets=_joined([one.cell_offsets for one in every]),
        cell_faces=np.arange(sum(len(one.cell_faces) for one in every)),
        face_offsets=_joined([one.face_offsets for one in every]),
        face_points=np.concatenate([one.face_points for one in every]),
        labels=np.concatenate([none if one.labels is None else one.labels for one in every]),
    )
    return Solids(types, offsets, connectivity, polyhedra)


def _some(faces: Faces, start: int, stop: int) -> Faces:
    """The faces of some cells."""
    offsets = faces.cell_offsets[start : stop + 1]
    some = slice(int(offsets[0]), int(offsets[-1]))
    inward = None if faces.inward is None else faces.inward[some]
    return replace(faces, cell_offsets=offsets - offsets[0], cell_faces=faces.cell_faces[some], inward=inward)


def _joined(offsets: Sequence[Ints]) -> Ints:
    """Offsets of several parts, one behind the other."""
    return offsets_of(np.concatenate([np.diff(one) for one in offsets]))


def _solids(faces: Faces, points: NDArray[np.floating]) -> Solids:
    n_cells = len(faces.cell_offsets) - 1
    n_faces = np.diff(faces.cell_offsets)
    entry_cell = np.repeat(np.arange(n_cells), n_faces)
    sizes = sizes_of(faces, faces.cell_faces)
    starts = offsets_of(sizes)
    flat = faces.face_points[spans(faces.face_offsets[faces.cell_faces], sizes)]
    if faces.inward is not None:
        flat = _reverse(flat, starts, faces.inward)
    elif n_cells:
        flat = _reverse(flat, starts, _alike(flat, starts, entry_cell, faces.cell_offsets))
        volume = _volumes(points, flat, starts, entry_cell, n_cells)
        flat = _reverse(flat, starts, (volume < 0)[entry_cell])

    point_cell = np.repeat(entry_cell, sizes)
    keys, place = np.unique(point_cell * max(len(points), 1) + flat, return_inverse=True)
    own = keys % max(len(points), 1)  # the points of each cell, ascending
    n_own = np.bincount(keys // max(len(points), 1), minlength=n_cells).astype(np.int64)
    own_offsets = offsets_of(n_own)
    local = place.reshape(-1) - own_offsets[point_cell]

    types = np.full(n_cells, POLYHEDRON.vtk_id, np.uint8)
    connectivity = own.copy()
    n_three = np.bincount(entry_cell[sizes == 3], minlength=n_cells)
    n_four = np.bincount(entry_cell[sizes == 4], minlength=n_cells)
    for shape in _STANDARD:
        t, q = (sum(len(face) == n for face in shape.faces) for n in (3, 4))
        has_its_faces = (n_faces == len(shape.faces)) & (n_three == t) & (n_four == q)
        cells = np.flatnonzero(has_its_faces & (n_own == shape.n_nodes))
        if not len(cells):
            continue
        order, matches = _standard(shape, cells, faces.cell_offsets, starts, sizes, local)
        cells, order = cells[matches], order[matches]
        at = own_offsets[cells][:, None]
        connectivity[at + np.arange(shape.n_nodes)] = own[at + order]
        types[cells] = BY_NAME[shape.name].vtk_id
    is_poly = types == POLYHEDRON.vtk_id
    polyhedra = None
    if is_poly.any():
        kept = is_poly[entry_cell]
        polyhedra = Polyhedra(
            cell_offsets=offsets_of(np.where(is_poly, n_faces, 0)),
            cell_faces=np.arange(int(kept.sum())),
            face_offsets=offsets_of(sizes[kept]),
            face_points=flat[np.repeat(kept, sizes)],
            labels=faces.cell_faces[kept] if faces.numbers is None else faces.numbers[faces.cell_faces[kept]],
        )
    return Solids(types, own_offsets, connectivity, polyhedra)


def _compiled_solids(faces: Faces, points: NDArray[np.floating]) -> Solids:
    """As `_solids`, by a kernel and for any number of cells."""
    inward = faces.inward if faces.inward is not None else _inward(faces, points)
    types, n_own, connectivity = driver.recognise(
        faces.cell_offsets, faces.cell_faces, faces.face_offsets, faces.face_points, inward, POLYHEDRON.vtk_id, _LAYOUTS
    )
    is_poly = types == POLYHEDRON.vtk_id
    polyhedra = None
    if is_poly.any():
        n_faces = np.diff(faces.cell_offsets)
        kept = np.flatnonzero(np.repeat(is_poly, n_faces))
        own = faces.cell_faces[kept]
        starts = offsets_of(sizes_of(faces, own))
        polyhedra = Polyhedra(
            cell_offsets=offsets_of(np.where(is_poly, n_faces, 0)),
            cell_faces=np.arange(len(kept)),
            face_offsets=starts,
            face_points=driver.copy_faces(own, inward[kept], faces.face_offsets, faces.face_points, starts),
            labels=own if faces.numbers is None else faces.numbers[own],
        )
    return Solids(types, offsets_of(n_own), connectivity, polyhedra)


def _inward(faces: Faces, points: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Which faces to turn for the cells they are of, where the file does not say."""
    sizes = sizes_of(faces, faces.cell_faces)
    starts, n_cells = offsets_of(sizes), len(faces.cell_offsets) - 1
    entry_cell = np.repeat(np.arange(n_cells), np.diff(faces.cell_offsets))
    flat = faces.face_points[spans(faces.face_offsets[faces.cell_faces], sizes)]
    turned = _alike(flat, starts, entry_cell, faces.cell_offsets)
    volume = _volumes(points, _reverse(flat, starts, turned), starts, entry_cell, n_cells)
    return turned ^ (volume < 0)[entry_cell]


def _alike(flat: Ints, starts: Ints, entry_cell: Ints, cell_offsets: Ints) -> NDArray[np.bool_]:
    """Which faces to turn so that those of a cell run the same way as its first; from neighbour to neighbour.

    Of cells whose surface is not closed or has no two sides some faces may stay wrong.
    """
    sizes = np.diff(starts)
    entry = np.repeat(np.arange(len(sizes)), sizes)
    at = np.arange(len(flat))
    after = flat[np.where(at + 1 == np.repeat(starts[1:], sizes), np.repeat(starts[:-1], sizes), at + 1)]
    low, high = np.minimum(flat, after), np.maximum(flat, after)
    order = np.lexsort((high, low, entry_cell[entry]))
    same = np.ones(max(len(order) - 1, 0), bool)
    for key in (entry_cell[entry], low, high):
        same &= key[order[:-1]] == key[order[1:]]
    a, b = order[:-1][same], order[1:][same]  # two uses of one edge in one cell
    first, second = entry[a], entry[b]
    differ = flat[a] == flat[b]  # in the same direction: one of the faces must be turned
    state = np.full(len(sizes), -1, np.int8)
    state[cell_offsets[:-1][np.diff(cell_offsets) > 0]] = 0
    while True:
        forth = (state[first] >= 0) & (state[second] < 0)
        back = (state[second] >= 0) & (state[first] < 0)
        if not (forth.any() or back.any()):
            return np.asarray(state == 1)
        state[second[forth]] = state[first[forth]] ^ differ[forth]
        state[first[back]] = state[second[back]] ^ differ[back]


def _reverse(flat: Ints, starts: Ints, turned: NDArray[np.bool_]) -> Ints:
    """The points of some faces in the opposite order."""
    sizes = np.diff(starts)
    at = np.arange(len(flat))
    back = np.repeat(starts[:-1] + starts[1:] - 1, sizes) - at
    return flat[np.where(np.repeat(turned, sizes), back, at)]


def volumes(faces: Faces, points: NDArray[np.floating]) -> NDArray[np.float64]:
    """``(n_cells,)`` six times the volume of each cell by what the file says of its sides; only the sign counts."""
    sizes = sizes_of(faces, faces.cell_faces)
    starts = offsets_of(sizes)
    flat = faces.face_points[spans(faces.face_offsets[faces.cell_faces], sizes)]
    if faces.inward is not None:
        flat = _reverse(flat, starts, faces.inward)
    n_cells = len(faces.cell_offsets) - 1
    entry_cell = np.repeat(np.arange(n_cells), np.diff(faces.cell_offsets))
    return _volumes(points, flat, starts, entry_cell, n_cells)


def _volumes(
    points: NDArray[np.floating], flat: Ints, starts: Ints, entry_cell: Ints, n_cells: int
) -> NDArray[np.float64]:
    """Six times the volume of each cell whose faces run the same way, by fans of triangles; only its sign counts."""
    sizes = np.diff(starts)
    centre_sum = np.zeros((n_cells, 3))
    point_cell = np.repeat(entry_cell, sizes)
    with np.errstate(all="ignore"):
        x = points[flat].astype(np.float64)
        n = np.maximum(np.bincount(point_cell, minlength=n_cells), 1)
        for axis in range(3):
            centre_sum[:, axis] = np.bincount(point_cell, x[:, axis], minlength=n_cells)
        x = x - (centre_sum / n[:, None])[point_cell]
        first = np.repeat(starts[:-1], sizes)
        following = np.where(np.arange(len(flat)) + 1 == np.repeat(starts[1:], sizes), first, np.arange(len(flat)) + 1)
        terms = np.einsum("ij,ij->i", x[first], np.cross(x, x[following]))
        return np.asarray(np.bincount(point_cell, terms, minlength=n_cells), np.float64)


def _standard(
    shape: Shape, cells: Ints, cell_offsets: Ints, starts: Ints, sizes: Ints, local: Ints
) -> tuple[Ints, NDArray[np.bool_]]:
    """Nodes of cells that may be of a standard shape, as local point numbers, and which of them are.

    The base is the first face of the kind that has a base; above each of its points is the one other point that an
    edge joins to it. Then all faces must be those of the shape; if all run the other way, the cell is mirrored.
    """
    k, f = shape.n_nodes, len(shape.faces)
    entries = cell_offsets[cells][:, None] + np.arange(f)
    size = sizes[entries]
    widest = 4 if any(len(face) == 4 for face in shape.faces) else 3
    corner = np.arange(widest)
    around = np.minimum(corner, size[..., None] - 1)
    ring = local[starts[entries][..., None] + around]  # (n, f, widest), the last point repeated
    after = local[starts[entries][..., None] + (around + 1) % size[..., None]]
    n = np.arange(len(cells))
    joined = np.zeros((len(cells), k, k), bool)
    joined[n[:, None, None], ring, after] = True
    joined |= joined.transpose(0, 2, 1)

    n_base = len(shape.faces[0])
    base = ring[n, np.argmax(size == n_base, axis=1)][:, :n_base]
    lower = base[:, ::-1]  # the base as seen from inside
    in_base = np.zeros((len(cells), k), bool)
    np.put_along_axis(in_base, base, True, axis=1)
    if k == n_base + 1:
        upper = np.argmin(in_base, axis=1)[:, None]
    else:
        free = joined & ~in_base[:, None, :]
        upper = np.argmax(np.take_along_axis(free, lower[:, :, None], axis=1), axis=2)
    nodes = np.concatenate([lower, upper], axis=1)
    is_permutation = (np.sort(nodes, axis=1) == np.arange(k)).all(axis=1)

    position = np.argsort(nodes, axis=1)  # node of the shape at each local point
    seen = position[n[:, None, None], ring]
    codes = _ring_code(seen, size)
    mirror = _ring_code(np.take_along_axis(seen, _backwards(size, widest), axis=2), size)
    table = {_code(face): index for index, face in enumerate(shape.faces)}
    right, wrong = _lookup(codes, table), _lookup(mirror, table)
    which = np.where(right >= 0, right, wrong)
    complete = (np.sort(which, axis=1) == np.arange(f)).all(axis=1)
    n_right = (right >= 0).sum(axis=1)
    # A cell of which some faces run the other way stays a polyhedron, so that they are not lost.
    is_alike = (n_right == f) | (n_right == 0)
    mirrored = n_right == 0
    if mirrored.any():
        order = np.array(shape.reversal)
        nodes = np.where(mirrored[:, None], nodes[:, order], nodes)
    return nodes, is_permutation & complete & is_alike


def _backwards(size: Ints, widest: int) -> Ints:
    """For each ring the positions in the opposite order; behind a triangle its last is repeated."""
    return np.asarray(np.maximum(size[..., None] - 1 - np.arange(widest), 0), np.int64)


def _ring_code(seen: Ints, size: Ints) -> Ints:
    """A number for each ring of nodes, whatever node it starts at."""
    three, four = seen[..., :3], seen
    codes = np.where(size == 3, _smallest(three), _smallest(four) + 1000 if seen.shape[-1] == 4 else 0)
    return np.asarray(codes)


def _smallest(ring: Ints) -> Ints:
    columns = [ring[..., n] for n in range(ring.shape[-1])]
    smallest = np.full(ring.shape[:-1], np.iinfo(np.int64).max)
    for shift in range(len(columns)):
        code = columns[shift]
        for column in (*columns[shift + 1 :], *columns[:shift]):
            code = 10 * code + column
        np.minimum(smallest, code, out=smallest)
    return smallest


def _code(face: tuple[int, ...]) -> int:
    ring = np.array(face, np.int64)
    return int(_smallest(ring)) + (1000 if len(face) == 4 else 0)


def _lookup(codes: Ints, table: dict[int, int]) -> Ints:
    keys = np.array(sorted(table), np.int64)
    at = np.minimum(np.searchsorted(keys, codes), len(keys) - 1)
    return np.where(keys[at] == codes, np.array([table[int(key)] for key in keys])[at], -1)


def mesh(
    path: Path,
    points: NDArray[np.floating],
    faces: Faces,
    zones: Sequence[tuple[str, int, int]],
    patches: Sequence[tuple[str, Ints]],
    notes: Sequence[str] = (),
) -> Mesh:
    """Cells by faces, then the faces of the patches as surface cells: a block a zone and a block a patch.

    Parameters
    ----------
    zones
        Name, first cell and the one after the last, in the order of the cells.
    patches
        Name and faces.
    """
    cells = solids(faces, points)
    n_cells = len(cells.types)
    ids = np.concatenate([np.empty(0, np.int64), *(faces for _, faces in patches)])
    sizes = sizes_of(faces, ids)
    blocks = [CellBlock(name, first, last) for name, first, last in zones if last > first]
    at = n_cells
    for name, own in patches:
        if len(own):
            blocks.append(CellBlock(name, at, at + len(own)))
            at += len(own)
    polyhedra = cells.polyhedra
    if polyhedra is not None:
        ends = np.full(len(ids), polyhedra.cell_offsets[-1])
        polyhedra = replace(polyhedra, cell_offsets=np.concatenate([polyhedra.cell_offsets, ends]))
    return Mesh(
        points,
        np.concatenate([cells.types, surface_types(sizes)]),
        np.concatenate([cells.offsets, cells.offsets[-1] + np.cumsum(sizes)]),
        np.concatenate([cells.connectivity, faces.face_points[spans(faces.face_offsets[ids], sizes)]]),
        polyhedra,
        blocks=tuple(blocks),
        path=str(path),
        notes=tuple(notes),
        purpose="fv",
        copy=False,
    )


_A, _B = np.uint64(0x9E3779B97F4A7C15), np.uint64(0xBF58476D1CE4E5B9)


def face_keys(sizes: Ints, points: Ints) -> NDArray[np.uint64]:
    """64 bits of the points of each face, wherever they begin and whichever way they run."""
    mixed = (points.astype(np.uint64) + _A) * _B
    mixed = (mixed ^ (mixed >> np.uint64(29))) * _A
    mixed ^= mixed >> np.uint64(32)
    sums = np.concatenate([np.zeros(1, np.uint64), np.cumsum(mixed, dtype=np.uint64)])
    ends = offsets_of(sizes)
    return np.asarray((sums[ends[1:]] - sums[ends[:-1]]) ^ (sizes.astype(np.uint64) * _B))


def coincide(keys: NDArray[np.uint64]) -> NDArray[np.bool_]:
    """Which keys are there more than once."""
    _, which, counts = np.unique(keys, return_inverse=True, return_counts=True)
    return np.asarray(counts[which.reshape(-1)] > 1)


_SURFACES = np.array([BY_NAME[n].vtk_id for n in ("vertex", "vertex", "line", "triangle", "quad", "polygon")], np.uint8)


def surface_types(sizes: Ints) -> NDArray[np.uint8]:
    """The surface cell of a face, by its number of points."""
    return np.asarray(_SURFACES[np.minimum(sizes, 5)])


def of_cells(n_cells: int, owner: Ints, neighbour: Ints) -> tuple[Ints, Ints, NDArray[np.bool_]]:
    """Faces of each cell from the two cells of each face; a negative cell is none.

    Returns
    -------
    tuple
        Offsets and faces by cell, in the order of the faces, and for each entry whether the cell is the neighbour.
    """
    if is_compiled(n_cells, is_once=True):
        return driver.faces_by_cell(n_cells, owner, neighbour)
    cells = np.concatenate([owner, neighbour])
    faces = np.tile(np.arange(len(owner)), 2)
    is_neighbour = np.repeat([False, True], len(owner))
    kept = cells >= 0
    order = np.argsort(cells[kept] * (len(owner) + 1) + faces[kept], kind="stable")
    counts = np.bincount(cells[kept], minlength=n_cells)
    return offsets_of(counts), faces[kept][order], is_neighbour[kept][order]
