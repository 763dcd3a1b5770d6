"""J_ENS, or a metric's function, over the cells of a mesh: in slices, on threads."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import partial
from operator import itemgetter

import numpy as np
from numpy.typing import NDArray

from ..cells import IS_SOLID, CellType
from ..kernels import path
from ..kernels.cells import driver
from ..kernels.threads import run, thread_count
from ..look.records import brief
from ..mesh import CellIds, Mesh, connectivity
from ..mesh.cast import frozen
from ..mesh.polyhedra import Polyhedra
from ..status import Status
from ..surface_cells import IS_SURFACE
from . import validity
from .flat import mark_flat
from .metrics import Cells, Metric, PolyhedralCells

Values = NDArray[np.float64]


def n_deciding(mesh: Mesh) -> int:
    """Cells of a mesh that are measured, of all types, without ghosts: so many decide whether kernels are taken.

    Of all types, because a part of a mesh cannot know of how many of its cells the whole has few.
    """
    of_type = IS_SURFACE if mesh.dimension == 2 else IS_SOLID
    is_measured = of_type[mesh.types]
    ghosts = mesh.is_ghost
    return int(np.count_nonzero(is_measured if ghosts is None else is_measured & ~ghosts))


def mesh_cells(mesh: Mesh, row: CellType, cells: CellIds, n: int) -> Cells:
    """Some cells of one type that is measured, as metrics take them; ``n``: see `n_deciding`."""
    compiled = path.is_compiled(n)
    nodes = connectivity.pick(mesh, row, cells, driver.columns(row), compiled=compiled)
    return Cells(row, mesh.points, nodes, compiled, mesh.up)


def of_cells(one: Metric, mesh: Mesh, row: CellType, cells: CellIds, n: int, out: Values, threads: int | None) -> None:
    """Put a metric's values of all cells of one type, for which it is defined, into ``out`` ``(mesh.n_cells,)``.

    ``n``: see `n_deciding`.
    """
    if not one.in_slices:
        out[cells] = one.of_cells(mesh_cells(mesh, row, cells, n))
        return
    one.of_cells(mesh_cells(mesh, row, next(connectivity.chunks(cells, 1)), n))  # what it compiles, it compiles here

    def work(part: CellIds) -> None:
        out[part] = one.of_cells(mesh_cells(mesh, row, part, n))

    run(work, connectivity.chunks(cells), threads)


def polyhedral_cells(
    mesh: Mesh,
    polyhedra: Polyhedra,
    cells: CellIds,
    threads: int | None,
    beyond_faces: Callable[[NDArray[np.int64]], NDArray[np.int64]] | None,
) -> PolyhedralCells:
    """Polyhedra of a mesh as metrics take them: measured. ``beyond_faces``: see `measure.measure_part`."""
    from ..mesh.beyond import beyond
    from .polyhedra import measure_polyhedra

    know = beyond_faces or partial(beyond, mesh)
    quality = measure_polyhedra(mesh.points, polyhedra, cells, threads=threads, stored=mesh.stored, beyond=know)
    return PolyhedralCells(mesh.points, polyhedra, quality, know)


def of_polyhedra(one: Metric, cells: PolyhedralCells, threads: int | None) -> Values:
    """A metric's values of polyhedra, ``(n_cells,)``."""
    if not one.in_slices:
        return one.of_polyhedra(cells)
    one.of_polyhedra(cells.part(slice(0, 1)))
    from .polyhedra import CHUNK

    parts = [slice(start, start + CHUNK) for start in range(0, cells.n_cells, CHUNK)]
    return np.concatenate(run(lambda part: one.of_polyhedra(cells.part(part)), parts, threads))


SCATTERED = 1 << 15
"""Cells of a type that a thread is handed at a time where they do not follow one another: few enough that those of all
types come from one part of the file, which stays in its cache."""


ALONE = 1 << 18
"""Cells that a single thread works on at a time where the kernel tells all that is asked, and nothing large is made."""


@dataclass(frozen=True, eq=False)
class Beside:
    """What a report says beside J_ENS of cells of some types, told in passing; see `quality.companions`.

    Attributes
    ----------
    means, ratios
        ``(n_cells,)``; NaN where it has to be looked at more closely, and anything for cells of other types.
    rows
        These types.
    """

    means: Values
    ratios: Values
    rows: set[CellType] = field(default_factory=set)

    __repr__ = brief

    def of(self, part: CellIds) -> tuple[Values, Values]:
        """Of some cells, as arrays or views."""
        return self.means[part], self.ratios[part]

    def put(self, cells: NDArray[np.intp], known: Beside) -> None:
        """Of some cells, all that there are of some types, what is known of them."""
        self.means[cells], self.ratios[cells] = known.means, known.ratios
        self.rows.update(known.rows)


