"""The door for files: one registry of formats, one file a format.

Importing this loads NumPy only; VTK, h5py, meshio and PyVista are loaded by the reader that needs them, most of them in
a process of its own (`plumbing.isolate`).
"""

from __future__ import annotations

import os
from pathlib import Path

from ..errors import WriteError
from ..files import sources
from ..files.output import STANDARD_OUTPUT, replacing
from ..mesh import Mesh
from . import registry
from .objects import from_meshio, from_pyvista
from .plumbing import files
from .plumbing.format import Format
from .plumbing.isolate import Limits
from .plumbing.wedge_order import WEDGE_ORDERS, check_order, normalise
from .plumbing.writing import with_regions
from .registry import FORMATS, format_named

__all__ = [
    "FORMATS",
    "WEDGE_ORDERS",
    "Format",
    "Limits",
    "format_named",
    "from_meshio",
    "from_pyvista",
    "read",
    "write",
]

StrPath = str | os.PathLike[str]


def read(
    path: StrPath, *, file_format: str | None = None, wedge_order: str = "auto", limits: Limits | None = None
) -> Mesh:
    """Read a mesh file.

    Parameters
    ----------
    path
        A file, plain or gzipped; or the folder of an OpenFOAM case, which has constant/polyMesh in it.
    file_format
        A name of `FORMATS`; detected by extension and content if None.
    wedge_order
        Order of the wedges in the file: "gmsh" (the normal of (0, 1, 2) points to (3, 4, 5), also VTK's since 9.7),
        "vtk-legacy" (it points away) or "auto": in formats that exist in both, decided by the other solid cells.
    limits
        Time and memory of a reader that is not ours, which runs in a process of its own; by the size of the file if
        None.

    Returns
    -------
    Mesh
        All cells of the file in its order, solid or not. ``notes`` says what was changed or left out.

    Raises
    ------
    ReadError
        If the file is missing, of no known format, broken, or would not be read right; if its reader crashed, hung or
        took too much memory. The message names the file.
    """
    check_order(wedge_order)
    given = Path(path)
    with sources.recorded() as used:
        mesh = _read(given, file_format, wedge_order, limits)
    for source in mesh.sources:  # those of a reader in a process of its own
        sources.note(source)
        used[source] = None
    sources.check_pending(used)
    return mesh.replace(path=str(given), sources=tuple(used))


def _read(given: Path, file_format: str | None, wedge_order: str, limits: Limits | None) -> Mesh:
    if os.path.isdir(given):  # False, not an error, for a name that no file can have
        return normalise(registry.read_folder(given, file_format), wedge_order, has_both=False)
    with files.opened(given) as (plain, head):
        chosen = format_named(file_format) if file_format is not None else registry.detect(plain, head)
        mesh = registry.read(chosen, plain, limits)
        return normalise(mesh, wedge_order, has_both=chosen.has_both_wedge_orders)


def write(path: StrPath, mesh: Mesh, *, file_format: str | None = None, overwrite: bool = False) -> tuple[str, ...]:
    """Write a mesh with its data.

    The file is whole or not there, see `meshgauge.files.output.replacing`. Wedges are written in our order, which
    readers of every format written here expect today.

    Parameters
    ----------
    path
        Where to; its extension tells the format unless ``file_format`` does.
    file_format
        A name of `FORMATS`.
    overwrite
        Allow to replace the file that the mesh was read from. Other files are replaced without asking, but those that
        belong to what was read (its pieces, what it includes) never.

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
    if target == STANDARD_OUTPUT:
        raise WriteError(f"{target}: standard output takes text only; name a file")
    chosen = registry.for_writing(target, file_format)
    assert chosen.write is not None
    _check_sources(target, mesh, overwrite=overwrite)
    with replacing(target, overwrite=overwrite) as beside:
        try:
            return chosen.write(beside, with_regions(mesh))
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


def _check_sources(target: Path, mesh: Mesh, *, overwrite: bool) -> None:
    """Raise if the target is a file that the mesh was read from, but for the one that may be replaced."""
    if mesh.path is not None and _same_file(target, Path(mesh.path)):
        if not overwrite:
            raise WriteError(f"{target}: is the file that the mesh was read from; pass overwrite=True to replace it")
    elif any(_same_file(target, Path(source)) for source in mesh.sources):
        raise WriteError(f"{target}: is part of {mesh.path}, which the mesh was read from; it is not overwritten")


def _same_file(a: Path, b: Path) -> bool:
    try:
        return a.samefile(b)
    except OSError:  # one of them does not exist
        return False
