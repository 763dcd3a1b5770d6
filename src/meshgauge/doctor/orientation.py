"""Cells that are numbered in reverse, told from cells that are really inverted.

In a mesh whose cells are numbered alike, the two cells of an interior face go round it in opposite directions. That is
a matter of numbering alone: moving points does not change it. A cell that is only *numbered* the other way goes round
its faces in the same direction as its neighbours; a cell that is *inverted* (tangled, folded over) goes round them as
it should. So numbering is decided by the faces, cell by cell through the mesh, up to one choice for each connected
part, which the sign of the volume inside the part's boundary decides.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..cells import BY_NAME, CELL_TYPES, IS_SOLID, type_name
from ..kernels.arrays import read_only
from ..kernels.topology import driver
from ..mesh import CellBlock, connectivity
from ..mesh.labels import cell_labels
from ..mesh.polyhedra import IndexArray
from ..mesh.topology import BOUNDARY, ELSEWHERE, SAME, Topology, topology
from ..quality import arrays
from ..quality.measure import Quality
from ..status import Purpose, Status, is_degenerate
from .points import extent
from .reversal import reversal

EXAMPLES = 5
"""Cell ids named in a finding."""


HAS_SHAPE = np.array([t in CELL_TYPES and CELL_TYPES[t].shape is not None for t in range(256)])
"""By VTK id: whether cells have a numbering that can be right or reversed."""


class Numbering(IntEnum):
    """How a cell is numbered, and what that says of an inverted one. Codes of `Orientation.numbering`."""

    RIGHT = 0  #: numbered as it should be, not inverted; or not a cell of which it can be told
    REVERSED = 1  #: numbered in reverse; a valid shape
    REVERSED_TANGLED = 2  #: numbered in reverse, and not valid when renumbered either
    TANGLED = 3  #: numbered as it should be, and inverted: renumbering does not repair it
    OVERLAPPING = 4  #: not inverted, but on the same side of a face as its neighbour
    UNDECIDED = 5  #: inverted, and the faces do not tell


@dataclass(frozen=True, slots=True)
class BlockOrientation:
    """The cells of one type in one block of the file, of which some are inverted or numbered in reverse."""

    block: str
    type: str
    n_cells: int
    n_reversed: int
    n_reversed_tangled: int
    n_tangled: int
    n_overlapping: int
    n_undecided: int
    cells: tuple[int, ...]  #: the first few that are not right
    text: str  #: one sentence
    labels: tuple[int | None, ...] = ()  #: the file's own numbers of `cells`; empty if it numbers none
    left: str = ""  #: as `text`, without the cells that renumbering sets right

    def to_dict(self) -> dict[str, Any]:
        """Plain data, for JSON."""
        return {
            "block": self.block,
            "type": self.type,
            "n_cells": self.n_cells,
            "n_reversed": self.n_reversed,
            "n_reversed_tangled": self.n_reversed_tangled,
            "n_tangled": self.n_tangled,
            "n_overlapping": self.n_overlapping,
            "n_undecided": self.n_undecided,
            "cells": list(self.cells),
            "labels": list(self.labels),
            "text": self.text,
        }


@dataclass(frozen=True, eq=False, repr=False)
class Orientation:
    """How the cells of a mesh are numbered.

    Attributes
    ----------
    numbering
        ``(n_cells,)`` uint8, codes of `Numbering`.
    is_left_handed
        Every solid cell is numbered in reverse: the file, or its coordinates, are mirrored.
    blocks
        Of each block and type that has cells that are not right, in file order.
    n_contradictions
        Interior faces whose two cells are numbered differently, by all other faces, than by this one.
    """

    numbering: NDArray[np.uint8]
    is_left_handed: bool
    blocks: tuple[BlockOrientation, ...]
    n_contradictions: int

    @property
    def reversed_cells(self) -> NDArray[np.int64]:
        """Ids of the cells that are numbered in reverse, valid once renumbered or not."""
        return np.flatnonzero((self.numbering == Numbering.REVERSED) | (self.numbering == Numbering.REVERSED_TANGLED))

    @property
    def n_reversed(self) -> int:
        return len(self.reversed_cells)

    @property
    def n_tangled(self) -> int:
        """Number of cells that are inverted, however they are numbered."""
        return int(np.isin(self.numbering, (Numbering.REVERSED_TANGLED, Numbering.TANGLED)).sum())

    @property
    def texts(self) -> tuple[str, ...]:
        """A sentence for each block and type that has something to say; empty if all is right."""
        return tuple(block.text for block in self.blocks)

    def to_dict(self) -> dict[str, Any]:
        """Plain data, for JSON."""
        return {
            "is_left_handed": self.is_left_handed,
            "n_reversed": self.n_reversed,
            "n_contradictions": self.n_contradictions,
            "blocks": [block.to_dict() for block in self.blocks],
        }

    def __repr__(self) -> str:
        counts = np.bincount(self.numbering, minlength=len(Numbering))
        counts_text = ", ".join(f"{n} {Numbering(code).name.lower()}" for code, n in enumerate(counts) if n)
        return f"<Orientation of {len(self.numbering)} cells: {counts_text or 'no cells'}>"


def orientation(
    quality: Quality,
    *,
    faces: Topology | None = None,
    points: IndexArray | None = None,
    ignored: IndexArray | None = None,
) -> Orientation:
    """Tell cells that are numbered in reverse from cells that are inverted.

    Parameters
    ----------
    quality
        Of the mesh.
    faces
        The mesh's topology, if it is at hand.
    points
        ``(n_points,)`` the point that stands for each where some coincide (`doctor.points.representatives`): boundary
        faces are then matched across points that coincide, as between the pieces of a parallel output. None: not.
    ignored
        Ids of cells that tell nothing about their neighbours, such as duplicates.

    Notes
    -----
    Polyhedra and cells that could not be measured are right, for want of anything to say; they connect no neighbours.
    """
    mesh = quality.mesh
    is_inverted = inverted(quality)
    faces = faces if faces is not None else topology(mesh)
    if not is_inverted.any() and not (faces.windings[faces.mates >= 0] == SAME).any():
        return all_right(mesh.n_cells)
    mates, windings = neighbours(faces, points, ignored)
    if not is_inverted.any() and not (windings[mates >= 0] == SAME).any():
        return all_right(mesh.n_cells)
    geometry = handedness(quality, np.flatnonzero(is_inverted))
    parent, sign, n_contradictions = driver.components_by_faces(faces.cells, mates, windings, geometry)
    votes = np.zeros(len(parent))
    np.add.at(votes, parent, sign * geometry)
    slots = outside(faces.cells, mates, windings, sign)
    volumes = np.zeros(len(parent))
    np.add.at(volumes, parent[faces.cells[slots]], sign[faces.cells[slots]] * fluxes(faces, slots, parent))
    part_sign, likely = part_signs(volumes, votes)
    measured = np.isfinite(quality.values) & has_shape(quality)
    numbering = numbering_of(sign * part_sign[parent], sign * likely[parent], geometry, is_inverted, measured)
    blocks = of_blocks(
        mesh.types, mesh.blocks, measured, numbering, mesh.purpose, lambda cells: cell_labels(mesh, cells)
    )
    return Orientation(read_only(numbering), is_left_handed(mesh.types, numbering), blocks, n_contradictions)


def has_shape(quality: Quality) -> NDArray[np.bool_]:
    """``(n_cells,)`` cells whose numbering can be right or reversed."""
    return np.asarray(HAS_SHAPE[quality.mesh.types])


def inverted(quality: Quality) -> NDArray[np.bool_]:
    """``(n_cells,)`` inverted cells whose numbering can be reversed."""
    return np.asarray((quality.status == Status.INVERTED) & has_shape(quality))


def numbering_of(
    handed: NDArray[np.int8],
    likely: NDArray[np.int8],
    geometry: NDArray[np.int8],
    is_inverted: NDArray[np.bool_],
    measured: NDArray[np.bool_],
) -> NDArray[np.uint8]:
    """``(n,)`` codes of `Numbering` of some cells, by their sign in their part, the likelier one, and their shape."""
    numbering = np.zeros(len(handed), np.uint8)
    numbering[(handed > 0) & is_inverted] = Numbering.TANGLED
    numbering[(handed < 0) & measured] = Numbering.REVERSED_TANGLED
    numbering[(handed < 0) & (geometry < 0)] = Numbering.REVERSED
    numbering[(likely < 0) & (geometry > 0)] = Numbering.OVERLAPPING
    numbering[(handed == 0) & is_inverted] = Numbering.UNDECIDED
    return numbering


def is_left_handed(types: NDArray[np.uint8], numbering: NDArray[np.uint8]) -> bool:
    """Whether every solid cell is numbered in reverse."""
    has_solid = False
    for start in range(0, len(types), connectivity.CHUNK):  # as a rule the first few say that it is not so
        solid = IS_SOLID[types[start : start + connectivity.CHUNK]]
        own = numbering[start : start + connectivity.CHUNK][solid]
        if not ((own == Numbering.REVERSED) | (own == Numbering.REVERSED_TANGLED)).all():
            return False
        has_solid = has_solid or len(own) > 0
    return has_solid


def all_right(n_cells: int) -> Orientation:
    """That of so many cells of which nothing is to be said."""
    return Orientation(read_only(np.zeros(n_cells, np.uint8)), False, (), 0)


def neighbours(
    faces: Topology, points: IndexArray | None, ignored: IndexArray | None
) -> tuple[IndexArray, NDArray[np.int8]]:
    """Mates and windings that tell about numbering: without polyhedra, across points that coincide."""
    mates, windings = faces.mates, faces.windings.copy()
    if points is not None and not np.array_equal(points, np.arange(len(points))):
        welded = topology(faces.mesh, points=points)
        joined = np.flatnonzero((mates == BOUNDARY) & (welded.mates >= 0))
        joined = joined[mates[welded.mates[joined]] == BOUNDARY]
        mates = mates.copy()
        mates[joined] = welded.mates[joined]
        windings[joined] = welded.windings[joined]
    tells = HAS_SHAPE[faces.mesh.types]
    if ignored is not None:
        tells[ignored] = False
    known = tells[faces.cells]
    windings[~known] = 0
    paired = np.flatnonzero(mates >= 0)
    windings[paired[~known[mates[paired]]]] = 0
    return mates, windings


def handedness(quality: Quality, inverted: NDArray[np.int64]) -> NDArray[np.int8]:
    """What the shape alone says: 1 for a valid cell, -1 for one that is valid when renumbered, else 0.

    A cell that is flat as far as its coordinates can tell says nothing; one that is concave, but star-shaped, is seen
    from inside.
    """
    mesh = quality.mesh
    is_right = (quality.values > 0.0) & ~is_degenerate(quality.status) | (quality.status == Status.CONCAVE)
    signs: NDArray[np.int8] = (is_right & HAS_SHAPE[mesh.types]).astype(np.int8)
    types = mesh.types[inverted]
    for vtk_id in np.unique(types):
        row = CELL_TYPES[int(vtk_id)]
        if row.shape is None:
            continue  # a polyhedron is measured with its faces turned outward: no numbering mends it
        if row.n_nodes is None:
            row = BY_NAME[row.shape.name]  # Lagrange and Bézier cells have their corners first
        order = reversal(row.vtk_id, row.n_nodes or 0)
        assert order is not None  # it is known for every type with a fixed number of nodes
        ids = inverted[types == vtk_id]
        first = np.asarray(mesh.offsets[ids], np.int64)[:, None]
        values = arrays.jens(mesh.points, mesh.connectivity[first + np.array(order)], row)
        signs[ids] = -(values > 0.0).astype(np.int8)
    return signs


def outside(
    cells: IndexArray, mates: IndexArray, windings: NDArray[np.int8], sign: NDArray[np.int8]
) -> NDArray[np.int64]:
    """The half-faces that do not lie between two cells which agree, by the ``(n_cells,)`` signs that they have."""
    paired = mates >= 0
    inside = mates == ELSEWHERE
    inside[paired] = windings[paired] * sign[cells[paired]] * sign[cells[mates[paired]]] > 0
    return np.flatnonzero(~inside)


def part_signs(volumes: NDArray[np.float64], votes: NDArray[np.float64]) -> tuple[NDArray[np.int8], NDArray[np.int8]]:
    """For each part: 1 if its first cell is numbered as it should be, -1 if in reverse, 0 if not known; and the same
    with the likelier one where it is not known.

    The signed volumes of a part's cells add up to the volume inside its boundary, however tangled its inside is. A part
    is said to be reversed only if that volume and most of the cells that have a handedness both say so.
    """
    out = np.zeros(len(votes), np.int8)
    out[volumes > 0] = 1
    out[(volumes < 0) & (votes < 0)] = -1
    out[~(volumes > 0) & (votes > 0) & ~(volumes < 0)] = 1  # a flat or not finite boundary
    return out, np.where(out != 0, out, np.where(votes < 0, -1, 1)).astype(np.int8)


def fluxes(faces: Topology, slots: NDArray[np.int64], parent: IndexArray) -> NDArray[np.float64]:
    """Three times the flux of x through each face, taken from the first point of the ``parent`` ``(n_cells,)`` of its
    cell; 0 where not finite.

    A polygon counts as the mean of its fans from each of its points, the same from both sides; for a quadrilateral that
    is exact for the bilinear surface.
    """
    mesh = faces.mesh
    out = np.zeros(len(slots))
    x = mesh.points
    cells = faces.cells[slots].astype(np.int64)
    local = slots - faces.starts[cells]
    types = mesh.types[cells]
    starts = mesh.offsets[:-1].astype(np.int64)
    _, size = extent(x)
    with np.errstate(all="ignore"):
        for vtk_id in np.unique(types):
            row = CELL_TYPES[int(vtk_id)]
            if row.shape is None:
                continue
            for f, face in enumerate(row.shape.faces):
                at = np.flatnonzero((types == vtk_id) & (local == f))
                first = starts[cells[at]]
                base = x[mesh.connectivity[starts[parent[cells[at]]]]].astype(np.float64)
                nodes = mesh.connectivity[first[:, None] + [row.corners[m] for m in face]]
                d = (x[nodes].astype(np.float64) - base[:, None]) / size
                n = len(face)
                for m in range(n):
                    u, rest = d[:, m], [d[:, (m + k) % n] for k in range(1, n)]
                    for v, w in pairwise(rest):
                        out[at] += np.einsum("ij,ij->i", u, np.cross(v, w)) / n
    out[~np.isfinite(out)] = 0.0
    return out


def counts_of(types: NDArray[np.uint8], which: NDArray[np.bool_] | None = None) -> NDArray[np.int64]:
    """``(256,)`` cells of each type, or of some; some at a time, since counting takes eight bytes for each."""
    counts = np.zeros(256, np.int64)
    for start in range(0, len(types), connectivity.CHUNK):
        own = types[start : start + connectivity.CHUNK]
        counts += np.bincount(own if which is None else own[which[start : start + connectivity.CHUNK]], minlength=256)
    return counts


def of_blocks(
    types: NDArray[np.uint8],
    blocks: Sequence[CellBlock],
    measured: NDArray[np.bool_],
    numbering: NDArray[np.uint8],
    purpose: Purpose,
    labels: Callable[[list[int]], tuple[int | None, ...]],
) -> tuple[BlockOrientation, ...]:
    """What is to be said, by block and type; blocks of one name together, for some readers make one of every run.

    Parameters
    ----------
    types, measured, numbering
        ``(n_cells,)`` VTK ids; cells that have a value and a shape; codes of `Numbering`.
    blocks, purpose
        Of the mesh.
    labels
        The file's own numbers of some cells.
    """
    names = list(dict.fromkeys(block.name for block in blocks))
    marked = np.flatnonzero(numbering)
    rows = (CELL_TYPES.get(vtk_id) for vtk_id in np.flatnonzero(counts_of(types)).tolist())
    solid = [row for row in rows if row is None or row.dimension == 3]
    # Where all are wedges, it is their order that is the other one.
    is_mirrored = is_left_handed(types, numbering) and any(
        row is None or row.shape is None or not row.shape.other_order for row in solid
    )
    block_of = np.zeros(len(marked), np.int64)
    for block in blocks:
        low, high = np.searchsorted(marked, (block.start, block.stop))
        block_of[low:high] = names.index(block.name)
    made = []
    for b in np.unique(block_of):
        name = names[b]
        in_block = marked[block_of == b]
        for vtk_id in np.unique(types[in_block]):
            cells = in_block[types[in_block] == vtk_id]
            n_cells = sum(
                int(counts_of(types[s.start : s.stop], measured[s.start : s.stop])[vtk_id])
                for s in blocks
                if s.name == name
            )
            counts = np.bincount(numbering[cells], minlength=len(Numbering)).tolist()
            others = [0 if n in (Numbering.REVERSED, Numbering.REVERSED_TANGLED) else c for n, c in enumerate(counts)]
            kind = type_name(int(vtk_id))
            where = f" of block {name!r}" if len(names) > 1 and name not in ("", kind) else ""
            made.append(
                BlockOrientation(
                    block=name,
                    type=kind,
                    n_cells=n_cells,
                    n_reversed=counts[Numbering.REVERSED],
                    n_reversed_tangled=counts[Numbering.REVERSED_TANGLED],
                    n_tangled=counts[Numbering.TANGLED],
                    n_overlapping=counts[Numbering.OVERLAPPING],
                    n_undecided=counts[Numbering.UNDECIDED],
                    cells=tuple(cells[:EXAMPLES].tolist()),
                    labels=labels(cells[:EXAMPLES].tolist()),
                    text=_sentence(int(vtk_id), n_cells, counts, where, is_mirrored, purpose),
                    left=_sentence(int(vtk_id), n_cells, others, where, is_mirrored, purpose),
                )
            )
    return tuple(made)


_REMEDIES: dict[Purpose, str] = {
    "fem": "run `meshgauge orient`",
    "fv": "where a file gives cells by faces, all of theirs point inward and have to be turned there; else run "
    "`meshgauge orient`",
}


def _sentence(vtk_id: int, n_cells: int, counts: list[int], where: str, is_mirrored: bool, purpose: Purpose) -> str:
    kind = type_name(vtk_id)
    clauses: list[str] = []

    def clause(code: Numbering, one: str, several: str) -> None:
        n = counts[code]
        if not n:
            return
        if clauses:
            clauses.append(f"{n:,} {one if n == 1 else several}")
        elif n == n_cells:
            clauses.append(f"the one {kind}{where} {one}" if n == 1 else f"all {n:,} {kind} cells{where} {several}")
        else:
            clauses.append(f"{n:,} of {n_cells:,} {kind} cells{where} {one if n == 1 else several}")

    why = _custom(vtk_id, n_cells, counts[Numbering.REVERSED], is_mirrored)
    end = f"numbered in reverse{why}, with valid shapes: {_REMEDIES[purpose]}"
    clause(Numbering.REVERSED, f"is {end}", f"are {end}")
    end = "numbered in reverse and inverted besides, so that `meshgauge orient` repairs only the numbering"
    clause(Numbering.REVERSED_TANGLED, f"is {end}", f"are {end}")
    clause(
        Numbering.TANGLED,
        "is really inverted: it is numbered like its neighbours, and renumbering does not repair it",
        "are really inverted: they are numbered like their neighbours, and renumbering does not repair them",
    )
    clause(
        Numbering.OVERLAPPING,
        "has a valid shape but lies on the same side of a face as its neighbour",
        "have valid shapes but lie on the same side of a face as a neighbour",
    )
    end = "inverted, and its faces do not tell whether by numbering or by shape"
    clause(Numbering.UNDECIDED, f"is {end}", f"are {end.replace('its', 'their')}")
    return "; ".join(clauses)


def _custom(vtk_id: int, n_cells: int, n_reversed: int, is_mirrored: bool) -> str:
    """Who numbers cells so, if it is known."""
    shape = CELL_TYPES[vtk_id].shape
    if is_mirrored:
        return ", as is every cell of this mesh (a left-handed or mirrored file)"
    if shape is not None and shape.other_order and n_reversed == n_cells:
        return f", {shape.other_order}"
    return ""
