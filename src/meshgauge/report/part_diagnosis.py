"""The diagnosis of a mesh of which every part is measured apart: what is kept of a part, and what all say together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from ..doctor import LIMIT, Diagnosis, not_diagnosed
from ..doctor.inward import InwardEntries
from ..doctor.points import TOLERANCE
from ..doctor.streamed import Marks
from ..doctor.streamed.marks import marks_of
from ..doctor.streamed.passes import Passes
from ..errors import ReadError
from ..files.plain_records import NotPlain
from ..mesh import CellBlock, Mesh
from ..mesh.ghosts import without_ghosts
from ..mesh.labels import cell_labels, has_labels, point_labels
from ..mesh.mesh import Precision
from ..quality.measure import Quality
from ..slices import Job
from ..slices.facts import Labels
from ..slices.points import WINDOW
from ..status import Purpose
from .diagnosis import room_for, source_of, why_no_memory

if TYPE_CHECKING:
    from ..doctor.streamed.open_cells import OpenCells
    from .partial_report import PartialReport

Ids = NDArray[np.int64]

MOST = 1 << 28
"""Bytes of what is kept of a part for the diagnosis; more are left out."""

IN_OTHERS = "Whether surface cells of one part are faces inside of another is not known from partial reports."

_INSIDE = (
    "some cells of a part lie inside of another, and of each only the outer cells are known; measure the parts as one "
    "mesh (--as-one), or their file as a whole"
)

PER_CELL = 1000
"""Bytes that a cell which is kept takes where the parts are put together."""

NOT_ASKED = "not asked"
"""Stands for parts that were measured without."""


def open_cells(
    job: Job, marks: Marks, memory: int | None, share: tuple[int, int], *, tolerance: float = TOLERANCE
) -> OpenCells | str:
    """What is kept of a part of a mesh, or of a share of it, for the diagnosis of the whole; or why nothing is."""
    from ..doctor.streamed.open_cells import PartOf
    from ..doctor.streamed.opening import open_cells_of

    source, pieces, facts = source_of(job, marks, tolerance, share), job.pieces, job.facts
    polys = [piece.polyhedra for piece in pieces.pieces if piece.polyhedra is not None]
    part = PartOf(
        first_cell=source.first_cell,
        first_point=source.first_point,
        n_all_faces=0 if all("labels" in one for one in polys) else int(pieces.face_starts[-1]),
        parts=pieces.parts,
        cell_labels=facts.cell_labels,
        point_labels=facts.point_labels,
        has_all_points=share[1] == 1,
    )
    inward = marks.inward.moved(-source.first_cell, -source.first_point)
    room = room_for(job, memory)
    return _limited(open_cells_of(source, source.marks, inward, part, tolerance=tolerance, room=room))


def _limited(kept: OpenCells) -> OpenCells | str:
    """The same, or why it is too large to be kept."""
    n = kept.n_bytes
    return kept if n <= MOST else f"it takes {n / 1e6:,.0f} MB, more than the {MOST / 1e6:,.0f} that are kept"


@dataclass(frozen=True, eq=False)
class _InMemory:
    """A part that is in memory, without its ghosts, as a `meshgauge.doctor.streamed.Source`."""

    mesh: Mesh
    silent: None = None
    known: None = None
    joined: None = None
    passes: Passes = field(default_factory=Passes)

    @property
    def n_cells(self) -> int:
        return self.mesh.n_cells

    @property
    def n_points(self) -> int:
        return self.mesh.n_points

    @property
    def stored(self) -> Precision:
        return self.mesh.stored or "double"

    @property
    def purpose(self) -> Purpose:
        return self.mesh.purpose

    @property
    def dimension(self) -> Literal[2, 3]:
        return self.mesh.dimension

    @property
    def up(self) -> Literal[-1, 0, 1]:
        return self.mesh.up

    @property
    def blocks(self) -> Sequence[CellBlock]:
        return self.mesh.blocks

    def cells(self) -> Iterator[tuple[int, int, Mesh]]:
        yield 0, 0, self.mesh

    def points(self) -> Iterator[NDArray[np.floating]]:
        for start in range(0, self.n_points, WINDOW):
            yield self.mesh.points[start : start + WINDOW]

    def points_of(self, ids: Ids) -> NDArray[np.floating]:
        return self.mesh.points[ids]

    def cell_labels(self, ids: Sequence[int]) -> tuple[int | None, ...]:
        return cell_labels(self.mesh, ids)

    def point_labels(self, ids: Sequence[int]) -> tuple[int | None, ...]:
        return point_labels(self.mesh, ids)


def open_cells_of_mesh(quality: Quality, *, tolerance: float = TOLERANCE) -> OpenCells | str:
    """The same of a part that is in memory."""
    from ..doctor.streamed.open_cells import PartOf
    from ..doctor.streamed.opening import open_cells_of

    real = without_ghosts(quality.mesh)
    poly = real.polyhedra
    mesh = real if poly is None else real.replace(polyhedra=poly.with_own_faces())
    part = PartOf(
        n_all_faces=0 if poly is None or poly.labels is not None else poly.n_faces,
        parts=mesh.parts,
        cell_labels=_how(mesh, "cell"),
        point_labels=_how(mesh, "point"),
    )
    inward = InwardEntries.of(real)
    return _limited(open_cells_of(_InMemory(mesh), marks_of(quality), inward, part, tolerance=tolerance))


def _how(mesh: Mesh, what: Literal["cell", "point"]) -> Labels:
    return "none" if not has_labels(mesh, what) else "counted" if f"{what}s" in mesh.counted else "stored"


def merged_diagnosis(
    files: Sequence[Sequence[PartialReport]], *, memory: int | None, is_double: bool, tolerance: float = TOLERANCE
) -> Diagnosis | None:
    """The diagnosis of the mesh that some files are together, of which the shares are given, and which ``is_double`` if
    some cells are in several; None if none was looked at for it."""
    given = [one for shares in files for one in shares]
    if all(one.not_diagnosed == NOT_ASKED for one in given):
        return None
    n_cells, n_points = (sum(getattr(shares[0], name) for shares in files) for name in ("n_cells", "n_points"))
    lacking = next((one for one in given if one.open_cells is None), None)
    if lacking is not None:
        why = "that was not asked for" if lacking.not_diagnosed == NOT_ASKED else lacking.not_diagnosed
        reason = f"what it takes is not in the partial report of {lacking.path}: {why}"
    else:
        kept = [one.open_cells for one in given if one.open_cells is not None]
        more = max(PER_CELL * sum(one.cells.n for one in kept), sum(one.n_bytes_of_cells for one in kept))
        reason = _INSIDE if is_double else why_no_memory(n_cells, n_points, memory, more)
    if reason:
        return not_diagnosed(n_cells, LIMIT, reason=reason, tolerance=tolerance)
    from ..doctor.streamed.of_parts import Overlap, Placed, diagnosis_of_parts

    placed: list[Placed] = []
    cells = points = faces = 0
    for number, shares in enumerate(files):
        opened = [one.open_cells for one in shares if one.open_cells is not None]
        placed += [Placed(one, number, cells, points, faces) for one in opened]
        cells, points = cells + shares[0].n_cells, points + shares[0].n_points
        faces += opened[0].n_all_faces
    measured = next((one for one in given if one.summary.all.n_measured), given[0])
    try:
        made = diagnosis_of_parts(
            placed,
            n_points=points,
            purpose=measured.summary.purpose,
            up=1 if measured.up > 0 else -1 if measured.up < 0 else 0,
            tolerance=tolerance,
        )
        return replace(made, skipped=(*made.skipped, *_unknown(made, len(files))))
    except NotPlain as error:
        raise ReadError(f"a partial report is damaged: {error}") from error
    except Overlap:
        return not_diagnosed(n_cells, LIMIT, reason=_INSIDE, tolerance=tolerance)


def _unknown(made: Diagnosis, n_files: int) -> tuple[str, ...]:
    """What parts, of which the outer cells are known, cannot tell."""
    found = made.finding("surface_cells") is not None and n_files > 1
    return (IN_OTHERS,) if found else ()
