"""What the function of a metric is given: some cells of one type, or some polyhedra."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...cells import BY_NAME, CellType, Shape
from ...kernels.cells import aggregate, driver
from ...surface_cells import straight

if TYPE_CHECKING:
    from ...kernels.polyhedra.driver import Faces
    from ...mesh.polyhedra import Polyhedra
    from ..polyhedra import PolyhedralQuality

Values = NDArray[np.float64]
Points = NDArray[np.floating]


@dataclass(frozen=True, eq=False, repr=False)
class Cells:
    """Some cells of one type. Arrays are not to be changed.

    Attributes
    ----------
    type
        The row of their type; it has a shape.
    points
        ``(n_points, 3)`` float32 or float64: all points of the mesh.
    nodes
        ``(n_cells, n)`` int64 point ids: all nodes of a cell whose edges are curved and measured so, else its corners.
    compiled
        Take kernels: the mesh has many cells of the type, see `kernels.path`.
    up
        Of surface cells: 1 or -1 in a plane that is seen from +z or -z, 0 in space; see `Mesh`.
    """

    type: CellType
    points: Points
    nodes: NDArray[np.int64]
    compiled: bool
    up: int = 0

    @property
    def n_cells(self) -> int:
        return len(self.nodes)

    @property
    def shape(self) -> Shape:
        """Corners, edges and faces, as positions among the corners."""
        assert self.type.shape is not None
        return self.type.shape

    @cached_property
    def corners(self) -> NDArray[np.int64]:
        """``(n_cells, n_corners)`` int64 point ids of the corners, in the order of `shape`."""
        if driver.columns(self.type) == self.type.corners:
            return self.nodes
        return np.ascontiguousarray(self.nodes[:, list(self.type.corners)])

    @cached_property
    def coordinates(self) -> Values:
        """``(n_cells, n_corners, 3)`` float64: where the corners are."""
        return np.asarray(self.points[self.corners], np.float64)

    @property
    def linear(self) -> Cells:
        """The same cells with straight edges."""
        of = straight(self.type) if self.shape.dimension == 2 else BY_NAME[self.shape.name]
        return Cells(of, self.points, self.corners, self.compiled, self.up)

    def part(self, cells: slice) -> Cells:
        """Some of the cells."""
        return replace(self, nodes=self.nodes[cells])

    def jens(self, out: Values | None = None) -> Values:
        """``(n_cells,)`` J_ENS; ``out``, contiguous, receives it if given."""
        values = np.empty(self.n_cells) if out is None else out
        driver.cell_jens(self.points, self.nodes, self.type, values, self.up, compiled=self.compiled)
        return values

    def node_scaled_jacobian(self) -> Values:
        """``(n_cells, n_corners)`` J_S of the corners."""
        values = np.empty((self.n_cells, self.shape.n_nodes))
        driver.node_scaled_jacobian(self.points, self.nodes, self.type, values, self.up, compiled=self.compiled)
        return values

    def node_jens(self) -> Values:
        """``(n_cells, n_corners)`` J_ENS of the corners."""
        return aggregate.jens(self.node_scaled_jacobian(), self.shape.k)

    def scaled_jacobian(self) -> Values:
        """``(n_cells,)`` J_S: the fold of the corners'."""
        return aggregate.fold(self.node_scaled_jacobian()) + 0.0  # no -0.0

    def signs(self) -> NDArray[np.int8]:
        """``(n_cells,)`` exact sign of J_ENS with straight edges; of tetrahedra, that of the volume. 0 where a
        coordinate is not finite."""
        return np.sign(np.nan_to_num(self.linear.jens())).astype(np.int8)


@dataclass(frozen=True, eq=False, repr=False)
class PolyhedralCells:
    """Some polyhedra. Arrays are not to be changed.

    Attributes
    ----------
    points
        ``(n_points, 3)`` float32 or float64: all points of the mesh.
    polyhedra
        The faces of all polyhedra of the mesh, by cell id.
    quality
        What was measured on these cells; ``quality.cells`` are their ids, ``quality.node_offsets`` tells which nodes
        are whose.
    beyond
        What lies beyond entries of ``polyhedra.cell_faces``, as they were measured; None if that was not known.
    """

    points: Points
    polyhedra: Polyhedra
    quality: PolyhedralQuality
    beyond: Callable[[NDArray[np.int64]], NDArray[np.int64]] | None = None

    @property
    def n_cells(self) -> int:
        return len(self.quality.cells)

    @cached_property
    def faces(self) -> Faces:
        """The faces of these cells, cell after cell, hanging nodes among their points."""
        from ..polyhedra import faces_of  # brings in Numba

        return faces_of(self.polyhedra, self.quality.cells)

    def part(self, cells: slice) -> PolyhedralCells:
        """Some of the cells."""
        return replace(self, quality=self.quality.part(cells))
