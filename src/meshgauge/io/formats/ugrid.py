"""AFLR UGRID (.ugrid): points, then surface triangles and quads with tags, tetra, pyramids, wedges and hexahedra.

Own, because meshio fails on ascii files with NumPy of today. The letters before the extension tell the encoding: b8 and
lb8 are binary, big- and little-endian, r8 and lr8 the same in Fortran's records; b4 and the like hold single precision.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...cells import BY_NAME
from ...errors import ReadError
from ...mesh import Mesh
from ..plumbing import writing
from ..plumbing.build import Ints, Kind, gather
from ..plumbing.format import Format, anything
from ..plumbing.text import NotNumbers, numbers
from . import ugrid_places
from .ugrid_places import Encoding, encoding_of

REF = "ugrid:ref"
_KINDS = (
    Kind("triangle", 3),
    Kind("quad", 4),
    Kind("tetra", 4),
    Kind("pyramid", 5, (0, 3, 4, 1, 2)),  # the third node is the apex
    Kind("wedge", 6),
    Kind("hexahedron", 8),
)
_N_SURFACES = 2


def read(path: Path) -> Mesh:
    """Cells by type, in the order of the file; cell data ``ugrid:ref`` is the tag of a surface cell, 0 of a solid."""
    encoding, data = encoding_of(path), path.read_bytes()
    if encoding is None:
        arrays = _ascii(path, data)
    else:
        arrays = _binary(path, _without_records(path, data, encoding) if encoding.has_records else data, encoding)
    points, lists, tags = arrays
    codes = np.repeat(np.arange(len(_KINDS)), [len(ids) // k.n_nodes for ids, k in zip(lists, _KINDS, strict=True)])
    ids = np.concatenate(lists) - 1
    wrong = (ids < 0) | (ids >= len(points))
    if wrong.any():
        raise ReadError(f"{path}: a cell refers to point {int(ids[np.argmax(wrong)]) + 1}, outside 1..{len(points)}")
    sizes = np.array([k.n_nodes for k in _KINDS], np.int64)[codes]
    cells = gather(ids, np.cumsum(sizes) - sizes, codes, dict(enumerate(_KINDS)))
    ref = np.zeros(len(codes), np.int32)
    ref[: len(tags)] = tags
    return Mesh(
        points, cells.types, cells.offsets, cells.connectivity, cell_data={REF: ref}, path=str(path), copy=False
    )


_Content = tuple[NDArray[np.floating], list[Ints], Ints]


def _counts(path: Path, head: Ints, size: int, least: int) -> list[int]:
    """The numbers of points and of the cells of each type, of which the file can hold so many."""
    counts = [int(n) for n in head]
    names = ["points", *(k.name for k in _KINDS)]
    what = ", ".join(f"{n} {name}" for n, name in zip(counts, names, strict=False) if n)
    if len(counts) != len(names) or min(counts) < 0 or not any(counts[1:]):
        raise ReadError(f"{path}: begins with {counts}, not with the numbers of points and of cells of six types")
    if max(counts) * least > size:
        raise ReadError(f"{path}: states {what}, but has only {size} bytes")
    return counts


def _sizes(counts: list[int]) -> tuple[int, list[int], int]:
    """How many coordinates, nodes of each type and tags there are."""
    nodes = [n * k.n_nodes for n, k in zip(counts[1:], _KINDS, strict=True)]
    return 3 * counts[0], nodes, sum(counts[1 : 1 + _N_SURFACES])


def _binary(path: Path, data: bytes, encoding: Encoding) -> _Content:
    real, integer = np.dtype(encoding.real), np.dtype(encoding.integer)
    if len(data) < 7 * integer.itemsize:
        raise ReadError(f"{path}: has only {len(data)} bytes")
    counts = _counts(path, np.frombuffer(data, integer, 7), len(data), integer.itemsize)
    n_real, nodes, n_tags = _sizes(counts)
    need = 7 * integer.itemsize + n_real * real.itemsize + (sum(nodes) + n_tags) * integer.itemsize
    if len(data) < need:
        cells = sum(counts[1:])
        raise ReadError(f"{path}: its {counts[0]} points and {cells} cells need {need} bytes, it has {len(data)}")
    at = 7 * integer.itemsize
    points = np.frombuffer(data, real, n_real, at).astype(real.newbyteorder("=")).reshape(-1, 3)
    flat = np.frombuffer(data, integer, sum(nodes) + n_tags, at + n_real * real.itemsize).astype(np.int64)
    return points, *_split_tables(flat, nodes, n_tags)


def _split_tables(flat: Ints, nodes: list[int], n_tags: int) -> tuple[list[Ints], Ints]:
    """Nodes of each type and the tags, which stand behind the surfaces."""
    surfaces = sum(nodes[:_N_SURFACES])
    tags = flat[surfaces : surfaces + n_tags]
    rest = np.concatenate([flat[:surfaces], flat[surfaces + n_tags :]])
    return np.split(rest, np.cumsum(nodes)[:-1]), tags


def _without_records(path: Path, data: bytes, encoding: Encoding) -> bytes:
    """The content of Fortran's records: each has its length in 4 bytes before and behind it."""
    parts, at = [], 0
    order: Literal["big", "little"] = "big" if encoding.real[0] == ">" else "little"
    while at < len(data):
        length = int.from_bytes(data[at : at + 4], order)
        if data[at + 4 + length : at + 8 + length] != data[at : at + 4]:
            raise ReadError(f"{path}: a record of {length} bytes at byte {at} of {len(data)}; it is truncated")
        parts.append(data[at + 4 : at + 4 + length])
        at += 8 + length
    return b"".join(parts)


