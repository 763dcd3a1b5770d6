"""What is wrong with a mesh beside the shapes of its cells: found, counted and named; nothing is repaired."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..cells import IS_SOLID, POLYHEDRON
from ..kernels.arrays import read_only
from ..kernels.topology import driver
from ..look.names import cell_name, listed
from ..look.records import brief
from ..mesh import Mesh
from ..mesh.ghosts import without_ghosts
from ..mesh.interface import is_interface
from ..mesh.labels import cell_labels, point_labels
from ..mesh.polyhedra import IndexArray
from ..mesh.topology import OPPOSITE, Topology, topology
from ..quality.measure import Quality, measure
from . import cells, faces, points, surfaces
from .hanging import Hanging, hanging
from .inward import InwardFaces, inward
from .orientation import EXAMPLES, Orientation, orientation

LIMIT = 5_000_000
"""Cells up to which a report includes a diagnosis: it then takes at most about 3 s and 900 MB."""

Level = Literal["defect", "notice"]


@dataclass(frozen=True, slots=True)
class Finding:
    """Something found, in one sentence.

    A *defect* makes a mesh unfit for most solvers; a *notice* may be meant so.
    """

    name: str
    level: Level
    count: int
    examples: tuple[int, ...]  #: the first few: cell ids, or point ids where it is points that were counted
    text: str
    labels: tuple[int | None, ...] = ()  #: the file's own numbers of the examples; empty if it numbers none

    __repr__ = brief

    def to_dict(self) -> dict[str, Any]:
        """Plain data, for JSON."""
        return {
            "name": self.name,
            "level": self.level,
            "count": self.count,
            "examples": list(self.examples),
            "labels": list(self.labels),
            "text": self.text,
        }


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
            "n_parts": self.n_parts,
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
    connected, cells numbered in reverse, and faces of polyhedra that point inward. Time and memory are linear: about
    0.6 s and 170 bytes for each of a million hexahedra.
    """
    if limit is not None and mesh.n_cells > limit:
        return not_diagnosed(mesh.n_cells, limit, tolerance=tolerance)
    quality = quality if quality is not None else measure(mesh, keep_bricks=keep_bricks)
    mesh = quality.mesh  # collapsed cells as what they stand for
    is_ghost = mesh.is_ghost
    if is_ghost is not None:
        mesh = without_ghosts(mesh)
        quality = replace(quality, mesh=mesh)
    is_used, repeated, hashes = driver.signatures(mesh.types, mesh.offsets, mesh.connectivity, IS_SOLID, mesh.n_points)
    if mesh.polyhedra is not None:
        is_used[mesh.polyhedra.face_points] = True
    representative = points.representatives(mesh.points, tolerance=tolerance, stored=mesh.stored)
    doubles = points.duplicates(representative, is_used if is_ghost is None else _points_in_use(mesh, ~is_ghost))
    interface = is_interface(mesh)
    by_design = doubles[:0]
    if interface is not None:
        repeated &= ~interface
        is_side = points.sides_of_interfaces(mesh, representative, interface)
        doubles, by_design = doubles[~is_side[doubles]], doubles[is_side[doubles]]
    matched = topology(mesh)
    twice = cells.duplicates(mesh, hashes)
    covering = (
        np.setdiff1d(cells.covering(mesh, representative), twice) if len(doubles) or len(by_design) else twice[:0]
    )
    oriented = orientation(quality, faces=matched, points=representative if len(doubles) else None, ignored=twice)
    sizes = _part_sizes(mesh)
    split = faces.split_quadrilaterals(matched)
    hangs = hanging(quality, matched)
    findings = [
        *_orientation(oriented),
        _misoriented(mesh, inward(mesh)),
        _repeated(mesh, np.flatnonzero(repeated)),
        _duplicate_cells(mesh, twice),
        _covering_cells(mesh, covering),
        _multiple_faces(mesh, matched.n_multiple, faces.of_three_cells(matched)),
        _split_faces(matched, split),
        _hanging(mesh, hangs),
        _hinges(matched, len(sizes), conforms=not (matched.n_multiple or len(split) or len(hangs.points))),
        _parts(sizes),
        _duplicate_points(mesh, representative, doubles, tolerance),
        _interfaces(mesh, interface, len(by_design)),
        _unused(mesh, np.flatnonzero(~is_used)),
        *_beside_solids(mesh),
    ]
    return Diagnosis(
        findings=tuple(finding for finding in findings if finding is not None),
        orientation=oriented,
        repeated_points=read_only(repeated),
        part_sizes=tuple(sizes),
        n_interior_faces=matched.n_interior,
        n_boundary_faces=matched.n_boundary,
        tolerance=tolerance,
        skipped=() if IS_SOLID[mesh.types].any() else (_NO_SOLIDS,),
        checked=_checks(mesh),
    )


