"""The faces of a mesh's solid cells, matched between cells. Derived from a mesh on demand, never kept in it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..cells import CELL_TYPES, POLYHEDRON
from ..kernels.arrays import read_only
from ..kernels.path import is_compiled
from ..kernels.topology import driver
from ..kernels.topology.codes import BOUNDARY, COLLAPSED, CROSSED, ELSEWHERE, MULTIPLE, OPPOSITE, SAME
from .mesh import Mesh
from .polyhedra import IndexArray, ragged_positions

__all__ = ["BOUNDARY", "COLLAPSED", "CROSSED", "ELSEWHERE", "MULTIPLE", "OPPOSITE", "SAME", "Topology", "topology"]


@dataclass(frozen=True, eq=False, repr=False)
class Topology:
    """Faces of cells, and which of them are one face.

    A *half-face* is a face as one solid cell has it, in the order of its type's table (curved cells by their corners,
    polyhedra by their own faces); half-faces are numbered by cell. Two are one face if they have the same points.

    Attributes
    ----------
    mesh
        Whose faces they are.
    starts
        ``(n_cells + 1,)`` int64: cell ``c`` has the half-faces from ``starts[c]`` up to ``starts[c + 1]``; none if it
        is not solid or has no known faces.
    cells
        ``(n_half_faces,)`` cell of each half-face.
    mates
        ``(n_half_faces,)`` the half-face of the one other cell with this face; `BOUNDARY` if no other cell has it,
        `MULTIPLE` if two or more others have it, `COLLAPSED` if it has fewer than three distinct points.
    windings
        ``(n_half_faces,)`` int8, the winding relative to the mate: `OPPOSITE`, as of cells of one handedness on either
        side of a face; `SAME`; or `CROSSED` if the two cells join the points in another order.
    n_multiple
        Number of faces that three or more cells have.
    """

    mesh: Mesh
    starts: NDArray[np.int64]
    cells: IndexArray
    mates: IndexArray
    windings: NDArray[np.int8]
    n_multiple: int

    @property
    def n_boundary(self) -> int:
        """Number of faces that one cell has."""
        return int(np.count_nonzero(self.mates == BOUNDARY))

    @property
    def n_interior(self) -> int:
        """Number of faces that two cells have."""
        return int(np.count_nonzero(self.mates >= 0)) // 2

    @property
    def n_collapsed(self) -> int:
        """Number of faces of cells that have fewer than three distinct points."""
        return int(np.count_nonzero(self.mates == COLLAPSED))

    def pairs(self, winding: int | None = None) -> NDArray[np.int64]:
        """``(n, 2)`` half-faces of the faces that two cells have, the lower first; of one winding if given."""
        lower = np.flatnonzero(self.mates > np.arange(len(self.mates)))
        if winding is not None:
            lower = lower[self.windings[lower] == winding]
        return np.stack([lower, self.mates[lower].astype(np.int64)], axis=1)

    def face(self, half_face: int) -> tuple[int, ...]:
        """Point ids of a half-face, as its cell lists them: outward, counter-clockwise seen from outside."""
        cell = int(self.cells[half_face])
        local = half_face - int(self.starts[cell])
        row = CELL_TYPES[int(self.mesh.types[cell])]
        if row.shape is not None:
            nodes = self.mesh.nodes(cell)
            return tuple(int(nodes[row.corners[m]]) for m in row.shape.faces[local])
        poly = self.mesh.polyhedra
        assert poly is not None  # else the cell has no half-faces
        face = int(poly.cell_faces[int(poly.cell_offsets[cell]) + local])
        return tuple(int(p) for p in poly.face_points[poly.face_offsets[face] : poly.face_offsets[face + 1]])

    def face_points(
        self,
        half_faces: NDArray[np.int64],
        table: NDArray[np.int8] | None = None,
        width: type[np.signedinteger] = np.int64,
    ) -> tuple[IndexArray, NDArray[np.int64]]:
        """Points of some half-faces, as `face` gives them one at a time: ids one after another, and where each one's
        begin, ``(n + 1,)``. ``table``: another than `face_table`; ``width``: the type of the ids."""
        mesh, table = self.mesh, face_table() if table is None else table
        if is_compiled(len(half_faces), is_once=True):
            half_faces = np.ascontiguousarray(half_faces, np.int64)
            columns = (self.cells, self.starts, mesh.types, mesh.offsets, mesh.connectivity, table)
            return driver.face_points(half_faces, *columns, faces_of_polyhedra(mesh)[0], width)
        cells = np.asarray(self.cells, np.int64)[half_faces]
        local = half_faces - self.starts[cells]
        types = mesh.types[cells]
        own = table[types, 0, 0] < 0
        sizes = table[types, np.where(own, 0, local), 0].astype(np.int64)
        first = np.zeros(len(half_faces), np.int64)
        poly = mesh.polyhedra
        if poly is not None and own.any():
            at = np.asarray(poly.cell_offsets, np.int64)[cells[own]] + local[own]
            faces = np.asarray(poly.cell_faces, np.int64)[at]
            first[own] = np.asarray(poly.face_offsets, np.int64)[faces]
            sizes[own] = np.asarray(poly.face_offsets, np.int64)[faces + 1] - first[own]
        offsets = np.zeros(len(half_faces) + 1, np.int64)
        np.cumsum(sizes, out=offsets[1:])
        owner = np.repeat(np.arange(len(half_faces)), sizes)
        place = np.arange(int(offsets[-1])) - offsets[owner]
        points: IndexArray = np.empty(len(owner), width)
        standard = ~own[owner]
        at = owner[standard]
        node = table[types[at], local[at], place[standard] + 1].astype(np.int64)
        points[standard] = mesh.connectivity[np.asarray(mesh.offsets, np.int64)[cells[at]] + node]
        if poly is not None and own.any():
            points[~standard] = np.asarray(poly.face_points)[ragged_positions(first[own], sizes[own])]
        return points, offsets

    def __repr__(self) -> str:
        return (
            f"<Topology of {self.mesh.n_cells} cells: {self.n_interior} interior faces, {self.n_boundary} boundary, "
            f"{self.n_multiple} of three or more cells>"
        )


def topology(mesh: Mesh, *, points: IndexArray | None = None) -> Topology:
    """Match the faces of the solid cells of a mesh.

    Parameters
    ----------
    mesh
        Of any cells; those that are not solid have no faces here.
    points
        ``(n_points,)`` the point that stands for each point, to match faces across points that coincide; None: each for
        itself.
    """
    if mesh.polyhedra is not None and mesh.polyhedra.flipped is not None:
        mesh = mesh.replace(polyhedra=mesh.polyhedra.with_own_faces())
    table = face_table()
    n_faces = numbers_of_faces(mesh)
    starts = np.zeros(mesh.n_cells + 1, np.int64)
    np.cumsum(n_faces, out=starts[1:])
    width = driver.index_type(max(int(starts[-1]), mesh.n_points))
    cells: IndexArray = np.repeat(np.arange(mesh.n_cells, dtype=width), n_faces)
    nodes = mesh.connectivity
    if points is not None:
        nodes = points.astype(nodes.dtype)[nodes]  # kernels are compiled for each dtype
    poly, longest = faces_of_polyhedra(mesh, points)
    longest = max(longest, table.shape[2] - 1)
    mates, windings, n_multiple = driver.match(
        cells, starts, mesh.types, mesh.offsets, nodes, table, poly, longest, mesh.n_points
    )
    return Topology(mesh, read_only(starts), read_only(cells), read_only(mates), read_only(windings), n_multiple)


@cache
def face_table() -> NDArray[np.int8]:
    """``(256, most_faces, most_nodes + 1)``: for each type and face the number of nodes, then their positions.

    The number is 0 where there is no face, and that of the first face -1 for polyhedra, whose faces are their own.
    """
    shapes = [row for row in CELL_TYPES.values() if row.shape is not None]
    most_faces = max(len(row.shape.faces) for row in shapes if row.shape)
    most_nodes = max(len(face) for row in shapes if row.shape for face in row.shape.faces)
    table = np.zeros((256, most_faces, most_nodes + 1), np.int8)
    for row in shapes:
        assert row.shape is not None
        for f, face in enumerate(row.shape.faces):
            table[row.vtk_id, f, : len(face) + 1] = (len(face), *(row.corners[m] for m in face))
    table[POLYHEDRON.vtk_id, 0, 0] = -1
    table.flags.writeable = False
    return table


def numbers_of_faces(mesh: Mesh) -> NDArray[np.int64]:
    """``(n_cells,)`` half-faces of each cell."""
    of_type = np.count_nonzero(face_table()[:, :, 0] > 0, axis=1)
    numbers: NDArray[np.int64] = of_type[mesh.types]
    if mesh.polyhedra is not None:
        is_poly = mesh.types == POLYHEDRON.vtk_id
        numbers[is_poly] = np.diff(mesh.polyhedra.cell_offsets)[is_poly]
    return numbers


def faces_of_polyhedra(mesh: Mesh, points: IndexArray | None = None) -> tuple[tuple[NDArray[np.int64], ...], int]:
    """The four arrays of the polyhedra, as kernels take them, and the most points of a face; ``points`` as for
    `topology`."""
    poly = mesh.polyhedra
    if poly is None:
        none = read_only(np.zeros(1, np.int64))
        return (none, none, none, none), 0
    of_faces = poly.face_points if points is None else points[poly.face_points]
    arrays = (poly.cell_offsets, poly.cell_faces, poly.face_offsets, of_faces)
    longest = int(np.diff(poly.face_offsets).max(initial=0))
    return tuple(read_only(np.ascontiguousarray(array, np.int64)) for array in arrays), longest
