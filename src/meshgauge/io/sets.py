"""Files with a named set of cells: copies of which all else stays, or a mesh that is written with it."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import ReadError, WriteError
from ..files.output import STANDARD_OUTPUT, replacing
from ..mesh import Mesh
from . import registry
from .adding import difference
from .formats import table
from .patching import format_if_same, format_of_copy, same_format
from .plumbing import files, verify
from .plumbing.added import CannotAdd
from .plumbing.cell_set import CellSet
from .plumbing.isolate import Limits
from .plumbing.pieces import Pieces
from .plumbing.steps import StepChoice
from .plumbing.writing import with_regions
from .reading import pieces, read

StrPath = str | os.PathLike[str]


def write_set(
    mesh: Mesh,
    target: StrPath,
    cells: NDArray[np.int64],
    name: str,
    *,
    file_format: str | None = None,
    limits: Limits | None = None,
    step: StepChoice = None,
    wedge_order: str = "auto",
    displacement: str | None = None,
) -> tuple[str, ...]:
    """Write a mesh with a set of its cells.

    An Exodus or CGNS file is copied, with all that it holds, and the set added; to Gmsh's format any mesh is written.
    What was written is read back before it takes the place of the target.

    Parameters
    ----------
    mesh
        As `meshgauge.read` returned it.
    target
        The output; it is whole or not there.
    cells
        ``(n,)`` positions, ascending, one at least.
    name
        What the set is called.
    file_format, limits, step, wedge_order, displacement
        As the mesh was read.

    Returns
    -------
    tuple of str
        A sentence for each thing that the format could not hold.

    Raises
    ------
    WriteError
        If the format has no sets, or the file cannot be written, or does not read back as it should.
    """
    target = Path(target)
    check_extension(target)
    same = format_if_same(mesh, target, file_format=file_format) if mesh.path is not None else None
    if same is not None and same.add_set is not None:
        source = Path(mesh.path or "")
        if {os.path.realpath(path) for path in mesh.sources} - {os.path.realpath(source)}:
            raise WriteError(f"{target}: no set is added to a file that is spread over several")
        with replacing(target) as staged, files.open_input(source) as (plain, _):
            try:
                same.add_set(plain, staged, CellSet(name, cells, mesh))
                back = read(
                    staged,
                    file_format=same.name,
                    limits=limits,
                    step=step,
                    wedge_order=wedge_order,
                    displacement=displacement,
                )
                verify.check(mesh, back, is_exact=True)
            except CannotAdd as reason:
                raise WriteError(f"{target}: no set is added to a file that {reason}") from None
            except (ReadError, WriteError) as error:
                raise WriteError(f"{target}: with the set it does not read back as it was to be: {error}") from error
        return ()
    chosen = next((one for one in table.of_extension(target.suffix.lower()) if one.write_set is not None), None)
    if chosen is None or chosen.write_set is None:
        raise _refused(target)
    given = with_regions(mesh)
    with replacing(target) as staged:
        lost = chosen.write_set(staged, CellSet(name, cells, given))
        try:
            verify.check(given, registry.read(chosen, staged), is_exact=False, lost=lost)
        except (ReadError, WriteError) as error:
            raise WriteError(f"{target}: does not read back as it was to be: {error}") from error
    return lost


def takes_set(source: StrPath, target: StrPath, *, file_format: str | None = None) -> bool:
    """Whether an output is a copy of a file to which a set of cells is added, without the mesh in memory."""
    chosen = format_of_copy(source, target, file_format=file_format)
    return chosen is not None and chosen.add_set is not None


def add_set_to_pieces(
    listed: Pieces,
    target: StrPath,
    cells: NDArray[np.int64],
    name: str,
    *,
    file_format: str | None = None,
    step: StepChoice = None,
) -> None:
    """`write_set` of a mesh that is read in pieces: a copy of its file, see `takes_set`.

    Parameters
    ----------
    listed
        The mesh, as `meshgauge.io.pieces` tells it.
    target, cells, name, file_format, step
        As for `write_set`.

    Raises
    ------
    WriteError
        If the file cannot take the set or be written, or does not read back as it should.
    """
    source, target = Path(listed.path), Path(target)
    chosen = same_format(source, target, file_format=file_format)
    assert chosen is not None  # see `takes_set`
    assert chosen.add_set is not None
    if {os.path.realpath(known[0]) for known in listed.stamps} - {os.path.realpath(source)}:
        raise WriteError(f"{target}: no set is added to a file that is spread over several")
    with replacing(target) as staged:
        try:
            chosen.add_set(source, staged, CellSet(name, cells))
            listed.check_unchanged()
            wrong = difference(listed, pieces(staged, file_format=chosen.name, step=step))
        except CannotAdd as reason:
            raise WriteError(f"{target}: no set is added to a file that {reason}") from None
        except ReadError as error:
            raise WriteError(f"{target}: with the set it does not read back as it was to be: {error}") from error
        if wrong:
            raise WriteError(f"{target}: with the set it does not read back as it was to be: {wrong} differ")


def check_extension(target: Path) -> None:
    """Raise `WriteError` if no format with the extension of an output has sets."""
    if target == STANDARD_OUTPUT:
        raise WriteError(f"{target}: standard output takes text only; name a file")
    here = table.of_extension(target.suffix.lower())
    if not any(one.add_set is not None or one.write_set is not None for one in here):
        raise _refused(target)


def _refused(target: Path) -> WriteError:
    adding = " and ".join(one.title for one in registry.ALL if one.add_set is not None)
    return WriteError(f"{target}: a set is added to copies of files of {adding}, or written with any mesh as .msh")
