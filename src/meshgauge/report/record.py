"""What a report is made of: data only, nothing to read or measure."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import PurePath
from typing import TYPE_CHECKING

from ..quality.summary import Summary

if TYPE_CHECKING:
    from ..doctor import Diagnosis
    from ..quality.measure import StatusCells, WorstCell


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
    worst_regions: tuple[str, ...] = ()  #: name of the region of each of the worst cells; none unless asked for


def short_names(paths: list[str]) -> list[str]:
    """The last parts of each path, as many as it takes to tell the paths apart."""
    parts = [PurePath(path).parts for path in paths]
    for length in range(1, max(map(len, parts), default=1) + 1):
        names = [str(PurePath(*p[-length:])) if p else "" for p in parts]
        if len(set(names)) == len(set(paths)):
            return names
    return list(paths)
