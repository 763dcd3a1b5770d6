"""Every format there is, which of them a file is of, and its readers called so that only our errors come out."""

from __future__ import annotations

import contextlib
import difflib
import os
from collections.abc import Callable, Iterable
from contextvars import ContextVar
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from ..errors import MeshgaugeError, ReadError, WriteError
from ..files import sources
from ..look.names import meant_or_known
from ..mesh import Mesh
from .formats import table
from .plumbing import budget, files, isolate
from .plumbing.format import HEAD, Format, Take
from .plumbing.messages import is_out_of_memory, named_once, out_of_memory
from .plumbing.pieces import Pieces, ReadWhole, check_alike
from .plumbing.steps import Step, StepChoice, note, position

if TYPE_CHECKING:
    from .plumbing.patch import Places
    from .plumbing.patch_faces import Faces
    from .plumbing.patch_nodes import Nodes

    ALL: tuple[Format, ...]
    """Every format, in the order in which they are asked whether a file is theirs."""
    FORMATS: dict[str, Format]
    """Every format, by name."""
else:

    def __getattr__(name: str) -> Any:
        """What needs every format loaded, once somebody asks for it."""
        if name == "ALL":
            return table.every()
        if name == "FORMATS":
            return table.by_name()
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def format_named(name: str) -> Format:
    """The format of that name.

    Raises
    ------
    ReadError
        If there is none; the message lists the names.
    """
    known = table.by_name()
    if name not in known:
        raise ReadError(f"no format {name!r}{meant_or_known(name, known, _LISTED)}")
    return known[name]


def detect(path: Path, head: bytes) -> Format:
    """The format of a file by its extension and its first bytes."""
    extension = path.suffix.lower()
    here = table.of_extension(extension)
    if not head and extension != ".foam":  # that file only marks its folder
        raise ReadError(f"{path}: is empty (0 bytes)")
    closed = next((what for mark, what in _CLOSED.items() if extension == mark or head.startswith(mark.encode())), None)
    if closed is not None:
        raise ReadError(f"{path}: {closed}")
    if chosen := _sniffed(here, head, path) or _sniffed((f for f in table.every() if f.by_content), head, path):
        return chosen
    if here:
        expected = " or ".join(f"{f.title}: {f.name}" for f in here)
        raise ReadError(
            f"{path}: does not begin as a file with the extension {extension} does ({expected}); {_OTHERWISE}"
        )
    given = f"the extension {extension!r} and the content are" if extension else "has no extension, and its content is"
    raise ReadError(f"{path}: {given} of no known format{_nearest(extension)}; {_OTHERWISE}")


def _sniffed(formats: Iterable[Format], head: bytes, path: Path) -> Format | None:
    """The first of some formats that a file is of, by its first bytes."""
    for chosen in formats:
        with contextlib.suppress(OSError, RuntimeError, KeyError, ValueError):  # of HDF5, of a damaged file
            if chosen.sniff(head, path):
                return chosen
    return None


_SUBZONES = "Tecplot's subzone files (.szplt) are read by Tecplot's own library only; save it as .plt or .dat there"
_CLOSED = {
    ".szplt": _SUBZONES,
    "#!SZPLT": _SUBZONES,
    "meshgauge-partial ": "is the partial report of a part of a mesh, and has no cells; 'meshgauge merge' makes the "
    "report of all parts",
    "MFEM NURBS": "NURBS meshes of MFEM are not read: their elements are no cells; print it as MFEM mesh v1.0 "
    "with nodes of order 2 (SetCurvature), or as VTU",
}
"""By extension, or by first bytes, what files are that are read by none of our formats."""
_LISTED = "'meshgauge formats'"
_OTHERWISE = "--format NAME reads it as another format"
_MOST_NEAR, _NEAR = 3, 0.6
"""Names that a message repeats at most, and how alike they are at least (`difflib`)."""


