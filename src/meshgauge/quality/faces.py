"""Measures of finite volumes: of each face between two cells or on the boundary, and the worst of each cell's faces.

The formulas are those of the field, as OpenFOAM's checkMesh (``primitiveMesh``, v1912) computes them: a face is cut
into triangles about the mean of its points, a cell into pyramids on its faces about the mean of their centres.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..kernels.finite_volume import driver
from ..kernels.finite_volume.numpy_path import dot, norm
from ..mesh import Mesh
from ..mesh.labels import cell_label
from ..mesh.regions import regions
from ..mesh.topology import COLLAPSED, Topology, topology
from ..surface_cells import IS_SURFACE

Ids = NDArray[np.int64]
Values = NDArray[np.float64]

NONE = -1
"""The neighbour of a face of the boundary."""

AT_LEAST, AT_LEAST_OUTSIDE = 0.2, 0.4
"""Shares of the distance of the centres that a face counts at least as wide for its skewness; outside twice as much,
since the distance is half."""


@dataclass(frozen=True, slots=True)
class WorstFace:
    """A face, and the cells beside it."""

    measure: str
    value: float
    owner: int
    neighbour: int | None  #: None: a face of the boundary
    owner_label: int | None  #: the cells' numbers in the file, if it has some
    neighbour_label: int | None
    patch: str | None  #: name of the part of the boundary, if the mesh names them
    points: tuple[int, ...]  #: in their order around the face, outward from the owner
    centre: tuple[float, float, float]


class FaceQuality:
    """Faces of a mesh's solid cells, and what finite volumes ask of them. Arrays are read-only.

    Attributes
    ----------
    topology
        Of the mesh: half-faces and their mates.
    half_faces
        ``(n_faces,)`` the half-face of the owner.
    owner, neighbour
        ``(n_faces,)`` the cells beside each face; the neighbour is -1 on the boundary. A face that three cells have is
        one of the boundary of each.
    centres, areas
        ``(n_faces, 3)`` centre, and area vector out of the owner. [length, length²]
    cell_centres, volumes
        ``(n_cells, 3)`` and ``(n_cells,)``; 0 for cells that are not solid. [length, length³]
    """

    def __init__(self, mesh: Mesh, threads: int | None = None) -> None:
        self.topology: Topology = topology(mesh)
        self.threads = threads
        cells, mates = (np.asarray(ids, np.int64) for ids in (self.topology.cells, self.topology.mates))
        is_first = (mates < 0) | (mates > np.arange(len(mates)))
        self.half_faces: Ids = np.flatnonzero(is_first & (mates != COLLAPSED))
        self.owner: Ids = cells[self.half_faces]
        mate = mates[self.half_faces]
        self.neighbour: Ids = np.full(len(mate), NONE)
        self.neighbour[mate >= 0] = cells[mate[mate >= 0]]
        self.points, self.offsets = self.topology.face_points(self.half_faces)
        self._x = np.ascontiguousarray(self.mesh.points, np.float64)
        self.centres, self.areas, self._triangle_areas = driver.polygons(self._x, self.points, self.offsets, threads)
        with np.errstate(all="ignore"):
            self._measure_cells()

    @property
    def mesh(self) -> Mesh:
        return self.topology.mesh

    @property
    def n_faces(self) -> int:
        return len(self.owner)

    @property
    def is_inner(self) -> NDArray[np.bool_]:
        """``(n_faces,)`` True for a face between two cells."""
        return np.asarray(self.neighbour >= 0)

    # Each measure by face; NaN where it is not defined.

    @cached_property
    def non_orthogonality(self) -> Values:
        """``(n_faces,)`` angle between the line of the two centres and the face's normal; inner faces. [degree]"""
        d = self._between
        with np.errstate(all="ignore"):
            cosine = dot(d, self.areas) / (norm(d) * norm(self.areas))
        angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
        return self._of_inner(np.where(np.isnan(cosine) & ~self._is_lost, 180.0, angle))

    @cached_property
    def skewness(self) -> Values:
        """``(n_faces,)`` how far the line of the two centres pierces an inner face off its centre, over the larger of
        .2 of the line and the extent of the face that way. [1]"""
        return self._of_inner(self._skewness(self._between, AT_LEAST))

    @cached_property
    def boundary_skewness(self) -> Values:
        """``(n_faces,)`` the same of faces of the boundary, for the line from the cell's centre at right angles to the
        face, and .4 of it. [1]"""
        with np.errstate(all="ignore"):
            normal = self.areas / norm(self.areas)[:, None]
            d = normal * dot(normal, self.centres - self.cell_centres[self.owner])[:, None]
        return np.where(self.is_inner, np.nan, self._skewness(d, AT_LEAST_OUTSIDE))

    @cached_property
    def face_weight(self) -> Values:
        """``(n_faces,)`` smaller share of the distance of the two centres from the plane of an inner face. [0, 0.5]"""
        own = np.abs(dot(self.areas, self.centres - self.cell_centres[self.owner]))
        other = np.abs(dot(self.areas, self.cell_centres[self.neighbour] - self.centres))
        return self._of_inner(_share(np.minimum(own, other), own + other))

    @cached_property
    def volume_ratio(self) -> Values:
        """``(n_faces,)`` smaller over larger volume of the two cells of an inner face. [0, 1]"""
        own, other = np.abs(self.volumes[self.owner]), np.abs(self.volumes[self.neighbour])
        return self._of_inner(_share(np.minimum(own, other), np.maximum(own, other)))

    @cached_property
    def flatness(self) -> Values:
        """``(n_faces,)`` length of the area vector of a face of four points or more over the sum of the areas of its
        triangles about its centre; 1: flat. [0, 1]"""
        flat = _share(norm(self.areas), self._triangle_areas)
        return np.where(np.diff(self.offsets) == 3, np.nan, np.minimum(flat, 1.0))

    @cached_property
    def pyramid_volume(self) -> Values:
        """``(n_faces,)`` smaller of the volumes of the pyramids from the face to the centres of its cells. [length³]"""
        own = self._pyramids(self.owner)
        return np.where(self.is_inner, np.minimum(own, -self._pyramids(self.neighbour)), own)

    # Measures of cells.

    @cached_property
    def aspect_ratio(self) -> Values:
        """``(n_cells,)`` the larger of: largest over smallest of the areas of a cell's faces seen along x, y and z; a
        sixth of their sum over volume^(2/3). At least 1, of a cube 1. [1]"""
        seen = self._sum_by_cell(np.abs(self.areas), np.abs(self.areas))
        with np.errstate(all="ignore"):
            spread = seen.max(axis=1) / seen.min(axis=1)
            compact = seen.sum(axis=1) / 6.0 / np.abs(self.volumes) ** (2.0 / 3.0)
        worst = np.maximum(np.maximum(spread, compact), 1.0)
        return np.where(np.isnan(worst) & np.isfinite(seen).all(axis=1), np.inf, worst)

    @cached_property
    def determinant(self) -> Values:
        """``(n_cells,)`` determinant of the sum of S Sᵀ over a cell's inner faces, in units of their mean area, over 8:
        how well gradients are determined; of a cube 1, 0 if it has no inner face. [1]"""
        area = np.where(self.is_inner, norm(self.areas), 0.0)
        one = np.where(self.is_inner, 1.0, 0.0)
        n_inner = self._sum_by_cell(one, one)
        total = self._sum_by_cell(area, area)
        s = np.where(self.is_inner[:, None], self.areas, 0.0)
        with np.errstate(all="ignore"):
            unit = (total / n_inner) ** 2
            xx, yy, zz, xy, yz, zx = (
                self._sum_by_cell(product, product) / unit
                for product in (s[:, i] * s[:, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)))
            )
        found = np.abs(xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * zx) + zx * (xy * yz - yy * zx)) / 8.0
        return np.where((n_inner == 0.0) | (total == 0.0), 0.0, found)

    # From faces to cells.

    def largest(self, values: Values, without: float) -> Values:
        """``(n_cells,)`` the largest value of each cell's faces, NaN apart; ``without``: of a cell with none."""
        return self._reduce(np.maximum, values, -np.inf, without)

    def least(self, values: Values, without: float) -> Values:
        """``(n_cells,)`` the least value of each cell's faces, NaN apart; ``without``: of a cell with none."""
        return self._reduce(np.minimum, values, np.inf, without)

    def worst(self, measure: str, n: int = 5, *, highest: bool) -> list[WorstFace]:
        """The n faces with the highest or the lowest values of a measure, the worst first."""
        values = getattr(self, measure)
        order = np.where(np.isnan(values), -np.inf, values if highest else -values)
        n = min(n, int(np.count_nonzero(~np.isnan(values))))
        if n <= 0:
            return []
        at = np.argpartition(-order, n - 1)[:n] if n < len(order) else np.arange(len(order))
        at = at[np.lexsort((at, -order[at]))][:n]
        patches = self._patches(at)
        return [self._worst_face(measure, int(face), float(values[face]), patches[k]) for k, face in enumerate(at)]

    def _worst_face(self, measure: str, face: int, value: float, patch: str | None) -> WorstFace:
        owner, neighbour = int(self.owner[face]), int(self.neighbour[face])
        x, y, z = (float(v) for v in self.centres[face])
        return WorstFace(
            measure=measure,
            value=value,
            owner=owner,
            neighbour=neighbour if neighbour >= 0 else None,
            owner_label=cell_label(self.mesh, owner),
            neighbour_label=cell_label(self.mesh, neighbour) if neighbour >= 0 else None,
            patch=patch,
            points=tuple(self.points[self.offsets[face] : self.offsets[face + 1]].tolist()),
            centre=(x, y, z),
        )

    def _patches(self, faces: Ids) -> list[str | None]:
        """The name of the region of the surface cell that lies on each face, None inside and where there is none."""
        mesh = self.mesh
        outer = [face for face in faces.tolist() if self.neighbour[face] < 0]
        wanted = {frozenset(self.points[self.offsets[face] : self.offsets[face + 1]].tolist()): face for face in outer}
        surface = np.flatnonzero(IS_SURFACE[mesh.types])
        names: dict[int, str] = {}
        if wanted and len(surface):
            near = np.zeros(mesh.n_points, np.bool_)
            near[list(frozenset().union(*wanted))] = True
            first = mesh.connectivity[np.asarray(mesh.offsets, np.int64)[surface]]
            ids, regions_named = regions(mesh)
            for cell in surface[near[first]].tolist():
                face = wanted.get(frozenset(mesh.nodes(cell).tolist()))
                if face is not None:
                    names[face] = regions_named[int(ids[cell])]
        return [names.get(face) for face in faces.tolist()]

    # Geometry.

    @cached_property
    def _is_lost(self) -> NDArray[np.bool_]:
        """``(n_faces,)`` True where a coordinate of the face or of a cell beside it is not finite."""
        rest = np.where(self.is_inner[:, None], self.cell_centres[self.neighbour], 0.0)
        known = (self.areas, self.centres, self.cell_centres[self.owner], rest)
        return np.asarray(~np.logical_and.reduce([np.isfinite(array).all(axis=1) for array in known]))

    @cached_property
    def _between(self) -> Values:
        """``(n_faces, 3)`` from the owner's centre to the neighbour's; without meaning on the boundary."""
        return np.asarray(self.cell_centres[self.neighbour] - self.cell_centres[self.owner])

    def _of_inner(self, values: Values) -> Values:
        return np.where(self.is_inner, values, np.nan)

    def _pyramids(self, cells: Ids) -> Values:
        """``(n_faces,)`` volume of the pyramid from each face to the centre of a cell, positive out of it."""
        return dot(self.areas, self.centres - self.cell_centres[cells]) / 3.0

    def _measure_cells(self) -> None:
        n = self.mesh.n_cells
        counts = self._sum_by_cell(np.ones(self.n_faces), np.ones(self.n_faces))
        about = self._sum_by_cell(self.centres, self.centres) / np.maximum(counts, 1.0)[:, None]
        inner = self.neighbour

        def pyramids(cells: Ids, sign: float) -> tuple[Values, Values]:
            three = sign * dot(self.areas, self.centres - about[cells])
            return three, three[:, None] * (0.75 * self.centres + 0.25 * about[cells])

        own, other = pyramids(self.owner, 1.0), pyramids(inner, -1.0)
        three = self._sum_by_cell(own[0], other[0])
        moments = self._sum_by_cell(own[1], other[1])
        centres = np.where(np.abs(three)[:, None] > 0.0, moments / three[:, None], about)
        self.cell_centres, self.volumes = centres.reshape(n, 3), three / 3.0

    def _skewness(self, d: Values, least: float) -> Values:
        """Of every face, for a line ``d`` from the owner's centre through the face."""
        starts = self.cell_centres[self.owner]
        values = driver.skewness(
            self._x, self.points, self.offsets, self.centres, self.areas, starts, d, least, self.threads
        )
        return np.where(self._is_lost, np.nan, values)

    def _sum_by_cell(self, of_owner: Values, of_neighbour: Values) -> Values:
        """``(n_cells, ...)`` sums over the faces of each cell of what they are for their owner and neighbour."""
        n, inner = self.mesh.n_cells, np.flatnonzero(self.is_inner)
        other = self.neighbour[inner]

        def total(own: Values, far: Values) -> Values:
            return np.asarray(np.bincount(self.owner, own, n) + np.bincount(other, far[inner], n))

        if of_owner.ndim == 1:
            return total(of_owner, of_neighbour)
        return np.stack([total(own, far) for own, far in zip(of_owner.T, of_neighbour.T, strict=True)], axis=1)

    def _reduce(self, combine: Any, values: Values, start: float, without: float) -> Values:
        """NaN where a face could not be measured; faces for which the measure is not defined are left out."""
        known = np.where(self._is_lost, np.nan, np.where(np.isnan(values), start, values))
        out = np.full(self.mesh.n_cells, start)
        inner = self.is_inner
        with np.errstate(invalid="ignore"):
            combine.at(out, self.owner, known)
            combine.at(out, self.neighbour[inner], known[inner])
        return np.where(out == start, without, out)


def _share(part: Values, whole: Values) -> Values:
    """``part / whole``, 0 where both are 0."""
    with np.errstate(all="ignore"):
        return np.where(whole == 0.0, 0.0, part / whole)
