"""What the kernels of polyhedra say and are given in codes: apart from them, as they load Numba."""

from __future__ import annotations

# What may be wrong with a cell, one bit each; `Fault` gives them names.
NO_FACES = 1
SMALL_FACE = 2
REPEATED_POINT = 4
OPEN = 8
NON_MANIFOLD = 16
NON_ORIENTABLE = 32
SEVERAL_SHELLS = 64
PINCHED = 128
BROKEN = 255  # any of the above: the cell is no solid
REORIENTED = 256
HANDLE = 512
HANGING = 1024

STAR_SHAPED, WARPED, ZERO_EDGE, UNSEEN, NOT_PLANE = 1, 2, 4, 8, 16
"""Bits of the shape of a cell."""

NO_SOLID, PRISM, ANTIPRISM = -1, -2, -3
"""Instead of the number of a regular-faced solid: none; a prism; an antiprism."""

INNER, PATCH = 1, 2
"""What lies beyond a face: a cell; a patch of the boundary, which are numbered from here. 0: not known."""

REDUCED, CANDIDATE = 1, 2
"""Bits of the outcome for a cell: something was taken out; more would be if cells lay beyond all faces."""