def _nearest(extension: str) -> str:
    """The formats whose extensions are most like one."""
    formats = table.every()
    known = {e: [f.name for f in formats if f.is_readable and e in f.extensions] for f in formats for e in f.extensions}
    near = difflib.get_close_matches(extension, [e for e in known if known[e]], _MOST_NEAR, _NEAR)
    return "; nearest are " + ", ".join(f"{e} ({' or '.join(known[e])})" for e in near) if near else ""


def read(chosen: Format, path: Path, limits: isolate.Limits | None = None, choice: StepChoice = None) -> Mesh:
    """Read a file, or one of its time steps: by our own reader here, else by that of others in a process of its own."""
    with budget.of(path, *(limits or isolate.Limits()).given):
        mesh = _own(chosen, path, choice)
    if mesh is None and chosen.is_foreign:
        mesh = isolate.read(path, chosen.name, limits, choice)
    if mesh is None:
        raise ReadError(f"{path}: {chosen.title} can be written, but not read")
    return mesh


def _own(chosen: Format, path: Path, choice: StepChoice = None) -> Mesh | None:
    """What our own reader makes of a file; None if there is none, or if it leaves the file to that of others."""
    if chosen.read is None and chosen.read_step is None:
        return None
    mesh = _state(chosen, path, choice, chosen.read, chosen.read_step)
    if mesh is not None:
        budget.draw("mesh", n_bytes(mesh), "the mesh")
    return mesh


def pieces(chosen: Format, path: Path, choice: StepChoice = None) -> Pieces | None:
    """Where the arrays of a file, or of one of its time steps, stand; None if it has to be read whole."""
    with contextlib.suppress(ReadWhole):
        return listed(chosen, path, choice)
    return None


def listed(chosen: Format, path: Path, choice: StepChoice = None) -> Pieces:
    """`pieces`; raises `ReadWhole` with the reason if it has to be read whole."""
    lister = chosen.pieces
    if lister is None:
        raise ReadWhole(f"files of {chosen.title} are not read in slices")
    with budget.of(path):
        states = (_call_reader(chosen, path, chosen.steps) or ()) if chosen.steps is not None else ()
        at = position(states, choice, path)
        found = _call_reader(chosen, path, lambda path: lister(path, at))
        if found is None:
            raise ReadWhole("its arrays are packed, encoded or arranged in a way that is not read in slices")
        check_alike(found.pieces)
        return replace(
            found,
            notes=(*found.notes, *note(states, at, choice)),
            has_both_wedge_orders=chosen.has_both_wedge_orders,
        )


def n_bytes(mesh: Mesh) -> int:
    """Of the arrays of a mesh."""
    data = (*mesh.point_data.values(), *mesh.cell_data.values(), *mesh.field_data.values())
    return sum(values.nbytes for values in (mesh.points, mesh.types, mesh.offsets, mesh.connectivity, *data))


def places(chosen: Format, path: Path, limits: isolate.Limits | None = None, choice: StepChoice = None) -> Places:
    """Where the file, or one of its time steps, holds the coordinates of points. Raises `ReadError`."""
    of_step = chosen.step_places
    with budget.of(path, *(limits or isolate.Limits()).given):
        if of_step is None:
            given = _call_reader(chosen, path, chosen.places)
        else:
            at = position(steps(chosen, path, limits), choice, path)
            given = _call_reader(chosen, path, lambda path: of_step(path, at))
    if given is None:
        raise ReadError(f"{path}: {chosen.title} is not patched")
    return given


def nodes(chosen: Format, path: Path, limits: isolate.Limits | None = None) -> tuple[Nodes | Faces, ...]:
    """Where the file holds the nodes of cells. Raises `ReadError`."""
    with budget.of(path, *(limits or isolate.Limits()).given):
        return _call_reader(chosen, path, chosen.nodes) or ()


def scan(chosen: Format, path: Path, take: Take) -> bool:
    """Hand over the arrays of a file in pieces; False if that cannot be done."""
    if chosen.scan is None:
        return False
    scanner = chosen.scan
    return bool(_call_reader(chosen, path, lambda path: scanner(path, take)))


