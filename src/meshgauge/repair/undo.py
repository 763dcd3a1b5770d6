"""Files that hold the old places of points, or the old mesh, so that a repair can be taken back to the last bit."""

from __future__ import annotations

import hashlib
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import MeshError, ReadError, WriteError
from ..files.output import replacing
from ..mesh import CellBlock, Mesh
from ..mesh.polyhedra import Polyhedra

KIND = "meshgauge-undo-2"
"""Of files that hold the points that have moved."""

MESH_KIND = "meshgauge-undo-mesh-1"
"""Of files that hold the whole mesh, whose cells have changed."""

_ARRAYS = ("points", "types", "offsets", "connectivity")
_OF_POLYHEDRA = ("cell_offsets", "cell_faces", "face_offsets", "face_points", "flipped", "labels")
_DATA = ("point_data", "cell_data", "field_data")


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


def store_mesh(path: Path, before: Mesh, written: Mesh) -> None:
    """Keep a whole mesh, to come back in the place of one of other cells; see `store`."""
    arrays: dict[str, Any] = {name: getattr(before, name) for name in _ARRAYS}
    if before.polyhedra is not None:
        held = {name: getattr(before.polyhedra, name) for name in _OF_POLYHEDRA}
        arrays |= {f"polyhedra.{name}": array for name, array in held.items() if array is not None}
    arrays["blocks"] = np.array([[block.start, block.stop] for block in before.blocks], np.int64).reshape(-1, 2)
    arrays["block_names"] = np.array([block.name for block in before.blocks], np.str_)
    for what in _DATA:
        data = {name: values for name, values in getattr(before, what).items() if values.dtype.kind != "O"}
        arrays[f"{what}.names"] = np.array(list(data), np.str_)
        arrays |= {f"{what}.{n}": values for n, values in enumerate(data.values())}
    texts: dict[str, str] = {"kind": MESH_KIND, "cells": checksum(written), "written": coordinates(written)}
    texts |= {"purpose": before.purpose, "stored": str(before.stored)}
    with replacing(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, **(arrays | {name: np.array(text) for name, text in texts.items()}))


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


def restore_mesh(path: Path, mesh: Mesh) -> Mesh:
    """The mesh as it was before a repair; the mesh itself if its points are where they were already.

    Raises
    ------
    ReadError
        If the file is not one of undo data, of another mesh, or of one that was changed since.
    """
    try:
        with np.load(path, allow_pickle=False) as data:
            kind = str(data["kind"])
            if kind == MESH_KIND:
                return _whole(path, data, mesh)
            cells, old, written = (str(data[name]) for name in ("cells", "before", "written"))
            ids, points = data["ids"], data["points"]
    except OSError as error:
        raise ReadError(f"{path}: cannot be read: {error.strerror or error}") from error
    except (KeyError, ValueError, TypeError, AttributeError, EOFError, zipfile.BadZipFile, MeshError) as error:
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


def _whole(path: Path, data: Any, mesh: Mesh) -> Mesh:
    """The mesh that a file holds, if it was stored for this one."""
    if str(data["cells"]) != checksum(mesh) or str(data["written"]) != coordinates(mesh):
        name = mesh.path or "this mesh"
        raise ReadError(f"{path}: undo data of another mesh, or of one that was changed since: {name}")
    poly = {name: data[f"polyhedra.{name}"] for name in _OF_POLYHEDRA if f"polyhedra.{name}" in data}
    names, spans = data["block_names"].tolist(), data["blocks"].tolist()
    held: dict[str, Any] = {name: data[name] for name in _ARRAYS}
    for what in _DATA:
        held[what] = {name: data[f"{what}.{n}"] for n, name in enumerate(data[f"{what}.names"].tolist())}
    return Mesh(
        **held,
        polyhedra=Polyhedra(**poly) if poly else None,
        blocks=tuple(CellBlock(name, start, stop) for name, (start, stop) in zip(names, spans, strict=True)),
        path=mesh.path,
        purpose=str(data["purpose"]),  # type: ignore[arg-type]
        stored=str(data["stored"]),  # type: ignore[arg-type]
        copy=False,
    )
