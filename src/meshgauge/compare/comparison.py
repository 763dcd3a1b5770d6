"""Meshes of one domain side by side: which is better, in what, and for which type of cell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import MeshgaugeError
from ..look.records import brief
from ..quality.by_region import by_region
from ..quality.measure import Quality
from ..quality.summary import CRITERIA, KeyFigures, Summary, Tally, rankings
from .pairs import PairedCells, correspond, pair_cells
from .scores import Values, by_type
from .superiority import Superiority, superiority

KEYS = tuple(CRITERIA)
"""Every criterion."""

ALL = "all"

OUTSIDE = 0.01
"""Boxes that differ by more than this share of the size are reported."""

MIXED = 0.05
"""Shares of a type that differ by more than this are reported."""

Box = tuple[tuple[float, ...], tuple[float, ...]]


@dataclass(frozen=True)
class Side:
    """One of the meshes."""

    name: str
    n_points: int
    n_cells: int
    summary: Summary  #: of J_ENS
    box: Box | None  #: least and greatest finite coordinates; None if there are none
    samples: Mapping[str, Values]  #: ascending scores of the measured cells, by type
    regions: Mapping[str, Summary]  #: by name of the region; empty unless asked for

    __repr__ = brief

    def tally(self, cells: str) -> Tally | None:
        """That of all cells or of a type; None if none of them is measured."""
        tally = self.summary.all if cells == ALL else self.summary.types.get(cells)
        return tally if tally is not None and tally.n_measured else None

    def region(self, name: str) -> Tally | None:
        """The tally of a region; None if none of its cells is measured."""
        summary = self.regions.get(name)
        return summary.all if summary is not None and summary.all.n_measured else None

    def sample(self, cells: str) -> Values | None:
        """Ascending scores of all cells or of a type; None if none of them is measured."""
        if cells != ALL:
            return self.samples.get(cells)
        return np.sort(np.concatenate(list(self.samples.values()))) if self.samples else None


@dataclass(frozen=True, slots=True)
class Row:
    """One criterion for some cells: the value of each mesh (None: nothing measured), and which are best."""

    criterion: str  #: key of a row of `meshgauge.quality.summary.CRITERIA`
    values: tuple[float | None, ...]
    best: tuple[int, ...]  #: positions of the best meshes; all of them if equal; none if they cannot be ranked

    __repr__ = brief

    def to_dict(self) -> dict[str, Any]:
        """Plain data."""
        return {"values": list(self.values), "best": list(self.best)}


@dataclass(frozen=True, slots=True)
class Against:
    """One mesh against the first."""

    position: int
    superiority: Mapping[str, Superiority]  #: of this mesh over the first: for all cells, and types that both have
    paired: PairedCells | None
    why_not: str  #: why the cells do not correspond

    __repr__ = brief

    def to_dict(self) -> dict[str, Any]:
        """Plain data; undefined numbers are NaN."""
        return {
            "superiority": {cells: one.to_dict() for cells, one in self.superiority.items()},
            "paired": self.paired.to_dict() if self.paired is not None else None,
            "why_not": self.why_not,
        }


@dataclass(frozen=True)
class Comparison:
    """Several meshes compared; the first is what the others are held against."""

    sides: tuple[Side, ...]
    rows: Mapping[str, tuple[Row, ...]]  #: for all cells (``all``, last) and for each type
    regions: Mapping[str, tuple[Row, ...]]  #: for each region that a mesh has, by its name; empty unless asked for
    against: tuple[Against, ...]  #: the others, in order
    notes: tuple[str, ...]  #: reasons to doubt the comparison, a sentence each

    __repr__ = brief

    def to_dict(self, bins: int = 20) -> dict[str, Any]:
        """Plain data; undefined numbers are NaN."""
        return {
            "meshes": [
                {"name": side.name, "n_points": side.n_points, "n_cells": side.n_cells, **side.summary.to_dict(bins)}
                for side in self.sides
            ],
            "criteria": _plain(self.rows),
            "regions": _plain(self.regions),
            "against": [{"mesh": self.sides[one.position].name, **one.to_dict()} for one in self.against],
            "notes": list(self.notes),
        }


def comparison(meshes: Mapping[str, Quality], *, losses: int = 5, by_regions: bool = False) -> Comparison:
    """Compare what was measured on two or more meshes of the same domain.

    Parameters
    ----------
    meshes
        From `meshgauge.measure`, by name. The first is what the others are held against.
    losses
        How many of the largest losses to name where cells correspond.
    by_regions
        Compare by region as well; regions of the same name are taken to be the same.

    Raises
    ------
    MeshgaugeError
        If there are fewer than two.

    Notes
    -----
    Where the cells of a mesh correspond to those of the first (as many, of the same types, on the same points), they
    are compared one by one. Where not, and besides, the statement is how often a random cell of one is better than a
    random cell of the other. No significance is claimed: the cells are all there are, and neighbours depend on each
    other.
    """
    if len(meshes) < 2:
        raise MeshgaugeError(f"cannot compare {len(meshes)} meshes, expected two or more")
    (first, reference), *others = meshes.items()
    builder = Builder(first, reference, losses=losses, by_regions=by_regions)
    for name, quality in others:
        builder.add(name, quality)
    return builder.finish()


class Builder:
    """A comparison in the making: of all meshes but the first only what is needed stays in memory."""

    def __init__(self, name: str, reference: Quality, *, losses: int = 5, by_regions: bool = False) -> None:
        self.reference = reference
        self.losses = losses
        self.by_regions = by_regions
        self.sides = [_side(name, reference, by_regions)]
        self.pairs: list[tuple[PairedCells | None, str]] = []

    def add(self, name: str, quality: Quality) -> None:
        """Another mesh."""
        why = correspond(self.reference.mesh, quality.mesh)
        pairs = None if why else pair_cells(self.reference, quality, losses=self.losses)
        self.sides.append(_side(name, quality, self.by_regions))
        self.pairs.append((pairs, why))

    def finish(self) -> Comparison:
        """Of all that were added."""
        names = list(dict.fromkeys(t for side in self.sides for t in side.summary.types if side.tally(t)))
        kinds = [*(names if len(names) > 1 else ()), ALL]
        against = []
        for at, (pairs, why) in enumerate(self.pairs, 1):
            superior = {}
            for cells in kinds:
                a, b = self.sides[0].sample(cells), self.sides[at].sample(cells)
                if a is not None and b is not None:
                    superior[cells] = superiority(b, a)
            against.append(Against(at, superior, pairs, why))
        return Comparison(
            sides=tuple(self.sides),
            rows={cells: _rows([side.tally(cells) for side in self.sides]) for cells in kinds},
            regions={
                region: _rows([side.region(region) for side in self.sides])
                for region in dict.fromkeys(name for side in self.sides for name in side.regions if side.region(name))
            },
            against=tuple(against),
            notes=tuple(_notes(self.sides)),
        )


def _side(name: str, quality: Quality, by_regions: bool) -> Side:
    mesh = quality.mesh
    regions = dict(by_region(quality)[1]) if by_regions else {}
    return Side(name, mesh.n_points, mesh.n_cells, quality.summary(), _box(mesh.points), by_type(quality), regions)


def _box(points: NDArray[np.floating]) -> Box | None:
    columns = [column[np.isfinite(column)] for column in points.T]
    if not all(map(len, columns)):
        return None
    return tuple(float(c.min()) for c in columns), tuple(float(c.max()) for c in columns)


def _plain(groups: Mapping[str, tuple[Row, ...]]) -> dict[str, Any]:
    return {name: {row.criterion: row.to_dict() for row in rows} for name, rows in groups.items()}


def _rows(tallies: Sequence[Tally | None]) -> tuple[Row, ...]:
    there = [at for at, tally in enumerate(tallies) if tally is not None]
    rows = []
    for ranking in rankings([KeyFigures.of(tally) for tally in tallies if tally is not None], KEYS) if there else ():
        values: list[float | None] = [None] * len(tallies)
        for at, value in zip(there, ranking.values, strict=True):
            values[at] = value
        best = [there[at] for at in ranking.best]
        row = ranking.criterion
        if row.kind in ("value", "quantile") and row.key != "mean" and max(ranking.values) < 0:
            best = []  # below 0 less is not worse
        rows.append(Row(row.key, tuple(values), tuple(best)))
    return tuple(rows)


def _notes(sides: Sequence[Side]) -> list[str]:
    first = sides[0]
    return [note for side in sides[1:] for note in (_other_box(first, side), _other_mix(first, side)) if note]


def _other_box(first: Side, side: Side) -> str:
    if first.box is None or side.box is None:
        return ""
    box = np.array(first.box, np.float64)
    size = float(np.linalg.norm(box[1] - box[0]))
    gap = float(np.abs(np.array(side.box, np.float64) - box).max())
    if gap <= OUTSIDE * size:
        return ""
    share = f"{100 * gap / size:.3g} % of the size of {first.name}" if size else f"{gap:.3g}"
    return f"The box of {side.name} differs by {share}: are these meshes of the same domain?"


def _other_mix(first: Side, side: Side) -> str:
    """That types have other shares, so that numbers of all cells tell of the mix as well."""
    if not first.samples or not side.samples:
        return ""
    gaps = {name: _share(side, name) - _share(first, name) for name in {*first.samples, *side.samples}}
    name = max(sorted(gaps), key=lambda name: abs(gaps[name]))
    if abs(gaps[name]) <= MIXED:
        return ""
    return (
        f"{100 * _share(side, name):.3g} % of the cells of {side.name} are {name}, "
        f"{100 * _share(first, name):.3g} % of {first.name}: compare them type by type."
    )


def _share(side: Side, name: str) -> float:
    return len(side.samples.get(name, ())) / sum(map(len, side.samples.values()))
