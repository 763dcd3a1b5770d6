"""Repair: moving the points of a mesh so that no cell is inverted and the worst are better."""

from __future__ import annotations

from .certificate import Certificate, Claim, Limited, Moved, Worse
from .engine import BOUNDARIES, Improvement, improve
from .run import Progress

__all__ = ["BOUNDARIES", "Certificate", "Claim", "Improvement", "Limited", "Moved", "Progress", "Worse", "improve"]
