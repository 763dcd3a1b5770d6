"""Options of ``meshgauge report``: what is measured and listed."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from ...errors import OptionError
from .. import options
from ..options import MEASURING, WRITING, option

WORST_OF_ONE, WORST_OF_SEVERAL = 10, 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Contents:
    """What a report holds."""

    worst: options.WorstIfGiven = None
    bins: options.Bins = 20
    metric: options.Metrics = None
    compare_metric: Annotated[
        list[str] | None,
        option("--compare-metric", "NAME", "Ask Verdict, through VTK, for this; repeatable.", MEASURING, default=False),
    ] = None
    by: options.By = None
    cell: options.Cell = None
    diagnosis: Annotated[
        bool,
        option("--diagnosis/--no-diagnosis", None, "Look for what else is wrong, see 'meshgauge doctor'.", MEASURING),
    ] = True

    def n_worst(self, *, several: bool) -> int:
        """How many of the worst cells are listed: by default fewer if there are several meshes."""
        if self.worst is not None:
            return self.worst
        return WORST_OF_SEVERAL if several else WORST_OF_ONE

    def metrics(self) -> tuple[str, ...]:
        """The metrics asked for, J_ENS first, each once; those of Verdict may be named without their prefix.

        Raises
        ------
        MetricError
            If there is no such metric.
        """
        from ...quality.metrics import metric
        from ...quality.metrics.verdict_library import PREFIX

        verdict = (name if name.startswith(PREFIX) else PREFIX + name for name in self.compare_metric or ())
        return tuple(dict.fromkeys(metric(name).name for name in ("jens", *(self.metric or ()), *verdict)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Apart:
    """Parts of a mesh that are measured apart."""

    partial: Annotated[
        Path | None,
        option("--partial", "FILE", "Keep what was measured of this part, for 'meshgauge merge' (.mgp).", WRITING),
    ] = None
    share: Annotated[
        str | None,
        option("--share", "K/N", "With --partial: of N shares of the cells measure the K-th.", MEASURING),
    ] = None

    rule: Annotated[
        list[str] | None,
        option("--rule", "RULE", "With --partial: count what it comes to, for 'check *.mgp'; repeatable.", WRITING),
    ] = None

    def shares(self) -> tuple[int, int]:
        """Which share of how many. Raises `OptionError`."""
        if self.rule and self.partial is None:
            raise OptionError("--rule counts for a partial report: give --partial FILE, or check the mesh")
        if self.share is None:
            return 1, 1
        match = re.fullmatch(r"(\d{1,9})/(\d{1,9})", self.share)
        if match is None or not 1 <= int(match[1]) <= int(match[2]):
            raise OptionError(f"--share is {self.share!r}, expected K/N with 1 <= K <= N, such as 3/8")
        if self.partial is None:
            raise OptionError("--share measures some of the cells: give --partial FILE, and merge the files")
        return int(match[1]), int(match[2])
