"""What the gate says of a mesh: data only."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from ..look import style
from ..look.names import cell_name, point_name
from ..look.records import brief
from .rules import Level, Rule

if TYPE_CHECKING:
    from ..quality.summary import Tally
    from ..report.record import StepOf


class State(StrEnum):
    """How a rule, or a mesh, came out."""

    PASS = "pass"
    EMPTY = "empty"  #: the mesh has no cell that the rule is about
    WARN = "warn"
    FAIL = "fail"
    UNCHECKED = "unchecked"  #: the rule could not be checked


@dataclass(frozen=True, slots=True)
class FailingCell:
    """A cell that breaks a rule, and where to look for it."""

    cell: int  #: position in the file, from 0
    type: str
    status: str
    metric: str
    value: float  #: of the metric; NaN if it has none
    node: int | None  #: position in the cell, from 0, of the node with the lowest J_ENS, or of one that is not finite
    point: int | None  #: its point id; None where no node is to blame
    coordinates: tuple[float, float, float]  #: of the point, else the mean of the nodes
    region: str | None  #: None if the mesh is of one region
    cell_label: int | None = None  #: the file's own number of the cell; None if it gives none
    point_label: int | None = None  #: that of the point
    spacing: float = 0.0  #: least distance of two nodes of the cell that are apart; 0 if none are

    def to_dict(self) -> dict[str, Any]:
        """Plain data; undefined numbers are NaN."""
        return {
            "cell": self.cell,
            "cell_label": self.cell_label,
            "type": self.type,
            "status": self.status,
            "metric": self.metric,
            "value": self.value,
            "node": self.node,
            "point": self.point,
            "point_label": self.point_label,
            "coordinates": list(self.coordinates),
            "region": self.region,
        }

    @property
    def text(self) -> str:
        """One phrase: ``hexahedron cell 521 (inverted, jens -0.06) at node 0, point 718 (0.11, 0.053, 0.016)``.

        With the file's numbers ``tetra element 7000 (cell 5), inverted, jens -0.06, at node 100 (point 7), (0.1, ...``.
        """
        value = "no value" if math.isnan(self.value) else f"{self.metric} {self.value:.4g}"
        reading = value if self.status == "ok" else f"{self.status}, {value}"
        if self.point is None:
            where = "around"
        elif self.point_label is None:
            where = f"at node {self.node}, {point_name(self.point)}"
        else:
            where = f"at {point_name(self.point, self.point_label)},"
        place = ", ".join(style.coordinates(self.coordinates, self.spacing))
        region = f" in {self.region}" if self.region is not None else ""
        reading = f" ({reading})" if self.cell_label is None else f", {reading},"
        return f"{self.type} {self.name}{reading}{region} {where} ({place})"

    @property
    def name(self) -> str:
        """``element 7000 (cell 521)``, or ``cell 521``."""
        return cell_name(self.cell, self.cell_label)


@dataclass(frozen=True, slots=True)
class Change:
    """A number that is worse than in the stored report."""

    cells: str  #: ``all``, or a cell type
    criterion: str  #: key of a row of `meshgauge.quality.summary.CRITERIA`
    before: float
    now: float
    text: str

    def to_dict(self) -> dict[str, Any]:
        """Plain data; undefined numbers are NaN."""
        return {
            "cells": self.cells,
            "criterion": self.criterion,
            "before": self.before,
            "now": self.now,
            "text": self.text,
        }


@dataclass(frozen=True, slots=True)
class Outcome:
    """How one rule came out on one mesh."""

    rule: Rule
    state: State
    text: str  #: one sentence, with the numbers
    n_cells: int = 0  #: cells that the rule is about
    n_failing: int = 0  #: of these, those that break it
    n_allowed: int = 0  #: so many may
    cells: tuple[FailingCell, ...] = ()  #: the first of those that break it, worst first; none if the rule passes
    changes: tuple[Change, ...] = ()  #: of ``no worse than``: what is worse

    __repr__ = brief

    @property
    def n_more(self) -> int:
        """Cells that break the rule and are not listed."""
        return max(self.n_failing - len(self.cells), 0) if self.cells else 0

    def to_dict(self) -> dict[str, Any]:
        """Plain data; undefined numbers are NaN."""
        return {
            "rule": str(self.rule),
            "level": self.rule.level.value,
            "state": self.state.value,
            "text": self.text,
            "n_cells": self.n_cells,
            "n_failing": self.n_failing,
            "n_allowed": self.n_allowed,
            "cells": [cell.to_dict() for cell in self.cells],
            "n_more": self.n_more,
            "changes": [change.to_dict() for change in self.changes],
        }


@dataclass(frozen=True, slots=True)
class Check:
    """How every rule came out on one mesh."""

    path: str
    n_points: int
    n_cells: int
    outcomes: tuple[Outcome, ...]
    notes: tuple[str, ...] = ()  #: what was noticed or changed while reading, a sentence each
    step: StepOf | None = None  #: which of several time steps it is
    tally: Tally | None = field(default=None, compare=False)  #: J_ENS of all cells, for pictures

    __repr__ = brief

    @property
    def state(self) -> State:
        """The gravest of the outcomes: UNCHECKED, FAIL, WARN, else PASS."""
        states = {outcome.state for outcome in self.outcomes}
        return next((s for s in (State.UNCHECKED, State.FAIL, State.WARN) if s in states), State.PASS)

    @property
    def is_passed(self) -> bool:
        """True if every rule was checked and none of level FAIL is broken."""
        return self.state in (State.PASS, State.WARN)

    def of(self, *states: State) -> tuple[Outcome, ...]:
        """The outcomes of these states."""
        return tuple(outcome for outcome in self.outcomes if outcome.state in states)

    def to_dict(self) -> dict[str, Any]:
        """Plain data; undefined numbers are NaN."""
        return {
            "path": self.path,
            "step": None if self.step is None else self.step.to_dict(),
            "n_points": self.n_points,
            "n_cells": self.n_cells,
            "state": self.state.value,
            "outcomes": [outcome.to_dict() for outcome in self.outcomes],
            "notes": list(self.notes),
        }


def first_step(checks: Iterable[Check]) -> Check | None:
    """Of time steps the first that breaks a rule; None if none does, or these are no steps."""
    return next((check for check in checks if check.step is not None and check.of(State.FAIL)), None)


def overall(checks: Iterable[Check], n_failed: int = 0) -> State:
    """The gravest of the states of several meshes; UNCHECKED if some could not be read: the answer is not complete."""
    states = {check.state for check in checks} | ({State.UNCHECKED} if n_failed else set())
    return next((s for s in (State.UNCHECKED, State.FAIL, State.WARN) if s in states), State.PASS)


def broken(level: Level) -> State:
    """What a rule of this level comes to if it is broken."""
    return State.FAIL if level is Level.FAIL else State.WARN
