"""What a metric says about many cells: counts, extremes, mean, quantiles and histogram, by cell type and over all.

A summary is a mergeable record: merge those of any split of the cells, in any order, and the result equals the
summary of the whole, bit for bit. Three things make it so: sums are exact integers, up to `EXACT` values are kept as
they are, and more are counted in fixed fine bins, a choice that depends on nothing but how many there are.
"""

from .ranking import CRITERIA, ROUNDING, Criterion, KeyFigures, Ranking, rankings
from .record import Summary, summarise, summarise_nothing
from .scale import Scale
from .tally import EXACT, QUANTILES, UNDEFINED, Tally

__all__ = [
    "CRITERIA",
    "EXACT",
    "QUANTILES",
    "ROUNDING",
    "UNDEFINED",
    "Criterion",
    "KeyFigures",
    "Ranking",
    "Scale",
    "Summary",
    "Tally",
    "rankings",
    "summarise",
    "summarise_nothing",
]
