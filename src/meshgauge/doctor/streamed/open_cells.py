"""What the diagnosis of a mesh needs to know of one of its parts: the cells that others may say something about.

These are the cells with a face that no other cell of the part has, or that is not plainly right, and the few others
that `diagnose` looks at. Of all others no face can meet one of another part: it is enough to know how they hang
together, and a byte or two of each cell and point, most of which are the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ...files.zipped import Zipped
from ...look.records import brief
from ...mesh.mesh import Precision

Labels = Literal["none", "counted", "stored"]

GHOST, FLAT = 1, 2
"""What a cell that is kept may be: a ghost, of surfaces; a cohesive or gasket cell."""


@dataclass(frozen=True, eq=False)
class OpenCells:
    """The cells of a part that those of other parts may say something about, and what is known of its other cells.

    Cells, points and faces are counted from the first of the part.

    Attributes
    ----------
    first_cell, n_cells, first_point, n_points
        Of the file: the cells that are meant, and among which points theirs are.
    dimension, stored, has_ghosts
        As of `Source` and `Seen`.
    marks, types, parent, flags
        Of all cells, and of all points; see `marks_of`, `Matched` and `Seen`. A parent by faces of which one cell is
        not kept. Of surfaces, of which all cells are kept, parents and flags are none.
    cells, cell_types, sizes, nodes, kinds
        The cells that are kept: ids, types, nodes of each one after another and how many; `GHOST`, `FLAT` or 0.
    n_faces, face_sizes, face_points
        Of these the polyhedra: how many faces each has, how many points each face, and these.
    inside
        A bit for each face of these cells, eight to a byte: the cell beside is not kept.
    n_half_faces, n_collapsed
        Of cells that are not kept.
    groups, group_sizes
        Of the cells that are kept that of the groups that share points, from 1 on, 0 for none; solid cells of each.
    known, coordinates
        The points of which it is known where they are.
    inward
        Faces that point into their cell: number, lowest point and cell of each.
    n_all_faces
        Of polyhedra in the file, where it does not number them itself; else 0.
    parts, block_names, block_ends
        As of `Mesh`; where each block begins and ends.
    cell_labels, point_labels
        How the file numbers its cells and points.
    labelled, labels, of_known
        Cells whose numbers in the file are kept, these plus 1, and those of the known points; 0 for none.
    """

    first_cell: int
    n_cells: int
    first_point: int
    n_points: int
    dimension: int
    stored: Precision
    has_ghosts: bool
    marks: Zipped
    types: Zipped
    parent: Zipped
    flags: Zipped
    cells: Zipped
    cell_types: Zipped
    sizes: Zipped
    nodes: Zipped
    kinds: Zipped
    n_faces: Zipped
    face_sizes: Zipped
    face_points: Zipped
    inside: Zipped
    n_half_faces: int
    n_collapsed: int
    groups: Zipped
    group_sizes: Zipped
    known: Zipped
    coordinates: Zipped
    inward: tuple[Zipped, Zipped, Zipped]
    n_all_faces: int
    parts: tuple[int, ...]
    block_names: tuple[str, ...]
    block_ends: Zipped
    cell_labels: Labels
    point_labels: Labels
    labelled: Zipped
    labels: Zipped
    of_known: Zipped

    __repr__ = brief

    @property
    def n_bytes(self) -> int:
        """Of what is packed."""
        zipped = [one for one in vars(self).values() if isinstance(one, Zipped)]
        return sum(one.data.nbytes for one in (*zipped, *self.inward))

    @property
    def n_bytes_of_cells(self) -> int:
        """Of what is said to be packed of cells that are kept, once it is not packed any more."""
        of_all = (self.marks, self.types, self.parent, self.flags)
        zipped = [one for one in vars(self).values() if isinstance(one, Zipped) and one not in of_all]
        return 8 * sum(max(one.n, 0) for one in (*zipped, *self.inward))


@dataclass(frozen=True)
class PartOf:
    """What a source does not say of the part that it is; attributes as of `OpenCells`. ``has_all_points``: points that
    no cell of the part has belong to no cell at all."""

    first_cell: int = 0
    first_point: int = 0
    n_all_faces: int = 0
    parts: tuple[int, ...] = ()
    cell_labels: Labels = "none"
    point_labels: Labels = "none"
    has_all_points: bool = True
