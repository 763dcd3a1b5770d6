"""VTK's parallel files of cells (.pvtu, .pvtp): pieces, each a file of its own.

Own, because VTK's reader fails where a piece lacks an array or has no cells.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

from ....errors import ReadError
from ....mesh import Mesh
from ....mesh.labels import LABEL
from ...plumbing import within
from ...plumbing.merge import join_pieces
from ...plumbing.pieces import Pieces, ReadWhole

KINDS = ("PUnstructuredGrid", "PPolyData")


def read(path: Path, read_piece: Callable[[Path], Mesh]) -> Mesh:
    """The pieces one after another; arrays that some lack are NaN there, and a note says so.

    Raises
    ------
    ReadError
        If the file is broken, names no pieces, or one of them is missing.
    """
    names = _names(path)
    meshes = [read_piece(path.parent / name) for name in names]
    return join_pieces(meshes, names, path=path, names_blocks=False)


def pieces(path: Path, list_piece: Callable[[Path], Pieces | None]) -> Pieces | None:
    """Where the arrays of the pieces stand; None if some piece has to be read whole.

    Raises
    ------
    ReadError
        As `read`.
    """
    listed = [list_piece(path.parent / name) for name in _names(path)]
    if any(one is None for one in listed):
        return None
    files = [one for one in listed if one is not None]
    filled = tuple(piece for one in files for piece in one.pieces if piece.n_cells or piece.n_points)
    for piece in filled:
        for numbers in (piece.cell_data.get(LABEL), piece.point_data.get(LABEL)):
            if numbers is not None and numbers.shape[0] and int(numbers.read(0, 1)[0]) in (0, 1):
                raise ReadWhole("whether its numbers say anything depends on each piece")
    fields = {name: values for one in reversed(files) for name, values in one.field_data.items()}
    renumbered = tuple({vtk_id for one in files for vtk_id in one.renumbered})
    return Pieces(str(path), filled, fields, renumbered=renumbered) if filled else None


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
