"""CGNS (.cgns) in HDF5: structured and unstructured zones, mixed sections, polyhedra, families and boundaries.

Own, because VTK's reader keeps no names of families, groups and boundaries, and no surfaces. Files of the old kind,
ADF, are left to it.
"""

from __future__ import annotations

from pathlib import Path

from ....errors import MeshgaugeError, ReadError
from ....mesh import CellBlock, Mesh
from ...plumbing import within
from ...plumbing.format import Format
from ...plumbing.ids import drop_counts
from ...plumbing.merge import merge_parts
from ..others import by_pyvista
from ..vtk.hdf import MAGIC
from . import adding, cell_set
from . import zone as cgns_zone
from .pieces import pieces
from .places import places
from .tree import Node


def sniff(head: bytes, path: Path) -> bool:
    return head.startswith(MAGIC) or b"ADF Database" in head[:64]


def read(path: Path) -> Mesh | None:
    """Every zone of every base, their points not merged; blocks by family, boundary and zone.

    A cell belongs to the family of the boundary or group (BC_t) that lists it, else to that of its zone, else to the
    zone. Faces of polyhedra are cells only where a boundary lists them. Of several solutions the first is read.
    """
    import h5py

    with path.open("rb") as raw:
        if raw.read(8) != MAGIC:
            return None
    try:
        with h5py.File(path, "r") as file:
            within.check_hdf(path, file)
            root = Node(file, path.stat().st_size)
            zones = [zone for base in root.children("CGNSBase_t") for zone in cgns_zone.zones(base)]
            if not zones:
                raise ReadError(f"{path}: has no zones (Zone_t)")
            return _mesh(zones, path)
    except MeshgaugeError as error:
        raise ReadError(f"{path}: {str(error).removeprefix(f'{path}: ')}") from error
    except (OSError, KeyError, ValueError, TypeError, IndexError, AttributeError, RuntimeError) as error:
        raise ReadError(f"{path}: not a whole CGNS file: {' '.join(str(error).split())}") from error


def _mesh(zones: list[cgns_zone.Zone], path: Path) -> Mesh:
    notes = list(dict.fromkeys(note for zone in zones for note in zone.notes))
    mesh = merge_parts([zone.part for zone in zones], path=path)
    blocks, at = [], 0
    for zone in zones:
        for name, start, stop in zone.blocks:
            if stop > start:
                blocks.append(CellBlock(name, at + start, at + stop))
        at += len(zone.part.types)
    if not mesh.n_cells:
        raise ReadError(f"{path}: has no cells")
    return drop_counts(mesh.replace(blocks=tuple(blocks), notes=tuple(notes)))


CGNS = Format(
    "cgns",
    "CGNS",
    (".cgns",),
    sniff,
    read,
    foreign=by_pyvista,
    places=places,
    pieces=pieces,
    add=adding.add,
    add_set=cell_set.add_set,
    by_content=False,
)