def _ascii(path: Path, data: bytes) -> _Content:
    try:
        flat = numbers(data, np.float64)
    except NotNumbers as error:
        raise ReadError(f"{path}, line {error.line(data)}: something else than numbers: {error}") from None
    if len(flat) < 7 or not (np.abs(flat[:7]) < 2**53).all():
        raise ReadError(f"{path}: does not begin with the numbers of points and of cells of six types")
    counts = _counts(path, flat[:7].astype(np.int64), len(data), 2)
    n_real, nodes, n_tags = _sizes(counts)
    need = 7 + n_real + sum(nodes) + n_tags
    if len(flat) < need:
        cells = sum(counts[1:])
        raise ReadError(f"{path}: its {counts[0]} points and {cells} cells need {need} numbers, it has {len(flat)}")
    rest = flat[7 + n_real : need]
    if not ((rest == np.trunc(rest)) & (np.abs(rest) < 2**53)).all():
        raise ReadError(f"{path}: a node or a tag is no integer")
    return flat[7 : 7 + n_real].reshape(-1, 3), *_split_tables(rest.astype(np.int64), nodes, n_tags)


def write(path: Path, mesh: Mesh) -> tuple[str, ...]:
    """In the encoding that the name of the file tells; tags of surface cells are kept, solid ones have none."""
    mesh = writing.plain(mesh)
    writing.check_types(mesh, (k.name for k in _KINDS))
    by_type = [np.flatnonzero(mesh.types == BY_NAME[k.name].vtk_id) for k in _KINDS]
    lists = []
    for kind, cells in zip(_KINDS, by_type, strict=True):
        nodes = writing.nodes_of(mesh, cells) + 1
        lists.append(nodes[:, np.argsort(kind.order)] if kind.order and len(cells) else nodes)
    surfaces = np.concatenate(by_type[:_N_SURFACES])
    tags = mesh.cell_data.get(REF)
    has_tags = tags is not None and tags.ndim == 1 and tags.dtype.kind in "iu"
    own = tags[surfaces].astype(np.int64) if tags is not None and has_tags else np.zeros(len(surfaces), np.int64)
    head = np.array([mesh.n_points, *map(len, by_type)], np.int64)
    flat = [*(x.ravel() for x in lists[:_N_SURFACES]), own, *(x.ravel() for x in lists[_N_SURFACES:])]
    encoding = encoding_of(path)
    if encoding is None:
        tables = [head[None], *lists[:_N_SURFACES], own[:, None], *lists[_N_SURFACES:]]
        texts = [writing.rows(table) for table in tables]
        path.write_text(texts[0] + writing.rows(mesh.points) + "".join(texts[1:]), encoding="ascii")
    else:
        _write_binary(path, encoding, head, mesh, np.concatenate(flat))
    moved = np.any(np.diff(np.concatenate(by_type)) < 0)
    order = ("The format keeps cells by type: their order changed.",) if moved else ()
    return (*order, *writing.loss_notes(mesh, cell=(REF,) if has_tags else ()))


def _write_binary(path: Path, encoding: Encoding, head: Ints, mesh: Mesh, flat: Ints) -> None:
    first = head.astype(encoding.integer).tobytes()
    rest = mesh.points.astype(encoding.real).tobytes() + flat.astype(encoding.integer).tobytes()
    if encoding.has_records:
        order = encoding.integer[0]
        first, rest = (np.array(len(x), f"{order}u4").tobytes().join((b"", x, b"")) for x in (first, rest))
    path.write_bytes(first + rest)


def reduce(mesh: Mesh) -> tuple[Mesh, tuple[str, ...]]:
    """Without lines and curved surfaces."""
    return writing.without_lesser(mesh, (k.name for k in _KINDS))


UGRID = Format(
    "ugrid",
    "AFLR UGRID",
    (".ugrid",),
    anything,
    read,
    write=write,
    places=ugrid_places.places,
    by_content=False,
    reduce=reduce,
)
