"""Files of Fluent in HDF5, made of meshes of linear cells."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from cgns_files import faces_of

from meshgauge.mesh import Mesh


def cff(path: Path, mesh: Mesh, **changes: Any) -> Path:
    """Two zones of cells; the faces that bound one cell only are the wall, and no others are there."""
    faces, cells = faces_of(mesh)
    owner = np.zeros((2, len(faces)), np.int32)
    for cell, row in enumerate(cells, 1):
        for face in row:
            owner[int(face > 0), abs(face) - 1] = cell  # the normal points into the first cell
    turned = owner[0] == 0  # a face of one cell has it first
    faces = [face[::-1] if turn else face for face, turn in zip(faces, turned, strict=True)]
    owner[:, turned] = owner[::-1, turned]
    half, n = mesh.n_cells // 2, mesh.n_cells
    import h5py

    with h5py.File(path, "w") as file:
        made = file.create_group("meshes/1")
        for key, value in (("dimension", 3), ("nodeCount", mesh.n_points), ("cellCount", n), ("faceCount", len(faces))):
            made.attrs[key] = np.array([value], np.uint64)
        arrays: dict[str, Any] = {
            "nodes/coords/1": mesh.points,
            "cells/zoneTopology/id": [5, 6],
            "cells/zoneTopology/minId": [1, half + 1],
            "cells/zoneTopology/maxId": [half, n],
            "cells/zoneTopology/name": np.array([b"fluid;solid"]),
            "cells/zoneTopology/dimension": [3, 3],
            "cells/zoneTopology/cellType": [7, 7],
            "faces/zoneTopology/id": [8],
            "faces/zoneTopology/minId": [1],
            "faces/zoneTopology/maxId": [len(faces)],
            "faces/zoneTopology/zoneType": [3],
            "faces/zoneTopology/name": np.array([b"wall"]),
            "faces/nodes/1/nnodes": np.array([len(face) for face in faces], np.int16),
            "faces/nodes/1/nodes": np.array([node for face in faces for node in face], np.int32),
            "faces/c0/1": owner[0],
            "faces/c1/1": owner[1],
        } | changes
        for key, values in arrays.items():
            made[key] = values
        for_vtk(file, mesh.n_points, len(faces))
    return path


def for_vtk(file: Any, n_points: int, n_faces: int) -> None:
    """What VTK's reader asks for beside: numbers of sections, ranges, a group of settings."""
    file.create_group("settings")
    made = file["meshes/1"]
    for key, values in (("id", [1]), ("minId", [1]), ("maxId", [n_points]), ("dimension", [3])):
        made[f"nodes/zoneTopology/{key}"] = np.array(values, np.int32)
    for key in ("nodeOffset", "cellOffset", "faceOffset"):
        made.attrs[key] = np.array([1], np.uint64)
    made["nodes/coords/1"].attrs["minId"], made["nodes/coords/1"].attrs["maxId"] = np.uint64(1), np.uint64(n_points)
    for key, value in (("c0", 1), ("c1", 0), ("childZoneId", 0), ("shadowZoneId", 0), ("flags", 0), ("dimension", 2)):
        made.require_group("faces/zoneTopology").require_dataset(key, (1,), np.int32, data=np.array([value], np.int32))
    made["faces/zoneTopology/faceType"] = np.zeros(1, np.int32)
    for key in ("nodes", "cells", "faces"):
        group = made[f"{key}/zoneTopology"]
        group.attrs["nZones"] = np.array([len(group["id"])], np.uint64)
    for key in ("nodes", "c0", "c1"):
        made[f"faces/{key}"].attrs["nSections"] = np.array([1], np.uint64)
    for key in ("faces/nodes/1", "faces/c0/1", "faces/c1/1"):
        made[key].attrs["minId"], made[key].attrs["maxId"] = np.uint64(1), np.uint64(n_faces)
    for key in ("childZoneId", "zoneType"):
        made[f"cells/zoneTopology/{key}"] = np.ones(len(made["cells/zoneTopology/id"]), np.int32)
