"""Meshes side by side as a page: distributions over each other, two in one scene, cells that lost and won."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..look.bands import PoorBelow
from ..report import FileReport
from ..report.html.frame import Frame
from ..report.html.page import page
from ..report.html.section import BUDGET, Section, section
from .comparison import Comparison
from .pairs import Loss, PairCounts, correspond, gains
from .sentences import sentences

if TYPE_CHECKING:
    from ..quality.measure import Quality

ROOM = 1.05
"""By so much the frame of the first mesh is larger, for others of the same domain."""


class Paired(NamedTuple):
    """A mesh of which the cells correspond to those of the first."""

    name: str
    rows: list[tuple[str, PairCounts]]
    losses: tuple[Loss, ...]
    gains: tuple[Loss, ...]


@dataclass(frozen=True)
class Lead:
    """What stands before the sections."""

    names: tuple[str, ...]
    sentences: tuple[str, ...]
    pairs: tuple[Paired, ...]
    has_wipe: bool
    poor: PoorBelow
    template: str = "compare.html.jinja"


class Pages:
    """A page in the making: of each mesh only its section is kept, and the first as the comparison keeps it."""

    def __init__(self, n_meshes: int, *, worst: int, bins: int = 20) -> None:
        self.budget, self.worst, self.bins = BUDGET // max(n_meshes, 1), worst, bins
        self.sections: list[Section] = []
        self.gains: list[tuple[Loss, ...]] = []
        self.first: Quality | None = None
        self.frame: Frame | None = None
        self.has_wipe = False

    def add(self, name: str, quality: Quality) -> None:
        """Another mesh."""
        if self.first is None:
            self.first, own = quality, Frame.of(quality.mesh.points)
            self.frame = replace(own, half=own.half * ROOM)
        elif not correspond(self.first.mesh, quality.mesh):
            self.gains.append(gains(self.first, quality, self.worst))
        else:
            self.gains.append(())
        assert self.frame is not None
        shown = self.frame.shown(quality.mesh.points)
        is_near = bool((np.abs(shown[np.isfinite(shown)]) <= 1.0).all())
        report = FileReport.of(quality, path=name, worst=self.worst)
        frame = self.frame if is_near else None
        self.sections.append(section(quality, report, bins=self.bins, budget=self.budget, frame=frame))
        if len(self.sections) == 2:
            self.has_wipe = is_near and all(one.model is not None for one in self.sections)

    def finish(self, comparison: Comparison) -> str:
        """The text of the page."""
        names = tuple(one.path for one in self.sections)
        pairs = tuple(
            Paired(
                names[one.position],
                [*(one.paired.types.items() if len(one.paired.types) > 1 else ()), ("all", one.paired.all)],
                one.paired.losses,
                self.gains[one.position - 1],
            )
            for one in comparison.against
            if one.paired is not None
        )
        assert self.first is not None
        texts = tuple(text for text in (*sentences(comparison), *comparison.notes) if text)
        lead = Lead(names, texts, pairs, self.has_wipe, self.first.poor_below)
        return page(self.sections, title=" and ".join(names[:2]), lead=lead, templates=__package__)
