"""Files one after another: each is read, measured and dropped; one that fails is reported, and the others go on."""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypeVar

from ..errors import FailedFile, MeshgaugeError, ReadError, WriteError
from ..io import Limits, read_as_one, steps
from ..io.plumbing.pieces import Pieces, ReadWhole, row_bytes
from ..io.plumbing.steps import StepChoice, position
from ..look.bands import PoorBelow
from ..mesh import Mesh
from . import ahead, inputs, scheduler, slices, terminal
from .options import Purposes, Reading, WedgeOrders
from .terminal import COULD_NOT, DONE, TRACEBACK

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ..io.patching import Changes, Patch
    from ..quality.measure import Quality
    from ..quality.one_cell import OneCell
    from ..report.record import StepOf
    from ..report.states import StateReader
    from ..slices import Ask, Job, Partial
    from ..slices.partial import CellRows
    from .ahead import Task

T = TypeVar("T")

LARGE = 4_000_000
"""Bytes of a file from which its cells are likely too many to be measured without Numba."""

SAID = 100_000_000
"""Bytes of a file from which on it is said why it is not read in slices."""

REFERRING = (".pvtu", ".pvd", ".series", ".vtkhdf", ".hdf")
"""Extensions of files that may be small although the mesh is large: its arrays stand in others."""

DIAGNOSED = 5_000_000
"""Cells up to which a mesh is read whole if there is memory: it is diagnosed as well, see `doctor.LIMIT`."""

OFTEN = 2.0
"""Times from which on it is said how often points are read."""

AS_STORED = WedgeOrders.gmsh
"""Wedges are not renumbered while reading: for commands that find out which cells are numbered in reverse."""


