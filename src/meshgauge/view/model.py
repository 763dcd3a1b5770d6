"""A mesh as the viewer holds it: measured, its faces matched, and placed in the frame of the scene."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..cells import type_name
from ..look.colours import (
    DEGENERATE,
    INVALID,
    OF_CATEGORY,
    SERIES,
    SERIES_NAMES,
    cell_colours,
    colours,
    rgb,
    shade,
)
from ..mesh import Mesh
from ..mesh.connectivity import polygons
from ..mesh.labels import find_cell
from ..mesh.regions import regions
from ..mesh.topology import Topology, topology
from ..quality.measure import Quality, measure
from ..status import STATUSES, Category, Status, is_degenerate, is_invalid, is_solid
from ..status import category as category_of
from . import faces
from .filters import ViewError
from .hollows import FINE, Boxes, Grid, parts, volumes
from .layers import layers
from .surface import Surface, all_faces, drawn, seen_faces, surface

MOST_APART = 300_000
"""Faces of cells drawn apart."""

QUALITY = "quality"
"""The colouring by J_ENS."""


@dataclass(frozen=True, slots=True)
class Frame:
    """Takes coordinates of a mesh to those of the scene, where the mesh fills a ball of radius 1 about 0.

    Graphics count in single precision: a mesh of micrometres, or one far from the origin, must not suffer from it.
    """

    centre: tuple[float, float, float]
    radius: float

    @classmethod
    def of(cls, points: NDArray[np.floating]) -> Frame:
        """The frame of the finite ones of some points. Raises `ViewError` if there are none."""
        finite = points[np.isfinite(points).all(axis=1)]
        if not len(finite):
            raise ViewError("no cell that is measured has finite coordinates: there is nothing to show")
        low, high = finite.min(axis=0).astype(np.float64), finite.max(axis=0).astype(np.float64)
        x, y, z = (float(v) for v in low / 2 + high / 2)
        half = high / 2 - low / 2
        longest = float(half.max()) or 1.0  # squares of what is divided by it do not overflow
        radius = float(np.linalg.norm(half / longest)) * longest
        return cls((x, y, z), radius or 1.0)

    def to_scene(self, points: NDArray[np.floating]) -> NDArray[np.float32]:
        """Points in the scene, float32; NaN or infinite where they are."""
        with np.errstate(over="ignore", invalid="ignore"):
            return np.asarray((points - np.array(self.centre)) / self.radius, np.float32)


@dataclass(frozen=True, eq=False, repr=False)
class Model:
    """A measured mesh and what is drawn of it. All arrays have one entry a cell of the mesh; see `filters.Cells`."""

    name: str
    quality: Quality
    topology: Topology
    frame: Frame

    @classmethod
    def of(cls, what: Quality | Mesh, name: str, *, frame: Frame | None = None) -> Model:
        """The model of a mesh, measured or not; ``frame`` is that of the mesh that it is shown beside.

        Raises `ViewError` if it has no solid cell to show.
        """
        quality = what if isinstance(what, Quality) else measure(what)
        mesh = quality.mesh
        matched = topology(mesh) if quality.faces is None else quality.faces.topology
        shown = is_solid(quality.status) if mesh.dimension == 2 else np.diff(matched.starts) > 0
        of_shown = np.zeros(mesh.n_points, np.bool_)
        of_shown[mesh.connectivity[np.repeat(shown, np.diff(mesh.offsets))]] = True
        own = Frame.of(mesh.points[of_shown])
        return cls(name, quality, matched, frame or own)

    @property
    def mesh(self) -> Mesh:
        return self.quality.mesh

    @property
    def n_cells(self) -> int:
        """Number of cells that count: those that can be shown."""
        return int(np.count_nonzero(self.is_solid))

    @property
    def values(self) -> NDArray[np.float64]:
        return self.quality.values

    @cached_property
    def is_solid(self) -> NDArray[np.bool_]:
        return is_solid(self.quality.status)

    @cached_property
    def colourings(self) -> tuple[str, ...]:
        """By what cells can be coloured: quality, status, region, and the other metrics that were measured."""
        others = tuple(name for name in self.quality.metrics if name != "jens")
        regional = ("region",) if len(self.region_names) > 1 else ()
        return (QUALITY, "status", *regional, *others, *map(faces.colouring, faces.measures(self.quality)))

    def colours(self, cells: NDArray[np.integer], by: str = QUALITY) -> NDArray[np.uint8]:
        """``(n, 3)`` red, green and blue of some cells, by one of `colourings`: by status first where it is a value."""
        status, quality = self.quality.status[cells], self.quality
        if by == "region":
            of_cells = np.array([rgb(code) for code in SERIES])[self.region_ids[cells] % len(SERIES)]
        elif by == "status":
            codes = np.array([rgb(OF_CATEGORY[category]) for category in Category])
            of_cells = codes[category_of(status, self.mesh.purpose)]
        else:
            bad = is_invalid(status, self.mesh.purpose), is_degenerate(status)
            values = shade(self.values[cells], quality.poor_limits(cells))
            of_cells = cell_colours(values, *bad)
            if by != QUALITY:
                row = quality.rows[by]
                of_cells = colours(
                    quality.values_of(by)[cells], row.acceptable, is_signed=False, lower_is_better=row.better == "lower"
                )
                of_cells[bad[0]], of_cells[bad[1]] = rgb(INVALID), rgb(DEGENERATE)
        return np.asarray((255 * of_cells).round(), np.uint8)

    def colours_of(self, surface: Surface, by: str = QUALITY) -> NDArray[np.uint8]:
        """``(n_faces, 3)``: as `colours` of the cells of some faces; where faces are coloured, of the faces."""
        measure = faces.measure_of(by)
        if measure is None or surface.slots is None:
            return self.colours(surface.cells, by if measure is None else measure)
        row = self.quality.rows[measure]
        own = colours(
            faces.values_at(self.quality, measure, self._face_of_slot[surface.slots]),
            row.acceptable,
            is_signed=False,
            lower_is_better=row.better == "lower",
        )
        return np.asarray((255 * own).round(), np.uint8)

    @cached_property
    def _face_of_slot(self) -> NDArray[np.int64]:
        """``(n_half_faces,)`` the face of `quality.faces` that each half-face is of, -1 for one that has collapsed."""
        return faces.of_half_faces(self.quality)

    def face_at(self, slot: int) -> int:
        """The face of `quality.faces` at a half-face. Raises `ViewError` if there is none."""
        known = self._face_of_slot if self.quality.faces is not None else np.empty(0, np.int64)
        if not 0 <= slot < len(known) or known[slot] < 0:
            raise ViewError(f"no face {slot} of {self.name} is measured: give --for fv, or a metric of faces")
        return int(known[slot])

    def worst_colouring(self, slot: int) -> str:
        """The colouring of a face by the measure that it is listed for; if it is not, by the first that it has."""
        for one in self.hard_faces:
            if one.slot == slot:
                return faces.colouring(one.face.measure)
        at = np.array([self.face_at(slot)])
        known = faces.measures(self.quality)
        has = (name for name in known if not np.isnan(faces.values_at(self.quality, name, at)[0]))
        return faces.colouring(next(has, known[0]))

    def normal_of(self, slot: int) -> NDArray[np.float64]:
        """``(3,)`` the area vector of a face."""
        assert self.quality.faces is not None  # else no face is picked
        return np.asarray(self.quality.faces.areas[self.face_at(slot)])

    def place_of_face(self, slot: int) -> tuple[tuple[float, float, float], float]:
        """Centre of a face in the scene, and the size of its cells."""
        seen = self.faces_at(np.array([slot]))
        if not seen.n_faces:
            raise ViewError(f"face {slot} has no finite coordinates")
        own = self.points[seen.points].astype(float)
        x, y, z = (float(v) for v in own.mean(axis=0))
        return (x, y, z), max(self.place_of(cell)[1] for cell in self.beside(slot))

    def beside(self, slot: int) -> list[int]:
        """The cells of a half-face: its own, and the one beyond if there is one."""
        mate = int(self.topology.mates[slot])
        return [int(self.topology.cells[at]) for at in ((slot, mate) if mate >= 0 else (slot,))]

    def faces_at(self, slots: NDArray[np.int64]) -> Surface:
        """Some faces, by their half-faces; those of points that cannot be drawn are left out."""
        return surface(self.topology, slots, self.is_drawable)

    def faces_of_cells(self, cells: list[int]) -> Surface:
        """All faces of some cells."""
        shown = np.zeros(self.mesh.n_cells, np.bool_)
        shown[cells] = True
        return self.faces_at(all_faces(self.topology, shown))

    @cached_property
    def hard_faces(self) -> list[faces.Listed]:
        """The faces beyond their limits, and of each other measure of faces the worst; see `faces.listed`."""
        return faces.listed(self.quality, self.topology)

    def legend(self, by: str) -> str:
        """What the colours of a colouring say, in words; empty for quality, which has a legend of its own."""
        if by == QUALITY:
            return ""
        if by == "region":
            pairs = zip(self.region_names, SERIES_NAMES, strict=False)
            names = [f"{name} {colour}" for name, colour in pairs]
            return ", ".join(names) + (", ..." if len(self.region_names) > len(SERIES_NAMES) else "")
        if by == "status":
            return "valid blue, invalid red, degenerate purple, others grey"
        measure = faces.measure_of(by)
        row = self.quality.rows[measure or by]
        low, high = (f"{end:g}" for end in row.acceptable)
        if measure:
            return f"{by}: blue within {low} to {high}, light is best; orange outside; grey has no value"
        return f"{by}: blue within {low} to {high}, light is best; orange outside; invalid cells red"

    def neighbours(self, cell: int) -> list[int]:
        """The cells that share a face with one, ascending; of surface cells an edge."""
        own = slice(int(self.topology.starts[cell]), int(self.topology.starts[cell + 1]))
        mates = self.topology.mates[own]
        return sorted({int(other) for other in self.topology.cells[mates[mates >= 0]].tolist()} - {cell})

    def place_in(self, text: str) -> int:
        """The cell that a text means, see `mesh.labels.find_cell`. Raises `OptionError` if there is none."""
        return find_cell(self.mesh, text)

    @property
    def type_ids(self) -> NDArray[np.uint8]:
        return self.mesh.types

    @cached_property
    def type_names(self) -> tuple[str, ...]:
        return tuple(type_name(t) for t in range(256))

    @property
    def status_ids(self) -> NDArray[np.uint8]:
        return self.quality.status

    @cached_property
    def status_names(self) -> tuple[str, ...]:
        return tuple(STATUSES[status].name for status in Status)

    @cached_property
    def _regions(self) -> tuple[NDArray[np.int64], tuple[str, ...]]:
        return regions(self.mesh)

    @property
    def region_ids(self) -> NDArray[np.int64]:
        return self._regions[0]

    @property
    def region_names(self) -> tuple[str, ...]:
        return self._regions[1]

    @cached_property
    def layers(self) -> NDArray[np.int32]:
        return self.is_solid.astype(np.int32) - 1 if self.mesh.dimension == 2 else layers(self.topology)

    @property
    def n_layers(self) -> int:
        return int(self.layers.max(initial=-1)) + 1

    @cached_property
    def points(self) -> NDArray[np.float32]:
        """``(n_points, 3)`` in the frame of the scene."""
        return self.frame.to_scene(self.mesh.points)

    @cached_property
    def is_drawable(self) -> NDArray[np.bool_]:
        """``(n_points,)`` whether a point is finite in the scene."""
        return np.asarray(np.isfinite(self.points).all(axis=1))

    @cached_property
    def centres(self) -> NDArray[np.float32]:
        """``(n_cells, 3)``: mean of the nodes of each cell, in the frame of the scene; NaN for one without nodes."""
        offsets, points = self.mesh.offsets, self.points
        sizes = np.diff(offsets)
        out = np.full((self.mesh.n_cells, 3), np.nan, np.float32)
        filled = np.flatnonzero(sizes > 0)
        if len(filled):
            sums = np.add.reduceat(points[self.mesh.connectivity], np.asarray(offsets)[filled].astype(np.int64))
            out[filled] = sums / sizes[filled, None].astype(np.float32)
        return out

    @cached_property
    def volumes(self) -> NDArray[np.float32]:
        """``(n_cells,)`` about how large each cell is in the scene."""
        return volumes(self.points, self.mesh.connectivity, np.asarray(self.mesh.offsets, np.int64))

    @cached_property
    def _boxes(self) -> tuple[NDArray[np.bool_], Boxes]:
        """The cells that have a finite centre, and their boxes."""
        there = self.is_solid & np.isfinite(self.centres).all(axis=1)
        return there, Boxes.of(self.centres[there])

    def grid(self, shown: NDArray[np.bool_], shrink: float = 0.0) -> Grid | None:
        """How full space is of some cells, each smaller by a share of itself; None of surface cells."""
        if self.mesh.dimension == 2:
            return None
        if self.n_cells > FINE:
            there, boxes = self._boxes
            return Grid.by_count(boxes, shown[there], empty=shrink)
        cells = np.flatnonzero(shown & (self.volumes > 0))
        if not len(cells):
            return None
        offsets = np.asarray(self.mesh.offsets, np.int64)
        places, volume = parts(self.points, self.mesh.connectivity, offsets, self.volumes, cells)
        return Grid.by_volume(places, volume, usual=float(np.median(self.volumes[cells])), empty=shrink)

    def counts(self, of: Literal["types", "statuses", "regions"]) -> dict[str, int]:
        """Number of solid cells by name, of the names that occur."""
        ids: NDArray[np.integer]
        if of == "types":
            names, ids = self.type_names, self.type_ids
        elif of == "statuses":
            names, ids = self.status_names, self.status_ids
        else:
            names, ids = self.region_names, self.region_ids
        counts = np.bincount(ids[self.is_solid], minlength=len(names))
        return {names[n]: int(counts[n]) for n in np.flatnonzero(counts)}

    def surface(self, shown: NDArray[np.bool_]) -> Surface:
        """The faces that are seen of some cells; surface cells themselves."""
        if self.mesh.dimension == 2:
            cells, offsets, points = polygons(self.mesh)
            return drawn(Surface(points, offsets, points, cells).some(np.flatnonzero(shown[cells])), self.is_drawable)
        return surface(self.topology, seen_faces(self.topology, shown), self.is_drawable)

    def apart(self, shown: NDArray[np.bool_], shrink: float) -> tuple[Surface, NDArray[np.float32]]:
        """Some cells, each smaller by a share of itself: their faces, and points of the scene, one for each corner.

        Of many cells only those at the surface of what is shown are there: what is behind them is hardly seen.
        """
        seen = self.surface(shown)
        if self.mesh.dimension == 3:
            if int(np.diff(self.topology.starts)[shown].sum()) > MOST_APART:
                shown = np.bincount(seen.cells, minlength=self.mesh.n_cells) > 0
            seen = surface(self.topology, all_faces(self.topology, shown), self.is_drawable)
        own = np.arange(len(seen.connectivity))
        middle = self.centres[np.repeat(seen.cells, np.diff(seen.offsets))]
        corners = self.points[seen.points[seen.connectivity]]
        return Surface(own, seen.offsets, own, seen.cells, seen.slots), corners + np.float32(shrink) * (
            middle - corners
        )

    @cached_property
    def boundary(self) -> Surface:
        """The faces that are seen of the whole mesh."""
        return self.surface(self.is_solid)

    def place_of(self, cell: int) -> tuple[tuple[float, float, float], float]:
        """Centre and size of a cell in the scene. Raises `ViewError` if there is none, or none to see."""
        if not 0 <= cell < self.mesh.n_cells:
            raise ViewError(f"no cell {cell}: the mesh has cells 0 to {self.mesh.n_cells - 1}")
        points = self.points[self.mesh.nodes(cell)]
        points = points[np.isfinite(points).all(axis=1)]
        if not len(points):
            raise ViewError(f"cell {cell} has no finite coordinates")
        low, high = points.min(axis=0).astype(float), points.max(axis=0).astype(float)
        x, y, z = (float(v) for v in (low + high) / 2)
        return (x, y, z), float(np.linalg.norm(high - low))
