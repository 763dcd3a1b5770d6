"""Measure every cell of a 3D mesh, of every type, with one number."""

__version__ = "0.1.0"
