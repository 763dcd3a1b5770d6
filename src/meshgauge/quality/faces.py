"""Measures of finite volumes: of each face between two cells or on the boundary, and the worst of each cell's faces.

The formulas are those of the field, as OpenFOAM's checkMesh (``primitiveMesh``, v1912) computes them: a face is cut
into triangles about the mean of its points, a cell into pyramids on its faces about the mean of their centres.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..files.resources import give_back
from ..kernels.arrays import read_only
from ..kernels.finite_volume import driver
from ..kernels.path import is_compiled
from ..look import style
from ..look.names import cell_entry
from ..mesh import Mesh
from ..mesh.labels import cell_label
from ..mesh.regions import regions
from ..mesh.topology import COLLAPSED, Topology, topology
from ..surface_cells import IS_SURFACE

Ids = NDArray[np.signedinteger]
Values = NDArray[np.float64]

NONE = -1
"""The neighbour of a face of the boundary."""

AT_LEAST, AT_LEAST_OUTSIDE = 0.2, 0.4
"""Shares of the distance of the centres that a face counts at least as wide for its skewness; outside twice as much,
since the distance is half."""

ALONG = 1e-6
"""The share of its area that a face shows along an axis, if it looks that way at all; less is rounding."""

_BLOCK = 1 << 12
"""Faces of which one is looked at first where the worst are sought."""


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

    @property
    def name(self) -> str:
        """A face by its cells: ``cells 12, 40`` or ``cell 7, inlet``."""
        owner = cell_entry(self.owner, self.owner_label)
        if self.neighbour is not None:
            return f"cells {owner}, {cell_entry(self.neighbour, self.neighbour_label)}"
        return f"cell {owner}, {style.printable(self.patch) if self.patch else 'boundary'}"


class FaceQuality:
    """Faces of a mesh's solid cells, and what finite volumes ask of them. Arrays are read-only.

    Attributes
    ----------
    mesh
        Whose faces they are.
    half_faces
        ``(n_faces,)`` the half-face of the owner. Ids and positions are as wide as the topology's.
    owner, neighbour
        ``(n_faces,)`` the cells beside each face; the neighbour is -1 on the boundary. A face that three cells have is
        one of the boundary of each.
    centres, areas
        ``(n_faces, 3)`` centre, and area vector out of the owner. [length, length²]
    flatness
        ``(n_faces,)`` length of the area vector of a face of four points or more over the sum of the areas of its
        triangles about its centre; 1: flat; NaN of triangles. [0, 1]
    cell_centres, volumes
        ``(n_cells, 3)`` and ``(n_cells,)``; 0 for cells that are not solid. [length, length³]
    """

    def __init__(self, mesh: Mesh, threads: int | None = None) -> None:
        if is_compiled(mesh.n_cells):
            give_back()  # what reading took: arrays of faces are larger than the mesh
        matched = topology(mesh)
        self.mesh, self.threads = matched.mesh, threads
        cells, mates = matched.cells, matched.mates
        is_first = ((mates < 0) & (mates != COLLAPSED)) | (mates > np.arange(len(mates), dtype=mates.dtype))
        half_faces, width = np.flatnonzero(is_first), cells.dtype.type
        self.half_faces: Ids = half_faces.astype(width)
        self.owner: Ids = cells[half_faces]
        mate = mates[half_faces]
        self.neighbour: Ids = np.where(mate >= 0, cells[mate], width(NONE))
        self.points, self.offsets = matched.face_points(half_faces, width=width)
        del matched, cells, mates, is_first, half_faces, mate  # before what is larger is made
        self._x = np.ascontiguousarray(self.mesh.points, np.float64)
        self.centres, self.areas, self.flatness = driver.polygons(self._x, self.points, self.offsets, threads)
        self._beside = (read_only(self.owner), read_only(self.neighbour))
        self.cell_centres, self.volumes = driver.cells(*self._beside, self.centres, self.areas, self.mesh.n_cells)

    @cached_property
    def topology(self) -> Topology:
        """Half-faces of the mesh and their mates; matched again for whoever asks."""
        return topology(self.mesh)

    @property
    def n_faces(self) -> int:
        return len(self.owner)

    @property
    def is_inner(self) -> NDArray[np.bool_]:
        """``(n_faces,)`` True for a face between two cells."""
        return np.asarray(self.neighbour >= 0)

    # Each measure by face; NaN where it is not defined.

    @property
    def non_orthogonality(self) -> Values:
        """``(n_faces,)`` angle between the line of the two centres and the face's normal; inner faces. [degree]"""
        return self._measured("non_orthogonality")

    @property
    def skewness(self) -> Values:
        """``(n_faces,)`` how far the line of the two centres pierces an inner face off its centre, over the larger of
        .2 of the line and the extent of the face that way. [1]"""
        return self._measured("skewness")

    @property
    def boundary_skewness(self) -> Values:
        """``(n_faces,)`` the same of faces of the boundary, for the line from the cell's centre at right angles to the
        face, and .4 of it. [1]"""
        return self._measured("boundary_skewness")

    @property
    def face_weight(self) -> Values:
        """``(n_faces,)`` smaller share of the distance of the two centres from the plane of an inner face. [0, 0.5]"""
        return self._measured("face_weight")

    @property
    def volume_ratio(self) -> Values:
        """``(n_faces,)`` smaller over larger volume of the two cells of an inner face. [0, 1]"""
        return self._measured("volume_ratio")

    @property
    def pyramid_volume(self) -> Values:
        """``(n_faces,)`` smaller of the volumes of the pyramids from the face to the centres of its cells. [length³]"""
        return self._measured("pyramid_volume")

    # Measures of cells.

    @cached_property
    def axes(self) -> NDArray[np.bool_]:
        """``(3,)`` whether some face between cells looks along x, y, z; all True of a mesh without such faces.

        A mesh that is one cell thick along an axis is one of the plane to a solver of finite volumes, which does not
        solve that way: its cells are measured without it.
        """
        found = np.zeros(3, np.bool_)
        inner = self.is_inner
        for first in range(0, self.n_faces, driver.BLOCK):
            areas = np.abs(self.areas[first : first + driver.BLOCK][inner[first : first + driver.BLOCK]])
            found |= (areas > ALONG * areas.sum(axis=1, keepdims=True)).any(axis=0)
            if found.all():
                break
        return found if found.any() else ~found

    @cached_property
    def aspect_ratio(self) -> Values:
        """``(n_cells,)`` the larger of: largest over smallest of the areas of a cell's faces seen along x, y and z; a
        sixth of their sum over volume^(2/3). At least 1, of a cube 1. Without an axis that is none of `axes`, and
        then without the sixth. [1]"""
        return driver.aspect_ratio(*self._beside, self.areas, self.volumes, self.axes)

    @cached_property
    def determinant(self) -> Values:
        """``(n_cells,)`` determinant of the sum of S Sᵀ over a cell's inner faces, in units of their mean area, over 8:
        how well gradients are determined; of a cube 1, 0 if it has no inner face. For an axis that is none of `axes`
        the sum has a 1; 1 where there is one axis. [1]"""
        return driver.determinant(*self._beside, self.areas, self.axes, self.mesh.n_cells)

    # From faces to cells.

    def largest(self, values: Values, without: float) -> Values:
        """``(n_cells,)`` the largest value of each cell's faces, NaN apart; ``without``: of a cell with none."""
        return self._reduce(values, without, is_largest=True)

    def least(self, values: Values, without: float) -> Values:
        """``(n_cells,)`` the least value of each cell's faces, NaN apart; ``without``: of a cell with none."""
        return self._reduce(values, without, is_largest=False)

    def worst(self, measure: str, n: int = 5, *, highest: bool) -> list[WorstFace]:
        """The n faces with the highest or the lowest values of a measure, the worst first."""
        values = getattr(self, measure)
        at = _first(values, n, highest=highest)
        patches = self._patches(at)
        return [self._worst_face(measure, int(face), float(values[face]), patches[k]) for k, face in enumerate(at)]

    def face(self, face: int, measure: str = "flatness") -> WorstFace:
        """What is beside a face, and its value of a measure."""
        patch = self._patches(np.array([face]))[0]
        return self._worst_face(measure, face, float(getattr(self, measure)[face]), patch)

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

    # All measures of a face come from one pass over it.

    @cached_property
    def _all(self) -> tuple[Values, NDArray[np.bool_]]:
        """``(6, n_faces)`` other measures, and where a coordinate of a face or of a cell beside is not finite."""
        faces = (self.centres, self.areas)
        cells = (self.cell_centres, self.volumes)
        least = (AT_LEAST, AT_LEAST_OUTSIDE)
        return driver.measures(self._x, self.points, self.offsets, faces, self._beside, cells, least, self.threads)

    def _measured(self, name: str) -> Values:
        return np.asarray(self._all[0][driver.MEASURES.index(name)])

    def _reduce(self, values: Values, without: float, *, is_largest: bool) -> Values:
        """NaN where a face could not be measured; faces for which the measure is not defined are left out."""
        out = driver.reduce(*self._beside, values, self._all[1], is_largest, self.mesh.n_cells)
        return np.where(out == (-np.inf if is_largest else np.inf), without, out)


