"""Which points an improvement must leave where they are, as the command line names them."""

from __future__ import annotations

import fnmatch
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..errors import MeshgaugeError
from ..mesh import Mesh

Mask = NDArray[np.bool_]


def fixed_points(mesh: Mesh, arrays: Sequence[str], patterns: Sequence[str], boxes: Sequence[str]) -> Mask | None:
    """``(n_points,)`` True where any of the three says so; None if nothing is asked for.

    Parameters
    ----------
    arrays
        Names of point data: a point is fixed where they are not 0.
    patterns
        Names of regions or patterns: the points of their cells are fixed.
    boxes
        Texts ``xmin,xmax,ymin,ymax,zmin,zmax``; an end left empty is infinite.

    Raises
    ------
    MeshgaugeError
        If there is no such data or region, or a box holds no numbers.
    """
    if not (arrays or patterns or boxes):
        return None
    mask = np.zeros(mesh.n_points, np.bool_)
    for name in arrays:
        mask |= _of_array(mesh, name)
    if patterns:
        mask |= _of_regions(mesh, patterns)
    for text in boxes:
        low, high = box(text)
        points = np.asarray(mesh.points)
        mask |= ((points >= low) & (points <= high)).all(axis=1)
    return mask


def _of_array(mesh: Mesh, name: str) -> Mask:
    if name not in mesh.point_data:
        names = ", ".join(map(repr, mesh.point_data)) or "none"
        raise MeshgaugeError(f"{mesh.path}: there is no point data {name!r} for --fixed-points; there is {names}")
    values = np.asarray(mesh.point_data[name])
    if values.dtype.kind not in "biuf":
        raise MeshgaugeError(f"{mesh.path}: point data {name!r} are no numbers; --fixed-points needs 0 where free")
    marked: Mask = np.asarray(values.reshape(mesh.n_points, -1).astype(bool).any(axis=1), np.bool_)
    return marked


def _of_regions(mesh: Mesh, patterns: Sequence[str]) -> Mask:
    from ..mesh.regions import regions

    ids, names = regions(mesh)
    chosen = np.zeros(len(names), np.bool_)
    for pattern in patterns:
        fits = np.array([name == pattern or fnmatch.fnmatchcase(name, pattern) for name in names], np.bool_)
        if not fits.any():
            known = ", ".join(map(repr, names[:8])) or "none"
            raise MeshgaugeError(f"{mesh.path}: the mesh has no region {pattern!r} for --fixed-region; it has {known}")
        chosen |= fits
    at = np.repeat(chosen[ids] & (ids >= 0), np.diff(mesh.offsets))
    mask = np.zeros(mesh.n_points, np.bool_)
    mask[mesh.connectivity[at]] = True
    return mask


def box(text: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The lower and the upper corner. Raises `MeshgaugeError`."""
    parts = text.split(",")
    try:
        ends = [float(part) if part.strip() else np.nan for part in parts]
    except ValueError:
        ends = []
    if len(ends) != 6:
        raise MeshgaugeError(f"--fixed-box is {text!r}, expected xmin,xmax,ymin,ymax,zmin,zmax")
    low, high = np.array(ends[::2]), np.array(ends[1::2])
    low, high = np.where(np.isnan(low), -np.inf, low), np.where(np.isnan(high), np.inf, high)
    if (low > high).any():
        raise MeshgaugeError(f"--fixed-box is {text!r}: a lower end is above its upper end")
    return low, high
