"""Meshes of one domain side by side, and the same cells before and after."""

from .comparison import Against, Builder, Comparison, Row, Side, comparison
from .pairs import Loss, PairCounts, PairedCells, correspond, pair_cells
from .superiority import Superiority, superiority

__all__ = [
    "Against",
    "Builder",
    "Comparison",
    "Loss",
    "PairCounts",
    "PairedCells",
    "Row",
    "Side",
    "Superiority",
    "comparison",
    "correspond",
    "pair_cells",
    "superiority",
]
