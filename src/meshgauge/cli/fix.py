"""``meshgauge check --fix``: meshes that fail are oriented and improved into new files, which are checked, too."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path

from .. import repair
from ..check import Check
from ..check.output.text import verdict
from ..errors import MeshgaugeError, OptionError, WriteError
from ..files import output
from ..look import style
from . import inputs, terminal
from .batch import Batch
from .changed import ChangedMesh
from .repairing import oriented


def require_alone(paths: Sequence[str], folder: Path) -> None:
    """Refuse what cannot be fixed, before anything is measured.

    Raises
    ------
    OptionError
        If a path is a time step or several files, or two meshes have one name.
    WriteError
        If the folder is a file, or a file of the name of a mesh is there.
    """
    if folder.exists() and not folder.is_dir():
        raise WriteError(f"{folder}: is no folder; --fix takes one, for the meshes")
    there = next(path for path in (folder.absolute(), *folder.absolute().parents) if os.path.lexists(path))
    if not there.is_dir():
        raise WriteError(f"{folder}: {there} is no folder")
    names: dict[str, str] = {}
    for path in paths:
        if isinstance(path, (inputs.State, inputs.Joined)):
            raise OptionError(f"{path}: --fix takes meshes of one file and one time step")
        name = Path(path).name
        if name in names:
            raise OptionError(f"{path} and {names[name]}: --fix writes by name, and both have one")
        names[name] = path
        if (folder / name).exists():
            raise WriteError(f"{folder / name}: is there already; --fix writes new files only")


def fix(
    batch: Batch, path: str, folder: Path, examine: Callable[[str, str | None], Check], *, is_silent: bool
) -> Check | None:
    """Write a mesh anew, oriented and improved, check it, and say what came of it; None if it could not be."""
    target = folder / Path(path).name
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with terminal.activity(f"fixing {path}", shown=not batch.quiet):
            n = _mend(batch, path, target)
        after = examine(str(target), path)
    except (MeshgaugeError, OSError, MemoryError) as error:
        is_bare = isinstance(error, OSError) and not isinstance(error, MeshgaugeError)
        why = f"{error.filename}: {error.strerror}" if is_bare else str(error)  # type: ignore[union-attr]
        terminal.warn("error", f"{path}: not fixed: {why}")
        return None
    if not is_silent:
        turned = f"{style.number_of(n, 'cell', 'cells')} renumbered, " if n else ""
        mark = "now" if after.is_passed else "still"
        terminal.emit(f"fixed: {style.printable(str(target))}: {turned}{mark}: {verdict(after)}")
    return after


def _mend(batch: Batch, path: str, target: Path) -> int:
    """Orient, then improve; returns how many cells were renumbered."""
    output.check(target)
    with oriented(batch, path, target) as (source, n):
        mesh = batch.read(source)
        changed = ChangedMesh.of(batch, mesh, target, in_place=False, undo=None, convert=False)
        result = repair.improve(
            mesh,
            target=batch.poor.all,
            fixed=changed.is_fixed,
            threads=batch.threads,
            keep_bricks=batch.keep_bricks,
            rounding=changed.roundings,
        )
        changed.write(mesh if result.report.outcome == "refused" else result.mesh)
    return n
