"""MED (.med), the files of Salome and Code_Aster, through h5py: meshes, families of groups, fields on points and cells.

Own, because meshio takes MED's order of nodes for VTK's, which turns every cell inside out, and loses names of groups.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....cells import CELL_TYPES
from ....errors import MeshgaugeError, ReadError
from ....mesh import Mesh
from ....mesh.labels import LABEL, counts_from
from ....mesh.regions import named_regions
from ...plumbing import budget, face_based, meshio, within, writing
from ...plumbing.build import Ints, Kind, gather
from ...plumbing.format import Format
from ...plumbing.ids import drop_counts
from ...plumbing.merge import Part, merge_parts
from ..vtk.hdf import MAGIC
from .adding import add
from .cells import BY_NAME, KINDS
from .places import places

GROUP = "med:group"
_NO_PROFILE = "MED_NO_PROFILE_INTERNAL"
_NONE = np.empty((0, 3))
_ONE = np.ones(1, np.int64)
_WIDTH = 80  # characters of the name of a group
_MESHIO = "meshio"
"""In the description of the meshes that meshio writes: it keeps VTK's order of nodes where it has that."""


def sniff(head: bytes, path: Path) -> bool:
    return head.startswith(MAGIC)


def read(path: Path) -> Mesh:
    """Every unstructured mesh of the file, at its first step; a block for each type of cells.

    Cell data ``med:group`` is the number of the groups that a cell is in, 0 of none; field data ``med:group:names`` has
    their names, joined with " + " where a cell is in several.
    """
    import h5py

    try:
        with h5py.File(path, "r") as file:
            within.check_hdf(path, file)
            if "ENS_MAA" not in file or not len(file["ENS_MAA"]):
                raise ReadError(f"{path}: holds no mesh (ENS_MAA)")
            meshes = file["ENS_MAA"]
            parts = [_mesh(path, file, name, meshes[name]) for name in meshes]
            if len(parts) == 1:
                return parts[0]
            return _join_meshes(parts, list(meshes), path)
    except MeshgaugeError:
        raise
    except (OSError, KeyError, ValueError, TypeError, IndexError, AttributeError, RuntimeError) as error:
        raise ReadError(f"{path}: not a whole MED file: {' '.join(str(error).split())}") from error


def _join_meshes(meshes: list[Mesh], names: list[str], path: Path) -> Mesh:
    """Meshes of one file: a block each, named groups counted through."""
    parts: list[Part] = []
    listed: list[str] = []
    for mesh, name in zip(meshes, names, strict=True):
        data = dict(mesh.cell_data)
        if GROUP in data:
            data[GROUP] = np.where(data[GROUP] > 0, data[GROUP] + len(listed), 0).astype(np.int32)
            listed += mesh.field_data[f"{GROUP}:names"].tolist()
        parts.append(
            Part(name, mesh.points, mesh.types, np.asarray(mesh.offsets), np.asarray(mesh.connectivity), mesh.polyhedra,
                 dict(mesh.point_data), data, notes=list(mesh.notes))
        )  # fmt: skip
    joined = merge_parts(parts, path=path)
    return joined.replace(field_data={f"{GROUP}:names": np.array(listed)} if listed else {})


