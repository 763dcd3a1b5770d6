"""Several files that are the parts of one mesh."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ..errors import ReadError
from ..look.names import of_files
from ..mesh import Mesh
from .plumbing.ghosts import note_ghosts
from .plumbing.isolate import Limits
from .plumbing.pieces import Pieces, ReadWhole, check_alike, join_listed
from .plumbing.steps import StepChoice, displace
from .plumbing.wedge_order import check_order, normalise
from .reading import StrPath, format_of, pieces, read_plainly


def read_as_one(
    paths: Sequence[StrPath],
    *,
    file_format: str | None = None,
    wedge_order: str = "auto",
    step: StepChoice = None,
    displacement: str | None = None,
    limits: Limits | None = None,
) -> Mesh:
    """Read files as the parts of one mesh: cells and points one after another, points not merged.

    Parameters
    ----------
    paths
        One at least, in this order.
    file_format, wedge_order, step, displacement, limits
        As for `read`. The order of the wedges is decided for all files together.

    Raises
    ------
    ReadError
        As `read`; if there is no file.
    """
    check_order(wedge_order)
    if not paths:
        raise ReadError("no file is given")
    meshes = [
        read_plainly(path, file_format=file_format, wedge_order="gmsh", step=step, limits=limits) for path in paths
    ]
    from .plumbing.merge import join_pieces, starts

    mesh = join_pieces(meshes, [os.fspath(path) for path in paths], path=Path(paths[0]), names_blocks=False)
    mesh = normalise(mesh, wedge_order, has_both=_has_both(paths, file_format))
    files = dict.fromkeys(source for one in meshes for source in one.sources)
    mesh = mesh.replace(parts=starts([one.n_points for one in meshes], [one.parts for one in meshes]))
    mesh = note_ghosts(mesh.replace(path=of_files([os.fspath(path) for path in paths]), sources=tuple(files)))
    return displace(mesh, displacement) if displacement is not None else mesh


def pieces_as_one(
    paths: Sequence[StrPath], *, file_format: str | None = None, step: StepChoice = None
) -> Pieces | None:
    """Where the arrays of files that are the parts of one mesh stand; None if it has to be read whole, see `pieces`."""
    if not paths:
        raise ReadError("no file is given")
    listed = [pieces(path, file_format=file_format, step=step) for path in paths]
    if len(listed) == 1:
        return listed[0]
    with contextlib.suppress(ReadWhole):
        joined = join_listed(listed, path=Path(paths[0]))
        if joined is None:
            return None
        check_alike(joined.pieces)
        from .plumbing.merge import starts

        known = [one for one in listed if one is not None]
        return replace(
            joined,
            parts=starts([one.n_points for one in known], [one.parts for one in known]),
            path=of_files([os.fspath(path) for path in paths]),
            notes=tuple(dict.fromkeys(note for one in known for note in one.notes)),
            has_both_wedge_orders=any(one.has_both_wedge_orders for one in known),
            stamps=tuple(dict.fromkeys(stamp for one in known for stamp in one.stamps)),
        )
    return None


def _has_both(paths: Sequence[StrPath], file_format: str | None) -> bool:
    """Whether one of the files is of a format with both orders of wedges."""
    files = [Path(path) for path in paths if not os.path.isdir(path)]
    return any(format_of(path, file_format).has_both_wedge_orders for path in files)
