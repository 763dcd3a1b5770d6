"""The door for files: one registry of formats, one file a format.

Importing this loads NumPy only; VTK, h5py, meshio and PyVista are loaded by the reader that needs them.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from ..errors import MeshError, MeshgaugeError, ReadError, WriteError
from ..mesh import Mesh
from . import _files, exodus, gmsh, medit, others, vtk_legacy, vtk_xml, vtkhdf
from ._format import Format
from .wedge_order import WEDGE_ORDERS, check_order, settled

__all__ = ["FORMATS", "WEDGE_ORDERS", "Format", "format_named", "from_meshio", "from_pyvista", "read", "write"]

StrPath = str | os.PathLike[str]

_ALL: tuple[Format, ...] = (
    vtk_xml.VTU,
    vtk_xml.VTK_XML,
    vtk_legacy.VTK_LEGACY,
    vtkhdf.VTKHDF,
    gmsh.GMSH,
    medit.MEDIT,
    exodus.EXODUS,
    *others.OTHERS,
)

FORMATS: dict[str, Format] = {f.name: f for f in _ALL}
"""Every format, by name."""


def format_named(name: str) -> Format:
    """The format of that name.

    Raises
    ------
    ReadError
        If there is none; the message lists the names.
    """
    if name not in FORMATS:
        raise ReadError(f"no format {name!r}; known are {', '.join(FORMATS)}")
    return FORMATS[name]


def read(path: StrPath, *, format: str | None = None, wedge_order: str = "auto") -> Mesh:
    """Read a mesh file.

    Parameters
    ----------
    path
        A file, plain or gzipped.
    format
        A name of `FORMATS`; told by extension and content if None.
    wedge_order
        Order of the wedges in the file: "auto" (decided for each block by the sign of the volumes), "gmsh" (the normal
        of (0, 1, 2) points to (3, 4, 5), also VTK's since 9.7) or "vtk-legacy" (it points away).

    Returns
    -------
    Mesh
        All cells of the file in its order, solid or not. ``notes`` says what was changed or left out.

    Raises
    ------
    ReadError
        If the file is missing, of no known format, broken, or would not be read right. The message names the file.
    """
    check_order(wedge_order)
    given = Path(path)
    with _files.opened(given) as (plain, head):
        chosen = format_named(format) if format is not None else _told(plain, head)
        mesh = _read(chosen, plain)
        mesh = settled(mesh, wedge_order)
    return mesh if plain == given else mesh.replace(path=str(given))


def _told(path: Path, head: bytes) -> Format:
    """The format of a file by its extension and its first bytes."""
    extension = path.suffix.lower()
    here = [f for f in _ALL if extension in f.extensions]
    if not head and extension != ".foam":  # that file only marks its folder
        raise ReadError(f"{path}: is empty (0 bytes)")
    for chosen in (*here, *(f for f in _ALL if f.by_content)):
        if chosen.sniff(head, path):
            return chosen
    if here:
        expected = " or ".join(f.title for f in here)
        raise ReadError(f"{path}: does not begin as a file with the extension {extension} does ({expected})")
    known = ", ".join(sorted({e for f in _ALL if f.read for e in f.extensions}))
    raise ReadError(f"{path}: the extension {extension!r} and the content are of no known format; known are {known}")


def _read(chosen: Format, path: Path) -> Mesh:
    if chosen.read is None:
        raise ReadError(f"{path}: {chosen.title} can be written, but not read")
    try:
        return chosen.read(path)
    except ReadError as error:
        message = str(error)
        raise (error if str(path) in message else ReadError(f"{path}: {message}")) from error.__cause__
    except MeshgaugeError as error:
        raise ReadError(f"{path}: {error}") from error
    except ImportError as error:
        raise ReadError(f"{path}: {chosen.title} needs a package that is not installed: {error}") from error
    except MemoryError as error:
        raise ReadError(f"{path}: does not fit into memory, or states sizes that do not fit") from error
    except (Exception, SystemExit) as error:
        # Readers of others raise anything on a broken file; a traceback from inside them helps no one.
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ReadError(f"{path}: cannot be read as {chosen.title}: {reason}") from error


def write(path: StrPath, mesh: Mesh, *, format: str | None = None, overwrite: bool = False) -> tuple[str, ...]:
    """Write a mesh with its data.

    The file is written beside and renamed, so that it is whole or not there. Wedges are written in our order, which
    readers of every format written here expect today.

    Parameters
    ----------
    path
        Where to; its extension tells the format unless ``format`` does.
    format
        A name of `FORMATS`.
    overwrite
        Allow to replace the file that the mesh was read from. Other files are replaced without asking.

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
    chosen = _for_writing(target, format)
    assert chosen.write is not None
    if not overwrite and mesh.path is not None and _same_file(target, Path(mesh.path)):
        raise WriteError(f"{target}: is the file that the mesh was read from; pass overwrite=True to replace it")
    with _files.replacing(target) as beside:
        try:
            return chosen.write(beside, mesh)
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


def _for_writing(path: Path, name: str | None) -> Format:
    writable = [f for f in _ALL if f.write is not None]
    if name is not None:
        found = [f for f in writable if f.name == name]
        what = f"format {name!r}"
    else:
        found = [f for f in writable if path.suffix.lower() in f.extensions]
        what = f"extension {path.suffix!r}"
    if not found:
        known = ", ".join(f"{f.name} ({' '.join(f.extensions)})" for f in writable)
        raise WriteError(f"{path}: no format to write for the {what}; known are {known}")
    return found[0]


def _same_file(a: Path, b: Path) -> bool:
    try:
        return a.samefile(b)
    except OSError:  # one of them does not exist
        return False


def from_pyvista(grid: Any, *, wedge_order: str = "auto") -> Mesh:
    """A mesh from a PyVista or VTK data set; a composite one gives a block for each leaf.

    Arrays are shared, not copied, where the layout allows: do not change the grid in place afterwards.
    Raises `ReadError` if it is no data set and `MeshError` if its arrays do not make a mesh.
    """
    from . import _vtk

    check_order(wedge_order)
    if not hasattr(grid, "IsA"):
        raise ReadError(f"a {type(grid).__name__} is not a PyVista or VTK data set")
    return settled(_vtk.mesh(grid), wedge_order)


def from_meshio(mesh: Any, *, wedge_order: str = "auto") -> Mesh:
    """A mesh from a meshio mesh: its blocks in their order.

    Raises `MeshError` if it has cells of a type that is not known or its arrays do not make a mesh.
    """
    from . import _meshio

    check_order(wedge_order)
    if not hasattr(mesh, "cells") or not hasattr(mesh, "points"):
        raise MeshError(f"a {type(mesh).__name__} is not a meshio mesh")
    return settled(_meshio.mesh(mesh), wedge_order)
