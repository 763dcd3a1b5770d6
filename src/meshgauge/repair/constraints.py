"""Which cells take part in an improvement, and which points must stay where they are, and why."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..cells import CELL_TYPES, IS_SOLID
from ..doctor import points as coincidence
from ..errors import MeshError
from ..mesh import Mesh
from ..mesh.regions import regions
from ..mesh.topology import MULTIPLE, Topology, topology
from ..quality.measure import Quality
from ..quality.polyhedra import PolyhedralQuality
from ..status import Status
from .curved import can_follow
from .faces import face_points, mask_of

Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Constraints:
    """What an improvement may touch. Arrays are of the whole mesh.

    Attributes
    ----------
    quality
        Of the mesh as it is.
    topology
        Its faces.
    cells
        ``(n_cells,)`` cells that take part: solid, measured, with coordinates that are finite.
    boundary
        ``(n_points,)`` points of the boundary, and of faces that three cells or more have.
    interface
        ``(n_points,)`` points of faces between regions, or of surface and line cells inside.
    pinned
        ``(n_points,)`` points that never move: asked for by the user, coinciding ones, those of cells that take no
        part.
    notes
        Notes for the report, a sentence each.
    """

    quality: Quality
    topology: Topology
    cells: Mask
    boundary: Mask
    interface: Mask
    pinned: Mask
    region_ids: NDArray[np.int64]
    notes: tuple[str, ...]

    @property
    def fixed(self) -> Mask:
        """``(n_points,)`` points that do not move as long as the boundary is fixed."""
        return self.boundary | self.interface | self.pinned


def constraints_of(mesh: Mesh, quality: Quality, fixed: ArrayLike | None) -> Constraints:
    """Find out what may move.

    Parameters
    ----------
    mesh, quality
        The mesh and what was measured on it.
    fixed
        Further points that must not move: a mask ``(n_points,)``, or ids.

    Raises
    ------
    MeshError
        If the mask or the ids do not fit the mesh.
    """
    faces = topology(mesh)
    notes: list[str] = []
    n = mesh.n_points
    is_solid = IS_SOLID[mesh.types]
    takes_part = is_solid & ~np.isin(quality.status, (Status.NON_FINITE, Status.UNSUPPORTED, Status.BROKEN))
    can = np.array(
        [(r := CELL_TYPES.get(t)) is not None and r.shape is not None and can_follow(r) for t in range(256)]
    )[mesh.types]
    if quality.polyhedra is not None:
        can[can_move(quality.polyhedra)] = True
    takes_part &= can
    left = int(np.count_nonzero(is_solid & ~takes_part))
    pinned = _asked(fixed, n)
    if left:
        pinned |= mask_of(n, mesh.connectivity[np.repeat(~takes_part & is_solid, np.diff(mesh.offsets))])
        notes.append(
            f"{left:,} solid cells take no part (of high order, with hanging nodes, not measured): their points stay."
        )

    alone = np.flatnonzero(faces.mates < 0)
    boundary = mask_of(n, face_points(faces, alone)[0])
    n_multiple = int(np.count_nonzero(faces.mates == MULTIPLE))
    if n_multiple:
        notes.append(f"{faces.n_multiple:,} faces belong to three cells or more: their points stay like the boundary.")

    region_ids, _ = regions(mesh)
    pairs = faces.pairs()
    between = region_ids[faces.cells[pairs[:, 0]]] != region_ids[faces.cells[pairs[:, 1]]]
    interface = mask_of(n, face_points(faces, pairs[between, 0])[0]) & ~boundary
    if between.any():
        notes.append(f"{int(between.sum()):,} faces between regions are kept where they are.")
    embedded = mask_of(n, mesh.connectivity[np.repeat(~is_solid, np.diff(mesh.offsets))]) & ~boundary
    used = mask_of(n, mesh.connectivity[np.repeat(takes_part, np.diff(mesh.offsets))])
    n_embedded = int(np.count_nonzero(embedded & used & ~interface))
    if n_embedded:
        notes.append(f"{n_embedded:,} points inside belong to surface, line or vertex cells and stay.")
    interface |= embedded

    representative = coincidence.representatives(mesh.points)
    twice = coincidence.duplicates(representative, used)
    if len(twice):
        pinned |= mask_of(n, np.concatenate([twice, np.asarray(representative, np.int64)[twice]]))
        notes.append(f"{len(twice):,} points coincide with another: parts that touch there stay together, unmoved.")
    return Constraints(quality, faces, takes_part, boundary, interface, pinned, region_ids, tuple(notes))


def can_move(measured: PolyhedralQuality) -> NDArray[np.int64]:
    """Ids of the polyhedra that have a value and no hanging node."""
    return measured.cells[~measured.has_hanging & ~np.isnan(measured.values)]


def _asked(fixed: ArrayLike | None, n: int) -> Mask:
    if fixed is None:
        return np.zeros(n, bool)
    array = np.asarray(fixed)
    if array.dtype.kind == "b":
        if array.shape != (n,):
            raise MeshError(f"the mask of fixed points has shape {array.shape}, expected ({n},)")
        return array.copy()
    if array.dtype.kind not in "iu" or array.ndim != 1:
        raise MeshError(f"fixed points have shape {array.shape} and dtype {array.dtype}, expected a mask or ids")
    if len(array) and (int(array.min()) < 0 or int(array.max()) >= n):
        raise MeshError(f"a fixed point's id is outside 0..{n - 1}")
    return mask_of(n, array.astype(np.int64))