def _mesh(path: Path, file: Any, name: str, group: Any) -> Mesh:
    if int(group.attrs.get("TYP", 0)) != 0:
        raise ReadError(f"{path}: mesh {name!r} is structured, which is not read")
    is_old = "NOE" in group  # of version 2, which knows no steps
    steps = [name] if is_old else list(group)
    if not steps:
        raise ReadError(f"{path}: mesh {name!r} has no step")
    step = group if is_old else group[steps[0]]
    notes = [f"The mesh {name!r} has {len(steps)} steps; the first was read."] if len(steps) > 1 else []
    dimension = int(group.attrs.get("ESP", group.attrs.get("DIM", 3)))
    points = _points(path, step, dimension)
    parts = _cells(path, step, points, as_stated=True, is_old=is_old)
    if _MESHIO in _text(group.attrs.get("DES", "")) and _is_mirrored(parts, points):
        parts = _cells(path, step, points, as_stated=False, is_old=is_old)
        notes.append("Most cells have a negative volume in MED's order of nodes: VTK's was taken, as meshio writes.")
    families_of_all = {name: group["FAS"]} if is_old and "FAS" in group else file.get("FAS", {})
    numbers, names = _groups(families_of_all.get(name, {}))
    for code, part in parts:
        own = step["MAI"][code]
        if "FAM" in own:
            families = np.asarray(own["FAM"][...], np.int64).ravel()
            _same(path, len(families), len(part.types), f"families of {code}")
            part.cell_data[GROUP] = _translate(families, numbers)
        part.cell_data.update(_numbers(path, own, len(part.types), f"cells of type {code}"))
    if len(parts) > 1 and all(counts_from(part.cell_data.get(LABEL, _ONE)) is not None for _, part in parts):
        for _, part in parts:  # of several types that are counted from 1 each, numbers name no cell
            part.cell_data.pop(LABEL, None)
    point_data: dict[str, NDArray[Any]] = {}
    if not is_old:
        point_data = _fields(path, file, name, parts, len(points), notes)
    elif "CHA" in file and len(file["CHA"]):
        notes.append("Fields of a file of MED's version 2 are not read; MED's medimport converts it.")
    point_data.update(_numbers(path, step["NOE"], len(points), "points"))
    mesh = merge_parts([part for _, part in parts], path=path, points=points)
    kept = dict(mesh.cell_data)
    if GROUP in kept and kept[GROUP].dtype.kind == "f":  # a type without families
        kept[GROUP] = np.nan_to_num(kept[GROUP]).astype(np.int32)
    if GROUP in kept and not kept[GROUP].any():
        del kept[GROUP]
    fields = {f"{GROUP}:names": np.array(names)} if GROUP in kept else {}
    is_single = step["NOE"]["COO"].dtype.itemsize == 4
    mesh = mesh.replace(
        cell_data=kept, field_data=fields, point_data=point_data, notes=tuple(notes),
        stored="single" if is_single else "double",
    )  # fmt: skip
    return drop_counts(mesh)


