"""Reference cells of polyhedra: the convex regular-faced solids, and a model of single corners where there is none."""

from __future__ import annotations

from .corner import corner_cosines, corner_model
from .table import Solid, antiprism, prism, solid, solids

__all__ = ["Solid", "antiprism", "corner_cosines", "corner_model", "prism", "solid", "solids"]
