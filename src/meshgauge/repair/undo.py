"""Files that hold the old places of points, so that an improvement can be taken back to the last bit."""

from __future__ import annotations

import hashlib
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ReadError, WriteError
from ..files.output import replacing
from ..mesh import Mesh

KIND = "meshgauge-undo-2"


def checksum(mesh: Mesh) -> str:
    """Of the cells: their types and points, whatever the order within a cell, which formats change for wedges."""
    owner = np.repeat(np.arange(mesh.n_cells), np.diff(mesh.offsets))
    order = np.lexsort((mesh.connectivity, owner))
    digest = hashlib.sha256(np.asarray(mesh.types, np.uint8).tobytes())
    digest.update(np.asarray(mesh.offsets, np.int64).tobytes())
    digest.update(np.asarray(mesh.connectivity, np.int64)[order].tobytes())
    digest.update(str(mesh.n_points).encode())
    return digest.hexdigest()


def coordinates(mesh: Mesh) -> str:
    """Digest of the points, whatever their precision: equal numbers give the same."""
    points = np.asarray(mesh.points, np.float64) + 0.0  # one zero
    points = np.where(np.isnan(points), np.nan, points)  # one NaN
    return hashlib.sha256(np.ascontiguousarray(points, "<f8").tobytes()).hexdigest()


def store(path: Path, before: Mesh, written: Mesh) -> int:
    """Keep the old coordinates of every point that is elsewhere in the file that was written; returns how many.

    The file that was written is asked, not the mesh in memory: a format of text or of single precision may have rounded
    points that never moved. It is on the disk when this returns.

    Parameters
    ----------
    path
        Where to.
    before
        The mesh that is to come back.
    written
        The better one, as it reads back from its file.

    Raises
    ------
    WriteError
        If the file cannot be written, or the better one's format numbers cells or points anew.
    """
    if checksum(before) != checksum(written):
        raise WriteError(f"{path}: not written: the format of the output numbers cells or points anew; keep the input")
    old = np.asarray(before.points)
    same = (old == np.asarray(written.points)) | (np.isnan(old) & np.isnan(written.points))
    # 0 and -0 are equal, but not the same bits.
    same &= np.signbit(old) == np.signbit(written.points)
    ids = np.flatnonzero(~same.all(axis=1))
    texts = {"kind": KIND, "cells": checksum(before), "before": coordinates(before), "written": coordinates(written)}
    arrays: dict[str, Any] = {"ids": ids, "points": old[ids], **{name: np.array(text) for name, text in texts.items()}}
    with replacing(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, **arrays)
    return len(ids)


def restore_points(path: Path, mesh: Mesh) -> Mesh:
    """The mesh with its points where they were; the mesh itself if they are there already.

    Raises
    ------
    ReadError
        If the file is not one of undo data, of another mesh, or of one whose points were moved since.
    """
    try:
        with np.load(path, allow_pickle=False) as data:
            kind, cells, old, written = (str(data[name]) for name in ("kind", "cells", "before", "written"))
            ids, points = data["ids"], data["points"]
    except OSError as error:
        raise ReadError(f"{path}: cannot be read: {error.strerror or error}") from error
    except (KeyError, ValueError, TypeError, AttributeError, EOFError, zipfile.BadZipFile) as error:
        raise ReadError(f"{path}: not a file of undo data") from error
    if kind != KIND:
        raise ReadError(f"{path}: undo data of the kind {kind!r}, expected {KIND!r}")
    name = mesh.path or "this mesh"
    if cells != checksum(mesh):
        raise ReadError(f"{path}: undo data of a mesh with other cells than {name}")
    now = coordinates(mesh)
    if now == old and now != written:
        return mesh
    if now != written:
        raise ReadError(f"{path}: undo data of other coordinates: the points of {name} are not where they were written")
    all_points = np.array(mesh.points, dtype=points.dtype)
    all_points[ids] = points
    return mesh.replace(points=all_points)