def _points(path: Path, step: Any, dimension: int) -> NDArray[np.float64]:
    """Coordinates stand one axis after the other."""
    flat = np.asarray(step["NOE"]["COO"][...], np.float64).ravel()
    if dimension not in (1, 2, 3) or len(flat) % dimension:
        raise ReadError(f"{path}: {len(flat)} coordinates of points in {dimension} dimensions")
    points = np.zeros((len(flat) // dimension, 3))
    points[:, :dimension] = flat.reshape(dimension, -1).T
    return points


def _cells(
    path: Path, step: Any, points: NDArray[np.float64], *, as_stated: bool, is_old: bool
) -> list[tuple[str, Part]]:
    """MED's name of each type and its cells; ``as_stated`` in MED's order of nodes, else in VTK's."""
    parts = []
    for code in step["MAI"]:
        group = step["MAI"][code]
        ids = np.asarray(group["NOD"][...], np.int64).ravel() - 1
        wrong = (ids < 0) | (ids >= len(points))
        if wrong.any():
            at = int(ids[np.argmax(wrong)]) + 1
            raise ReadError(f"{path}: cells of type {code} refer to point {at}, which is outside 1..{len(points)}")
        if code in ("POE", "POG", "PO2"):
            parts.append(
                (code, _polyhedra(path, group, ids, points, is_old) if code == "POE" else _polygons(path, group, ids))
            )
            continue
        kind = KINDS.get(code)
        if kind is None:
            raise ReadError(f"{path}: cells of type {code!r} are not known; known are {', '.join(KINDS)}")
        if len(ids) % kind.n_nodes:
            raise ReadError(f"{path}: {len(ids)} nodes of cells of type {code}, which have {kind.n_nodes}")
        n = len(ids) // kind.n_nodes
        _same(path, int(group["NOD"].attrs.get("NBR", n)), n, f"cells of type {code}")
        chosen = kind if as_stated else Kind(kind.name, kind.n_nodes)
        rows = np.ascontiguousarray(ids.reshape(kind.n_nodes, n).T).ravel()
        made = gather(rows, np.arange(n) * kind.n_nodes, np.zeros(n, np.int64), {0: chosen})
        parts.append((code, Part(chosen.name, _NONE, made.types, made.offsets, made.connectivity)))
    if not any(len(part.types) for _, part in parts):
        raise ReadError(f"{path}: has no cells")
    return parts


def _numbers(path: Path, group: Any, n: int, what: str) -> dict[str, Ints]:
    """What the file calls its points or cells, as data, if it numbers them."""
    if "NUM" not in group:
        return {}
    numbers = np.asarray(group["NUM"][...], np.int64).ravel()
    _same(path, len(numbers), n, f"numbers of {what}")
    return {LABEL: numbers}


def _same(path: Path, stated: int, n: int, what: str) -> None:
    if stated != n:
        raise ReadError(f"{path}: {stated} {what} are stated, but {n} were found")


def _counts(path: Path, index: Any, n: int) -> Ints:
    """Sizes of lists by where they start, counted from 1; they must fill ``n`` items."""
    starts = np.asarray(index, np.int64).ravel()
    if not len(starts) or starts[0] != 1 or starts[-1] != n + 1 or (np.diff(starts) < 0).any():
        raise ReadError(f"{path}: an index of polygons or polyhedra does not fit its {n} items")
    return np.diff(starts)


def _polygons(path: Path, group: Any, ids: Ints) -> Part:
    sizes = _counts(path, group["INN"][...], len(ids))
    return Part("polygon", _NONE, np.full(len(sizes), 7, np.uint8), face_based.offsets_of(sizes), ids)


def _polyhedra(path: Path, group: Any, ids: Ints, points: NDArray[np.float64], is_old: bool) -> Part:
    """INN has where the nodes of each face start, IFN where the faces of each cell do; in version 2 the other way."""
    nodes_of_face, faces_of_cell = ("IFN", "INN") if is_old else ("INN", "IFN")
    sizes = _counts(path, group[nodes_of_face][...], len(ids))
    n_faces = _counts(path, group[faces_of_cell][...], len(sizes))
    faces = face_based.Faces(face_based.offsets_of(n_faces), np.arange(len(sizes)), face_based.offsets_of(sizes), ids)
    made = face_based.solids(faces, points)
    return Part("polyhedron", _NONE, made.types, made.offsets, made.connectivity, made.polyhedra)


def _is_mirrored(parts: list[tuple[str, Part]], points: NDArray[np.float64]) -> bool:
    """True if more solid cells have a negative first corner than a positive one."""
    negative = positive = 0
    for code, part in parts:
        kind = CELL_TYPES.get(int(part.types[0])) if len(part.types) else None
        if code in KINDS and kind is not None and kind.shape is not None:
            nodes = part.connectivity.reshape(len(part.types), -1)
            a, i, j, k = (points[nodes[:, node]] for node in kind.shape.triples[0])
            volume = np.einsum("ij,ij->i", i - a, np.cross(j - a, k - a))
            negative, positive = negative + int((volume < 0).sum()), positive + int((volume > 0).sum())
    return negative > positive


def _groups(families: Any) -> tuple[dict[int, int], list[str]]:
    """For each family of cells the number of its groups, from 1, and the names of the groups."""
    numbers: dict[int, int] = {}
    names: dict[str, int] = {}
    for family in _families(families.get("ELEME", families)):
        own = _group_names(family)
        if own:
            numbers[int(family.attrs["NUM"])] = names.setdefault(" + ".join(own), len(names) + 1)
    budget.draw_names(tuple(names), "the names of groups")
    return numbers, list(names)


def _families(group: Any) -> Iterator[Any]:
    for key in group:
        if hasattr(group[key], "attrs") and "NUM" in group[key].attrs:
            yield group[key]


def _group_names(family: Any) -> list[str]:
    if "GRO" not in family or "NOM" not in family["GRO"]:
        return []
    raw = family["GRO"]["NOM"][...]
    bytes_ = np.ascontiguousarray(raw).view(np.uint8).ravel()
    rows = bytes_[: len(bytes_) // _WIDTH * _WIDTH].reshape(-1, _WIDTH)  # version 2 writes one byte more
    return [row.tobytes().split(b"\0")[0].decode("utf-8", "replace").strip() for row in rows]


def _translate(families: Ints, numbers: dict[int, int]) -> NDArray[np.int32]:
    keys, inverse = np.unique(families, return_inverse=True)
    return np.array([numbers.get(int(key), 0) for key in keys], np.int32)[inverse.reshape(-1)]


def _fields(
    path: Path, file: Any, name: str, parts: list[tuple[str, Part]], n_points: int, notes: list[str]
) -> dict[str, NDArray[Any]]:
    """Fields at their first step: those of points are returned, those of cells put into the parts."""
    point_data: dict[str, NDArray[Any]] = {}
    left_out = []
    for key in file.get("CHA", {}):
        field = file["CHA"][key]
        if not len(field) or _text(field.attrs.get("MAI", name)) != name:
            continue
        step, width = field[next(iter(field))], max(int(field.attrs.get("NCO", 1)), 1)
        for place in step:
            part = next((part for code, part in parts if place == f"MAI.{code}"), None)
            n = n_points if place == "NOE" else len(part.types) if part is not None else -1
            values = step[place].get(_NO_PROFILE)
            if values is None or "CO" not in values or values["CO"].size != n * width:
                left_out.append(f"{key} ({place})")
                continue
            flat = values["CO"][...].reshape(width, n).T
            target = point_data if part is None else part.cell_data
            target[key] = np.ascontiguousarray(flat[:, 0] if width == 1 else flat)
    if left_out:
        notes.append(
            f"Fields with several values a cell or on some cells only were left out: {', '.join(left_out[:8])}."
        )
    return point_data


def _text(value: Any) -> str:
    return (value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)).strip("\0 ")


def write(path: Path, mesh: Mesh) -> tuple[str, ...]:
    """By meshio's writer, in MED's order of nodes; regions become groups of cells, labels the file's numbers."""
    import h5py

    regions = named_regions(mesh)
    ids, names = regions if regions is not None else (np.zeros(mesh.n_cells, np.int64), ())
    labels = [_to_write(mesh.cell_data, mesh.n_cells), _to_write(mesh.point_data, mesh.n_points)]
    data = {k: v for k, v in mesh.cell_data.items() if k not in (GROUP, _FAMILY) and (k != LABEL or labels[0] is None)}
    point_data = {k: v for k, v in mesh.point_data.items() if k != LABEL or labels[1] is None}
    known = {f"{GROUP}:names", *names, *writing.named_by(mesh, names)}
    fields = {k: v for k, v in mesh.field_data.items() if k not in known}
    kept = mesh.replace(cell_data=data, field_data=fields, point_data=point_data)
    data = dict(meshio.of_numbers(kept).cell_data)
    has_groups = regions is not None
    families = {_FAMILY: (-1 - ids).astype(np.int64)} if has_groups else {}
    numbers = {_NUMBERS: labels[0]} if labels[0] is not None else {}
    source = meshio.from_mesh(meshio.of_numbers(kept).replace(cell_data={**data, **families, **numbers}), by_type=True)
    of_blocks = source.cell_data.pop(_NUMBERS, [])
    for block in source.cells:
        code = BY_NAME.get(block.type)
        order = KINDS[code].order if code is not None else ()
        if order:  # its own inverse: a mirror
            block.data = block.data[:, np.argsort(order)]
    if has_groups:
        source.cell_tags = {-1 - number: [name[:_WIDTH]] for number, name in enumerate(names)}
    order_note = (
        ("The format keeps cells by type: their order changed.",) if _changes_order(writing.plain(kept)) else ()
    )
    lost = meshio.write_source(path, source, kept, "med")
    with h5py.File(path, "r+") as file:
        for one in file["ENS_MAA"].values():
            one.attrs["DES"] = np.bytes_("Written by meshgauge")
            step = next(iter(one.values()))
            for block, own in zip(source.cells, of_blocks, strict=False):
                _number(step["MAI"][BY_NAME[block.type]], "NOD", own)
            if labels[1] is not None:
                _number(step["NOE"], "COO", labels[1])
    return (*order_note, *lost)


def _changes_order(mesh: Mesh) -> bool:
    """True if cells are not by type as the file lists types: by MED's names for them."""
    names = {t: BY_NAME.get(meshio.name_of(CELL_TYPES[t]), "") for t in np.unique(mesh.types).tolist()}
    rank = np.zeros(256, np.int64)
    rank[sorted(names, key=lambda t: names[t])] = np.arange(len(names))
    return bool((np.diff(rank[mesh.types]) < 0).any())


def _to_write(data: Mapping[str, NDArray[Any]], n: int) -> Ints | None:
    """Labels, if they are numbers that the format can have."""
    numbers = writing.numbers(data, n, 2**31 - 1)
    return numbers if np.array_equal(numbers, data.get(LABEL, ())) and n else None


def _number(group: Any, beside: str, numbers: Ints) -> None:
    """Put the numbers of cells or points beside their nodes or coordinates, marked as those are."""
    made = group.create_dataset("NUM", data=numbers.astype(np.int32))
    made.attrs["CGT"], made.attrs["NBR"] = group[beside].attrs["CGT"], group[beside].attrs["NBR"]


_FAMILY = "cell_tags"  # as meshio calls it
_NUMBERS = "NUM"
"""Under this name the numbers of cells are put in order with them."""

MED = Format("med", "MED", (".med",), sniff, read, write=write, places=places, add=add, by_content=False)
