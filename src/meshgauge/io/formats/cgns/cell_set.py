"""A set of cells added to CGNS files in HDF5: a region of each zone that has some of them."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np

from ....mesh.labels import LABEL
from ...plumbing.added import CannotAdd
from ...plumbing.cell_set import CellSet
from .adding import make_node, require_hdf
from .tree import Node
from .zone import zones

_REGION = "ZoneSubRegion_t"


def add_set(old: Path, new: Path, chosen: CellSet) -> None:
    """The numbers of elements, or of cells along the axes of a structured zone, counted from 1."""
    import h5py

    require_hdf(old)
    shutil.copyfile(old, new)
    start = 0
    with h5py.File(new, "r+") as file:
        for base in Node(file, new.stat().st_size).children("CGNSBase_t"):
            dimension = int(base.integers()[0])
            for node, zone in zip(base.children("Zone_t"), zones(base), strict=True):
                stop = start + len(zone.part.types)
                here = chosen.cells[(chosen.cells >= start) & (chosen.cells < stop)] - start
                start = stop
                if not len(here):
                    continue
                if node.child(chosen.name) is not None:
                    raise CannotAdd(f"has a node {chosen.name!r} already")
                labels = zone.part.cell_data.get(LABEL)
                if zone.shape:
                    along = np.unravel_index(here, tuple(n - 1 for n in zone.shape)[::-1])
                    points = np.stack(along[::-1], axis=1) + 1
                else:
                    points = (here + 1 if labels is None else labels[here])[:, None]
                made = make_node(node.group, chosen.name, _REGION, np.array([dimension], np.int32))
                make_node(made, "GridLocation", "GridLocation_t", np.frombuffer(b"CellCenter", np.int8))
                make_node(made, "PointList", "IndexArray_t", points.astype(np.int64))
