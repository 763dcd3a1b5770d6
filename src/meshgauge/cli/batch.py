"""Files one after another: each is read, measured and dropped; one that fails is reported, and the others go on."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from ..errors import FailedFile, MeshgaugeError, WriteError
from ..io import Limits, read, write
from ..mesh import Mesh
from . import inputs, terminal
from .options import Purposes, Reading, WedgeOrders
from .terminal import COULD_NOT, DONE, TRACEBACK

if TYPE_CHECKING:
    from ..quality.measure import Quality

T = TypeVar("T")

LARGE = 4_000_000
"""Bytes of a file from which its cells are likely too many to be measured without Numba."""

AS_STORED = WedgeOrders.gmsh
"""Wedges are not renumbered while reading: for commands that find out which cells are numbered in reverse."""


@dataclass(kw_only=True)
class Batch:
    """How every file of a command is read and measured, and which of them failed."""

    reading: Reading
    wedge_order: WedgeOrders = AS_STORED
    purpose: Purposes | None = None  #: what meshes are for; None: as their format says
    threads: int | None = None
    quiet: bool = False  #: no progress
    on_failure: Callable[[FailedFile], object] | None = None  #: is called for each file that fails, beside the message
    failures: list[FailedFile] = field(default_factory=list)

    @property
    def exit_code(self) -> int:
        """2 if some file failed, else 0."""
        return COULD_NOT if self.failures else DONE

    def progress(self, text: str) -> AbstractContextManager[None]:
        """A spinner, if this takes long: ``with batch.progress("drawing a.png"):``."""
        return terminal.activity(text, shown=not self.quiet)

    def read(self, path: str) -> Mesh:
        """The mesh in a file. Raises `ReadError`."""
        reading = self.reading
        memory = None if reading.read_memory is None else int(reading.read_memory * 2**30)
        with self.progress(f"reading {path}"):
            mesh = read(
                path,
                file_format=reading.file_format,
                wedge_order=self.wedge_order.value,
                limits=Limits(reading.read_seconds, memory),
            )
            return mesh if self.purpose is None else mesh.replace(purpose=self.purpose.value)

    def measure(self, path: str, metrics: Iterable[str] = ("jens",)) -> Quality:
        """What is measured on the mesh in a file. Raises `ReadError` and `MetricError`."""
        loading = terminal.beside(_load) if inputs.size(path) > LARGE else None
        mesh = self.read(path)
        with self.progress(f"measuring {path}"):
            if loading is not None:
                loading.join()
            from ..quality.measure import measure

            return measure(mesh, metrics=metrics, threads=self.threads)

    def write(self, target: Path, mesh: Mesh, *, overwrite: bool = False) -> None:
        """Write a mesh; what the format cannot hold is a note on standard error. Raises `WriteError`."""
        with self.progress(f"writing {target}"):
            for lost in write(target, mesh, overwrite=overwrite):
                terminal.warn("note", f"{target}: {lost}")

    def each(self, paths: Iterable[str], work: Callable[[str], T]) -> Iterator[tuple[str, T]]:
        """Every path with the result of the work on it; those that fail are passed over, see `attempt`."""
        for path in paths:
            result = self.attempt(path, work)
            if not isinstance(result, FailedFile):
                yield path, result
                del result  # not two meshes at a time

    def attempt(self, path: str, work: Callable[[str], T]) -> T | FailedFile:
        """The result of some work on a file; why there is none, reported and kept, if it fails.

        Raises
        ------
        WriteError
            If an output cannot be written: it is that of all files.
        """
        try:
            return work(path)
        except WriteError:
            raise
        except (MeshgaugeError, OSError, MemoryError) as error:
            failure = FailedFile(path, _reason(path, error))
        except Exception as error:
            # The other files are still reported; a message says what happened where a traceback would end all.
            if os.environ.get(TRACEBACK):
                raise
            failure = FailedFile(path, f"unexpected {type(error).__name__}: {error}")
        self.failures.append(failure)
        if self.on_failure is not None:
            self.on_failure(failure)
        terminal.warn("error", f"{path}: {failure.reason}")
        return failure


def _reason(path: str, error: BaseException) -> str:
    """Why, without the name of the file in front, which every message carries already."""
    if isinstance(error, MemoryError):
        return "does not fit into memory"
    if isinstance(error, OSError):
        return error.strerror or str(error)
    return str(error).removeprefix(f"{path}: ")


def _load() -> None:
    """Numba and the kernels: a second or two that pass while a large file is read."""
    from ..kernels import jit
    from ..quality import measure  # noqa: F401  imported to have it loaded

    jit.warm_up()
