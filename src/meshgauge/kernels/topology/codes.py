"""What is said of a half-face, as kernels write it."""

from __future__ import annotations

BOUNDARY, MULTIPLE, COLLAPSED = -1, -2, -3
"""Instead of a mate: no other cell has this face; three or more have it; it has fewer than three distinct points."""

OPPOSITE, SAME, CROSSED = 1, -1, 0
"""The winding of a half-face relative to its mate: opposite (right), the same, or the points in another order."""
