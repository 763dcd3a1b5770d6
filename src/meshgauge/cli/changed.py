"""What becomes of a mesh that a command changed: its file is patched where that can be, else the mesh is converted."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import MeshgaugeError, WriteError
from ..files import undo
from ..io import Format
from ..io.adding import CannotAdd
from ..io.patching import Changes, Patch, format_if_same
from ..io.plumbing.beside import beside
from ..io.registry import for_writing
from ..look.style import enumeration, number_of
from ..mesh import Mesh
from . import terminal
from .batch import Batch

if TYPE_CHECKING:
    from ..quality.measure import Quality

Reals = NDArray[np.float64]

MANY = 6
"""Time steps from which on they are counted, not named."""


@dataclass(frozen=True, eq=False)
class ChangedMesh:
    """Where a changed mesh goes.

    Attributes
    ----------
    before
        The mesh as it was read.
    target
        Where to.
    patch
        How the file is patched; None: the mesh is converted.
    undo
        Where the old bytes are kept; None: nowhere.
    changes
        What does, as for `of`.
    notes
        Sentences on how it will be written, each with the file in front; said when it is.
    """

    batch: Batch
    before: Mesh
    target: Path
    in_place: bool
    patch: Patch | None
    undo: Path | None
    changes: Changes | Literal["cells"]
    notes: tuple[str, ...] = ()

    @classmethod
    def of(
        cls,
        batch: Batch,
        before: Mesh,
        target: Path,
        *,
        in_place: bool,
        undo: Path | None,
        convert: bool,
        all_times: bool = False,
        changes: Changes | Literal["cells"] = "points",
    ) -> ChangedMesh:
        """Find out how a mesh is to be written, and whether it can be, before the work.

        Parameters
        ----------
        convert
            Write the mesh anew, whatever the format.
        all_times
            Copy a folder with the times that were not read.
        changes
            What does, as for `patch_of`; or the cells themselves, with which no file is patched.

        Raises
        ------
        MeshgaugeError
            If it cannot.
        """
        source = Path(before.path or "")
        patch, notes = None, list[str]()
        if not convert and changes != "cells":
            patch = batch.patch(before, target, changes)
            patch = None if patch is None else replace(patch, all_times=all_times)
            if patch is not None and patch.is_fixed.all() and not patch.places.why:
                same = format_if_same(before, target, file_format=batch.reading.file_format)
                patch = patch if same is None or not same.is_exact else None  # packed, but written anew to the bit
        if patch is None:
            same = None if convert else format_if_same(before, target, file_format=batch.reading.file_format)
            written_as = _for_writing(target, same)
            if same is not None and not (same.is_exact and written_as is same):
                why = "is not patched" if changes == "points" else "is not patched where cells change"
                how = "anew" if written_as is same else f"as {written_as.title}"
                if in_place and written_as is not same:
                    raise WriteError(
                        f"{target}: {same.title} {why} and cannot be written, and {written_as.title} has the same "
                        "extension: nothing is replaced; give -o OUT: a conversion, without what the file holds beside "
                        "the mesh, or --convert"
                    )
                lost = beside(same.name, source)
                note = f"{same.title} {why}: the mesh is written {how}, without what the file holds beside it"
                note += f": {lost}" if lost else ""
                notes.append(f"{target}: {note}")
            if undo is not None and source.is_dir():
                raise MeshgaugeError(f"{undo}: no undo of a folder that is converted: keep the folder")
        elif changes == "points" and patch.is_fixed.any():
            n = int(np.count_nonzero(patch.is_fixed))
            why = f" ({'; '.join(patch.places.why)})" if patch.places.why else ""
            if n == before.n_points:
                raise WriteError(
                    f"{source}: no point has a place of its own in a file that may change: they are of instances that "
                    f"are moved, of other coordinate systems, or in files outside of its folder{why}; --convert writes "
                    "the mesh anew, without what the file holds beside it"
                )
            what = number_of(n, "point has", "points have")
            terminal.warn("note", f"{source}: {what} no place in a file that may change, and will not move{why}")
        if patch is not None and changes == "points" and (same_points := batch.steps_with_the_same_points(str(source))):
            have = "has" if len(same_points) == 1 else "have"
            named = enumeration(same_points) if len(same_points) < MANY else f"{len(same_points)} other steps"
            notes.append(f"{source}: {named} {have} the same points, which move there, too")
        if patch is not None and patch.left_out:
            are = "is" if len(patch.left_out) == 1 else "are"
            note = f"{', '.join(patch.left_out)} {are} of the mesh as it was, and not copied"
            notes.append(f"{target}: {note}")
        if in_place and undo is None:
            undo = undo_beside(target)
        return cls(batch, before, target, in_place, patch, undo, changes, tuple(notes))

    @property
    def is_fixed(self) -> NDArray[np.bool_] | None:
        """``(n_points,)`` True for points that cannot move; None: all can."""
        return None if self.patch is None or not self.patch.is_fixed.any() else self.patch.is_fixed

    @property
    def roundings(self) -> tuple[Callable[[NDArray[np.int64], Reals], Reals], ...] | None:
        """From ids of points and their coordinates to these as the file will hold them, see `Patch.roundings`; None: it
        holds every bit, or other cells."""
        if self.patch is not None:
            return self.patch.roundings
        is_single = self.changes != "cells" and for_writing(self.target, None).is_single
        return (lambda _, points: points.astype(np.float32).astype(np.float64),) if is_single else None

    def write(self, mesh: Mesh) -> None:
        """Write the changed mesh; in place nothing, if it is the one that was read."""
        if self.in_place and mesh is self.before:
            return
        for note in self.notes:  # not before: what else is refused is refused without them
            terminal.warn("note", note)
        if self.patch is not None:
            with self.batch.progress(f"patching {self.target}"):
                self.patch.write(mesh, overwrite=self.in_place, undo_file=self.undo)
        else:
            keep = None if self.undo is None else self._keep
            self.batch.write(self.target, mesh, overwrite=self.in_place, before_replacing=keep)
        if self.in_place:
            say_how_to_undo(self.batch, self.target, self.undo)

    def _keep(self, written: Path) -> None:
        assert self.undo is not None
        undo.store(self.undo, [undo.Change(Path(self.before.path or ""), written)])


def write_report(batch: Batch, quality: Quality, target: Path, *, in_place: bool) -> None:
    """Write what was measured on the cells and points: into the file as it is where that can be, else with the mesh.

    Raises
    ------
    WriteError
        If it can be neither.
    """
    try:
        if batch.add(quality, target, overwrite=in_place):
            return
    except CannotAdd as reason:
        try:
            for_writing(target, None)
        except WriteError:
            raise WriteError(f"{target}: nothing is added to a file that {reason}; {_GIVE}") from None
        how = "the mesh is written anew, without what the file holds beside it"
        terminal.warn("note", f"{target}: nothing is added to a file that {reason}: {how}")
    batch.write(target, quality.with_data(), overwrite=in_place)


_GIVE = "give -o OUT in a format that can be written, such as .vtu: a conversion"


def _for_writing(target: Path, same: Format | None) -> Format:
    """The format to write; an error that names that of the input, if it is meant and cannot be written."""
    try:
        return for_writing(target, None)
    except WriteError:
        if same is None:
            raise
        raise WriteError(
            f"{target}: {same.title} can be neither patched nor written; give -o OUT in a format that can, such as "
            ".vtu: a conversion, without what the file holds beside the mesh"
        ) from None


def say_how_to_undo(batch: Batch, target: Path, undo: Path | None) -> None:
    """A note, once a file was changed in place."""
    if not batch.quiet:
        terminal.warn("note", f"meshgauge undo {target} {undo} --in-place brings the old file back")


def undo_beside(target: Path) -> Path:
    """NAME.undo.npz, or the first with a number that does not exist: an older one undoes an older change."""
    names = itertools.chain([f"{target.name}.undo.npz"], (f"{target.name}.undo-{n}.npz" for n in itertools.count(2)))
    return next(path for path in map(target.with_name, names) if not path.exists())
