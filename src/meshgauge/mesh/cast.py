"""The door for arrays: cast and check once, so that kernels accept exactly one layout."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..cells import CELL_TYPES, CellType, type_name
from ..errors import MeshError
from ..kernels.arrays import read_only
from ..kernels.threads import run
from .polyhedra import IndexArray, Polyhedra

CHUNK = 1 << 18
"""Items checked at a time, so that no check allocates a temporary as large as the mesh."""


def frozen(array: NDArray[Any]) -> NDArray[Any]:
    """The array itself, read-only from now on, and so is what it is a view of."""
    held: Any = array
    while isinstance(held, np.ndarray):
        held.flags.writeable = False
        held = held.base
    return array


def is_frozen(array: NDArray[Any]) -> bool:
    """True if nobody can write to the array: it is read-only, and so is what it is a view of."""
    held: Any = array
    while isinstance(held, np.ndarray):
        if held.flags.writeable:
            return False
        held = held.base
    try:
        return held is None or memoryview(held).readonly
    except TypeError:  # memory of another library, which may write to it
        return False


def own(array: NDArray[Any], given: object, *, copy: bool) -> NDArray[Any]:
    """``array``, which was made of what a caller gave, as one that nobody can write to.

    With ``copy`` it is copied where the caller, or anybody else, could still write to its memory.
    """
    if copy and not is_frozen(array):
        is_new = (
            not np.may_share_memory(array, given) if isinstance(given, np.ndarray) else type(given) in (list, tuple)
        )
        array = array if is_new else array.copy()
    return frozen(array)


def plain(values: ArrayLike, what: str) -> NDArray[Any]:
    """Any array; masked values become NaN. Raises `MeshError` for rows of different lengths, and for masked text."""
    try:
        array = np.asarray(values)
    except (ValueError, TypeError) as error:
        raise MeshError(f"{what} do not make an array: {_sentence(error)}") from None
    if not np.ma.is_masked(values):
        return array
    if array.dtype.kind not in "fiub":
        raise MeshError(f"{what} (of type {array.dtype}) have masked values, which only numbers may have")
    numbers = array.astype(array.dtype if array.dtype.kind == "f" else np.float64)
    numbers[np.ma.getmaskarray(values)] = np.nan  # type: ignore[arg-type]  # it is a masked array
    return numbers


def _sentence(error: Exception) -> str:
    return " ".join(str(error).split()).rstrip(".")


def points(values: ArrayLike) -> NDArray[np.floating]:
    """``(n, 3)`` C-contiguous float32 or float64 in native byte order; other real types become float64.

    Masked coordinates become NaN; where there are two, z is 0.
    """
    array = plain(values, "points")
    if array.ndim == 2 and array.shape[1] == 2 and len(array):
        array = np.pad(array, ((0, 0), (0, 1)))
    if array.ndim != 2 or array.shape[1] != 3:
        if array.size == 0:
            raise MeshError("no points")
        raise MeshError(f"points have shape {array.shape}, expected (n_points, 3)")
    if array.dtype.kind not in "fiub":
        raise MeshError(f"points have dtype {array.dtype}, expected real numbers")
    dtype = np.float32 if array.dtype.kind == "f" and array.dtype.itemsize == 4 else np.float64
    return read_only(np.ascontiguousarray(array, dtype=dtype))


def in_plane(values: ArrayLike) -> bool:
    """True for points that are given by two coordinates."""
    array = plain(values, "points")
    return array.ndim == 2 and array.shape[1] == 2


def types(values: ArrayLike) -> NDArray[np.uint8]:
    """``(n_cells,)`` VTK ids of cell types as uint8."""
    array = require_unmasked(values, "types")
    if array.ndim != 1:
        raise MeshError(f"types have shape {array.shape}, expected one dimension")
    if array.dtype == np.uint8 or not array.size:
        return np.ascontiguousarray(array, np.uint8)
    if array.dtype.kind not in "iu" or int(array.min()) < 0 or int(array.max()) > 255:
        raise MeshError(f"types (of type {array.dtype}) are not VTK ids from 0 to 255")
    return np.ascontiguousarray(array, np.uint8)


def count_types(ids: NDArray[np.uint8]) -> NDArray[np.int64]:
    """``(256,)`` how many of some VTK ids each is."""
    counts = np.zeros(256, np.int64)
    for start in range(0, len(ids), CHUNK):  # in pieces: `bincount` makes a copy of eight times the size
        some = ids[start : start + CHUNK]
        if bool((some == some[0]).all()):  # told thirty times as fast as they are counted
            counts[some[0]] += len(some)
        else:
            counts += np.bincount(some, minlength=256)
    return counts


def indices(values: ArrayLike, what: str) -> IndexArray:
    """One-dimensional C-contiguous int32 or int64; other integer types become int64."""
    array = require_unmasked(values, what)
    if array.ndim != 1:
        raise MeshError(f"{what} has shape {array.shape}, expected one dimension")
    return read_only(_integers(array, what))


def connectivity(values: ArrayLike, row: CellType) -> IndexArray:
    """``(n_cells, n_nodes)`` C-contiguous int32 or int64 with the right number of nodes for the type."""
    array = require_unmasked(values, f"connectivity of {row.name}")
    if array.size == 0 and array.ndim < 2:
        array = np.empty((0, row.n_nodes or 0), np.int64)
    least = row.shape.n_nodes if row.shape is not None else 1
    wrong = array.ndim != 2 or (
        array.shape[1] != row.n_nodes if row.n_nodes is not None else array.shape[1] < least and len(array) > 0
    )
    if wrong:
        expected = str(row.n_nodes) if row.n_nodes is not None else f"at least {least}"
        raise MeshError(f"connectivity of {row.name} has shape {array.shape}, expected (n_cells, {expected})")
    return read_only(_integers(array, f"connectivity of {row.name}"))


def check_ids(ids: IndexArray, n_points: int, what: str) -> None:
    """Raise `MeshError` if an id is not in ``0 <= id < n_points``."""
    if ids.size == 0:
        return
    flat = ids.reshape(-1)
    unsigned = flat.view(np.uint64 if flat.dtype.itemsize == 8 else np.uint32)
    # Negative ids are huge when read as unsigned, so that one pass over memory finds both kinds.
    if (
        max(run(lambda start: int(unsigned[start : start + 8 * CHUNK].max()), range(0, flat.size, 8 * CHUNK)))
        >= n_points
    ):
        at = int(np.argmax((flat < 0) | (flat >= n_points)))
        raise MeshError(f"{what}: point id {int(flat[at])} {_place(ids, at)} is outside 0..{n_points - 1}")


def _place(ids: NDArray[np.integer], at: int) -> str:
    """Where an id stands, for messages: in a table of cells its cell and the node, else its position."""
    if ids.ndim != 2:
        return f"at position {at}"
    cell, node = divmod(at, ids.shape[1])
    return f"of cell {cell}, node {node},"


def check_cells(types: NDArray[np.uint8], offsets: IndexArray, nodes: IndexArray, n_points: int | None) -> None:
    """Raise `MeshError` unless types, offsets and connectivity make cells on ``n_points`` points; None: all ids are."""
    n_cells = len(types)
    if types.ndim != 1 or len(offsets) != n_cells + 1:
        raise MeshError(f"offsets have length {len(offsets)}, expected {n_cells + 1} for {n_cells} cells")
    if n_cells and (offsets[0] != 0 or int(offsets[-1]) != len(nodes)):
        raise MeshError(f"offsets run from {offsets[0]} to {offsets[-1]}, expected 0 to {len(nodes)}")
    run(lambda start: _check_sizes(types, offsets, start), range(0, n_cells, CHUNK))
    if n_points is None:
        return
    try:
        check_ids(nodes, n_points, "connectivity")
    except MeshError as error:
        ids = np.asarray(nodes, np.int64)
        at = int(np.argmax((ids < 0) | (ids >= n_points)))
        cell = int(np.searchsorted(offsets, at, side="right")) - 1
        raise MeshError(
            f"cell {cell} ({type_name(types[cell])}): point id {int(ids[at])} is outside 0..{n_points - 1}"
        ) from error


_FIXED = np.array([CELL_TYPES[t].n_nodes or -1 if t in CELL_TYPES else -1 for t in range(256)], np.int64)
_LEAST = np.array(
    [s.n_nodes if t in CELL_TYPES and (s := CELL_TYPES[t].shape) is not None else 0 for t in range(256)], np.int64
)


def n_nodes_of(types: NDArray[np.uint8]) -> int:
    """The nodes of each of some cells, if all are of one type that has a fixed number; else -1."""
    return int(_FIXED[types[0]]) if len(types) and bool((types == types[0]).all()) else -1


def _check_sizes(all_types: NDArray[np.uint8], offsets: IndexArray, start: int) -> None:
    types = all_types[start : start + CHUNK]
    bounds = offsets[start : start + len(types) + 1]
    sizes = bounds[1:] - bounds[:-1]
    first = int(_FIXED[types[0]])
    if first >= 0 and int(sizes.min()) == int(sizes.max()) == first and bool((types == types[0]).all()):
        return
    fixed = _FIXED[types]
    wrong = np.where(fixed >= 0, sizes != fixed, sizes < _LEAST[types])
    if wrong.any():
        at = int(np.argmax(wrong))
        name, size, expected = type_name(types[at]), int(sizes[at]), int(fixed[at])
        wanted = str(expected) if expected >= 0 else f"at least {int(_LEAST[types[at]])}"
        raise MeshError(f"cell {start + at} ({name}) has {size} nodes, expected {wanted}")


def own_polyhedra(poly: Polyhedra, *, copy: bool) -> Polyhedra:
    """Polyhedra whose arrays are of the right types and nobody can write to."""

    def ids(name: str) -> IndexArray:
        given = getattr(poly, name)
        return own(indices(given, f"polyhedra: {name}"), given, copy=copy)

    flipped = poly.flipped
    if flipped is not None:
        flipped = own(np.ascontiguousarray(flipped, np.bool_), flipped, copy=copy)
    labels = ids("labels") if poly.labels is not None else None
    return Polyhedra(ids("cell_offsets"), ids("cell_faces"), ids("face_offsets"), ids("face_points"), flipped, labels)


def check_polyhedra(poly: Polyhedra, n_cells: int, n_points: int) -> None:
    """Raise `MeshError` unless faces and points of the polyhedra are in range."""
    if len(poly.cell_offsets) != n_cells + 1:
        raise MeshError(f"polyhedra: cell offsets have length {len(poly.cell_offsets)}, expected {n_cells + 1}")
    if poly.flipped is not None and len(poly.flipped) != len(poly.cell_faces):
        raise MeshError(f"polyhedra: flipped has length {len(poly.flipped)}, expected {len(poly.cell_faces)}")
    if poly.labels is not None and len(poly.labels) != poly.n_faces:
        raise MeshError(f"polyhedra: labels has length {len(poly.labels)}, expected {poly.n_faces}")
    for offsets, items, what in (
        (poly.cell_offsets, poly.cell_faces, "cell offsets"),
        (poly.face_offsets, poly.face_points, "face offsets"),
    ):
        if len(offsets) and (offsets[0] != 0 or int(offsets[-1]) != len(items) or (np.diff(offsets) < 0).any()):
            raise MeshError(f"polyhedra: {what} do not run from 0 up to {len(items)}")
    if poly.cell_faces.size and (int(poly.cell_faces.min()) < 0 or int(poly.cell_faces.max()) >= poly.n_faces):
        raise MeshError(f"polyhedra: a face id is outside 0..{poly.n_faces - 1}")
    check_ids(np.ascontiguousarray(poly.face_points), n_points, "polyhedra: faces")


def require_unmasked(values: ArrayLike, what: str) -> NDArray[Any]:
    """An array of ids, of which none is masked."""
    if isinstance(values, np.ma.MaskedArray) and np.ma.is_masked(values):
        at = tuple(int(axis[0]) for axis in np.nonzero(np.ma.getmaskarray(values)))
        raise MeshError(f"{what}: the id at {at if len(at) > 1 else at[0]} is masked")
    return plain(values, what)


def _integers(array: NDArray[Any], what: str) -> IndexArray:
    if array.dtype.kind not in "iu" and array.size:
        raise MeshError(f"{what} has dtype {array.dtype}, expected integers")
    dtype = np.int32 if array.dtype.kind == "i" and array.dtype.itemsize == 4 else np.int64
    if array.dtype.kind == "u" and array.dtype.itemsize == 8 and array.size and int(array.max()) > 2**63 - 1:
        at = int(np.argmax(array))
        raise MeshError(f"{what}: id {int(array.flat[at])} {_place(array, at)} does not fit a signed integer")
    return np.ascontiguousarray(array, dtype=dtype)
