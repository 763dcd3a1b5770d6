"""Meshes of surface cells, in a plane or in space: points move in it, one at a time, until their cells are better."""
