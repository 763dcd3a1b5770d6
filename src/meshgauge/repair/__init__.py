"""Repair: moving the points of a mesh so that no cell is inverted and the worst are better."""

from __future__ import annotations

from .engine import BOUNDARIES, Improvement, improve
from .report import Claim, Displacement, LimitedCell, RepairReport, WorsenedCell
from .run import Progress

__all__ = [
    "BOUNDARIES",
    "Claim",
    "Displacement",
    "Improvement",
    "LimitedCell",
    "Progress",
    "RepairReport",
    "WorsenedCell",
    "improve",
]
