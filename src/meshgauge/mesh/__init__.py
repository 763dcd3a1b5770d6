"""A mesh and what is derived from it: polyhedra, topology, regions, node positions."""

from __future__ import annotations

from .mesh import CellBlock, CellIds, Mesh, Precision

__all__ = ["CellBlock", "CellIds", "Mesh", "Precision"]