def mean_angle(angles: Values) -> float:
    """The angle whose cosine is the mean of the angles' cosines, as checkMesh averages them. [degree]"""
    # 1 - cos is small, and exact, where the cosine itself is 1 but for rounding.
    share = np.sin(np.radians(angles) / 2.0)
    return float(np.degrees(2.0 * np.arcsin(np.sqrt(np.mean(share * share)))))


def _first(values: Values, n: int, *, highest: bool) -> Ids:
    """Positions of the n highest or lowest values, NaN apart, in order; the lower of two positions first."""
    if n <= 0 or not len(values):
        return np.empty(0, np.int64)
    ends = (np.fmax if highest else np.fmin).reduceat(values, np.arange(0, len(values), _BLOCK))
    ends = ends[~np.isnan(ends)]
    if not len(ends):
        return np.empty(0, np.int64)
    # So many blocks have values at least as bad as the n-th worst of their ends: no other value need be sorted.
    sign = -1.0 if highest else 1.0
    limit = sign * float(np.sort(sign * ends)[min(n, len(ends)) - 1]) if len(ends) >= n else sign * np.inf
    at = np.flatnonzero(values >= limit if highest else values <= limit)
    if len(at) > n:
        key = sign * values[at]
        last = np.partition(key, n - 1)[n - 1]
        at = np.concatenate([at[key < last], at[key == last][:n]])
    return at[np.lexsort((at, sign * values[at]))][:n]
