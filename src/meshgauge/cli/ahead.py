"""The first run on a machine: while one process measures, a second compiles the kernels of what comes after that.

They are kept where the first looks for them. Nothing else depends on the second: what it has not done when it is asked
for is compiled here, and with the end of the first it ends.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import threading
from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from ..mesh import Mesh

Task = Literal["diagnose", "improve"]

MEMORY = 1 << 30
"""Bytes that must be free: two processes compile."""

_SPLITS = {
    "tetra": ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)),
    "pyramid": ((0, 1, 2, 3, 6), (0, 4, 5, 1, 6), (0, 3, 7, 4, 6)),
    "wedge": ((0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7)),
    "hexahedron": (tuple(range(8)),),
}
"""A cube as cells of each type."""

_beside: list[subprocess.Popen[bytes]] = []
"""The second process; what holds its pipe open."""


def load() -> None:
    """Numba and the kernels: a second or two that pass while a large file is read. What fails does so again at use."""
    with contextlib.suppress(Exception):  # too little memory is many errors
        from ..kernels import jit
        from ..quality import measure  # noqa: F401  imported to have it loaded

        jit.warm_up()


def begin(task: Task, mesh: Mesh, threads: int | None) -> None:
    """Have the kernels of a task compiled by a second process, as soon as the first finds that one is missing."""
    shapes = [name for name in _SPLITS if name in mesh.type_counts()]
    begin_for(task, mesh.n_cells, threads, str(mesh.points.dtype), str(mesh.connectivity.dtype), shapes)


def begin_for(
    task: Task,
    n_cells: int,
    threads: int | None,
    points: str = "float64",
    ids: str = "int64",
    shapes: Sequence[str] = tuple(_SPLITS),
) -> None:
    """The same for a mesh that is not read: how many cells, of which shapes, with which types of numbers in arrays."""
    from ..kernels import misses, path
    from ..kernels.threads import thread_count

    if n_cells > path.NUMPY_UP_TO and thread_count(threads) > 1:
        misses.when_missed(lambda: _start(task, points, ids, shapes))


def _start(task: Task, points: str, ids: str, shapes: Sequence[str]) -> None:
    from ..files.resources import free_memory

    free = free_memory()
    if _beside or not shapes or not sys.executable or (free is not None and free < MEMORY):
        return
    with contextlib.suppress(OSError):  # no more processes: then this one compiles all
        # Not from the folder that this one stands in: modules there are the user's.
        command = [sys.executable, "-P", "-m", __name__, task, points, ids, *shapes]
        _beside.append(
            subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        )


def _end_with_the_first() -> None:
    os.read(0, 1)  # until the pipe breaks
    os._exit(0)


def _some_cells(points: str, ids: str, shapes: Sequence[str], *, are_bad: bool) -> Mesh:
    """27 cubes for each type, one of their inner points far off if they are bad, in arrays of the mesh's own kinds."""
    import numpy as np

    from ..mesh import Mesh

    grid = np.moveaxis(np.mgrid[0:4, 0:4, 0:4], 0, -1).reshape(-1, 3).astype(points)
    grid[21] += 1.4 * are_bad
    place = np.arange(64).reshape(4, 4, 4)
    ends = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    cubes = np.stack([place[i : i + 3, j : j + 3, k : k + 3].ravel() for i, j, k in ends], axis=1)
    every = [grid + np.array((5 * n, 0, 0), points) for n in range(len(shapes))]
    cells = {
        name: np.concatenate([cubes[:, corners] for corners in _SPLITS[name]]).astype(ids) + np.array(64 * n, ids)
        for n, name in enumerate(shapes)
    }
    return Mesh.from_arrays(np.concatenate(every), cells)


def _compile(task: str, mesh: Mesh) -> None:
    from ..kernels import path
    from ..quality import measure

    if task == "diagnose":
        from ..doctor import diagnosis

        quality = measure.measure(mesh)  # by NumPy: the first process compiles what measures
        path.NUMPY_UP_TO = 0
        diagnosis(mesh, quality)
    else:
        from ..repair import improve

        improve(mesh, everywhere=True)  # which a local repair comes to after its longest kernel


if __name__ == "__main__":
    threading.Thread(target=_end_with_the_first, daemon=True).start()
    task, points, ids, *shapes = sys.argv[1:]
    _compile(task, _some_cells(points, ids, shapes, are_bad=task != "diagnose"))
