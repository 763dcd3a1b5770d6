"""Meshes measured slice by slice: facts of the whole, partial results, and their merging, to the last bit.

Knows no report and no rule. `report.stream` and `check.stream` stand on it.
"""

from .ask import Ask
from .facts import Facts, facts_of
from .job import Job
from .partial import Partial
from .run import Progress, measure_pieces

__all__ = ["Ask", "Facts", "Job", "Partial", "Progress", "facts_of", "measure_pieces"]
