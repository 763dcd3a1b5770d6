"""What is wrong with a mesh beside the shapes of its cells: found, counted and named; nothing is repaired."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..cells import IS_SOLID, POLYHEDRON
from ..kernels import path
from ..kernels.arrays import read_only
from ..kernels.threads import run
from ..kernels.topology import driver
from ..mesh import Mesh
from ..mesh.ghosts import without_ghosts
from ..mesh.interface import is_interface
from ..mesh.polyhedra import points_of_faces
from ..mesh.topology import OPPOSITE, Topology, face_table, topology
from ..quality.measure import Quality, measure
from ..surface_cells import IS_SURFACE
from . import cells, faces, findings, points, surfaces
from .findings import Finding
from .hanging import hanging
from .inward import inward
from .joined import Joined
from .orientation import Orientation, orientation

LIMIT = 5_000_000
"""Cells up to which a report includes a diagnosis: it then takes at most about 3 s and 900 MB."""


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis:
    """What was looked for in a mesh, and found.

    Attributes
    ----------
    findings
        What was found; empty if nothing.
    orientation
        How the cells are numbered; None if skipped.
    repeated_points
        ``(n_cells,)`` bool: a solid cell that has a point twice; None if skipped.
    part_sizes
        Solid cells of each part, largest first. Cells are of one part if they share a point, directly or through
        others.
    n_interior_faces, n_boundary_faces
        Faces that two cells have, and one; None if skipped.
    tolerance
        Relative to the size of the mesh, within which points were taken to coincide, see `points.size`.
    skipped
        Why something was not looked for, a sentence each.
    checked
        What was looked for, in words; what the mesh cannot have, such as faces of polyhedra, is not among it.
    dimension
        2: surface cells were looked at, and instead of faces their edges are meant.
    """

    findings: tuple[Finding, ...]
    orientation: Orientation | None
    repeated_points: NDArray[np.bool_] | None
    part_sizes: tuple[int, ...]
    n_interior_faces: int | None
    n_boundary_faces: int | None
    tolerance: float
    skipped: tuple[str, ...] = ()
    checked: tuple[str, ...] = ()
    dimension: int = 3

    @property
    def n_parts(self) -> int:
        return len(self.part_sizes)

    @property
    def n_defects(self) -> int:
        """Number of findings that are defects."""
        return sum(finding.level == "defect" for finding in self.findings)

    @property
    def all_clear(self) -> str:
        """The sentence where nothing was found: it names what was looked for, and nothing else."""
        return f"No {', '.join(self.checked[:-1])} or {self.checked[-1]}."

    def finding(self, name: str) -> Finding | None:
        """The finding of that name, if there is one."""
        return next((f for f in self.findings if f.name == name), None)

    def to_dict(self) -> dict[str, Any]:
        """Plain data, for JSON; at most 100 parts are listed."""
        return {
            "findings": [finding.to_dict() for finding in self.findings],
            "orientation": self.orientation.to_dict() if self.orientation else None,
            "dimension": self.dimension,
            "n_parts": None if self.n_interior_faces is None else self.n_parts,
            "part_sizes": list(self.part_sizes[:100]),
            "n_interior_faces": self.n_interior_faces,
            "n_boundary_faces": self.n_boundary_faces,
            "tolerance": self.tolerance,
            "skipped": list(self.skipped),
            "checked": list(self.checked),
        }

    def __repr__(self) -> str:
        counts = ", ".join(f"{f.count} {f.name}" for f in self.findings) or "nothing found"
        return f"<Diagnosis: {counts}{'; skipped' if self.skipped else ''}>"


def diagnosis(
    mesh: Mesh,
    quality: Quality | None = None,
    *,
    limit: int | None = None,
    tolerance: float = points.TOLERANCE,
    keep_bricks: bool = False,
) -> Diagnosis:
    """Look for what is wrong with a mesh beside the shapes of its cells.

    Parameters
    ----------
    mesh
        Any mesh.
    quality
        What was measured on it; measured here if None.
    limit
        Do nothing, and say so, if the mesh has more cells; None: no limit. See `LIMIT`.
    tolerance
        Distance within which points coincide, relative to the size of the mesh, see `points.size`.
    keep_bricks
        Take cells with repeated nodes as they are, see `meshgauge.measure`; without ``quality`` only.

    Notes
    -----
    Looks for points that no cell uses, points that coincide, cells that have a point twice, cells that are there twice,
    faces that three or more cells have, two triangles against a quadrilateral, hanging points, parts that are not
    connected, cells numbered in reverse, and faces of polyhedra that point inward. Of a mesh of surfaces: at an edge of
    two cells these must run along it in opposite directions, and points must not hang on edges. Time and memory are
    linear: about 0.6 s and 170 bytes for each of a million hexahedra.
    """
    if limit is not None and mesh.n_cells > limit:
        return not_diagnosed(mesh.n_cells, limit, tolerance=tolerance)
    quality = quality if quality is not None else measure(mesh, keep_bricks=keep_bricks)
    mesh = quality.mesh  # collapsed cells as what they stand for
    is_ghost = mesh.is_ghost
    if is_ghost is not None:
        mesh = without_ghosts(mesh)
        quality = replace(quality, mesh=mesh)
    together = Joined.of_mesh(mesh, tolerance) if mesh.parts else None
    if together is not None:
        mesh = together.on(mesh)
        quality = replace(quality, mesh=mesh)
    if mesh.dimension == 2:
        return _of_surfaces(quality, tolerance, is_ghost, together)
    matched, representative, (is_used, repeated, hashes) = _side_by_side(
        mesh,
        lambda: topology(mesh),
        lambda: points.representatives(mesh.points, tolerance=tolerance, stored=mesh.stored),
        lambda: driver.signatures(mesh.types, mesh.offsets, mesh.connectivity, IS_SOLID, mesh.n_points),
    )
    if mesh.polyhedra is not None:
        is_used[points_of_faces(mesh.polyhedra)] = True
    doubles = points.duplicates(representative, is_used if is_ghost is None else _points_in_use(mesh, ~is_ghost))
    interface = is_interface(mesh)
    by_design = doubles[:0]
    if interface is not None:
        repeated &= ~interface
        is_side = points.sides_of_interfaces(mesh, representative, interface)
        doubles, by_design = doubles[~is_side[doubles]], doubles[is_side[doubles]]
    hangs, twice, sizes = _side_by_side(
        mesh,
        lambda: hanging(quality, matched),
        lambda: cells.duplicates(mesh, hashes),
        lambda: _part_sizes(mesh, IS_SOLID),
    )
    covering = (
        np.setdiff1d(cells.covering(mesh, representative), twice) if len(doubles) or len(by_design) else twice[:0]
    )
    oriented = orientation(quality, faces=matched, points=representative if len(doubles) else None, ignored=twice)
    split = faces.split_quadrilaterals(matched)
    names = findings.NamesOf(mesh)
    n_of = np.bincount(mesh.types, minlength=256)
    conforms = not (matched.n_multiple or len(split) or len(hangs.points))
    made = [
        *findings.of_orientation(oriented),
        findings.misoriented_faces(names, inward(mesh)),
        findings.repeated_points(names, np.flatnonzero(repeated)),
        findings.duplicate_cells(names, twice),
        findings.covering_cells(names, covering),
        findings.multiple_faces(names, matched.n_multiple, faces.of_three_cells(matched)),
        findings.split_faces(names, matched.cells[split].astype(np.int64)),
        findings.hanging_points(names, hangs),
        findings.hinges(_roots(matched), len(sizes)) if conforms and have_faces(n_of) else None,
        findings.parts(sizes),
        _duplicate_points(names, doubles, representative, tolerance),
        findings.interfaces(names, np.flatnonzero(interface) if interface is not None else doubles[:0], len(by_design)),
        findings.joined_points(names, together),
        findings.unused_points(names, _unused(is_used, together)),
        *(_beside_solids(mesh) if has_others(n_of) else ()),
    ]
    return Diagnosis(
        findings=tuple(finding for finding in made if finding is not None),
        orientation=oriented,
        repeated_points=read_only(repeated),
        part_sizes=tuple(sizes),
        n_interior_faces=matched.n_interior,
        n_boundary_faces=matched.n_boundary,
        tolerance=tolerance,
        skipped=skipped(n_of),
        checked=checks(n_of),
    )


def _side_by_side(mesh: Mesh, *works: Callable[[], Any]) -> list[Any]:
    """What each of some functions returns: on threads, if the mesh has so many cells that kernels do the work."""
    return run(lambda work: work(), works, None if path.is_compiled(mesh.n_cells, is_once=True) else 1)


def _duplicate_points(
    names: findings.NamesOf, doubles: NDArray[np.int64], representative: NDArray[np.signedinteger], tolerance: float
) -> Finding | None:
    mesh = names.mesh
    exact = int((mesh.points[doubles] == mesh.points[representative[doubles]]).all(axis=1).sum())
    within = findings.within(points.PointScale.of(mesh.points, mesh.stored), tolerance, str(mesh.stored))
    return findings.duplicate_points(names, doubles, exact, within)


def _unused(is_used: NDArray[np.bool_], joined: Joined | None) -> NDArray[np.int64]:
    """Points of no cell; those for which others stand are none."""
    unused = np.flatnonzero(~is_used)
    return unused if joined is None else np.setdiff1d(unused, joined.ids)


def _of_surfaces(
    quality: Quality, tolerance: float, is_ghost: NDArray[np.bool_] | None, together: Joined | None
) -> Diagnosis:
    """The diagnosis of a mesh whose surface cells are measured; ghosts are marked, and vertices in it."""
    mesh = quality.mesh
    is_used, repeated, hashes = driver.signatures(
        mesh.types, mesh.offsets, mesh.connectivity, IS_SURFACE, mesh.n_points
    )
    representative = points.representatives(mesh.points, tolerance=tolerance, stored=mesh.stored)
    doubles = points.duplicates(representative, is_used if is_ghost is None else _points_in_use(mesh, ~is_ghost))
    names = findings.NamesOf(mesh)
    twice = cells.duplicates(mesh, hashes)
    from . import shells

    edges = shells.edges_of(mesh, twice)
    turned = shells.orientation(edges, quality)
    sizes = _part_sizes(mesh, IS_SURFACE)
    made = [
        findings.turned_cells(names, turned.cells, mesh.up != 0),
        findings.not_orientable(names, turned.contradictions),
        findings.repeated_points(names, np.flatnonzero(repeated)),
        findings.duplicate_cells(names, twice),
        findings.edges_of_three(names, edges.multiple, mesh.up != 0),
        findings.points_on_edges(names, shells.hanging(mesh, edges)),
        findings.parts(sizes),
        _duplicate_points(names, doubles, representative, tolerance),
        findings.joined_points(names, together),
        findings.unused_points(names, _unused(is_used, together)),
    ]
    return Diagnosis(
        findings=tuple(finding for finding in made if finding is not None),
        orientation=None,
        repeated_points=read_only(repeated),
        part_sizes=tuple(sizes),
        n_interior_faces=edges.n_interior,
        n_boundary_faces=edges.n_boundary,
        tolerance=tolerance,
        checked=OF_SURFACES,
        dimension=2,
    )


def _beside_solids(mesh: Mesh) -> tuple[Finding | None, ...]:
    alone, n_surface = surfaces.of_no_solid(mesh)
    names = findings.NamesOf(mesh)
    return (
        findings.surface_cells(names, alone, n_surface),
        findings.points_of_no_solid(names, surfaces.points_of_no_solid(mesh)),
    )


def _roots(matched: Topology) -> NDArray[np.int64]:
    """The first cells of each part that faces hold together."""
    unknown, opposite = np.zeros(matched.mesh.n_cells, np.int8), np.full(len(matched.cells), OPPOSITE, np.int8)
    parent, _, _ = driver.components_by_faces(matched.cells, matched.mates, opposite, unknown)
    return np.unique(parent[np.diff(matched.starts) > 0]).astype(np.int64)


def have_faces(n_of: NDArray[np.int64]) -> bool:
    """Whether the faces of all solid cells are known, of the numbers ``(256,)`` of cells of each type."""
    solid = np.flatnonzero((n_of > 0) & IS_SOLID)
    return bool((face_table()[solid, 0, 0] != 0).all())


def has_others(n_of: NDArray[np.int64]) -> bool:
    """Whether there are solid cells and others."""
    return bool(n_of[IS_SOLID].any() and n_of[~IS_SOLID].any())


def skipped(n_of: NDArray[np.int64]) -> tuple[str, ...]:
    """Why something is not looked for."""
    return () if n_of[IS_SOLID].any() else (_NO_SOLIDS,)


def not_diagnosed(n_cells: int, limit: int, *, reason: str = "", tolerance: float = points.TOLERANCE) -> Diagnosis:
    """The diagnosis of a mesh that is not looked at: for a reason, or because it has more cells than the limit."""
    why = f"The mesh was not diagnosed: {reason or f'it has {n_cells:,} cells, more than {limit:,}'}."
    return Diagnosis((), None, None, (), None, None, tolerance, (why,))


_NO_SOLIDS = "The mesh has no solid cells: nothing was looked at but its points."

_OF_CELLS = ("repeated points", "duplicate cells", "faces of three cells", "split faces", "hanging points", "parts")
_OF_POINTS = ("duplicate points", "unused points")
OF_SURFACES = (
    "cells that run the other way round",
    "surfaces without two sides",
    "repeated points",
    "duplicate cells",
    "edges of three cells",
    "hanging points",
    "parts",
    *_OF_POINTS,
)
"""What is looked for in a mesh of surfaces."""


def checks(n_of: NDArray[np.int64]) -> tuple[str, ...]:
    """What can be looked for in a mesh with these numbers ``(256,)`` of cells of each type."""
    n_solid = int(n_of[IS_SOLID].sum())
    if n_solid == 0:
        return _OF_POINTS
    n_own = int(n_of[POLYHEDRON.vtk_id])
    first = () if n_own == n_solid else ("cells numbered in reverse",)
    faces = ("faces that point inward",) if n_own else ()
    beside = ("surface cells that are no faces", "points of no solid cell") if has_others(n_of) else ()
    return (*first, *faces, *_OF_CELLS, *beside, *_OF_POINTS)


def _points_in_use(mesh: Mesh, cells: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Points of some of the cells."""
    used = np.zeros(mesh.n_points, bool)
    used[mesh.connectivity[np.repeat(cells, np.diff(mesh.offsets))]] = True
    return used


def _part_sizes(mesh: Mesh, of_types: NDArray[np.bool_]) -> list[int]:
    """Cells of some types ``(256,)`` of each part, largest first."""
    chosen = of_types[mesh.types]
    parent = driver.components_by_points(chosen, mesh.offsets, mesh.connectivity, mesh.n_points)
    first = mesh.offsets[:-1][chosen & (np.diff(mesh.offsets) > 0)]
    counts = np.bincount(parent[mesh.connectivity[first]])
    return sorted(counts[counts > 0].tolist(), reverse=True)
