"""What finite volumes ask of each cell, summed over its faces."""

from __future__ import annotations

import numpy as np

from ..arrays import BoolArray, Float64Array, IntArray
from ..jit import kernel


@kernel
def cells(
    owner: IntArray,
    neighbour: IntArray,
    centres: Float64Array,
    areas: Float64Array,
    cell_centres: Float64Array,
    volumes: Float64Array,
) -> None:
    """Centre and volume of each cell, from the pyramids on its faces about the mean of their centres.

    Parameters
    ----------
    owner, neighbour
        ``(n_faces,)`` the cells beside each face; no neighbour is negative.
    centres, areas
        ``(n_faces, 3)`` centre, and area vector out of the owner.
    cell_centres, volumes
        ``(n_cells, 3)`` and ``(n_cells,)`` zeros; receive them.
    """
    n_cells = len(volumes)
    about, counts = np.zeros((n_cells, 3)), np.zeros(n_cells, np.int32)
    for face in range(len(owner)):
        for side in range(2):
            cell = owner[face] if side == 0 else neighbour[face]
            if cell >= 0:
                counts[cell] += 1
                for axis in range(3):
                    about[cell, axis] += centres[face, axis]
    for cell in range(n_cells):
        for axis in range(3):
            about[cell, axis] /= max(counts[cell], 1)
    for face in range(len(owner)):
        for side in range(2):
            cell = owner[face] if side == 0 else neighbour[face]
            if cell >= 0:
                three = 0.0
                for axis in range(3):
                    three += areas[face, axis] * (centres[face, axis] - about[cell, axis])
                if side == 1:
                    three = -three
                volumes[cell] += three
                for axis in range(3):
                    cell_centres[cell, axis] += three * (0.75 * centres[face, axis] + 0.25 * about[cell, axis])
    for cell in range(n_cells):
        three = volumes[cell]
        is_solid = abs(three) > 0.0
        for axis in range(3):
            cell_centres[cell, axis] = cell_centres[cell, axis] / three if is_solid else about[cell, axis]
        volumes[cell] = three / 3.0


@kernel
def aspect_ratio(
    owner: IntArray,
    neighbour: IntArray,
    areas: Float64Array,
    volumes: Float64Array,
    axes: BoolArray,
    out: Float64Array,
) -> None:
    """``(n_cells,)`` in ``out``: the larger of the areas seen along x, y and z, largest over smallest, and a sixth of
    their sum over volume^(2/3).

    ``axes`` ``(3,)``: those that count; if not all do, the areas alone.
    """
    is_solid = axes[0] and axes[1] and axes[2]
    seen = np.zeros((len(volumes), 3))
    for face in range(len(owner)):
        for side in range(2):
            cell = owner[face] if side == 0 else neighbour[face]
            if cell >= 0:
                for axis in range(3):
                    seen[cell, axis] += abs(areas[face, axis])
    for cell in range(len(volumes)):
        total, largest, smallest = 0.0, 0.0, np.inf
        for axis in range(3):
            total += seen[cell, axis]
            if axes[axis]:
                largest, smallest = max(largest, seen[cell, axis]), min(smallest, seen[cell, axis])
        worst = np.nan
        if total == total:
            spread = largest / smallest
            compact = total / 6.0 / abs(volumes[cell]) ** (2.0 / 3.0) if is_solid else 1.0
            if spread == spread and compact == compact:
                worst = max(max(spread, compact), 1.0)
            elif total < np.inf:
                worst = np.inf
        out[cell] = worst


@kernel
def determinant(owner: IntArray, neighbour: IntArray, areas: Float64Array, axes: BoolArray, out: Float64Array) -> None:
    """``(n_cells,)`` in ``out``: determinant of the sum of S Sᵀ over the inner faces, in units of their mean area, over
    8; 0 of a cell without.

    ``axes`` ``(3,)``: those that count; the sum has a 1 for each other.
    """
    n_cells = len(out)
    sums, total, counts = np.zeros((n_cells, 6)), np.zeros(n_cells), np.zeros(n_cells, np.int32)
    for face in range(len(owner)):
        if neighbour[face] < 0:
            continue
        x, y, z = areas[face, 0], areas[face, 1], areas[face, 2]
        size = np.sqrt(x * x + y * y + z * z)
        for side in range(2):
            cell = owner[face] if side == 0 else neighbour[face]
            counts[cell] += 1
            total[cell] += size
            sums[cell, 0] += x * x
            sums[cell, 1] += y * y
            sums[cell, 2] += z * z
            sums[cell, 3] += x * y
            sums[cell, 4] += y * z
            sums[cell, 5] += z * x
    for cell in range(n_cells):
        if counts[cell] == 0 or total[cell] == 0.0:
            out[cell] = 0.0
            continue
        unit = (total[cell] / counts[cell]) ** 2
        xx, yy, zz = sums[cell, 0] / unit, sums[cell, 1] / unit, sums[cell, 2] / unit
        xy, yz, zx = sums[cell, 3] / unit, sums[cell, 4] / unit, sums[cell, 5] / unit
        xx, yy, zz = xx if axes[0] else 1.0, yy if axes[1] else 1.0, zz if axes[2] else 1.0
        found = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * zx) + zx * (xy * yz - yy * zx)
        out[cell] = abs(found) / 8.0


@kernel
def reduce(
    owner: IntArray,
    neighbour: IntArray,
    values: Float64Array,
    is_lost: BoolArray,
    is_largest: bool,
    out: Float64Array,
) -> None:
    """The largest or the least value of each cell's faces, NaN apart; NaN for good where a face is lost.

    ``out`` ``(n_cells,)`` holds what a cell without any keeps, less or more than all values.
    """
    for face in range(len(owner)):
        value = values[face]
        if is_lost[face] or value == value:
            for side in range(2):
                cell = owner[face] if side == 0 else neighbour[face]
                if cell >= 0:
                    old = out[cell]
                    if is_lost[face]:
                        out[cell] = np.nan
                    elif value > old if is_largest else value < old:
                        out[cell] = value
