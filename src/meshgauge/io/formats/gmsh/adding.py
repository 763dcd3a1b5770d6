"""Views added to Gmsh's files, behind all else: $NodeData and $ElementData."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ....mesh.labels import labels_of
from ...plumbing.added import Added, CannotAdd
from .cursor import Cursor
from .read import take_format


def add(old: Path, new: Path, added: Added) -> None:
    """A view for each array; items without a value are left out of it, as Gmsh does. Views of the same names go."""
    data = old.read_bytes()
    cursor = Cursor(old, data)
    if cursor.line() != "$MeshFormat":
        raise CannotAdd("is of version 1, which holds no data")
    take_format(cursor)
    cursor.line()
    mesh, kept = added.mesh, _without(cursor, {"NodeData": added.points, "ElementData": added.cells})
    views = [b"" if kept.endswith(b"\n") else b"\n"]
    for section, tags, arrays in (
        ("NodeData", labels_of(mesh, "point"), added.points_as_reals),
        ("ElementData", labels_of(mesh, "cell"), added.cells_as_reals),
    ):
        if tags is None or len(np.unique(tags)) < len(tags):
            raise CannotAdd("numbers several nodes or elements alike")
        views += [_view(cursor, section, name, tags, values) for name, values in arrays.items()]
    new.write_bytes(kept + b"".join(views))


def _without(cursor: Cursor, names: Mapping[str, Collection[str]]) -> bytes:
    """The bytes of the file without views of some names, by their section."""
    kept, begin = [], 0
    while line := cursor.line():
        section, start = line[1:], cursor.at
        name = ""
        if section in names and cursor.few():
            name = cursor.line().strip('"')
        cursor.skip(section)
        cursor.line()
        if section in names and name in names[section]:
            kept.append(cursor.data[begin : cursor.data.rindex(b"$", 0, start)])
            begin = cursor.at
    return b"".join([*kept, cursor.data[begin:]])


def _view(cursor: Cursor, section: str, name: str, tags: NDArray[np.int64], values: NDArray[np.float64]) -> bytes:
    """One number an item, at time 0."""
    has_value = np.isfinite(values)
    tags, values = tags[has_value], values[has_value]
    head = f'${section}\n1\n"{name}"\n1\n0.0\n3\n0\n1\n{len(tags)}\n'.encode()
    if cursor.is_binary:
        rows = np.empty(len(tags), [("tag", f"{cursor.order}i4"), ("value", f"{cursor.order}f8")])
        rows["tag"], rows["value"] = tags, values
        body = rows.tobytes()
    else:
        body = "\n".join(f"{tag} {value!r}" for tag, value in zip(tags.tolist(), values.tolist(), strict=True)).encode()
    return head + body + f"\n$End{section}\n".encode()
