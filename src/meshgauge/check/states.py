"""Time steps held against rules in processes, a step each."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from ..io.plumbing.pieces import ReadWhole
from ..quality.metrics import LIMITS
from ..quality.neighbours import with_face_metrics
from ..report.record import StepOf
from ..report.states import StateReader
from ..report.stream import job_of
from ..slices import measure_pieces
from .baseline import Baseline
from .judge import check, metrics_of
from .outcome import Check
from .rules import Rule
from .stream import check_slices, question


@dataclass(frozen=True)
class CheckJob:
    """What each step is held against; called with one, it returns the outcome. It can be sent to other processes.

    Attributes
    ----------
    reader
        How it is read and measured.
    rules, listed, baselines
        As for `check`.
    """

    reader: StateReader
    rules: tuple[Rule, ...] | None
    listed: int
    baselines: Mapping[Path, Baseline]

    def __call__(self, path: str, step: StepOf) -> Check:
        """How the rules come out on a step, which is to be called ``path``."""
        reader = self.reader
        listed = reader.pieces(step)
        with contextlib.suppress(ReadWhole):
            if listed is not None:
                ask = question(self.rules, listed=self.listed, purpose=reader.purpose, poor_below=reader.poor_below)
                ask = replace(ask, keep_bricks=reader.keep_bricks, dimension=reader.dimension)
                job = job_of(listed, ask, memory=reader.memory, wedge_order=reader.wedge_order)
                done = check_slices(job, measure_pieces(job, threads=1), path=path, baselines=self.baselines)
                return replace(done, step=step)
        quality = reader.quality(step, metrics_of(self.rules or ()))
        if self.rules is None and quality.mesh.purpose == "fv":
            quality = with_face_metrics(quality, LIMITS, 1)
        done = check(quality, self.rules, path=path, listed=self.listed, baselines=self.baselines)
        return replace(done, step=step)