def read_here(chosen: Format, path: Path, choice: StepChoice = None) -> Mesh:
    """Read a file by the third-party reader in this process."""
    with sources.record() as used, budget.of(path):
        mesh = _state(chosen, path, choice, chosen.foreign, chosen.foreign_step)
    if mesh is None:
        raise ReadError(f"{path}: {chosen.title} has no reader for it")
    return mesh.replace(sources=tuple(used))


def read_inside(path: Path) -> Mesh:
    """Read a file that another one names, in the process of that one's reader.

    Raises
    ------
    ReadError
        If it cannot be read, or names others itself so that there would be no end.
    """
    depth = _depth.get()
    if depth >= _DEEPEST:
        raise ReadError(f"{path}: files that name files that name files: {depth} deep")
    before = _depth.set(depth + 1)
    try:
        with files.open_input(path, detect) as (plain, head), budget.of(plain):
            chosen = detect(plain, head)
            mesh = _own(chosen, plain)
            return mesh if mesh is not None else read_here(chosen, plain)
    finally:
        _depth.reset(before)


def pieces_inside(path: Path) -> Pieces | None:
    """Where the arrays of a file stand that another one names; None if it has to be read whole."""
    if files.is_packed(path):
        return None
    with files.open_input(path, detect) as (plain, head), budget.of(plain):
        chosen = detect(plain, head)
        return None if chosen.pieces is None or plain != path else chosen.pieces(plain, 0)


def places_inside(path: Path) -> Places:
    """Where a file that another one names holds the coordinates of points. Raises `ReadError` if it is not patched."""
    with files.open_input(path, detect) as (plain, head), budget.of(plain):
        chosen = detect(plain, head)
        found = places(chosen, plain) if plain == path else None
    if found is None or not found.pieces:
        raise ReadError(f"{path}: is not patched: it is packed, or of a kind whose points are in other files")
    return found


_depth: ContextVar[int] = ContextVar("depth", default=0)
_DEEPEST = 3


def _state(
    chosen: Format,
    path: Path,
    choice: StepChoice,
    reader: Callable[[Path], Mesh | None] | None,
    step_reader: Callable[[Path, int], Mesh | None] | None,
) -> Mesh | None:
    """One time step of a file, with a note if it has several; the file as it is if its format knows no steps."""
    lister = chosen.steps or chosen.foreign_steps
    states = (_call_reader(chosen, path, lister) or ()) if lister is not None and step_reader is not None else ()
    at = position(states, choice, path)
    mesh = _call_reader(chosen, path, (lambda path: step_reader(path, at)) if step_reader is not None else reader)
    if mesh is None or len(states) < 2:
        return mesh
    return mesh.replace(notes=(*mesh.notes, *note(states, at, choice)))


def steps(chosen: Format, path: Path, limits: isolate.Limits | None = None) -> tuple[Step, ...]:
    """The time steps of a file; none or one if it holds a single state."""
    if chosen.steps is not None:
        with budget.of(path, *(limits or isolate.Limits()).given):
            return _call_reader(chosen, path, chosen.steps) or ()
    if chosen.foreign_steps is not None:
        return isolate.steps(path, chosen.name, limits)
    return ()


def steps_here(chosen: Format, path: Path) -> tuple[Step, ...]:
    """The time steps of a file by the third-party reader in this process."""
    with budget.of(path):
        return _call_reader(chosen, path, chosen.foreign_steps) or ()


def read_folder(folder: Path, name: str | None, choice: StepChoice = None) -> Mesh:
    """Read a folder: a case of OpenFOAM, its polyMesh, or a mesh of Elmer.

    Raises
    ------
    ReadError
        If it is none.
    """
    chosen, inside = case_of(folder, name)
    try:
        return read(chosen, inside, choice=choice).replace(path=str(folder))
    except ReadError as error:
        raise ReadError(str(error).replace(f"{inside}: ", f"{folder}: ")) from error