def jens(
    mesh: Mesh,
    types: Iterable[tuple[CellType, CellIds]],
    n: int,
    values: Values,
    status: NDArray[np.uint8],
    threads: int | None,
    beside: Beside | None = None,
) -> None:
    """Put J_ENS and the status of all cells of some types into arrays ``(mesh.n_cells,)``.

    Parameters
    ----------
    mesh
        What is measured.
    types
        For each its row, and the cells.
    n
        See `n_deciding`.
    values, status
        Changed in place.
    threads
        At most this many; None: one for each processor.
    beside
        Filled in as well, if given, for types for which that can be told in passing.
    """
    works: list[tuple[int, Callable[[], None]]] = []
    compiled = path.is_compiled(n)
    for row, cells in types:
        own = beside if driver.tells_companions(row, compiled=compiled) else None
        if own is not None:
            own.rows.add(row)
        driver.prepare(row, mesh.points, n, with_companions=own is not None)
        validity.prepare(row, mesh, compiled=compiled)
        size = ALONE if own is not None and thread_count(threads) == 1 else connectivity.CHUNK
        if not isinstance(cells, slice):
            size = SCATTERED
            if compiled:
                _jens(mesh, row, cells[:0], values, status, own, compiled=True)  # what it compiles, it compiles here
        for part in connectivity.chunks(cells, size):
            first = part.start if isinstance(part, slice) else int(part[0])
            works.append((first, partial(_jens, mesh, row, part, values, status, own, compiled=compiled)))
    # In the order of the file: of types that alternate the connectivity is then read once, not once for each.
    works.sort(key=itemgetter(0))
    run(lambda work: work[1](), works, threads)


def _jens(
    mesh: Mesh,
    row: CellType,
    part: CellIds,
    values: Values,
    status: NDArray[np.uint8],
    beside: Beside | None,
    *,
    compiled: bool,
) -> None:
    """The same for a few cells of one type."""
    ids = connectivity.pick(mesh, row, part, driver.columns(row), compiled=compiled)
    into = values[part] if isinstance(part, slice) else np.empty(len(ids))
    clear = np.empty(len(ids), np.bool_)
    pair = None if beside is None else beside.of(part)
    driver.cell_jens(mesh.points, ids, row, into, mesh.up, compiled=compiled, clear=clear, beside=pair)
    if beside is not None and pair is not None and not isinstance(part, slice):
        beside.means[part], beside.ratios[part] = pair
    codes = np.full(len(ids), Status.OK, np.uint8)
    others = np.flatnonzero(~clear)
    if len(others):
        some = slice(None) if len(others) == len(ids) else others
        codes[some] = _codes(mesh, row, ids[some], into[some], compiled=compiled)
    if isinstance(part, slice):
        status[part] = codes
    else:
        connectivity.put(part, into, codes, values, status, compiled=compiled)


def _codes(mesh: Mesh, row: CellType, ids: NDArray[np.int64], values: Values, *, compiled: bool) -> NDArray[np.uint8]:
    """The status of cells of one type, of which nothing is known but J_ENS."""
    codes = _status(values)
    mark_flat(mesh, row, ids, values, codes)
    flat = np.flatnonzero(codes == Status.DEGENERATE)
    if len(flat):
        nodes = np.sort(ids[flat], axis=1)
        codes[flat[(nodes[:, 1:] == nodes[:, :-1]).any(axis=1)]] = Status.REPEATED_POINTS
    validity.inside(mesh, row, ids, codes, compiled=compiled)
    return codes


def _status(values: Values) -> NDArray[np.uint8]:
    codes = np.full(len(values), Status.OK, np.uint8)
    others = np.flatnonzero(~(values > 0.0))  # NaN too
    if len(others):
        some = values[others]
        codes[others] = np.select(
            [some < 0.0, some == 0.0],
            [np.uint8(Status.INVERTED), np.uint8(Status.DEGENERATE)],
            np.uint8(Status.NON_FINITE),
        )
    return codes


def node_scaled_jacobian(mesh: Mesh, threads: int | None, n: int) -> Values:
    """J_S of every cell's nodes, flat, aligned with ``mesh.connectivity``; NaN at a node that is not a corner.

    ``n``: see `n_deciding`.
    """
    out = np.full(len(mesh.connectivity), np.nan)
    for row, _, cells in mesh.groups():
        if row is None or row.shape is None:
            continue
        driver.prepare(row, mesh.points, n, with_nodes=True)

        def work(part: CellIds, row: CellType = row) -> None:
            some = mesh_cells(mesh, row, part, n)
            out[connectivity.positions(mesh, row, part)] = some.node_scaled_jacobian() + 0.0

        run(work, connectivity.chunks(cells), threads)
    return frozen(out)
