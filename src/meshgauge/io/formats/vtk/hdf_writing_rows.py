"""VTKHDF files of meshes that are not in memory."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...plumbing.mesh_rows import AT_ONCE, MeshRows, OfType


def write_rows(path: Path, rows: MeshRows) -> None:
    """As `hdf.write`, some rows at a time."""
    import h5py

    from .hdf import write_array  # which knows this module

    mesh = rows.mesh
    with h5py.File(path, "w", libver=("earliest", "v110")) as file:
        root = file.create_group("VTKHDF", track_order=True)
        root.attrs["Version"] = np.array([2, 0], np.int64)
        root.attrs.create("Type", np.bytes_("UnstructuredGrid"))
        sizes = {
            "NumberOfPoints": mesh.n_points,
            "NumberOfCells": mesh.n_cells,
            "NumberOfConnectivityIds": mesh.connectivity.shape[0],
        }
        for name, count in sizes.items():
            root.create_dataset(name, data=np.array([count], np.int64))
        arrays = {
            "Points": mesh.points,
            "Types": mesh.types,
            "Offsets": OfType(mesh.offsets, np.dtype(np.int64)),
            "Connectivity": OfType(mesh.connectivity, np.dtype(np.int64)),
        }
        groups = {"PointData": mesh.point_data, "CellData": mesh.cell_data}
        for group, held in ((root, arrays), *((root.create_group(k, track_order=True), v) for k, v in groups.items())):
            for name, values in held.items():
                made = group.create_dataset(name, values.shape, values.dtype.newbyteorder("="))
                for start in range(0, values.shape[0], AT_ONCE):
                    stop = min(start + AT_ONCE, values.shape[0])
                    made[start:stop] = values.read(start, stop)
        fields = root.create_group("FieldData", track_order=True)
        for name, field in rows.field_data.items():
            write_array(fields, name, field, [])
