"""What there is to draw of a mesh: all of its cells, or those of a mesh not in memory that a page has room for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...doctor.joined import Joined
from ...doctor.points import TOLERANCE
from ...mesh import Mesh
from ...mesh.ghosts import without_ghosts
from ...mesh.topology import topology
from . import surface
from .frame import Frame
from .page_cells import Ids, drawable

if TYPE_CHECKING:
    from ...quality.measure import Quality

TRIANGLES = 400_000
"""Triangles of a surface from which it is made coarser."""


@dataclass(frozen=True, eq=False)
class Skin:
    """The surface of a mesh.

    Attributes
    ----------
    n_triangles
        Of the mesh.
    polygons, points
        Faces, and ``(n, 3)`` where their points are; the cells are positions among those of the picture. None for a
        surface that was only seen to be made coarser.
    coarse
        Points in the frame and triangles of a surface of more than `TRIANGLES`, see `surface.Boxes`.
    """

    n_triangles: int
    polygons: surface.Polygons | None
    points: NDArray[Any]
    coarse: tuple[NDArray[np.float64], Ids] | None = None

    @classmethod
    def of(cls, polygons: surface.Polygons, points: NDArray[Any], frame: Frame) -> Skin:
        """That of faces, by ids of points ``(n, 3)``."""
        n = polygons.n_triangles
        if n <= TRIANGLES:
            return cls(n, polygons, points)
        return cls(n, None, points[:0], coarse_of(polygons, points, frame).surface())


def coarse_of(
    polygons: surface.Polygons, points: NDArray[Any], frame: Frame, before: surface.Boxes | None = None
) -> surface.Boxes:
    """Faces gathered in boxes, with those that were ``before``."""
    boxes = before or surface.Boxes(surface.finest(TRIANGLES))
    used, local = np.unique(polygons.points, return_inverse=True)
    own = surface.Polygons(polygons.offsets, local.reshape(-1), polygons.cells)
    boxes.take(frame.shown(points[used]), surface.triangles(own))
    return boxes


@dataclass(frozen=True, eq=False)
class Picture:
    """What is drawn.

    Attributes
    ----------
    quality
        Of cells of the mesh.
    can_be_drawn
        ``(n,)`` those of these that may be shown as cells.
    n_drawn
        Cells of the mesh that can be drawn.
    regions, names
        The region of each of these cells; names of all regions.
    frame
        In which the mesh is placed.
    skin
        The surface.
    cells, points
        Ids in the mesh of the cells and points of ``quality``, ascending; None: it is of all.
    """

    quality: Quality
    can_be_drawn: NDArray[np.bool_]
    n_drawn: int
    regions: Ids
    names: tuple[str, ...]
    frame: Frame
    skin: Skin
    cells: Ids | None = None
    points: Ids | None = None

    @classmethod
    def of(
        cls,
        quality: Quality,
        regions: Ids,
        names: tuple[str, ...],
        *,
        can_be_drawn: NDArray[np.bool_] | None = None,
        frame: Frame,
    ) -> Picture:
        """That of a mesh in memory; ``can_be_drawn``: another choice than `drawable`."""
        mesh = quality.mesh
        chosen = drawable(quality) if can_be_drawn is None else can_be_drawn
        faces = surface.of_surfaces(mesh) if mesh.dimension == 2 else surface.boundary(topology(_as_diagnosed(mesh)))
        skin = Skin.of(faces, mesh.points, frame)
        return cls(quality, chosen, int(np.count_nonzero(chosen)), regions, names, frame, skin)

    def cell(self, at: int) -> int:
        """The id in the mesh of a cell."""
        return at if self.cells is None else int(self.cells[at])

    def point(self, at: int) -> int:
        """The id in the mesh of a point."""
        return at if self.points is None else int(self.points[at])

    def at(self, cells: Ids) -> Ids:
        """Where some cells of the mesh stand, which are there."""
        return cells if self.cells is None else np.asarray(np.searchsorted(self.cells, cells), np.int64)

    def named(self, arrays: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
        """Arrays of the page with the ids of the mesh."""
        known = {"id": self.cells, "surfaceCell": self.cells, "point": self.points}
        return {
            name: array if (ids := known.get(name)) is None else ids[array].astype(array.dtype)
            for name, array in arrays.items()
        }


def _as_diagnosed(mesh: Mesh) -> Mesh:
    """The mesh whose surface shows: ghosts are not looked at, and where parts meet is none."""
    mesh = without_ghosts(mesh)
    return Joined.of_mesh(mesh, TOLERANCE).on(mesh) if mesh.parts else mesh
