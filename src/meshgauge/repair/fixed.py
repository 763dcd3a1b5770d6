"""Which points an improvement must leave where they are, as the command line names them."""

from __future__ import annotations

import fnmatch
import os
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import MeshgaugeError
from ..files import sources
from ..mesh import Mesh
from ..mesh.labels import labels_of

Mask = NDArray[np.bool_]

_RANGE = re.compile(r"(\d{1,18})(?:-(\d{1,18}))?")


def fixed_points(
    mesh: Mesh, arrays: Sequence[str], patterns: Sequence[str], boxes: Sequence[str], ids: Sequence[str] = ()
) -> Mask | None:
    """``(n_points,)`` True where any of the four says so; None if nothing is asked for.

    Parameters
    ----------
    arrays
        Names of point data: a point is fixed where they are not 0.
    patterns
        Names of regions or patterns: the points of their cells are fixed.
    boxes
        Texts ``xmin,xmax,ymin,ymax,zmin,zmax``; an end left empty is infinite.
    ids
        Texts such as ``1-10,15``, or files that hold such text: the file's own numbers of points; if it numbers none,
        positions from 0.

    Raises
    ------
    MeshgaugeError
        If there is no such data, region or point, or a box or a list holds no numbers.
    """
    if not (arrays or patterns or boxes or ids):
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
    for text in ids:
        mask |= _of_ids(mesh, text)
    return mask


def _of_ids(mesh: Mesh, text: str) -> Mask:
    labels = labels_of(mesh, "point")
    numbers = np.arange(mesh.n_points) if labels is None else labels
    mask = np.zeros(mesh.n_points, np.bool_)
    for first, last in _ranges(text):
        chosen = (numbers >= first) & (numbers <= last)
        if not chosen.any() or last > numbers.max():
            named = f"{first}" if first == last else f"{first} to {last}" if not chosen.any() else f"{last}"
            what = f"points 0 to {mesh.n_points - 1:,}" if labels is None else f"numbers up to {numbers.max(initial=0)}"
            raise MeshgaugeError(f"{mesh.path}: the mesh has no point {named} for --fixed-ids; it has {what}")
        mask |= chosen
    return mask


def _ranges(text: str) -> list[tuple[int, int]]:
    """First and last of each range: from a file of that name if there is one, else from the text itself."""
    if os.path.isfile(text):
        sources.note(text)
        listed = Path(text).read_text(encoding="utf-8", errors="replace")
    else:
        listed = text
    items = listed.replace(",", " ").split()
    matches = [_RANGE.fullmatch(item) for item in items]
    if not items or not all(matches):
        wrong = next((item for item, match in zip(items, matches, strict=True) if match is None), text)
        raise MeshgaugeError(f"--fixed-ids {text!r}: {wrong[:40]!r} is no number or range; expected 1-10,15 or a file")
    return [(int(match[1]), int(match[2] or match[1])) for match in matches if match is not None]


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
