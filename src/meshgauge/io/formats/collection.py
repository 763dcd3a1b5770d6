"""Collections of files, one or more a time step: ParaView's .pvd (XML) and .series (JSON).

Own, because PyVista's reader takes the first time step without saying so. The files are read by the readers of their
formats, all in one process.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from ...errors import ReadError
from ...mesh import Mesh
from ..plumbing import included, within
from ..plumbing.format import Format
from ..plumbing.merge import join_pieces
from ..plumbing.patch import Places
from ..plumbing.pieces import Pieces, join_listed
from ..plumbing.steps import Step, number_steps
from .vtk import parallel

_LARGEST = 64 << 20
"""Bytes of a list of files; more is no list."""


@dataclass(frozen=True, slots=True)
class _Entry:
    """One file, and when."""

    time: float
    name: str  #: of its part; empty if it has none
    file: str


def sniff_pvd(head: bytes, path: Path) -> bool:
    return b"<VTKFile" in head and b"Collection" in head and b"<Collection" in head


def sniff_series(head: bytes, path: Path) -> bool:
    return b"file-series-version" in head


def _entries(path: Path) -> list[_Entry]:
    if path.stat().st_size > _LARGEST:
        raise ReadError(f"{path}: a list of {path.stat().st_size} bytes, expected at most {_LARGEST}")
    data = path.read_bytes()
    entries = _of_series(path, data) if sniff_series(data, path) else _of_pvd(path, data)
    if not entries:
        raise ReadError(f"{path}: names no files")
    within.check(path, (entry.file for entry in entries))
    return sorted(entries, key=lambda entry: entry.time)


def _of_pvd(path: Path, data: bytes) -> list[_Entry]:
    within.check_xml(path)
    try:
        root = ElementTree.fromstring(data)
    except ElementTree.ParseError as error:
        raise ReadError(f"{path}: is no XML: {error}") from error
    entries = []
    for number, item in enumerate(root.iter("DataSet")):
        file = item.get("file", "")
        if not file:
            raise ReadError(f"{path}: data set {number} names no file")
        name = item.get("name") or item.get("group") or (f"part {item.get('part')}" if item.get("part") else "")
        entries.append(_Entry(_time(path, item.get("timestep") or "0"), name, file))
    return entries


def _of_series(path: Path, data: bytes) -> list[_Entry]:
    try:
        files = json.loads(data)["files"]
        return [_Entry(_time(path, item.get("time", n)), "", str(item["name"])) for n, item in enumerate(files)]
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise ReadError(f"{path}: is no list of files: {error}") from error


def _time(path: Path, text: object) -> float:
    try:
        time = float(str(text))
    except ValueError:
        time = math.nan
    if math.isnan(time):
        raise ReadError(f"{path}: {text!r} is no time")
    return time


def _states(path: Path) -> list[list[_Entry]]:
    """The files of each time, in the order of time."""
    states: dict[float, list[_Entry]] = {}
    for entry in _entries(path):
        states.setdefault(entry.time, []).append(entry)
    return list(states.values())


def steps(path: Path) -> tuple[Step, ...]:
    states = _states(path)
    files = [tuple(entry.file for entry in state) for state in states]
    return number_steps([state[0].time for state in states], geometries=files)


def read(path: Path, at: int) -> Mesh:
    """The files of a time step, each a part; blocks keep their names behind that of their part."""
    from .. import registry  # which knows this format

    state = _states(path)[at]
    within.check_present(path, [entry.file for entry in state])
    meshes = [registry.read_inside(path.parent / entry.file) for entry in state]
    if len(meshes) == 1:
        return meshes[0].replace(path=str(path))
    return join_pieces(meshes, [entry.name or Path(entry.file).stem for entry in state], path=path, names_blocks=True)


def pieces(path: Path, at: int) -> Pieces | None:
    """Where the arrays of the files of a time step stand; None if one of them has to be read whole."""
    from .. import registry

    state = _states(path)[at]
    within.check_present(path, [entry.file for entry in state])
    listed = [registry.pieces_inside(path.parent / entry.file) for entry in state]
    if len(listed) == 1:
        return listed[0]
    return join_listed(listed, [entry.name or Path(entry.file).stem for entry in state], path=path)


def places(path: Path, at: int) -> Places:
    """Where the files of a time step hold the coordinates of points. Raises `ReadError` if one is not patched."""
    from .. import registry

    names = [entry.file for entry in _states(path)[at]]
    within.check_present(path, names)
    parallel.check_each_once(path, names)
    return Places.joined([registry.places_inside(path.parent / name) for name in names])


PVD = Format(
    "pvd", "ParaView collection", (".pvd",), sniff_pvd, has_both_wedge_orders=True, steps=steps, foreign_step=read,
    pieces=pieces, step_places=places, included=included.collection,
)  # fmt: skip
SERIES = Format(
    "series", "ParaView file series", (".series",), sniff_series, has_both_wedge_orders=True, steps=steps,
    foreign_step=read, pieces=pieces, step_places=places, included=included.collection,
)  # fmt: skip
