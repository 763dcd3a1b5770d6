"""Writing a mesh file."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path

from ..errors import ReadError, WriteError, expect
from ..files.output import STANDARD_OUTPUT, replacing
from ..mesh import Mesh
from . import registry
from .plumbing import verify
from .plumbing.format import Format
from .plumbing.names import replace_names
from .plumbing.writing import with_regions
from .reading import steps

_LARGE = 64 << 20
"""Bytes of a mesh from which on it is not read back as a whole, where the format allows, but compared in pieces."""

StrPath = str | os.PathLike[str]


def write(
    path: StrPath,
    mesh: Mesh,
    *,
    file_format: str | None = None,
    overwrite: bool = False,
    before_replacing: Callable[[Path], object] | None = None,
) -> tuple[str, ...]:
    """Write a mesh with its data.

    The file is whole or not there, see `meshgauge.files.output.replacing`. Wedges are written in our order, which
    readers of every format written here expect today.

    Parameters
    ----------
    path
        Where to; its extension tells the format unless ``file_format`` does.
    mesh
        What to write; named blocks are written as cell data as well, which more formats hold.
    file_format
        A name of `FORMATS`.
    overwrite
        Allow to replace the file that the mesh was read from. Other files are replaced without asking, but those that
        belong to what was read (its pieces, what it includes) never.
    before_replacing
        Called with the new file, which was read back, before it takes its place. If it raises, nothing is changed.

    Returns
    -------
    tuple of str
        What the format could not hold, a sentence each; empty if all was kept.

    Raises
    ------
    WriteError
        If the format is unknown or cannot hold the cells, or the file cannot be written.
    """
    target = Path(path)
    mesh = expect(mesh, Mesh)
    if target == STANDARD_OUTPUT:
        raise WriteError(f"{target}: standard output takes text only; name a file")
    chosen = registry.for_writing(target, file_format)
    assert chosen.write is not None
    _check_sources(target, mesh, overwrite=overwrite)
    given, renamed = replace_names(with_regions(mesh), chosen.forbidden)
    given, left_out = chosen.reduce(given) if chosen.reduce is not None else (given, ())
    with replacing(target, overwrite=overwrite) as beside:
        try:
            lost = (*renamed, *left_out, *chosen.write(beside, given))
            _verify(chosen, beside, given, lost)
        except WriteError as error:
            message = str(error).removeprefix(f"{beside}: ").replace(str(beside), str(target))
            raise WriteError(f"{target}: {message}") from error
        except (OSError, MemoryError):
            raise
        except ImportError as error:
            raise WriteError(f"{target}: {chosen.title} needs a package that is not installed: {error}") from error
        except Exception as error:
            reason = " ".join(str(error).split()) or type(error).__name__
            raise WriteError(f"{target}: cannot be written as {chosen.title}: {reason}") from error
        if before_replacing is not None:
            before_replacing(beside)
    return lost


def _verify(chosen: Format, path: Path, mesh: Mesh, lost: Sequence[str]) -> None:
    """Read back what was written, before it takes the place of anything.

    Raises
    ------
    WriteError
        If it cannot be read, is another mesh, or lacks data that are not among those that were lost.
    """
    if not mesh.n_cells:
        return
    try:
        if chosen.is_exact and registry.n_bytes(mesh) > _LARGE:
            comparison = verify.Comparison(mesh)
            if registry.scan(chosen, path, comparison.take):
                comparison.finish(lost)
                return  # to the last bit
        back = registry.read(chosen, path)
    except ReadError as error:
        raise WriteError(f"what was written cannot be read back: {error}") from error
    verify.check(mesh, back, is_exact=chosen.is_exact, lost=lost)


def _check_sources(target: Path, mesh: Mesh, *, overwrite: bool) -> None:
    """Raise if the target is a file that the mesh was read from, but for the one that may be replaced."""
    if mesh.path is not None and _same_file(target, Path(mesh.path)):
        if not overwrite:
            raise WriteError(f"{target}: is the file that the mesh was read from; pass overwrite=True to replace it")
        n_steps = _n_steps(target)
        if n_steps > 1:
            raise WriteError(
                f"{target}: holds {n_steps} time steps, of which all but one would be lost; write elsewhere"
            )
    elif any(_same_file(target, Path(source)) for source in mesh.sources):
        raise WriteError(f"{target}: is part of {mesh.path}, which the mesh was read from; it is not overwritten")


def _n_steps(path: Path) -> int:
    try:
        return len(steps(path))
    except ReadError:  # read as a format that its name and content do not tell
        return 0


def _same_file(a: Path, b: Path) -> bool:
    try:
        return a.samefile(b)
    except OSError:  # one of them does not exist
        return False
