"""Which files are asked for, and which must not be written to."""

from __future__ import annotations

import glob
import os
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import ReadError, WriteError
from ..look.names import natural, of_files

if TYPE_CHECKING:
    from ..io import Step
    from ..report.record import StepOf

ONE_STATE = "{path}: its {n} time steps have the same points, and are one; --displacement NAME measures deformed shapes"
"""What is said where all steps are asked for."""

_PIECE = re.compile(r".*\.\d+\.\d+")


class Joined(str):
    """Files that are the parts of one mesh, as a path that names the first and the last."""

    files: tuple[str, ...]

    @classmethod
    def of(cls, files: Iterable[str]) -> Joined:
        ordered = tuple(sorted(files, key=natural))
        joined = cls(of_files(ordered))
        joined.files = ordered
        return joined


PARTIAL = ".mgp"
"""Extension of what was measured of a part."""


class Partials(Joined):
    """Partial reports of the parts of one mesh."""


def expand(arguments: Iterable[str]) -> list[str]:
    """The files meant by the arguments: patterns that the shell left alone are expanded, and folders that are no cases
    to the meshes in them; each file is named once.

    Raises
    ------
    ReadError
        If a pattern matches nothing.
    """
    paths: dict[str, None] = {}
    for argument in arguments:
        if os.path.isdir(argument):
            paths.update(dict.fromkeys(_in_folder(argument)))
            continue
        if os.path.exists(argument) or not glob.has_magic(argument):
            paths[argument] = None
            continue
        matches = sorted(glob.glob(argument, recursive=True))
        if not matches:
            raise ReadError(f"{argument}: no file matches this pattern")
        paths.update(dict.fromkeys(matches))
    return _without_pieces(list(paths))


def _in_folder(folder: str) -> list[str]:
    """A folder that is a mesh by itself, as OpenFOAM's are; else the meshes in it, or itself if there are none."""
    from ..io.registry import is_case, meshes_in

    if is_case(Path(folder)):
        return [folder]
    return [str(path) for path in meshes_in(Path(folder))] or [folder]


def _without_pieces(paths: list[str]) -> list[str]:
    """Of the pieces of one mesh the first that is given: it stands for all."""
    if not any(_PIECE.fullmatch(path) for path in paths):
        return paths
    from ..io.formats.exodus import pieces

    kept: list[str] = []
    taken: set[Path] = set()
    for path in paths:
        if Path(path) not in taken:
            kept.append(path)
            taken.update(pieces(Path(path)))
    return kept


def check_targets(
    inputs: Iterable[str], *, texts: Iterable[Path | None] = (), files: Iterable[Path | None] = ()
) -> None:
    """Make sure that outputs can be written, and are neither inputs nor one file.

    Parameters
    ----------
    inputs
        What is read.
    texts
        Outputs that ``-`` may lead to standard output.
    files
        Others.

    Raises
    ------
    WriteError
        If it is not so.
    """
    taken: list[tuple[Path, str]] = [(Path(path), "is an input; it is not overwritten") for path in inputs]
    for targets, is_text in ((texts, True), (files, False)):
        for target in targets:
            if target is None:
                continue
            for path, reason in taken:
                if _is_same(target, path):
                    raise WriteError(f"{target}: {reason}")
            taken.append((target, "is given for two outputs"))
            from ..files import output

            output.check(target, text=is_text)


def check_folder(folder: Path) -> None:
    """Raise `WriteError` if a folder for outputs is no folder, or cannot be made."""
    if folder.is_dir():
        return
    if os.path.lexists(folder):
        raise WriteError(f"{folder}: is no folder")
    if not folder.absolute().parent.is_dir():
        raise WriteError(f"{folder}: there is no folder {folder.parent}")


def make_folder(folder: Path) -> None:
    """Make a folder for outputs, if it is not there. Raises `WriteError`."""
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise WriteError(f"{folder}: cannot be made: {error.strerror or error}") from error


def mesh_target(paths: list[str], written: Path | None, *, in_place: bool, what: str | None = None) -> Path | None:
    """Where a mesh is to be written: ``--output``, or the input if ``--in-place`` is given.

    Parameters
    ----------
    paths
        The inputs. Only one can be written.
    written, in_place
        The options.
    what
        The mesh that is written, in words, if there must be a target; None: there need be none.

    Raises
    ------
    WriteError
        If the options exclude each other, or there are several inputs.
    """
    if written is None and not in_place and what is not None:
        raise WriteError(f"{paths[0]}: give -o OUT for the {what} mesh, or --in-place to replace the input")
    if written is not None and in_place:
        raise WriteError(f"{written}: --output and --in-place exclude each other")
    if len(paths) > 1 and (written is not None or in_place):
        option = "--in-place" if in_place else f"{written}: --output"
        raise WriteError(f"{option} takes one mesh, {len(paths)} are given")
    return Path(paths[0]) if in_place else written


def _is_same(a: Path, b: Path) -> bool:
    try:
        return a.samefile(b)
    except OSError:  # one does not exist
        return a.resolve() == b.resolve()


def size(path: str) -> int:
    """Bytes of a file, 0 if it is not known."""
    try:
        return os.stat(path).st_size
    except OSError:
        return 0


class State(str):
    """One time step of a file, as a path that names both: ``run.pvd, step 2 (time 0.5)``."""

    file: str
    step: int
    time: float | None

    @classmethod
    def of(cls, file: str, step: Step) -> State:
        state = cls(f"{file}, {step}")
        state.file, state.step, state.time = file, step.number, step.time
        return state

    @property
    def of_file(self) -> StepOf:
        """Which step it is, for reports."""
        from ..report.record import StepOf

        return StepOf(self.file, self.step, self.time)


def states_of(path: str, held: Sequence[Step], *, displaced: bool) -> list[State]:
    """Steps of a file: of those that differ in data only the first, unless such data displace the points."""
    kept: dict[object, Step] = {}
    for step in held:
        kept.setdefault(step.number if displaced else step.geometry, step)
    return [State.of(path, step) for step in kept.values()]