@dataclass(kw_only=True)
class Batch:
    """How every file of a command is read and measured, and which of them failed."""

    reading: Reading
    wedge_order: WedgeOrders = AS_STORED
    purpose: Purposes | None = None  #: what meshes are for; None: as their format says
    threads: int | None = None
    keep_bricks: bool = False  #: measure cells with repeated nodes as they are
    scheduler: str | None = None  #: where slices are measured, see `cli.scheduler`; None: threads
    memory: str | None = None  #: that the points of a large mesh may take, as text; None: a quarter of what is free
    poor_below: PoorBelow | None = None  #: below which cells are poor; None: as the nearest settings say
    then: Task | None = None  #: what follows measuring, and needs kernels of its own
    quiet: bool = False  #: no progress
    on_failure: Callable[[FailedFile], object] | None = None  #: is called for each file that fails, beside the message
    failures: list[FailedFile] = field(default_factory=list)

    def __post_init__(self) -> None:
        scheduler.check(self.scheduler)  # a wrong one is refused, also where no mesh is large
        if self.poor_below is None:
            from ..check.settings import poor_below

            self.poor_below = poor_below()  # so are settings that cannot be understood

    @property
    def exit_code(self) -> int:
        """2 if some file failed, else 0."""
        return COULD_NOT if self.failures else DONE

    @property
    def poor(self) -> PoorBelow:
        """Below which cells are poor."""
        assert self.poor_below is not None  # since it was made
        return self.poor_below

    @property
    def allowed_memory(self) -> int | None:
        """Bytes that ``--memory`` allows; None if it is not given. Raises `OptionError` if it is no size."""
        return None if self.memory is None else slices.n_bytes(self.memory)

    def progress(self, text: str) -> AbstractContextManager[object]:
        """A spinner, if this takes long: ``with batch.progress("drawing a.png"):``."""
        return terminal.activity(text, shown=not self.quiet)

    @property
    def step(self) -> StepChoice:
        """The time step that is read. Raises `ReadError` if it is none."""
        return _choice(self.reading.step)

    @property
    def dimension(self) -> Literal[2, 3] | None:
        """Which cells are measured, if the user says so."""
        return self.reading.dimension.value_or_none

    @property
    def _limits(self) -> Limits:
        memory = self.reading.read_memory
        roots = tuple(self.reading.include_root or ())
        return Limits(self.reading.read_seconds, None if memory is None else int(memory * 2**30), roots)

    def states(self, paths: Iterable[str], *, every: bool = False) -> list[str]:
        """The files, and in place of one that holds several time steps each of them, where ``--step all`` asks for it.

        With ``every`` also where ``--step`` is not given. Steps that differ in data only are one, unless the points are
        displaced by such data. A file whose steps cannot be listed stays: reading it says why.
        """
        if self.reading.step != "all" and (self.reading.step is not None or not every):
            return list(paths)
        states: list[str] = []
        for path in paths:
            try:
                held = steps(path, file_format=self.reading.file_format, limits=self._limits)
            except MeshgaugeError:
                held = ()
            if len(held) < 2:
                states.append(path)
                continue
            kept = inputs.states_of(path, held, displaced=self.reading.displacement is not None)
            if len(kept) == 1 and self.reading.step == "all" and not self.quiet:
                terminal.warn("note", inputs.ONE_STATE.format(path=path, n=len(held)))
            states += kept
        return states

    def require_one_state(self, path: str) -> None:
        """Raise `ReadError` unless it is known which time step is to be changed, with the points of the file."""
        if self.reading.step == "all":
            raise ReadError(f"{path}: --step all names no single step to change")
        if self.reading.displacement is not None:
            raise ReadError(f"{path}: --displacement measures a deformed shape; it cannot be written as the mesh")
        if self.reading.step is None:
            n = len(steps(path, file_format=self.reading.file_format, limits=self._limits))
            if n > 1:
                raise ReadError(f"{path}: holds {n} time steps; --step says which one is to be changed")

    def steps_with_the_same_points(self, path: str) -> list[str]:
        """The other time steps of a file that have the points of the one that is read."""
        states = steps(path, file_format=self.reading.file_format, limits=self._limits)
        if len(states) < 2:
            return []
        own = states[position(states, self.step, Path(path))]
        return [str(one) for one in states if one.geometry == own.geometry and one is not own]

    def read(self, path: str) -> Mesh:
        """The mesh in a file. Raises `ReadError`."""
        with self.progress(f"reading {path}"):
            mesh = read_as_one(
                _files(path),
                file_format=self.reading.file_format,
                wedge_order=self.wedge_order.value,
                step=path.step if isinstance(path, inputs.State) else self.step,
                displacement=self.reading.displacement,
                limits=self._limits,
            )
            mesh = mesh if self.purpose is None else mesh.replace(purpose=self.purpose.of_mesh)
            mesh = mesh.as_measured(self.dimension)
        if self.purpose == Purposes.fv and mesh.dimension == 2:
            raise ReadError(f"{path}: --for fv asks for solid cells, and its surface cells are measured")
        return mesh

    def read_to_measure(self, path: str) -> Mesh:
        """As `read`; what measuring needs is loaded meanwhile, if the file is large."""
        loading = terminal.in_background(ahead.load) if _size(path) > LARGE else None
        mesh = self.read(path)
        if loading is not None:
            with self.progress(f"measuring {path}"):
                loading.join()
        if self.then is not None:
            ahead.begin(self.then, mesh, self.threads)
        return mesh

    def measure(self, path: str, metrics: Iterable[str] = ("jens",)) -> Quality:
        """What is measured on the mesh in a file. Raises `ReadError` and `MetricError`."""
        mesh = self.read_to_measure(path)
        with self.progress(f"measuring {path}"):
            from ..quality.measure import measure

            return measure(
                mesh, metrics=metrics, threads=self.threads, keep_bricks=self.keep_bricks, poor_below=self.poor
            )

    def is_small(self, path: str) -> bool:
        """Whether a mesh is read whole without a look at what its file holds."""
        if self.reading.displacement is not None or self.scheduler is not None:
            return self.reading.displacement is not None
        has_room = slices.has_room(_files(path), self.reading.file_format, self.allowed_memory)
        is_alone = not any(file.lower().endswith(REFERRING) for file in _files(path))
        return is_alone and _size(path) < LARGE if has_room is None else has_room

    def in_slices(
        self, path: str, ask: Ask, on_rows: Callable[[int, CellRows], object] | None = None
    ) -> tuple[Job, Partial] | None:
        """What is asked of a mesh, measured slice by slice; None if it is small, or has to be read whole.

        Raises `ReadError` and `MetricError`.
        """
        memory = self.allowed_memory
        if self.is_small(path):
            return None
        listed = self.pieces(path)
        if listed is None:
            self._say_why_whole(path)
        if listed is None or not (is_large(listed, memory) or self.scheduler is not None):
            return None
        from ..report.stream import job_of
        from ..slices import measure_pieces
        from ..slices.job import forget_points
        from ..slices.plan import seconds_of_reading, times_points_are_read

        ask = replace(
            ask,
            purpose=None if self.purpose is None else self.purpose.of_mesh,
            dimension=self.dimension,
            keep_bricks=self.keep_bricks,
            poor_below=self.poor,
        )
        try:
            with self.progress(f"looking through {path}"):
                job = job_of(listed, ask, memory=memory, wedge_order=self.wedge_order.value)
                times = times_points_are_read(job)
            if times > OFTEN and not self.quiet:
                whole = slices.size_text(
                    1.01 * sum(piece.points.shape[0] * row_bytes(piece.points) for piece in listed.pieces)
                )
                about = slices.duration(seconds_of_reading(job, times))
                terminal.warn(
                    "note",
                    f"{path}: points are read {times:.0f} times, about {about}; --memory {whole} reads them once",
                )
            with scheduler.executor(self.scheduler or scheduler.of_environment()) as (pool, n_processes):
                if pool is not None:  # each process has points of its own
                    forget_points()
                    job = replace(job, memory=job.memory // n_processes)
                with slices.progress(path, shown=not self.quiet) as progress:
                    partial = measure_pieces(
                        job, executor=pool, threads=self.threads, on_rows=on_rows, progress=progress
                    )
                return job, partial
        except ReadWhole as reason:
            if not self.quiet:
                terminal.warn("note", f"{path}: is read whole: {reason}")
            return None

    @contextlib.contextmanager
    def in_processes(
        self, paths: Sequence[str], job_of: Callable[[StateReader, str], Callable[[str, StepOf], T]]
    ) -> Iterator[Callable[[str], T] | None]:
        """What makes of time steps what ``job_of`` a reader and a path makes of each, several at a time in processes,
        if ``--scheduler`` asks for it; None if not, or there are no steps."""
        steps = [path for path in paths if isinstance(path, inputs.State)]
        if self.scheduler is None or len(steps) < 2 or len(steps) < len(paths):
            yield None
            return
        from ..report.states import StateReader, measuring

        with scheduler.executor(self.scheduler) as (pool, n_processes):
            assert pool is not None  # one was asked for
            memory = self.allowed_memory
            reader = StateReader(
                purpose=None if self.purpose is None else self.purpose.of_mesh,
                keep_bricks=self.keep_bricks,
                file_format=self.reading.file_format,
                wedge_order=self.wedge_order.value,
                displacement=self.reading.displacement,
                dimension=self.dimension,
                poor_below=self.poor,
                limits=self._limits,
                most=DIAGNOSED,
                memory=None if memory is None else memory // n_processes,
            )
            with measuring(pool, [(str(path), path.of_file, job_of(reader, path)) for path in steps]) as states:
                yield states.result

    def pieces(self, path: str) -> Pieces | None:
        """Where the arrays of a mesh stand; None where reading it whole will say what is wrong with it."""
        step = path.step if isinstance(path, inputs.State) else self.step
        files, chosen = _files(path), self.reading.file_format
        try:
            if self.scheduler is None and slices.has_room(files, chosen, self.allowed_memory):
                return None
            return slices.listed(files, chosen, step)
        except ReadError:
            return None

    def _say_why_whole(self, path: str) -> None:
        """A note on a large file that is not read in slices."""
        memory, size = self.allowed_memory, _size(path)
        if self.quiet or (size < SAID and (memory is None or slices.WHOLE * size <= memory)):
            return
        with contextlib.suppress(ReadError):  # reading it says what is wrong
            from ..io.reading import why_whole

            reasons = (why_whole(one, file_format=self.reading.file_format, step=self.step) for one in _files(path))
            reason = next(filter(None, reasons), "its files do not go together in slices")
            terminal.warn("note", f"{path}: is read whole: {reason}")

    def with_faces(self, path: str, quality: Quality) -> Quality:
        """The same with what finite volumes ask of faces, if that is what the mesh is for."""
        if quality.mesh.purpose != "fv":
            return quality
        from ..quality.metrics import LIMITS
        from ..quality.neighbours import with_face_metrics

        with self.progress(f"measuring faces of {path}"):
            return with_face_metrics(quality, LIMITS, self.threads)

    def cell(self, path: str, text: str, metrics: Iterable[str] = ("jens",)) -> OneCell:
        """One cell of the mesh in a file, see `find_cell`. Raises `ReadError`, `MetricError` and `OptionError`."""
        from ..mesh.labels import find_cell
        from ..quality.one_cell import one_cell

        quality = self.measure(path, metrics)
        return one_cell(quality, find_cell(quality.mesh, text))

    def write(
        self,
        target: Path,
        mesh: Mesh,
        *,
        overwrite: bool = False,
        before_replacing: Callable[[Path], object] | None = None,
    ) -> None:
        """Write a mesh, as `meshgauge.write`; what the format cannot hold is a note on standard error."""
        with self.progress(f"writing {target}"):
            from ..io import write

            for lost in write(target, mesh, overwrite=overwrite, before_replacing=before_replacing):
                terminal.warn("note", f"{target}: {lost}")

    def add(self, quality: Quality, target: Path, *, overwrite: bool = False) -> bool:
        """Copy the file of a mesh with what was measured, all else as it is; False if the output is a conversion.

        Raises `CannotAdd` and `WriteError`.
        """
        from ..io.adding import add_data

        mesh = quality.source
        with self.progress(f"writing {target}"):
            return add_data(
                mesh,
                target,
                cells=quality.cell_data(),
                points=quality.point_data(),
                overwrite=overwrite,
                file_format=self.reading.file_format,
                limits=self._limits,
                step=self.step,
                wedge_order=self.wedge_order.value,
            )

    def write_set(self, mesh: Mesh, target: Path, cells: NDArray[np.int64], name: str) -> tuple[str, ...]:
        """Write a mesh, as it was read, with a set of its cells, see `io.sets`."""
        from ..io.sets import write_set

        return write_set(
            mesh, target, cells, name, file_format=self.reading.file_format, limits=self._limits,
            step=self.step, wedge_order=self.wedge_order.value, displacement=self.reading.displacement,
        )  # fmt: skip

    def patch(self, mesh: Mesh, target: Path, changes: Changes = "points") -> Patch | None:
        """How the file of a mesh is patched; None if the output is a conversion. Raises `ReadError`."""
        from ..io.patching import patch_of

        return patch_of(
            mesh,
            target,
            file_format=self.reading.file_format,
            limits=self._limits,
            step=self.step,
            changes=changes,
        )

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
            failure = FailedFile(path, terminal.unexpected(error))
        self.failures.append(failure)
        if self.on_failure is not None:
            self.on_failure(failure)
        terminal.warn("error", f"{path}: {failure.reason}")
        return failure


def _files(path: str) -> Sequence[str]:
    """The files that a path stands for."""
    if isinstance(path, inputs.Joined):
        return path.files
    return (path.file if isinstance(path, inputs.State) else path,)


def _size(path: str) -> int:
    return sum(map(inputs.size, _files(path)))


def is_large(listed: Pieces, memory: int | None) -> bool:
    """Whether a mesh is measured slice by slice: beyond what is diagnosed, or what memory allows."""
    return listed.in_one_go or listed.n_cells > DIAGNOSED or slices.takes_more(listed, memory)


def _choice(text: str | None) -> StepChoice:
    """What ``--step`` asks for of a file; ``all`` of one that holds a single state is that."""
    if text == "all":
        return "first"
    if text is None:
        return None
    if text in ("first", "last"):
        return "first" if text == "first" else "last"
    try:
        return int(text)
    except ValueError:
        raise ReadError(f"--step is {text!r}, expected first, last, all or a number from 1") from None


def _reason(path: str, error: BaseException) -> str:
    """Why, without the name of the file in front, which every message carries already."""
    if isinstance(error, MemoryError) and not isinstance(error, MeshgaugeError):
        return "does not fit into memory"
    if isinstance(error, OSError):
        return error.strerror or str(error)
    if isinstance(path, inputs.Joined):
        return str(error)
    name = path.file if isinstance(path, inputs.State) else path
    names = "|".join(map(re.escape, (name, os.path.abspath(name))))  # as it was given, and as slices are read by
    return re.sub(rf"\A(?:{names})(?:: |, |{re.escape(os.sep)})", "", str(error))
