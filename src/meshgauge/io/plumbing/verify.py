"""What was written, held against what was to be written, before it takes the place of anything."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...cells import CELL_TYPES, type_name
from ...errors import WriteError
from ...mesh import Mesh
from ...mesh.labels import LABEL, counts_from
from ...mesh.polyhedra import Polyhedra, ragged_positions
from .writing import nodes_of, plain, type_counts

_ULPS = 4
"""Units in the last place of the greatest coordinate: the most that text moves a point."""
_CHUNK = 1 << 16
"""Cells that are compared at a time."""
_IS_POINT = np.zeros(256, np.bool_)
_IS_POINT[[vtk_id for vtk_id, row in CELL_TYPES.items() if row.dimension == 0]] = True
_DATA = ("point_data", "cell_data", "field_data")

Ints = NDArray[np.int64]


def check(before: Mesh, after: Mesh, *, is_exact: bool, lost: Sequence[str] = ()) -> None:
    """Raise `WriteError` unless a mesh that was read back is the one that was written.

    Parameters
    ----------
    before, after
        What was to be written, and what was read back.
    is_exact
        Whether the format keeps every bit, order and name. Else cells must be all there (vertices apart, which some
        formats do not have), each with its nodes in their order at their places, in whatever order the cells are and
        whatever numbers the points have; data that are no integers keep their values, in any order too.
    lost
        Sentences on what the format could not hold: data that do not read back are named there.
    """
    if is_exact:
        _equal(before, after)
    else:
        _same_cells(plain(before), plain(after))
        _same_data(before, after)
    text = " ".join(lost)
    _require_none(name for name in _missing(before, after, is_exact=is_exact) if repr(name) not in text)


class Comparison:
    """A mesh, held against what a file of an exact format holds, which is handed over in pieces.

    Parameters
    ----------
    mesh
        What was to be written.
    """

    def __init__(self, mesh: Mesh) -> None:
        self._mesh = mesh
        self._wanted: dict[tuple[str, str], NDArray[Any]] = {
            (name, ""): getattr(mesh, name) for name in ("points", "types", "offsets", "connectivity")
        }
        if mesh.polyhedra is not None:
            poly = mesh.polyhedra.with_own_faces()
            for name in ("cell_offsets", "cell_faces", "face_offsets", "face_points"):
                self._wanted["polyhedra", name] = getattr(poly, name)
        self._wrong: list[str] = []
        self._data = {(what, name) for what in _DATA for name in getattr(mesh, what)}

    def take(self, what: str, name: str, pieces: Iterable[NDArray[Any]]) -> None:
        """Compare an array; see `plumbing.format.Take`."""
        if what in _DATA:
            self._data.discard((what, name))
            wanted = getattr(self._mesh, what).get(name)
            if wanted is None:  # a name that the format changed, and said so
                return
        else:
            wanted = self._wanted.pop((what, name))
        flat, at = wanted.reshape(-1), 0
        is_same = True
        for piece in pieces:
            is_same = is_same and _same(flat[at : at + len(piece)], piece)
            at += len(piece)
        if not is_same or at != len(flat):
            self._wrong.append(f"the {what.replace('_', ' ')} {name!r}" if what in _DATA else what)

    def finish(self, lost: Sequence[str]) -> None:
        """Raise `WriteError` if anything was another, or is missing and not among the sentences on what was lost."""
        wrong = self._wrong + sorted({what for what, _ in self._wanted})
        if wrong:
            raise WriteError(f"{wrong[0]} do not read back as they were")
        text = " ".join(lost)
        _require_none(name for what, name in sorted(self._data) if repr(name) not in text)


def _require_none(gone: Iterable[str]) -> None:
    names = ", ".join(map(repr, gone))
    if names:
        raise WriteError(f"the data {names} do not read back")


def _equal(before: Mesh, after: Mesh) -> None:
    for name in ("points", "types", "offsets", "connectivity"):
        if not _same(getattr(before, name), getattr(after, name)):
            raise WriteError(f"{name} do not read back as they were")
    faces = [_faces_of_cells(mesh.polyhedra) for mesh in (before, after)]
    if not all(_same(a, b) for a, b in zip(*faces, strict=True)):
        raise WriteError("the faces of polyhedra do not read back as they were")
    for what in _DATA:
        for name, values in getattr(after, what).items():
            if name in getattr(before, what) and not _same(getattr(before, what)[name], values):
                raise WriteError(f"the {what.replace('_', ' ')} {name!r} do not read back as they were")


def _faces_of_cells(polyhedra: Polyhedra | None) -> tuple[NDArray[Any], ...]:
    """How many faces each cell has, how many points each of these, and which: also if faces are numbered otherwise."""
    if polyhedra is None:
        return (np.empty(0, np.int64),) * 3
    faces = np.asarray(polyhedra.cell_faces, np.int64)
    offsets = np.asarray(polyhedra.face_offsets, np.int64)
    sizes: NDArray[np.int64] = offsets[faces + 1] - offsets[faces]
    points = np.asarray(polyhedra.face_points)[ragged_positions(offsets[faces], sizes)]
    return np.diff(np.asarray(polyhedra.cell_offsets, np.int64)), sizes, _from_the_least(points, sizes)


def _from_the_least(points: NDArray[Any], sizes: NDArray[np.int64]) -> NDArray[Any]:
    """The points of each face from the least on, towards its lesser neighbour: a format may list either side."""
    if not len(points) or sizes.min() < 1:
        return points
    starts = np.cumsum(sizes) - sizes
    owner = np.repeat(np.arange(len(sizes)), sizes)
    turn = np.arange(len(points)) - starts[owner]
    least = np.minimum.reduceat(points, starts)
    at = np.minimum.reduceat(np.where(points == least[owner], turn, len(points)), starts)
    after, before = (points[starts + (at + step) % sizes] for step in (1, -1))
    way = np.where(after <= before, 1, -1)
    ordered: NDArray[Any] = points[starts[owner] + (at[owner] + way[owner] * turn) % sizes[owner]]
    return ordered


def _missing(before: Mesh, after: Mesh, *, is_exact: bool) -> list[str]:
    """Names of data that did not come back, but for labels that only count and, where the format has numbers and
    regions of its own, what may have become these: labels, integers of cells and their names."""
    return [
        name
        for what in _DATA
        for name, values in getattr(before, what).items()
        if name not in getattr(after, what)
        and (
            not (name == LABEL and counts_from(values.ravel()) is not None)
            if is_exact
            else name != LABEL and not _may_be_regions(what, values)
        )
    ]


def _may_be_regions(what: str, values: NDArray[Any]) -> bool:
    return (what == "cell_data" and values.ndim == 1 and values.dtype.kind in "iub") or (
        what == "field_data" and values.dtype.kind in "USiu"
    )


def _same(before: NDArray[Any], after: NDArray[Any]) -> bool:
    a, b = before.ravel(), after.ravel()
    if a.dtype.kind == "S":
        a = np.char.decode(a, "utf-8", "replace")
    is_float = a.dtype.kind == b.dtype.kind == "f"
    return bool(np.array_equal(a, b, equal_nan=is_float))


def _same_cells(before: Mesh, after: Mesh) -> None:
    """Each cell of one mesh is in the other, by its type and the places of its nodes."""
    want, have = (type_counts(mesh.types[~_IS_POINT[mesh.types]]) for mesh in (before, after))
    if want != have:
        raise WriteError(f"{_counts_text(want)} were to be written, {_counts_text(have)} read back")
    has_all_points = before.n_points == after.n_points
    if has_all_points and before.n_points:
        # Each axis sorted: some formats change the order of the points.
        off = _largest(np.sort(before.points, 0), np.sort(after.points, 0))
        if off > _allowed(before, after):
            raise WriteError(f"points read back up to {off:.3g} from where they were")
    for vtk_id in want:
        _same_cells_of(vtk_id, before, after)


def _same_data(before: Mesh, after: Mesh) -> None:
    """Numbers with decimals of points and cells are those that were, in whatever order the format has these."""
    for what in _DATA[:2]:
        there = getattr(after, what)
        for name, values in getattr(before, what).items():
            back = there.get(name)
            if back is None or values.dtype.kind != "f" or back.dtype.kind != "f" or back.shape != values.shape:
                continue
            allowed = _rounding(values, back)
            if _largest(values, back) > allowed and _largest(np.sort(values, 0), np.sort(back, 0)) > allowed:
                raise WriteError(f"the {what.replace('_', ' ')} {name!r} do not read back as they were")


def _same_cells_of(vtk_id: int, before: Mesh, after: Mesh) -> None:
    ours, theirs = (np.flatnonzero(mesh.types == vtk_id) for mesh in (before, after))
    sizes = [np.diff(mesh.offsets)[ids] for mesh, ids in ((before, ours), (after, theirs))]
    for n_nodes in np.unique(sizes[0]).tolist():
        a, b = ours[sizes[0] == n_nodes], theirs[sizes[1] == n_nodes]
        if len(a) != len(b) or not (_in_order(before, after, a, b) or _in_any_order(before, after, a, b)):
            raise WriteError(f"the nodes of {type_name(vtk_id)} cells do not read back as they were")


def _in_order(before: Mesh, after: Mesh, ours: Ints, theirs: Ints) -> bool:
    """Whether cells of as many nodes each are the same, one by one."""
    allowed = _allowed(before, after)
    return all(
        _largest(_places(before, ours[at : at + _CHUNK]), _places(after, theirs[at : at + _CHUNK])) <= allowed
        for at in range(0, len(ours), _CHUNK)
    )


def _in_any_order(before: Mesh, after: Mesh, ours: Ints, theirs: Ints) -> bool:
    places = [_places(mesh, ids).astype(after.points.dtype) for mesh, ids in ((before, ours), (after, theirs))]
    a, b = (table[np.lexsort(table.T)] for table in places)
    return _largest(a, b) <= _allowed(before, after)


def _places(mesh: Mesh, cells: Ints) -> NDArray[np.floating]:
    """``(n, 3 k)`` coordinates of the nodes of cells of ``k`` nodes."""
    return mesh.points[nodes_of(mesh, cells)].reshape(len(cells), -1)


def _allowed(before: Mesh, after: Mesh) -> float:
    """How far a point may be from where it was."""
    return _rounding(before.points, after.points)


def _rounding(before: NDArray[np.floating], after: NDArray[np.floating]) -> float:
    """What the precision of the file rounds."""
    precision = np.finfo(after.dtype).eps
    finite = before[np.isfinite(before)]
    return float(_ULPS * precision * np.abs(finite).max(initial=0.0))


def _largest(before: NDArray[np.floating], after: NDArray[np.floating]) -> float:
    """The greatest difference of two tables; infinite where one has a number and the other has none."""
    a, b = before.astype(np.float64, copy=False), after.astype(np.float64, copy=False)
    if a.shape != b.shape:
        return np.inf
    with np.errstate(invalid="ignore", over="ignore"):
        off = np.where((a == b) | (np.isnan(a) & np.isnan(b)), 0.0, np.abs(a - b))
    return float(np.nan_to_num(off, nan=np.inf).max(initial=0.0))


def _counts_text(counts: dict[int, int]) -> str:
    return ", ".join(f"{n} {type_name(t) if t in CELL_TYPES else t}" for t, n in sorted(counts.items())) or "no cells"
