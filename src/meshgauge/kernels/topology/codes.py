"""What is said of a half-face, as kernels write it."""

from __future__ import annotations

BOUNDARY, MULTIPLE, COLLAPSED, ELSEWHERE = -1, -2, -3, -4
"""Instead of a mate: no other cell has this face; three or more have it; it has fewer than three distinct points; the
one other cell that has it is not among those that are looked at."""

OPPOSITE, SAME, CROSSED = 1, -1, 0
"""The winding of a half-face relative to its mate: opposite (right), the same, or the points in another order."""
