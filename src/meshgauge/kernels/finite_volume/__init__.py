"""Geometry of faces as finite volumes take it."""