def not_diagnosed(n_cells: int, limit: int, *, tolerance: float = points.TOLERANCE) -> Diagnosis:
    """The diagnosis of a mesh that has more cells than are looked at, or is not in memory as a whole."""
    reason = f"it has {n_cells:,} cells, more than {limit:,}"
    if n_cells <= limit:
        reason = "it is measured slice by slice, with less memory than its diagnosis takes"
    why = f"The mesh was not diagnosed: {reason}."
    return Diagnosis((), None, None, (), None, None, tolerance, (why,))


_NO_SOLIDS = "The mesh has no solid cells: nothing was looked at but its points."

_OF_CELLS = ("repeated points", "duplicate cells", "faces of three cells", "split faces", "hanging points", "parts")
_OF_POINTS = ("duplicate points", "unused points")


def _checks(mesh: Mesh) -> tuple[str, ...]:
    """What can be looked for in the mesh."""
    solid = mesh.types[IS_SOLID[mesh.types]]
    if len(solid) == 0:
        return _OF_POINTS
    is_own = solid == POLYHEDRON.vtk_id
    first = () if is_own.all() else ("cells numbered in reverse",)
    faces = ("faces that point inward",) if is_own.any() else ()
    beside = ("surface cells that are no faces", "points of no solid cell") if len(solid) < mesh.n_cells else ()
    return (*first, *faces, *_OF_CELLS, *beside, *_OF_POINTS)


