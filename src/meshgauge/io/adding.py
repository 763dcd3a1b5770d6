"""Adding arrays to a file of which all else stays, where its format can hold them."""

from __future__ import annotations

import gzip
import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..errors import ReadError, WriteError
from ..files.output import replacing
from ..mesh import Mesh
from .patching import format_if_same
from .plumbing import files, verify
from .plumbing.added import Added, Array, CannotAdd
from .plumbing.isolate import Limits
from .plumbing.steps import StepChoice
from .reading import read

__all__ = ["CannotAdd", "add_data"]

StrPath = str | os.PathLike[str]


def add_data(
    mesh: Mesh,
    target: StrPath,
    *,
    cells: Mapping[str, Array],
    points: Mapping[str, Array],
    overwrite: bool = False,
    file_format: str | None = None,
    limits: Limits | None = None,
    step: StepChoice = None,
    wedge_order: str = "auto",
) -> bool:
    """Copy the file of a mesh with further data of cells and points; what stands in it already stays as it is.

    The copy is read back before it takes its place: it must hold the mesh, its data and those added.

    Parameters
    ----------
    mesh
        As `meshgauge.read` returned it.
    target
        The output, of the format of the file; it is whole or not there.
    cells, points
        By name, ``(n_cells,)`` and ``(n_points,)`` numbers.
    overwrite
        Allow the file itself to be replaced.
    file_format, limits, step, wedge_order
        As the mesh was read.

    Returns
    -------
    bool
        False if the output is of another format, or of one that no arrays are added to: a conversion.

    Raises
    ------
    CannotAdd
        If this file cannot take them; the message says why.
    WriteError
        If it cannot be written, or does not read back as it should.
    """
    source, target = Path(mesh.path or ""), Path(target)
    if not source.is_file():
        return False
    chosen = format_if_same(mesh, target, file_format=file_format)
    if chosen is None or chosen.add is None:
        return False
    if {os.path.realpath(path) for path in mesh.sources} - {os.path.realpath(source)}:
        raise CannotAdd("is spread over several files")
    if not mesh.n_cells:
        raise CannotAdd("has no cells")
    if not overwrite and os.path.realpath(target) == os.path.realpath(source):
        raise WriteError(f"{target}: is the file that the mesh was read from; pass overwrite=True to replace it")
    with replacing(target, overwrite=overwrite) as staged:
        with files.open_input(source) as (plain, _):
            is_held = chosen.add(plain, staged, Added(cells, points, mesh))
        if target.suffix.lower() == ".gz":
            staged.write_bytes(gzip.compress(staged.read_bytes(), mtime=0))
        held = cells if is_held is None else {name: np.where(is_held, one, np.nan) for name, one in cells.items()}
        expected = mesh.replace(cell_data={**mesh.cell_data, **held}, point_data={**mesh.point_data, **points})
        try:
            back = read(staged, file_format=chosen.name, limits=limits, step=step, wedge_order=wedge_order)
            verify.check(expected, back, is_exact=True)
        except (ReadError, WriteError) as error:
            raise WriteError(f"{target}: what was added does not read back as it was to be: {error}") from error
    return True
