"""Write meshes of any size in bounded memory: a cube of hexahedra, every point moved at random, layer by layer.

    python benchmarks/layers.py big.vtkhdf 465            # 465³, 100 million hexahedra
    python benchmarks/layers.py big.vtu 342 --shuffled

``--shuffled`` renumbers points and cells at random, which takes memory for all of them.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

NOISE = 0.33
"""Points move by up to a third of the cube's edge along each axis."""

Ids = NDArray[np.int64]


def points_of(n: int) -> Iterator[NDArray[np.float64]]:
    """``((n + 1)², 3)`` points of each layer."""
    axis = np.arange(n + 1.0)
    for layer in range(n + 1):
        points = np.empty((n + 1, n + 1, 3))
        points[..., 0], points[..., 1], points[..., 2] = axis[:, None], axis[None, :], layer
        points += np.random.default_rng(layer).uniform(-NOISE, NOISE, points.shape)
        yield points.reshape(-1, 3)


def cells_of(n: int) -> Iterator[Ids]:
    """``(n², 8)`` hexahedra of each layer."""
    i, j = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    bottom = (i * (n + 1) + j).reshape(-1, 1) + np.array([0, n + 1, n + 2, 1])
    for layer in range(n):
        yield np.concatenate([bottom, bottom + (n + 1) ** 2], axis=1) + layer * (n + 1) ** 2


def shuffled(n: int) -> tuple[Iterator[NDArray[np.float64]], Iterator[Ids]]:
    """The same in another order, in layers all the same."""
    rng = np.random.default_rng(0)
    points, cells = np.vstack(list(points_of(n))), np.vstack(list(cells_of(n)))
    places = rng.permutation(len(points))
    moved = np.empty_like(points)
    moved[places] = points
    cells = places[cells[rng.permutation(len(cells))]]
    return iter(np.array_split(moved, n + 1)), iter(np.array_split(cells, n))


def write_hdf(path: Path, n: int, points: Iterator[NDArray[np.float64]], cells: Iterator[Ids], chunks: int) -> None:
    """A VTKHDF file; ``chunks``: of so many rows, packed by gzip, if not 0."""
    n_points, n_cells = (n + 1) ** 3, n**3
    packing = {"compression": "gzip", "compression_opts": 1} if chunks else {}
    with h5py.File(path, "w", libver=("earliest", "v110")) as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = np.array([2, 0])
        root.attrs.create("Type", np.bytes_("UnstructuredGrid"))
        sizes = {"NumberOfPoints": n_points, "NumberOfCells": n_cells, "NumberOfConnectivityIds": 8 * n_cells}
        for name, size in sizes.items():
            root[name] = np.array([size], np.int64)
        shapes = {"Points": ((n_points, 3), "f8"), "Types": ((n_cells,), "u1"), "Offsets": ((n_cells + 1,), "i8")}
        for name, (shape, kind) in {**shapes, "Connectivity": ((8 * n_cells,), "i8")}.items():
            root.create_dataset(name, shape, kind, chunks=(chunks, *shape[1:]) if chunks else None, **packing)
        at = 0
        for some in points:
            root["Points"][at : at + len(some)] = some
            at += len(some)
        at = 0
        for ids in cells:
            stop = at + len(ids)
            root["Types"][at:stop] = 12
            root["Offsets"][at : stop + 1] = 8 * np.arange(at, stop + 1)
            root["Connectivity"][8 * at : 8 * stop] = ids.reshape(-1)
            at = stop


def write_vtu(path: Path, n: int, points: Iterator[NDArray[np.float64]], cells: Iterator[Ids]) -> None:
    """A VTU with raw appended data."""
    n_points, n_cells = (n + 1) ** 3, n**3
    arrays = (
        ("Points", "Points", "Float64", 24 * n_points),
        ("Cells", "connectivity", "Int64", 64 * n_cells),
        ("Cells", "offsets", "Int64", 8 * n_cells),
        ("Cells", "types", "UInt8", n_cells),
    )
    at, items = 0, {"Points": "", "Cells": ""}
    for where, name, kind, size in arrays:
        width = 'NumberOfComponents="3" ' if where == "Points" else ""
        items[where] += f'<DataArray type="{kind}" Name="{name}" {width}format="appended" offset="{at}"/>'
        at += size + 8
    head = (
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">'
        f'<UnstructuredGrid><Piece NumberOfPoints="{n_points}" NumberOfCells="{n_cells}">'
        f"<Points>{items['Points']}</Points><Cells>{items['Cells']}</Cells></Piece></UnstructuredGrid>"
        '<AppendedData encoding="raw">_'
    )
    layer = n * n
    bodies = (
        (some.tobytes() for some in points),
        (ids.tobytes() for ids in cells),
        ((8 * np.arange(k * layer + 1, (k + 1) * layer + 1)).tobytes() for k in range(n)),
        (np.full(layer, 12, np.uint8).tobytes() for _ in range(n)),
    )
    with path.open("wb") as file:
        file.write(head.encode())
        for (_, _, _, size), body in zip(arrays, bodies, strict=True):
            file.write(np.uint64(size).tobytes())
            file.writelines(body)
        file.write(b"</AppendedData></VTKFile>")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("path", type=Path, help="ends in .vtkhdf or .vtu")
    parser.add_argument("n", type=int, help="hexahedra along an edge")
    parser.add_argument("--shuffled", action="store_true")
    parser.add_argument("--chunks", type=int, default=0, help="rows of a chunk, packed by gzip (VTKHDF)")
    given = parser.parse_args()
    points, cells = shuffled(given.n) if given.shuffled else (points_of(given.n), cells_of(given.n))
    if given.path.suffix == ".vtu":
        write_vtu(given.path, given.n, points, cells)
    else:
        write_hdf(given.path, given.n, points, cells, given.chunks)


if __name__ == "__main__":
    main()
