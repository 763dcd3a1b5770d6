"""Files that hold the old places of points, so that an improvement can be taken back to the last bit."""

from __future__ import annotations

import hashlib
import zipfile
from pathlib import Path

import numpy as np

from ..errors import ReadError, WriteError
from ..files.output import replacing
from ..mesh import Mesh

KIND = "meshgauge-undo-1"


def checksum(mesh: Mesh) -> str:
    """Of the cells: their types and points, whatever the order within a cell, which formats change for wedges."""
    owner = np.repeat(np.arange(mesh.n_cells), np.diff(mesh.offsets))
    order = np.lexsort((mesh.connectivity, owner))
    digest = hashlib.sha256(np.asarray(mesh.types, np.uint8).tobytes())
    digest.update(np.asarray(mesh.offsets, np.int64).tobytes())
    digest.update(np.asarray(mesh.connectivity, np.int64)[order].tobytes())
    digest.update(str(mesh.n_points).encode())
    return digest.hexdigest()


def store(path: Path, before: Mesh, written: Mesh) -> int:
    """Keep the old coordinates of every point that is elsewhere in the file that was written; returns how many.

    The file that was written is asked, not the mesh in memory: a format of text or of single precision may have rounded
    points that never moved.

    Raises
    ------
    WriteError
        If the file cannot be written, or its format numbers cells or points anew.
    """
    if checksum(before) != checksum(written):
        raise WriteError(
            f"{path}: not written: {written.path or 'the output'} numbers cells or points anew; keep the input instead"
        )
    old = np.asarray(before.points)
    same = (old == np.asarray(written.points)) | (np.isnan(old) & np.isnan(written.points))
    # 0 and -0 are equal, but not the same bits.
    same &= np.signbit(old) == np.signbit(written.points)
    ids = np.flatnonzero(~same.all(axis=1))
    with replacing(path) as beside, beside.open("wb") as file:
        np.savez_compressed(file, kind=np.array(KIND), checksum=np.array(checksum(before)), ids=ids, points=old[ids])
    return len(ids)


def restored(path: Path, mesh: Mesh) -> Mesh:
    """The mesh with its points where they were.

    Raises
    ------
    ReadError
        If the file is not one of undo data, or of another mesh.
    """
    try:
        with np.load(path, allow_pickle=False) as data:
            kind, stored, ids, points = (data[name] for name in ("kind", "checksum", "ids", "points"))
    except OSError as error:
        raise ReadError(f"{path}: cannot be read: {error.strerror or error}") from error
    except (KeyError, ValueError, TypeError, AttributeError, EOFError, zipfile.BadZipFile) as error:
        raise ReadError(f"{path}: not a file of undo data") from error
    if str(kind) != KIND:
        raise ReadError(f"{path}: undo data of the kind {str(kind)!r}, expected {KIND!r}")
    if str(stored) != checksum(mesh):
        raise ReadError(f"{path}: undo data of a mesh with other cells than {mesh.path or 'this one'}")
    all_points = np.array(mesh.points, dtype=points.dtype)
    all_points[ids] = points
    return mesh.replace(points=all_points)
