"""Reading a mesh file, all of it or one of its time steps."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

from ..errors import ReadError
from ..files import sources
from ..mesh import Mesh
from . import registry
from .plumbing import files
from .plumbing.format import Format
from .plumbing.ghosts import note_ghosts
from .plumbing.isolate import Limits
from .plumbing.pieces import Pieces, ReadWhole, Stamp, stamp
from .plumbing.steps import Step, StepChoice, displace
from .plumbing.wedge_order import check_order, normalise
from .registry import format_named

StrPath = str | os.PathLike[str]


def read(
    path: StrPath,
    *,
    file_format: str | None = None,
    wedge_order: str = "auto",
    step: StepChoice = None,
    displacement: str | None = None,
    limits: Limits | None = None,
) -> Mesh:
    """Read a mesh file.

    Parameters
    ----------
    path
        A file, plain or gzipped; or the folder of an OpenFOAM case, which has constant/polyMesh in it, or
        of a mesh of Elmer, which has mesh.header or one partitioning.
    file_format
        A name of `FORMATS`; detected by extension and content if None.
    wedge_order
        Order of the wedges in the file: "gmsh" (the normal of (0, 1, 2) points to (3, 4, 5), also VTK's since 9.7),
        "vtk-legacy" (it points away) or "auto": in formats that exist in both, decided by the other solid cells.
    step
        Which time step of a file that holds several: "first", "last" or a number from 1. None reads the first, and a
        note says so.
    displacement
        Point data by which the points are moved: the deformed shape. Vectors, or scalars of that name with ``_x``,
        ``_y``, ``_z`` behind it.
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
        If the file is missing, of no known format, broken, or would not be read right; if there is no such step or
        displacement; if its reader crashed, hung or took too much memory. The message names the file.
    """
    check_order(wedge_order)
    mesh = read_plainly(path, file_format=file_format, wedge_order=wedge_order, step=step, limits=limits)
    mesh = note_ghosts(mesh)
    return displace(mesh, displacement) if displacement is not None else mesh


def read_plainly(
    path: StrPath, *, file_format: str | None, wedge_order: str, step: StepChoice, limits: Limits | None
) -> Mesh:
    """`read` without a word on ghosts."""
    given = Path(path)
    with sources.record() as used:
        mesh = _read(given, file_format, wedge_order, limits, step)
    for source in mesh.sources:  # those of a reader in a process of its own
        sources.note(source)
        used[source] = None
    sources.check_pending(used)
    return mesh.replace(path=str(given), sources=tuple(used))


def _read(given: Path, file_format: str | None, wedge_order: str, limits: Limits | None, step: StepChoice) -> Mesh:
    if os.path.isdir(given):  # False, not an error, for a name that no file can have
        return normalise(registry.read_folder(given, file_format, step), wedge_order, has_both=False)
    with files.open_input(given, registry.detect if file_format is None else None) as (plain, head):
        chosen = format_named(file_format) if file_format is not None else registry.detect(plain, head)
        mesh = registry.read(chosen, plain, limits, step)
        return normalise(mesh, wedge_order, has_both=chosen.has_both_wedge_orders)


def format_of(path: Path, file_format: str | None = None) -> Format:
    """The format of a file: by its name, else by the extension and the content. Raises `ReadError`."""
    if file_format is not None:
        return format_named(file_format)
    with files.open_input(path, registry.detect) as (plain, head):
        return registry.detect(plain, head)


def pieces(path: StrPath, *, file_format: str | None = None, step: StepChoice = None) -> Pieces | None:
    """Where the arrays of a mesh stand in its files, so that it can be read slice by slice.

    Parameters
    ----------
    path, file_format, step
        As for `read`.

    Returns
    -------
    Pieces or None
        None if the mesh has to be read whole: of a format without, packed by gzip.

    Raises
    ------
    ReadError
        If the file is missing, of no known format or broken.
    """
    given = Path(path)
    if os.path.isdir(given):
        with sources.record() as used:
            chosen, inside = registry.case_of(given, file_format)
            listed = registry.pieces(chosen, inside, step)
        return None if listed is None else replace(listed, path=str(given), stamps=_stamps(used))
    if files.is_packed(given):
        return None
    with sources.record() as used, files.open_input(given) as (plain, head):
        if plain != given:
            return None
        chosen = format_named(file_format) if file_format is not None else registry.detect(plain, head)
        listed = registry.pieces(chosen, plain, step)
    return None if listed is None else replace(listed, stamps=_stamps(used))


def _stamps(used: Iterable[str]) -> tuple[Stamp, ...]:
    """Of the files that are there; those of other time steps may be missing."""
    return tuple(stamp(file) for file in used if os.path.exists(file))


def why_whole(path: StrPath, *, file_format: str | None = None, step: StepChoice = None) -> str:
    """Why a file is not read in slices, a clause; empty if it is. Parameters and errors as of `pieces`."""
    given = Path(path)
    if os.path.isdir(given):
        return "folders are not read in slices"
    if files.is_packed(given):
        return "it is packed by gzip"
    try:
        registry.listed(format_of(given, file_format), given, step)
    except ReadWhole as reason:
        return str(reason)
    return ""


def takes(path: StrPath, file_format: str | None = None) -> int | None:
    """Bytes of memory that measuring a case as a whole takes, about, if `pieces` reads all of it; None of others."""
    given = Path(path)
    try:
        if os.path.isdir(given):
            chosen, given = registry.case_of(given, file_format)
        elif given.suffix.lower() == ".foam" or given.parent.name == "polyMesh":
            chosen = registry.format_named("openfoam")
        else:
            return None
        return None if chosen.takes is None else chosen.takes(given)
    except (ReadError, OSError):
        return None  # reading says what is wrong


def steps(path: StrPath, *, file_format: str | None = None, limits: Limits | None = None) -> tuple[Step, ...]:
    """The time steps of a file, in their order; none or one if it holds a single state.

    Parameters
    ----------
    path, file_format, limits
        As for `read`.

    Raises
    ------
    ReadError
        If the file is missing, of no known format or broken.
    """
    given = Path(path)
    if os.path.isdir(given):
        return registry.steps_of_folder(given, file_format)
    with files.open_input(given, registry.detect if file_format is None else None) as (plain, head):
        chosen = format_named(file_format) if file_format is not None else registry.detect(plain, head)
        return registry.steps(chosen, plain, limits)


def read_steps(
    path: StrPath,
    *,
    file_format: str | None = None,
    wedge_order: str = "auto",
    displacement: str | None = None,
    limits: Limits | None = None,
) -> Iterator[tuple[tuple[Step, ...], Mesh]]:
    """Read every state of a file in turn: the steps that have it, and the mesh.

    Steps that differ in data only are one state, unless the points are displaced by such data. A file that holds a
    single state has the one step 1.

    Parameters
    ----------
    path, file_format, wedge_order, displacement, limits
        As for `read`.

    Raises
    ------
    ReadError
        As `read`.
    """
    all_steps = steps(path, file_format=file_format, limits=limits) or (Step(1),)
    states: dict[int, list[Step]] = {}
    for step in all_steps:
        states.setdefault(step.number if displacement is not None else step.geometry, []).append(step)
    for state in states.values():
        mesh = read(
            path,
            file_format=file_format,
            wedge_order=wedge_order,
            step=state[0].number,
            displacement=displacement,
            limits=limits,
        )
        yield tuple(state), mesh