def steps_of_folder(folder: Path, name: str | None) -> tuple[Step, ...]:
    """The time steps of a case of OpenFOAM; a mesh of Elmer has none."""
    return steps(*case_of(folder, name))


def case_of(folder: Path, name: str | None) -> tuple[Format, Path]:
    """The format of a folder, and the path in it by which it is read."""
    for chosen, inside in _cases():
        if name in (None, chosen.name) and (path := inside(folder)) is not None:
            return chosen, path
    raise ReadError(
        f"{folder}: is a folder, and holds no mesh file ('meshgauge formats' lists them), no OpenFOAM case with "
        "constant/polyMesh in it, nor a mesh of Elmer with mesh.header"
    )


def is_case(folder: Path) -> bool:
    """Whether a folder is a mesh by itself."""
    return any(inside(folder) is not None for _, inside in _cases())


def _cases() -> tuple[tuple[Format, Callable[[Path], Path | None]], ...]:
    """The formats that are folders, each with what finds the path in one by which it is read."""
    from .formats import elmer
    from .formats.openfoam.format import OPENFOAM
    from .formats.openfoam.read import inside

    return (OPENFOAM, inside), (elmer.ELMER, elmer.inside)


def meshes_in(folder: Path) -> list[Path]:
    """The meshes in a folder and below it, by name: files whose content is that of the format of their extension, and
    folders that are cases. Hidden folders are passed over."""
    found: list[Path] = []
    for root, folders, names in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        here = Path(root)
        if here != folder and is_case(here):
            found.append(here)
            folders.clear()
            continue
        found += [here / name for name in sorted(names) if _is_mesh(here / name)]
    return found


def _is_mesh(path: Path) -> bool:
    """Whether the bytes of a file are those of a format of its extension, as far as they can tell; of a mesh in several
    files, such as TetGen's, one is it."""
    extension = path.suffix.lower()
    try:
        with path.open("rb") as file:
            head = file.read(HEAD)
    except OSError:
        return False
    if not head:
        return False
    row = _sniffed((f for f in table.of_extension(extension) if f.is_readable), head, path)
    if row is None or not row.is_several:
        return row is not None
    earlier = row.extensions[: row.extensions.index(extension)]
    return not any(path.with_suffix(one).exists() for one in earlier)


T = TypeVar("T")


def _call_reader(chosen: Format, path: Path, reader: Callable[[Path], T] | None) -> T | None:
    """What a reader returns; whatever it raises as a `ReadError` that names the file."""
    if reader is None:
        return None
    try:
        with np.errstate(all="ignore"):  # of numbers that a broken file makes too large NumPy would warn
            return reader(path)
    except ReadWhole:
        raise
    except MeshgaugeError as error:
        raise ReadError(named_once(path, str(error))) from (error.__cause__ or error)
    except (Exception, SystemExit) as error:
        if is_out_of_memory(error):
            raise ReadError(out_of_memory(path)) from error
        if isinstance(error, ImportError):
            raise ReadError(f"{path}: {chosen.title} needs a package that is not installed: {error}") from error
        # Third-party readers raise anything on a broken file; a traceback from inside them helps no one.
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ReadError(named_once(path, f"{path}: cannot be read as {chosen.title}: {reason}")) from error


def for_writing(path: Path, name: str | None) -> Format:
    """The format to write: by its name, else by the extension of the file."""
    writable = [f for f in table.every() if f.write is not None]
    if name is not None:
        matches = [f for f in writable if f.name == name]
        what = f"format {name!r}"
    else:
        matches = [f for f in writable if path.suffix.lower() in f.extensions]
        what = f"extension {path.suffix!r}"
    if not matches:
        known = ", ".join(f"{f.name} ({' '.join(f.extensions)})" for f in writable)
        raise WriteError(f"{path}: no format to write for the {what}; known are {known}")
    return matches[0]
