"""Adding arrays to a file of which all else stays, where its format can hold them."""

from __future__ import annotations

import contextlib
import gzip
import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..errors import ReadError, WriteError
from ..files.output import replacing
from ..mesh import Mesh
from .patching import format_if_same, format_of_copy, same_format
from .plumbing import files, verify
from .plumbing.added import Added, Array, CannotAdd
from .plumbing.isolate import Limits
from .plumbing.pieces import Pieces, Rows
from .plumbing.steps import StepChoice
from .reading import pieces, read

__all__ = ["CannotAdd", "add_data", "add_to_pieces", "takes_rows"]

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


def takes_rows(source: StrPath, target: StrPath, *, file_format: str | None = None) -> bool:
    """Whether arrays that are not in memory can be added to a file so that an output comes of it."""
    chosen = format_of_copy(source, target, file_format=file_format)
    return chosen is not None and chosen.add_rows is not None


def add_to_pieces(
    listed: Pieces,
    target: StrPath,
    *,
    cells: Mapping[str, Rows],
    points: Mapping[str, Rows],
    overwrite: bool = False,
    file_format: str | None = None,
    step: StepChoice = None,
    until: contextlib.ExitStack | None = None,
) -> None:
    """`add_data` to a file that is read in pieces, some rows at a time; see `takes_rows`.

    Parameters
    ----------
    listed
        The mesh, as `meshgauge.io.pieces` tells it.
    target, overwrite, file_format, step
        As for `add_data`.
    cells, points
        By name, ``(n_cells,)`` and ``(n_points,)`` numbers.
    until
        The output takes its place when this is closed, and not if an error closes it: until then pieces of a file that
        is replaced can be read. None: at once.

    Raises
    ------
    CannotAdd
        If this file cannot take them; the message says why.
    WriteError
        If it cannot be written, or does not read back as it should.
    """
    source, target = Path(listed.path), Path(target)
    chosen = same_format(source, target, file_format=file_format)
    if chosen is None or chosen.add_rows is None:
        raise CannotAdd("is read in pieces, but not added to")
    if {os.path.realpath(known[0]) for known in listed.stamps} - {os.path.realpath(source)}:
        raise CannotAdd("is spread over several files")
    if not overwrite and os.path.realpath(target) == os.path.realpath(source):
        raise WriteError(f"{target}: is the file that the mesh was read from; pass overwrite=True to replace it")
    with contextlib.ExitStack() as held:
        staged = held.enter_context(replacing(target, overwrite=overwrite))
        chosen.add_rows(source, staged, cells, points, (listed.n_points, listed.n_cells))
        listed.check_unchanged()
        try:
            back = pieces(staged, file_format=chosen.name, step=step)
        except ReadError as error:
            raise WriteError(f"{target}: what was added does not read back as it was to be: {error}") from error
        wrong = difference(listed, back, cells, points)
        if wrong:
            raise WriteError(f"{target}: what was added does not read back as it was to be: {wrong} differ")
        if until is not None:
            until.enter_context(held.pop_all())


_AT_ONCE = 1 << 18
"""Rows that are compared at a time."""


def difference(
    listed: Pieces, back: Pieces | None, cells: Mapping[str, Rows] = {}, points: Mapping[str, Rows] = {}
) -> str:
    """The name of an array that is not read back, of a mesh or of those added; empty if all are."""
    if back is None or len(back.pieces) != len(listed.pieces):
        return "pieces"
    for number, (old, new) in enumerate(zip(listed.pieces, back.pieces, strict=True)):
        for name in ("points", "types", "offsets", "connectivity"):
            if not _same(getattr(old, name), getattr(new, name)):
                return name
        for held, read_back, added, start in (
            (old.cell_data, new.cell_data, cells, listed.cell_starts[number]),
            (old.point_data, new.point_data, points, listed.point_starts[number]),
        ):
            for name in {*held, *added}:
                if name not in read_back:
                    return repr(name)
                if not (
                    _same(added[name], read_back[name], start) if name in added else _same(held[name], read_back[name])
                ):
                    return repr(name)
    return ""


def _same(old: Rows, new: Rows, start: int = 0) -> bool:
    """Whether rows, of the first array from ``start`` on, are the same to the last bit."""
    if old.dtype.newbyteorder("=") != new.dtype.newbyteorder("=") or old.shape[1:] != new.shape[1:]:
        return False
    n = new.shape[0]
    if old.shape[0] < start + n:
        return False
    blocks = ((at, min(at + _AT_ONCE, n)) for at in range(0, n, _AT_ONCE))
    return all(old.read(start + a, start + b).tobytes() == new.read(a, b).tobytes() for a, b in blocks)
