"""What a report is made of: data only."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

from ..look.records import brief
from ..mesh.same_cells import note_on_parts
from ..quality.companions import companions, companions_by_region
from ..quality.summary import Summary, summarise_nothing
from .finite_volume import FiniteVolumeMeasure, finite_volume

if TYPE_CHECKING:
    from ..doctor import Diagnosis
    from ..quality.measure import Quality
    from ..quality.worst import StatusCells, WorstCell

WORST = 10
"""Worst cells of a report."""


@dataclass(frozen=True, slots=True)
class StepOf:
    """A time step of a file."""

    file: str
    number: int  #: from 1
    time: float | None = None  #: None if the file tells none

    def to_dict(self) -> dict[str, Any]:
        """Plain data, for JSON."""
        return {"file": self.file, "number": self.number, "time": self.time}


@dataclass(frozen=True)
class FileReport:
    """One measured mesh."""

    path: str
    n_points: int
    n_cells: int
    summary: Summary  #: of J_ENS
    worst: tuple[WorstCell, ...] = ()  #: worst first
    others: tuple[Summary, ...] = ()  #: of other metrics, in the order asked for
    notes: tuple[str, ...] = ()  #: what was noticed while reading, a sentence each
    findings: tuple[StatusCells, ...] = ()  #: cells that are not ok, by status
    diagnosis: Diagnosis | None = None  #: what else is wrong with the mesh; None if it was not looked for
    regions: tuple[tuple[str, Summary], ...] = ()  #: name and J_ENS of each region; none unless asked for
    region_companions: tuple[tuple[Summary, ...], ...] = ()  #: `companions` of each of the regions
    worst_regions: tuple[str, ...] = ()  #: name of the region of each of the worst cells; none unless asked for
    finite_volume: tuple[FiniteVolumeMeasure, ...] = ()  #: what finite volumes ask for, if it was measured
    step: StepOf | None = None  #: which of several time steps it is
    dimension: int = 3  #: 3: solid cells were measured, 2: surface cells
    mixed_processors: bool = False  #: parts came from processors that differ in the last bits of values
    companions: tuple[Summary, ...] = ()  #: of the mean of the corners' J_ENS and of the edge ratio

    __repr__ = brief

    @classmethod
    def of(
        cls,
        quality: Quality,
        *,
        path: str | None = None,
        worst: int = WORST,
        by_region: bool = False,
        with_diagnosis: bool = False,
        threads: int | None = None,
    ) -> FileReport:
        """The report on a mesh, with every metric that was measured on it.

        Parameters
        ----------
        quality
            From `meshgauge.measure`.
        path
            What to call the mesh; None: the file that it was read from, else "mesh".
        worst
            How many of the worst cells to list.
        by_region
            Summarise each region as well, and name that of each of the worst cells.
        with_diagnosis
            Look for what is wrong beside the shapes of cells, unless the mesh has more than `meshgauge.doctor.LIMIT`
            cells.
        threads
            At most this many; None: one for each processor. It has no influence on the report.
        """
        mesh = quality.mesh
        summaries = {name: quality.summary(name, threads=threads) for name in quality.metrics}
        cells = tuple(quality.worst(worst)) if worst else ()
        if by_region:
            beside = _by_region(quality, cells, threads)
        else:
            beside = {"companions": companions(quality, threads=threads)}
        return cls(
            path=path or mesh.path or "mesh",
            n_points=mesh.n_points,
            n_cells=mesh.n_cells - (0 if mesh.is_ghost is None else int(mesh.is_ghost.sum())),
            summary=summaries.pop("jens"),
            worst=cells,
            others=tuple(summaries.values()),
            notes=(*mesh.notes, *note_on_parts(mesh)),
            findings=tuple(quality.findings()),
            diagnosis=_diagnosis(quality) if with_diagnosis else None,
            finite_volume=finite_volume(quality),
            dimension=mesh.dimension,
            **beside,
        )


def _by_region(quality: Quality, worst: tuple[WorstCell, ...], threads: int | None) -> dict[str, Any]:
    """Summaries of each region and of the whole, and the region of each of the worst cells."""
    from ..quality.by_region import by_region

    ids, regions = by_region(quality)
    several = len(regions) > 1
    whole, of_regions = companions_by_region(quality, ids if several else None, threads=threads)
    nothing = tuple(map(summarise_nothing, whole))
    return {
        "companions": whole,
        "regions": regions,
        "region_companions": tuple(of_regions.get(n, nothing) for n in range(len(regions))) if several else (whole,),
        "worst_regions": tuple(regions[ids[cell.cell]][0] for cell in worst),
    }


def _diagnosis(quality: Quality) -> Diagnosis:
    from ..doctor import LIMIT, diagnosis

    return diagnosis(quality.mesh, quality, limit=LIMIT)


def short_names(paths: list[str]) -> list[str]:
    """The last parts of each path, as many as it takes to tell the paths apart."""
    parts = [PurePath(path).parts for path in paths]
    for length in range(1, max(map(len, parts), default=1) + 1):
        names = [str(PurePath(*p[-length:])) if p else "" for p in parts]
        if len(set(names)) == len(set(paths)):
            return names
    return list(paths)
