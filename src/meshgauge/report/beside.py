"""What tables of J_ENS show beside it: the mean of the corners' values, and the edge ratio that 1 % are below."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..quality.summary import Summary, Tally
from .record import FileReport

Tallies = Mapping[str, tuple[Tally, ...]]
"""Of `quality.companions.NAMES`, by the name of a row of a table."""

LEGEND = "nodes: mean of the corners' J_ENS; edges: edge ratio, 1 % of the cells are below"


def of_types(report: FileReport) -> Tallies:
    """By name of type, and of all cells; none where they were not measured."""
    if not report.companions:
        return {}
    names = [name for name in report.summary.types if all(name in one.types for one in report.companions)]
    by_type = {name: tuple(one.types[name] for one in report.companions) for name in names}
    return {**by_type, "all": tuple(one.all for one in report.companions)}


def of_regions(names: Sequence[str], companions: Sequence[tuple[Summary, ...]]) -> Tallies:
    """By name of region; none where they were not measured."""
    return {name: tuple(one.all for one in some) for name, some in zip(names, companions, strict=False)}


def nodes(tallies: Sequence[Tally]) -> float:
    """The mean of the corners' J_ENS."""
    return tallies[0].mean


def edges(tallies: Sequence[Tally]) -> float:
    """The edge ratio that 1 % of the cells are below."""
    return tallies[1].quantiles((0.01,))[0.01]
