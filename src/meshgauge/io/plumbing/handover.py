"""A mesh as one file of raw arrays: how a child process hands over what it read, without a copy on our side.

The arrays, each at a multiple of 64 bytes; then a JSON text that says what stands where; then its length in 8 bytes.
"""

from __future__ import annotations

import json
import mmap
from collections.abc import Callable, Mapping, Sequence
from typing import Any, BinaryIO, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...errors import ReadError
from ...mesh import CellBlock, Mesh
from ...mesh.polyhedra import Polyhedra
from .steps import Step

T = TypeVar("T")

_ALIGN = 64
_POLY = ("cell_offsets", "cell_faces", "face_offsets", "face_points", "flipped", "labels")
_OWN = ("points", "types", "offsets", "connectivity")
_WORDS = ("purpose", "stored", "dimension", "up")
_LISTS = ("notes", "sources", "counted", "parts")
_DATA = ("point_data", "cell_data", "field_data")


def dump(file: BinaryIO, mesh: Mesh) -> None:
    """Write a mesh to an empty file."""
    arrays: list[dict[str, Any]] = []

    def put(values: NDArray[Any]) -> int:
        at = file.tell()
        at += file.write(b"\0" * (-at % _ALIGN))
        whole = np.ascontiguousarray(values)
        if whole.size:
            file.write(whole.data if whole.dtype.kind not in "US" else whole.tobytes())
        arrays.append({"dtype": whole.dtype.str, "shape": whole.shape, "at": at})
        return len(arrays) - 1

    head: dict[str, Any] = {name: put(getattr(mesh, name)) for name in _OWN}
    if mesh.polyhedra is not None:
        held = {name: getattr(mesh.polyhedra, name) for name in _POLY}
        head["polyhedra"] = {name: put(values) for name, values in held.items() if values is not None}
    for name in _DATA:
        head[name] = [(key, put(values)) for key, values in getattr(mesh, name).items()]
    head |= {"blocks": [(b.name, b.start, b.stop) for b in mesh.blocks], "arrays": arrays}
    head |= {name: getattr(mesh, name) for name in (*_WORDS, *_LISTS)}
    _finish(file, head)


def dump_error(file: BinaryIO, message: str) -> None:
    """Write, in place of a mesh, why there is none."""
    file.seek(0)
    file.truncate()
    _finish(file, {"error": message})


def _finish(file: BinaryIO, head: Mapping[str, Any]) -> None:
    text = json.dumps(head).encode("utf-8", "surrogatepass")
    file.write(text)
    file.write(len(text).to_bytes(8, "little"))
    file.flush()


def dump_steps(file: BinaryIO, steps: Sequence[Step]) -> None:
    """Write, in place of a mesh, the time steps of a file."""
    _finish(file, {"steps": [(step.number, step.time, step.name, step.geometry) for step in steps]})


def load(file: BinaryIO, path: str) -> Mesh:
    """The mesh in a file that `dump` wrote; its arrays are views of the file in memory, which they keep alive.

    Raises
    ------
    ReadError
        If the file holds an error instead, or is not whole.
    """
    return _load(file, path, lambda data, head: _mesh(data, head, path))


def load_steps(file: BinaryIO, path: str) -> tuple[Step, ...]:
    """The time steps in a file that `dump_steps` wrote. Raises as `load` does."""
    return _load(file, path, lambda _, head: tuple(Step(*step) for step in head["steps"]))


def _load(file: BinaryIO, path: str, make: Callable[[NDArray[np.uint8], dict[str, Any]], T]) -> T:
    try:
        data = np.frombuffer(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ), np.uint8)
        size = int.from_bytes(data[-8:].tobytes(), "little")
        head = json.loads(data[len(data) - 8 - size : len(data) - 8].tobytes().decode("utf-8", "surrogatepass"))
        if "error" in head:
            raise ReadError(head["error"])
        return make(data, head)
    except (OSError, ValueError, KeyError, IndexError, TypeError) as error:
        raise ReadError(f"{path}: the reader handed over nothing whole: {error}") from error


def _mesh(data: NDArray[np.uint8], head: dict[str, Any], path: str) -> Mesh:
    def array(number: int) -> NDArray[Any]:
        entry = head["arrays"][number]
        dtype, shape = np.dtype(entry["dtype"]), tuple(entry["shape"])
        n_bytes = dtype.itemsize * int(np.prod(shape, dtype=np.int64))
        return np.asarray(data[entry["at"] : entry["at"] + n_bytes].view(dtype).reshape(shape))

    own: dict[str, Any] = {name: array(head[name]) for name in _OWN}
    own |= {name: {key: array(number) for key, number in head[name]} for name in _DATA}
    poly = {name: array(number) for name, number in head.get("polyhedra", {}).items()}
    return Mesh(
        **own,
        polyhedra=Polyhedra(**poly) if poly else None,
        blocks=tuple(CellBlock(*block) for block in head["blocks"]),
        path=path,
        **{name: head[name] for name in _WORDS} | {name: tuple(head[name]) for name in _LISTS},
        copy=False,
    )
