"""A metric's function over the cells of a mesh: in slices, on threads."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..cells import CellType
from ..kernels import path
from ..kernels.cells import driver
from ..kernels.threads import run
from ..mesh import CellIds, Mesh, connectivity
from .metrics import Cells, Metric, PolyhedralCells
from .polyhedra import CHUNK

Values = NDArray[np.float64]


def mesh_cells(mesh: Mesh, row: CellType, cells: CellIds, n_of_type: int) -> Cells:
    """Some cells of one type that is measured, of which the mesh has so many, as metrics take them."""
    nodes = connectivity.pick(mesh, row, cells, driver.columns(row))
    return Cells(row, mesh.points, nodes, path.is_compiled(n_of_type))


def of_cells(one: Metric, mesh: Mesh, row: CellType, cells: CellIds, n: int, out: Values, threads: int | None) -> None:
    """Put a metric's values of all cells of one type, for which it is defined, into ``out`` ``(mesh.n_cells,)``.

    ``n``: so many decide whether kernels are taken, see `kernels.path`.
    """
    if not one.in_slices:
        out[cells] = one.of_cells(mesh_cells(mesh, row, cells, n))
        return
    one.of_cells(mesh_cells(mesh, row, next(connectivity.chunks(cells, 1)), n))  # what it compiles, it compiles here

    def work(part: CellIds) -> None:
        out[part] = one.of_cells(mesh_cells(mesh, row, part, n))

    run(work, connectivity.chunks(cells), threads)


def of_polyhedra(one: Metric, cells: PolyhedralCells, threads: int | None) -> Values:
    """A metric's values of polyhedra, ``(n_cells,)``."""
    if not one.in_slices:
        return one.of_polyhedra(cells)
    one.of_polyhedra(cells.part(slice(0, 1)))
    parts = [slice(start, start + CHUNK) for start in range(0, cells.n_cells, CHUNK)]
    return np.concatenate(run(lambda part: one.of_polyhedra(cells.part(part)), parts, threads))
