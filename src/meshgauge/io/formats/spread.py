"""Exodus meshes that are spread over files, ``x.e.N.M``: piece M, from 0, of N. One of them stands for all of them.

So it does for ParaView. Elements are in one piece each; nodes between pieces are in several, by the same number.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import ReadError
from ...mesh import Mesh
from ...mesh.labels import LABEL
from ..plumbing import within
from ..plumbing.ids import drop_counts
from ..plumbing.merge import join_pieces

_NAME = re.compile(r"(.+)\.(\d{1,6})\.(\d{1,6})")
_NAMED = 3
SAME = 1e-6
"""By which share of the size of the mesh a node may be elsewhere in another piece."""


def pieces(path: Path) -> tuple[Path, ...]:
    """The files of all pieces, there or not, if a file has the name of one; else none."""
    match = _NAME.fullmatch(path.name)
    if match is None:
        return ()
    stem, n, at = match[1], int(match[2]), int(match[3])
    if n < 2 or at >= n or len(match[3]) != len(match[2]):
        return ()
    return tuple(path.with_name(f"{stem}.{match[2]}.{k:0{len(match[2])}}") for k in range(n))


def all_pieces(path: Path) -> tuple[Path, ...]:
    """The files of all pieces, if all are there."""
    files = pieces(path)
    return files if files and all(file.is_file() for file in files) else ()


def join(path: Path, read: Callable[[Path], tuple[Mesh, bool]]) -> Mesh:
    """What a file is part of, or the file alone with a note that names what is missing.

    Parameters
    ----------
    path
        Any piece, or a file that is whole.
    read
        Reads one file; also tells whether it numbers its nodes for all pieces.

    Raises
    ------
    ReadError
        If a piece cannot be read, or a node has several places.
    """
    own, has_numbers = read(path)
    files = pieces(path) if has_numbers else ()
    if not files or not all(file.is_file() for file in files):
        return own.replace(notes=(*own.notes, *alone(path, has_numbers=has_numbers)))
    within.check(path, [file.name for file in files])
    meshes = [own if file == path else read(file)[0] for file in files]
    names = [file.name for file in files]
    whole = _join_points(join_pieces(meshes, names, path=path, names_blocks=False), path)
    return drop_counts(whole.replace(notes=(*whole.notes, *notes_of(path))))


def notes_of(path: Path) -> tuple[str, ...]:
    """What is to be said of a piece that is read with all others."""
    n = len(pieces(path))
    return (f"{_what(path)}: all {n} pieces were read.",)


def alone(path: Path, *, has_numbers: bool) -> tuple[str, ...]:
    """What is to be said of a piece that is read without the others; nothing of a file that is whole."""
    files = pieces(path)
    if not files:
        return ()
    missing = [file.name for file in files if not file.is_file()]
    more = f" and {len(missing) - _NAMED} more" if len(missing) > _NAMED else ""
    why = f"{', '.join(missing[:_NAMED])}{more} not found" if missing else "its nodes have no numbers to join them by"
    assert missing or not has_numbers
    return (f"{_what(path)}: read alone, {why}.",)


def _what(path: Path) -> str:
    files = pieces(path)
    return f"Piece {files.index(path)} of {len(files)} of a mesh that is spread over files"


def _join_points(mesh: Mesh, path: Path) -> Mesh:
    """The mesh with the points of one number joined, at the place of the first."""
    numbers = mesh.point_data[LABEL]
    kept, new_id = joined(numbers)
    points = np.asarray(mesh.points)
    apart = np.abs(points - points[kept][new_id]).max(axis=1)
    wrong = np.flatnonzero(apart > SAME * np.ptp(points, axis=0).max(initial=0.0))
    if len(wrong):
        raise ReadError(f"{path}: node {int(numbers[wrong[0]])} is at different places in the pieces of the mesh")
    return mesh.replace(
        points=points[kept],
        connectivity=new_id[mesh.connectivity],
        polyhedra=mesh.polyhedra.with_points(new_id) if mesh.polyhedra is not None else None,
        point_data={name: values[kept] for name, values in mesh.point_data.items()},
        counted=(),
    )


def joined(numbers: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The first node of each number, in their order, and for each node which of these it is."""
    _, first, which = np.unique(numbers, return_index=True, return_inverse=True)
    kept = np.sort(first)
    return kept, np.searchsorted(kept, first)[which.reshape(-1)]
