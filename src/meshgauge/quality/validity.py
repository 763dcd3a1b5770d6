"""Is a cell valid inside, where its corners say that it is? What is proved, and which status follows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..cells import CellType
from ..errors import expect
from ..kernels.arrays import read_only
from ..kernels.cells import driver
from ..kernels.certificate.bounds import Bounds, Validity, bounds, validity
from ..kernels.threads import run, thread_count
from ..look.records import brief
from ..mesh import CellIds, Mesh, connectivity
from ..mesh.ghosts import without_ghosts
from ..status import Status

ZERO = 2.0**-50
"""Least determinant, in units of the ideal cell's, that rounding of coordinates makes of zero."""

Values = NDArray[np.float64]
Codes = NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Certificate:
    """What is proved of every cell of a mesh, in file order. Arrays are read-only.

    Attributes
    ----------
    validity
        ``(n_cells,)`` uint8, codes of `Validity`: VALID (the Jacobian determinant is positive on the whole closed
        cell), INVALID (zero or negative somewhere), UNDECIDED (neither could be proved, or there is no certificate for
        the type), UNDEFINED (a coordinate is NaN or infinite, or not a solid cell).
    lower, upper
        ``(n_cells,)`` certified bounds on the least determinant, divided by that of the ideal cell with the same
        root-mean-square edge: 1 for the ideal cell, the same in any unit, ARG_S for a linear tetrahedron. ``lower > 0``
        exactly where VALID, ``upper <= 0`` exactly where INVALID. NaN where nothing is known.
    """

    validity: Codes
    lower: Values
    upper: Values

    __repr__ = brief


def certify(mesh: Mesh, *, threads: int | None = None) -> Certificate:
    """Bound the Jacobian determinant inside every cell, and decide its sign.

    Exact for linear tetrahedra, pyramids and wedges; Bernstein coefficients, subdivision and at last whole numbers for
    hexahedra and the quadratic types (Johnen, Remacle, Geuzaine 2013; Johnen, Weill, Remacle 2017). `measure` decides
    the signs as well, and faster; this adds the bounds.

    Parameters
    ----------
    mesh
        Any mesh; of types without a certificate (polyhedra, curved cells of other orders) nothing is known.
    threads
        At most this many; None: one for each processor. It has no influence on the bounds.

    Returns
    -------
    Certificate
        A decision and two bounds for each cell, without a unit.

    Raises
    ------
    OptionError
        If there is less than one thread.
    """
    thread_count(threads)
    codes = np.full(expect(mesh, Mesh).n_cells, Validity.UNDEFINED, np.uint8)
    lower, upper = np.full(mesh.n_cells, np.nan), np.full(mesh.n_cells, np.nan)
    mesh = without_ghosts(mesh)
    for row, _, cells in mesh.groups():
        if row is None or row.shape is None:
            continue
        known = _certified_as(row)
        if known is None:
            codes[cells] = Validity.UNDECIDED
            continue

        def work(part: CellIds, row: CellType = row, known: CellType = known) -> None:
            ids = connectivity.pick(mesh, row, part, driver.columns(row))
            codes[part], lower[part], upper[part] = _bounds(mesh, known, ids)

        run(work, connectivity.chunks(cells), threads)
    return Certificate(read_only(codes), read_only(lower), read_only(upper))


def prepare(row: CellType, mesh: Mesh, *, compiled: bool) -> None:
    """Compile what `inside` needs, on the calling thread."""
    known = _certified_as(row)
    if known is not None and not driver.corners_decide(row):
        _validity(mesh, known, np.zeros((0, len(driver.columns(row))), np.int64), compiled=compiled)


def inside(mesh: Mesh, row: CellType, ids: NDArray[np.int64], status: Codes, *, compiled: bool) -> None:
    """Change the status of cells that are valid at their corners but not, or not provably, inside.

    Parameters
    ----------
    mesh, row, ids
        Some cells of one type, their points as `kernels.cells.driver.columns` has them.
    status
        Theirs, changed in place: OK becomes INVERTED_INSIDE or UNDECIDED where it must, and DEGENERATE where the
        determinant reaches zero as far as coordinates can tell, and is nowhere seen to be negative.
    compiled
        Take the kernels, see `kernels.path`.
    """
    known = _certified_as(row)
    if driver.corners_decide(row):
        return
    ok = np.flatnonzero(status == Status.OK)
    if known is None and row.is_curved:
        status[ok] = Status.UNDECIDED
        return
    if len(ok) == 0:
        return
    if len(ok) < len(ids):
        ids = ids[ok]
    if known is None:
        from ..kernels.certificate import prism

        proved = prism.validity(np.asarray(mesh.points[ids], np.float64))
    else:
        proved = _validity(mesh, known, ids, compiled=compiled)
    status[ok[proved == Validity.INVALID]] = Status.INVERTED_INSIDE
    undecided = np.flatnonzero(proved == Validity.UNDECIDED)
    status[ok[undecided]] = Status.UNDECIDED
    if len(undecided) and known is not None:
        least = _bounds(mesh, known, ids[undecided]).upper
        status[ok[undecided[least <= ZERO]]] = Status.DEGENERATE


def _certified_as(row: CellType) -> CellType | None:
    """As `driver.certified_as`; a polygon as what it is, which its corners and its boundary tell."""
    shape = row.shape
    is_polygon = shape is not None and shape.dimension == 2 and not row.is_curved
    return row if is_polygon else driver.certified_as(row)


def _validity(mesh: Mesh, known: CellType, ids: NDArray[np.int64], *, compiled: bool) -> Codes:
    if known.dimension == 2:
        from ..kernels.surfaces import driver as surfaces

        return surfaces.validity(mesh.points, ids, known, mesh.up)
    return validity(known.kind, mesh.points, ids, compiled=compiled)


def _bounds(mesh: Mesh, known: CellType, ids: NDArray[np.int64]) -> Bounds:
    if known.dimension == 2:
        from ..kernels.surfaces import driver as surfaces

        return surfaces.bounds(mesh.points, ids, known, mesh.up)
    return bounds(known.kind, mesh.points, ids)
