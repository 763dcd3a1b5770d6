"""Meshes measured slice by slice: facts of the whole, partial results, and their merging, to the last bit.

Knows no report and no rule. `report.stream` and `check.stream` stand on it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from .._lazy import door

if TYPE_CHECKING:
    from .ask import Ask as Ask
    from .facts import Facts as Facts
    from .facts import facts_of as facts_of
    from .job import Job as Job
    from .partial import Partial as Partial
    from .run import Progress as Progress
    from .run import measure_pieces as measure_pieces

_HOME = {
    "Ask": "ask",
    "Facts": "facts",
    "facts_of": "facts",
    "Job": "job",
    "Partial": "partial",
    "Progress": "run",
    "measure_pieces": "run",
}
"""The module of each public name."""

__all__ = sorted(_HOME)

if not TYPE_CHECKING:  # to type checkers a name that is not imported above is an error
    __getattr__, __dir__ = door(__name__, _HOME)
