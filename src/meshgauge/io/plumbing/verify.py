"""What was written, held against what was to be written, before it takes the place of anything."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...cells import CELL_TYPES, IS_SOLID, type_name
from ...errors import WriteError
from ...mesh import Mesh
from ...mesh.polyhedra import Polyhedra, ragged_positions
from .writing import type_counts

_ROUNDED = 1e-5
"""Of the size of a mesh: the most that text and single precision move a point."""


def check(before: Mesh, after: Mesh, *, is_exact: bool) -> None:
    """Raise `WriteError` unless a mesh that was read back is the one that was written.

    Parameters
    ----------
    before, after
        What was to be written, and what was read back.
    is_exact
        Whether the format keeps every bit, order and name. Else solid cells must be all there, and points in place.
    """
    if is_exact:
        _equal(before, after)
        return
    want, have = _solids(before), _solids(after)
    if want != have:
        raise WriteError(f"{_counts_text(want)} were to be written, {_counts_text(have)} read back")
    if after.n_points == before.n_points and before.n_points:
        with np.errstate(invalid="ignore", over="ignore"):
            size = float(np.ptp(before.points, axis=0).max())
            # Each axis sorted: some formats change the order of the points.
            off = float(np.abs(np.sort(np.asarray(after.points, np.float64), 0) - np.sort(before.points, 0)).max())
            if np.isfinite(size) and off > _ROUNDED * max(size, float(np.abs(before.points).max())):
                raise WriteError(f"points read back up to {off:.3g} from where they were")


def _equal(before: Mesh, after: Mesh) -> None:
    for name in ("points", "types", "offsets", "connectivity"):
        if not _same(getattr(before, name), getattr(after, name)):
            raise WriteError(f"{name} do not read back as they were")
    faces = [_faces_of_cells(mesh.polyhedra) for mesh in (before, after)]
    if not all(_same(a, b) for a, b in zip(*faces, strict=True)):
        raise WriteError("the faces of polyhedra do not read back as they were")
    for what in ("point_data", "cell_data", "field_data"):
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


def missing(before: Mesh, after: Mesh) -> list[str]:
    """Names of data that did not come back."""
    return [
        name
        for what in ("point_data", "cell_data", "field_data")
        for name in getattr(before, what)
        if name not in getattr(after, what)
    ]


def _same(before: NDArray[Any], after: NDArray[Any]) -> bool:
    a, b = before.ravel(), after.ravel()
    if a.dtype.kind == "S":
        a = np.char.decode(a, "utf-8", "replace")
    is_float = a.dtype.kind == b.dtype.kind == "f"
    return bool(np.array_equal(a, b, equal_nan=is_float))


def _solids(mesh: Mesh) -> dict[int, int]:
    return type_counts(mesh.types[IS_SOLID[mesh.types]])


def _counts_text(counts: dict[int, int]) -> str:
    return ", ".join(f"{n} {type_name(t) if t in CELL_TYPES else t}" for t, n in sorted(counts.items())) or "no solids"
