"""Which region (material, zone, physical group, block) each cell belongs to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..cells import BY_NAME, CELL_TYPES, IS_SOLID
from ..errors import expect
from ..look.style import printable
from .mesh import CellBlock, Mesh

KEYS: tuple[str, ...] = (
    "med:group",
    "gmsh:physical",
    "medit:ref",
    "abaqus:material",
    "ansys:material",
    "lsdyna:part",
    "mfem:attribute",
    "nastran:property",
    "nastran:material",
    "nastran:ref",
    "su2:zone",
    "elmer:body",
    "femap:property",
    "frontistr:material",
    "exodus:block",
    "kratos:property",
    "unv:property",
    "unv:material",
    "tetgen:attribute",
    "avsucd:material",
    "netgen:index",
    "cell_tags",
    "material",
    "material_id",
    "materialid",
    "materialids",
    "mat",
    "mat_id",
    "matid",
    "region",
    "region_id",
    "regionid",
    "attribute",
    "attributes",
    "zone",
    "domain",
    "subdomain",
    "subdomain_id",
    "part",
    "partid",
    "block",
    "blockid",
    "block_id",
    "group",
    "elementblockids",
    "objectid",
    "property",
    "component",
    "cellentityids",
    "gmsh:geometrical",
)
"""Names of integer cell data that tell a region, the best first; compared without case and with - as _."""

BLOCKS = "blocks"
"""What tells regions that are the blocks of the mesh; names of cell data tell the others."""

MOST = 4096
"""Values that cell data may have to tell regions rather than number cells."""


def regions(mesh: Mesh) -> tuple[NDArray[np.int64], tuple[str, ...]]:
    """The best partition of the cells into regions that the file gives.

    Tried in this order: blocks with names of their own (zones, element sets, parts), cell data of integers with a name
    that says so (`KEYS`), the blocks whatever they are called. Of these the first counts that parts the solid cells in
    two or more; if none does, the first there is.

    Parameters
    ----------
    mesh
        Any mesh.

    Returns
    -------
    ids : ndarray of int64, shape (n_cells,)
        Position in ``names`` of the region of each cell.
    names : tuple of str
        Each region once. A number is written with the name of its data ("material 3") unless the file names it.
        A mesh without any regions has one, called "all". Characters that a terminal would obey stand as ``\\x1b``.
    """
    ids, names, _ = partition(expect(mesh, Mesh))
    return ids, names


def partition(mesh: Mesh) -> tuple[NDArray[np.int64], tuple[str, ...], str]:
    """`regions`, and what tells them: the name of cell data, ``BLOCKS``, or nothing."""
    best = _best(mesh, [(BLOCKS, named_blocks(mesh)), *_from_data(mesh), (BLOCKS, _blocks(mesh))])
    return best if best is not None else (np.zeros(mesh.n_cells, np.int64), ("all",), "")


def named_regions(mesh: Mesh) -> tuple[NDArray[np.int64], tuple[str, ...]] | None:
    """As `regions`, but only those that the file gives a name or a number; None if there are none."""
    best = _best(mesh, [(BLOCKS, named_blocks(mesh)), *_from_data(mesh)])
    return None if best is None else best[:2]


def _best(
    mesh: Mesh, partitions: Sequence[tuple[str, _Partition | None]]
) -> tuple[NDArray[np.int64], tuple[str, ...], str] | None:
    """The first partition that parts the solid cells, else the first there is; and what tells it."""
    candidates = [(source, *one) for source, one in partitions if one is not None]
    if not candidates:
        return None
    source, ids, names = candidates[0]
    if len(candidates) > 1:
        is_solid = IS_SOLID[mesh.types]
        source, ids, names = next((one for one in candidates if _parts(one[1][is_solid])), candidates[0])
    return ids, tuple(map(printable, names)), source


def _parts(ids: NDArray[np.int64]) -> bool:
    return bool(len(ids) and (ids != ids[0]).any())


_Partition = tuple[NDArray[np.int64], tuple[str, ...]]


def _blocks(mesh: Mesh) -> _Partition | None:
    """Blocks; those of one name are one region."""
    of_blocks = block_regions(mesh.blocks)
    if of_blocks is None:
        return None
    ids = np.zeros(mesh.n_cells, np.int64)
    for region, block in zip(of_blocks[0], mesh.blocks, strict=True):
        ids[block.start : block.stop] = region
    return ids, of_blocks[1]


def block_regions(blocks: Sequence[CellBlock]) -> tuple[tuple[int, ...], tuple[str, ...]] | None:
    """The region of each block, and their names; None if there are less than two blocks."""
    if len(blocks) < 2:
        return None
    labels = [block.name or f"block {n}" for n, block in enumerate(blocks, 1)]
    names = tuple(dict.fromkeys(labels))
    return tuple(map(names.index, labels)), names


def named_blocks(mesh: Mesh) -> _Partition | None:
    """Blocks if their names say more than a type of cells, a piece or the entity of a model."""
    return _blocks(mesh) if have_names(mesh.blocks) else None


def have_names(blocks: Sequence[CellBlock]) -> bool:
    """Whether the names of blocks say more than a type of cells, a piece or the entity of a model."""
    # "polyhedron12": some formats add the number of nodes to the type.
    of_any_size = (row.name for row in CELL_TYPES.values() if row.n_nodes is None and row.dimension >= 2)
    dull = ("block ", "partition ", "piece ", "volume ", "surface ", "curve ", "point ", *of_any_size)
    return len({b.name for b in blocks if b.name and b.name not in BY_NAME and not b.name.startswith(dull)}) > 1


def place_of(name: str) -> int | None:
    """How well the name of cell data says that they tell regions, 0 is best; None if it does not."""
    return _PLACES.get(name.lower().replace("-", "_").replace(" ", "_"))


_PLACES = {key: place for place, key in enumerate(KEYS)}


def _from_data(mesh: Mesh) -> list[tuple[str, _Partition]]:
    partitions = []
    for name, values in mesh.cell_data.items():
        place = place_of(name)
        if place is not None and (of_data := _partition(mesh, name, values)) is not None:
            partitions.append((place, name, of_data))
    return [(name, one) for _, name, one in sorted(partitions, key=lambda known: known[0])]


def _partition(mesh: Mesh, name: str, values: NDArray[Any]) -> _Partition | None:
    keys = distinct(values) if len(values) else None
    if keys is None:
        return None
    return ids_of(values, keys), names_of(name, keys, mesh.field_data)


def distinct(values: NDArray[Any]) -> NDArray[Any] | None:
    """The values of cell data ``(n, ...)``, ascending, each once; None if they do not tell regions."""
    flat = values.reshape(len(values), -1)
    if len(flat) and flat.shape[1] != 1:
        return None
    column = flat[:, 0] if len(flat) else flat.reshape(-1)
    if column.dtype.kind == "f" and not (np.isfinite(column) & (column == np.trunc(column))).all():
        return None
    if column.dtype.kind not in "iubfU":
        return None
    keys = np.unique(column)
    return keys if len(keys) <= MOST else None


def ids_of(values: NDArray[Any], keys: NDArray[Any]) -> NDArray[np.int64]:
    """The position of each value in the keys, which are all of them."""
    return np.searchsorted(keys, values.reshape(-1)).astype(np.int64)


def names_of(name: str, keys: NDArray[Any], field_data: Mapping[str, NDArray[Any]]) -> tuple[str, ...]:
    """What the regions are called that these values of cell data tell."""
    known = _known_names(field_data, name)
    label = name.split(":")[-1]
    if keys.dtype.kind == "U":
        return tuple(str(key) or "none" for key in keys)
    return tuple(known.get(int(key), f"{label} {int(key)}") for key in keys)


def _known_names(field_data: Mapping[str, NDArray[Any]], name: str) -> dict[int, str]:
    """Names of numbers: Gmsh's physical groups of solids, and lists kept as field data ``<name>:names``, of the numbers
    in ``<name>:numbers``, or from 1 on."""
    listed = field_data.get(f"{name}:names")
    numbers = field_data.get(f"{name}:numbers")
    if listed is not None and numbers is not None and numbers.shape == listed.shape and numbers.dtype.kind in "iu":
        return dict(zip(numbers.ravel().tolist(), map(str, listed.ravel().tolist()), strict=True))
    if listed is not None:
        return {0: f"no {name.split(':')[-1]}", **{n: str(v) for n, v in enumerate(listed.ravel().tolist(), 1)}}
    if name != "gmsh:physical":
        return {}
    groups = [(int(v[1]), int(v[0]), key) for key, v in field_data.items() if v.shape == (2,) and v.dtype.kind in "iu"]
    return {0: "no physical", **{tag: key for _, tag, key in sorted(groups)}}