def _points_in_use(mesh: Mesh, cells: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Points of some of the cells."""
    used = np.zeros(mesh.n_points, bool)
    used[mesh.connectivity[np.repeat(cells, np.diff(mesh.offsets))]] = True
    return used


def _part_sizes(mesh: Mesh) -> list[int]:
    """Solid cells of each part, largest first."""
    solid = IS_SOLID[mesh.types]
    parent = driver.components_by_points(solid, mesh.offsets, mesh.connectivity, mesh.n_points)
    first = mesh.offsets[:-1][solid & (np.diff(mesh.offsets) > 0)]
    counts = np.bincount(parent[mesh.connectivity[first]])
    return sorted(counts[counts > 0].tolist(), reverse=True)


def _orientation(result: Orientation) -> list[Finding]:
    out = []
    for block in result.blocks:
        count = block.n_reversed + block.n_reversed_tangled + block.n_tangled + block.n_overlapping + block.n_undecided
        out.append(Finding("orientation", "defect", count, block.cells, _sentence(block.text), block.labels))
    return out


def _misoriented(mesh: Mesh, result: InwardFaces) -> Finding | None:
    n = result.n_faces
    firsts = [result.cells_of(at) for at in range(min(n, EXAMPLES))]
    named = "; ".join(
        f"face {face} of {_both(mesh, own)}" for face, own in zip(result.faces.tolist(), firsts, strict=False)
    )
    text = f"{_count(n, 'face')} {_verb(n, 'points', 'point')} the wrong way, inward"
    cells = [own[0] for own in firsts]
    more = "; ..." if n > EXAMPLES else ""
    return _of_cells(mesh, "misoriented_faces", n, cells, f"{text} ({named}{more}).")


def _repeated(mesh: Mesh, ids: NDArray[np.int64]) -> Finding | None:
    n = len(ids)
    text = f"{_count(n, 'cell')} {_verb(n, 'has', 'have')} a point twice"
    return _of_cells(mesh, "repeated_points", n, ids.tolist(), f"{text} ({_ids(mesh, 'cell', ids)}).")


def _duplicate_cells(mesh: Mesh, ids: NDArray[np.int64]) -> Finding | None:
    n = len(ids)
    text = f"{_count(n, 'cell')} {_verb(n, 'is', 'are')} there already, with the same points"
    return _of_cells(mesh, "duplicate_cells", n, ids.tolist(), f"{text} ({_ids(mesh, 'cell', ids)}).")


def _covering_cells(mesh: Mesh, ids: NDArray[np.int64]) -> Finding | None:
    n = len(ids)
    text = (
        f"{_count(n, 'cell')} {_verb(n, 'lies', 'lie')} where another is, with points of {_verb(n, 'its', 'their')} own"
    )
    return _of_cells(mesh, "covering_cells", n, ids.tolist(), f"{text} ({_ids(mesh, 'cell', ids)}).")


def _multiple_faces(mesh: Mesh, n: int, cells_of_one: list[int]) -> Finding | None:
    # A cell may have a face twice: then three half-faces are those of two cells.
    shared = "shared by three or more cells" if len(cells_of_one) != 2 else "there three times or more, in two cells"
    text = f"{_count(n, 'face')} {_verb(n, 'is', 'are')} {shared}"
    where = _ids(mesh, "cell", np.array(cells_of_one, np.int64)) if n else ""
    text = f"{text} ({'' if n == 1 else 'one by '}{where})."
    return _of_cells(mesh, "multiple_faces", n, cells_of_one, text)


def _split_faces(matched: Topology, split: NDArray[np.int64]) -> Finding | None:
    mesh, n = matched.mesh, len(split)
    ids = matched.cells[split].tolist()
    where = f" ({_both(mesh, ids[0][:1])} against {_both(mesh, ids[0][1:])})" if n else ""
    text = f"{_count(n, 'quadrilateral face')} {_verb(n, 'stands', 'stand')} against two triangles{where}."
    return _of_cells(mesh, "split_faces", n, [cell for cell, *_ in ids], text)


def _hanging(mesh: Mesh, result: Hanging) -> Finding | None:
    n, n_cells = len(result.points), len(result.cells)
    places = [_count(count, noun) for count, noun in ((result.n_edges, "edge"), (result.n_faces, "face")) if count]
    text = (
        f"{_count(n, 'point')} {_verb(n, 'hangs', 'hang')}, in {' and '.join(places)} of "
        f"{_count(n_cells, 'coarser cell')}, which {_verb(n_cells, 'does', 'do')} not have {_verb(n, 'it', 'them')}"
    )
    return _of_points(mesh, "hanging_points", result.points, text, level="defect")


def _hinges(matched: Topology, n_parts: int, *, conforms: bool) -> Finding | None:
    """Parts that touch at points or edges only; nothing is said where faces do not conform, nor of polyhedra alone."""
    if not conforms:
        return None
    unknown, opposite = np.zeros(matched.mesh.n_cells, np.int8), np.full(len(matched.cells), OPPOSITE, np.int8)
    parent, _, _ = driver.components_by_faces(matched.cells, matched.mates, opposite, unknown)
    with_faces = np.diff(matched.starts) > 0
    roots = np.unique(parent[with_faces])
    n = len(roots) - n_parts
    if n <= 0 or not with_faces[IS_SOLID[matched.mesh.types]].all():
        return None
    text = (
        f"The cells are {len(roots):,} parts by shared faces, but {n_parts:,} by shared points: "
        "some touch at an edge or a point only."
    )
    return Finding("hinges", "notice", n, tuple(roots[:EXAMPLES].tolist()), text)


def _parts(sizes: Sequence[int]) -> Finding | None:
    n = len(sizes)
    if n < 2:
        return None
    largest = ", ".join(f"{size:,}" for size in sizes[:EXAMPLES])
    more = ", ..." if n > EXAMPLES else ""
    text = f"The mesh is {n:,} parts that share no point, of {largest}{more} cells."
    return Finding("parts", "notice", n, (), text)


def _duplicate_points(
    mesh: Mesh, representative: IndexArray, ids: NDArray[np.int64], tolerance: float
) -> Finding | None:
    n = len(ids)
    exactly = int((mesh.points[ids] == mesh.points[representative[ids]]).all(axis=1).sum())
    how = "exactly" if exactly == n else f"{exactly:,} exactly, the others"
    least = points.LAST_PLACES * points.last_place(mesh.points, mesh.stored)
    is_last = least > tolerance * points.size(mesh.points)
    of = f"the last place of {mesh.stored} precision" if is_last else f"{tolerance:g} of the mesh's size"
    within = "" if exactly == n else f" within {of}"
    text = f"{_count(n, 'point')} {_verb(n, 'coincides', 'coincide')} with an earlier one, {how}{within}"
    return _of_points(mesh, "duplicate_points", ids, text)


def _interfaces(mesh: Mesh, interface: NDArray[np.bool_] | None, n_sides: int) -> Finding | None:
    """Cohesive and gasket cells, apart from the others, and how many coinciding points they account for."""
    if interface is None:
        return None
    ids = np.flatnonzero(interface)
    n = len(ids)
    sides = (
        f"; {_count(n_sides, 'coinciding point')} {_verb(n_sides, 'is', 'are')} of their two sides" if n_sides else ""
    )
    text = f"{_count(n, 'cohesive or gasket cell')} {_verb(n, 'is', 'are')} flat by design, and not measured{sides}"
    return _of_cells(mesh, "interface_cells", n, ids.tolist(), f"{text} ({_ids(mesh, 'cell', ids)}).", level="notice")


def _unused(mesh: Mesh, ids: NDArray[np.int64]) -> Finding | None:
    n = len(ids)
    text = f"{_count(n, 'point')} {_verb(n, 'belongs', 'belong')} to no cell"
    return _of_points(mesh, "unused_points", ids, text)


def _beside_solids(mesh: Mesh) -> list[Finding | None]:
    """What other cells have to do with the solid ones, if there are any of both."""
    is_solid = IS_SOLID[mesh.types]
    if is_solid.all() or not is_solid.any():
        return []
    alone, n_surface = surfaces.of_no_solid(mesh)
    ids = surfaces.points_of_no_solid(mesh)
    n, n_points = len(alone), len(ids)
    text = f"{n:,} of {_count(n_surface, 'surface cell')} {_verb(n, 'is', 'are')} no face of a solid cell"
    of_points = f"{_count(n_points, 'point')} {_verb(n_points, 'belongs', 'belong')} to no solid cell"
    return [
        _of_cells(mesh, "surface_cells", n, alone.tolist(), f"{text} ({_ids(mesh, 'cell', alone)}).", level="notice"),
        _of_points(mesh, "points_of_no_solid", ids, of_points),
    ]


def _of_cells(mesh: Mesh, name: str, n: int, cells: list[int], text: str, level: Level = "defect") -> Finding | None:
    """A finding about cells, of which the first few are examples; None if ``n`` is 0."""
    first = tuple(cells[:EXAMPLES])
    return Finding(name, level, n, first, text, cell_labels(mesh, first)) if n else None


def _of_points(mesh: Mesh, name: str, ids: NDArray[np.int64], text: str, level: Level = "notice") -> Finding | None:
    """A finding about points, which are named behind the text; None if there are none."""
    n, first = len(ids), tuple(ids[:EXAMPLES].tolist())
    text = f"{text} ({_ids(mesh, 'point', ids)})."
    return Finding(name, level, n, first, text, point_labels(mesh, first)) if n else None


def _count(n: int, noun: str) -> str:
    return f"{n:,} {noun}{'' if n == 1 else 's'}"


def _verb(n: int, one: str, several: str) -> str:
    return one if n == 1 else several


def _ids(mesh: Mesh, noun: Literal["cell", "point"], ids: NDArray[np.int64]) -> str:
    """``cell 3``, ``cells 3, 5, 9, ...``, with the file's own numbers in front, if it has any."""
    first = ids[:EXAMPLES].tolist()
    labels = cell_labels(mesh, first) if noun == "cell" else point_labels(mesh, first)
    return listed(noun, first, labels, more=len(ids) > EXAMPLES)


def _both(mesh: Mesh, cells: Sequence[int]) -> str:
    """``cell 3``, ``cells 3 and 5``, ``element 70 (cell 3) and element 71 (cell 5)``."""
    labels = cell_labels(mesh, cells)
    if labels:
        return " and ".join(cell_name(cell, label) for cell, label in zip(cells, labels, strict=True))
    return f"cell{'' if len(cells) == 1 else 's'} {' and '.join(map(str, cells))}"


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}."
