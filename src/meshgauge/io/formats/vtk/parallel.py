"""VTK's parallel files of cells (.pvtu, .pvtp): pieces, each a file of its own.

Own, because VTK's reader fails where a piece lacks an array or has no cells.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

from ....errors import ReadError
from ....mesh import Mesh
from ...plumbing import within
from ...plumbing.merge import join_pieces, starts
from ...plumbing.patch import Places
from ...plumbing.pieces import Pieces, join_listed

KINDS = ("PUnstructuredGrid", "PPolyData")


def read(path: Path, read_piece: Callable[[Path], Mesh]) -> Mesh:
    """The pieces one after another; arrays that some lack are NaN there, and a note says so. They are the parts of one
    mesh, whose points are joined for the diagnosis.

    Raises
    ------
    ReadError
        If the file is broken, names no pieces, or one of them is missing.
    """
    names = _names(path)
    meshes = [read_piece(path.parent / name) for name in names]
    mesh = join_pieces(meshes, names, path=path, names_blocks=False)
    return mesh.replace(parts=starts([one.n_points for one in meshes], [one.parts for one in meshes]))


def pieces(path: Path, list_piece: Callable[[Path], Pieces | None]) -> Pieces | None:
    """Where the arrays of the pieces stand; None if some piece has to be read whole.

    Raises
    ------
    ReadError
        As `read`.
    """
    names = _names(path)
    listed = [list_piece(path.parent / name) for name in names]
    joined = join_listed(listed, path=path)
    known = [one for one in listed if one is not None]
    return joined and replace(joined, parts=starts([one.n_points for one in known], [one.parts for one in known]))


def places(path: Path, places_of: Callable[[Path], Places]) -> Places:
    """Where the coordinates of points stand: in the pieces, one after another.

    Raises
    ------
    ReadError
        As `read`; if a piece is named twice, or is not patched.
    """
    names = _names(path)
    check_each_once(path, names)
    return Places.joined([places_of(path.parent / name) for name in names])


def check_each_once(path: Path, names: Sequence[str]) -> None:
    """Raise `ReadError` if a file is named twice: its points cannot be in two places."""
    twice = next((name for at, name in enumerate(names) if name in names[:at]), None)
    if twice is not None:
        raise ReadError(
            f"{path}: is not patched: it names {twice} twice, the points of which are one with each other's"
        )


def _names(path: Path) -> list[str]:
    """The files of the pieces; all are there."""
    within.check_xml(path)
    try:
        root = ElementTree.fromstring(path.read_bytes())
    except ElementTree.ParseError as error:
        raise ReadError(f"{path}: is no XML: {error}") from error
    names = [item.get("Source", "") for item in root.iter("Piece")]
    if not names or not all(names):
        raise ReadError(f"{path}: names no files of its pieces")
    within.check_present(path, names)
    return names
