"""What a file format is to the registry: one frozen record, made by one file a format."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from ...mesh import Mesh
from .steps import Step

if TYPE_CHECKING:
    from .added import Adder, RowsAdder
    from .cell_set import SetAdder, SetWriter
    from .mesh_rows import RowsWriter
    from .patch import Places
    from .patch_faces import Faces
    from .patch_nodes import Nodes
    from .pieces import Pieces

    PlacesFinder = Callable[[Path], Places]
    """Scans a file again for where it holds the coordinates of points, in the order of the mesh or by their labels."""

    PieceLister = Callable[[Path, int], Pieces | None]
    """Where the arrays of a time step stand in a file; None for a kind of file that has to be read whole."""

    StepPlacesFinder = Callable[[Path, int], Places]
    """The same of one time step, by its index from 0."""

    NodesFinder = Callable[[Path], tuple[Nodes | Faces, ...]]
    """Scans a file again for where it holds the nodes of cells, and what names faces of them by local numbers."""

Reader = Callable[[Path], Mesh]
"""Reads a file. Wedges stay in the order of the file: `wedge_order.normalise` turns them afterwards."""

OwnReader = Callable[[Path], Mesh | None]
"""Reads a file, or returns None for a kind of it that it leaves to the third-party reader."""

StepReader = Callable[[Path, int], Mesh]
"""Reads one time step of a file, by its index from 0; 0 also of a file that holds a single state."""

OwnStepReader = Callable[[Path, int], Mesh | None]
"""The same, or None for a kind of file that it leaves to the third-party reader."""

StepLister = Callable[[Path], tuple[Step, ...]]
"""The time steps of a file; none or one if it holds a single state."""

Writer = Callable[[Path, Mesh], tuple[str, ...]]
"""Writes a file that does not exist yet; returns what the format could not hold, a sentence each."""

Take = Callable[[str, str, Iterator[NDArray[Any]]], None]
"""Is handed what an array is (an attribute of `Mesh`), its name if it is data, and its values, flat, in pieces."""

Reducer = Callable[[Mesh], tuple[Mesh, tuple[str, ...]]]
"""Leaves out what a format cannot hold beside the cells that matter; a sentence on what that is."""

Scanner = Callable[[Path, Take], bool]
"""Hands over every array of a file, in pieces; False if the file is of a kind that it does not know."""

IncludedNames = Callable[[bytes], list[tuple[int, int]]]
"""Where the bytes of a file name others that it includes: first byte of each name, and that behind its last."""

Sniffer = Callable[[bytes, Path], bool]
"""True if the first bytes of a file (up to `HEAD` of them) are of this format."""

HEAD = 4096
"""Bytes of a file that are sniffed."""


@dataclass(frozen=True, slots=True)
class Format:
    """One file format.

    Attributes
    ----------
    name
        Short name, as given to ``file_format=``.
    title
        What the format is called in messages.
    extensions
        Lower case, with the dot. Two formats may share one: the content then decides.
    sniff
        Tells the format by the first bytes of a file.
    read
        Our own reader: checks every count and index itself, so that it runs in the caller's process. None if there is
        none.
    foreign
        A reader that may crash, hang, print or end its process, so that it gets one of its own. Called if ``read`` is
        None or returns None.
    forbidden
        Characters, beside control characters, that names cannot have in a file that is written.
    is_exact
        True if the format keeps every bit of a mesh, the order of its cells and all names.
    steps
        Lists the time steps by code of our own; None if there are none, or if ``foreign_steps`` does.
    foreign_steps
        Lists them by a reader that may crash.
    read_step, foreign_step
        In place of ``read`` and ``foreign`` where a file may hold several time steps.
    write
        None where the format cannot be written.
    reduce
        Called before ``write``: leaves out cells of lower dimension that the format has no place for; None if it has.
    scan
        Hands over what a file holds, so that a large one is compared without having it in memory; None if there is
        only reading it.
    places
        Where coordinates stand, so that a file comes back with others and nothing else touched; None where the format
        is not patched.
    pieces
        Tells where the arrays stand, so that a large mesh is measured without having it in memory; None if there is
        only reading it.
    takes
        Bytes of memory that measuring a mesh as a whole takes, about, by the sizes of its files: of a format whose
        pieces are listed by reading all of them once, which is only done where that is more than there is.
    step_places
        In place of ``places`` where a file may hold several time steps.
    nodes
        Where the nodes of cells stand, so that cells can be renumbered in the file; None where that is not done.
    add
        Adds arrays of cells and points to a copy of a file; None if the format has no place for them.
    add_rows
        The same with arrays that are not in memory; None if they have to be.
    write_rows
        Writes a mesh whose arrays are not in memory; None if they have to be.
    add_set
        Adds a named set of cells to a copy of a file; None where that is not done.
    write_set
        Writes any mesh with a named set of its cells; None where that is not done.
    included
        Where files name others that they include, so that a new file can name others; None if the format has no such.
    is_stale
        Of a format whose files are a folder: which entries of it are of the mesh as it was, such as results, so that a
        copy with other coordinates goes without them.
    parts
        The files of a mesh that is spread over several, there or not, by the name of any of them; none if a name is
        that of a whole one.
    by_content
        False if the bytes tell this format only together with its extension.
    is_several
        True if the extensions are those of the files of one mesh, by any of which it is read.
    has_kinds
        True if each extension is that of a kind of its own, which a file that is patched keeps.
    is_single
        True if coordinates that are written are floats of four bytes.
    has_both_wedge_orders
        True if files of the format hold wedges in either of two orders, without a mark: those of VTK, and formats that
        are read by VTK's readers or written after its documentation.
    """

    name: str
    title: str
    extensions: tuple[str, ...]
    sniff: Sniffer
    read: OwnReader | None = None
    foreign: Reader | None = None
    write: Writer | None = None
    scan: Scanner | None = None
    reduce: Reducer | None = None
    places: PlacesFinder | None = None
    step_places: StepPlacesFinder | None = None
    nodes: NodesFinder | None = None
    add: Adder | None = None
    add_rows: RowsAdder | None = None
    write_rows: RowsWriter | None = None
    add_set: SetAdder | None = None
    write_set: SetWriter | None = None
    included: IncludedNames | None = None
    is_stale: Callable[[str], bool] | None = None
    parts: Callable[[Path], tuple[Path, ...]] | None = None
    by_content: bool = True
    is_several: bool = False
    has_kinds: bool = False
    has_both_wedge_orders: bool = False
    is_single: bool = False
    forbidden: str = ""
    is_exact: bool = False
    steps: StepLister | None = None
    foreign_steps: StepLister | None = None
    read_step: OwnStepReader | None = None
    foreign_step: StepReader | None = None
    pieces: PieceLister | None = None
    takes: Callable[[Path], int] | None = None

    @property
    def is_readable(self) -> bool:
        return any((self.read, self.read_step, self.is_foreign))

    @property
    def is_patched(self) -> bool:
        """Whether a file can be given back with other coordinates and nothing else touched."""
        return self.places is not None or self.step_places is not None

    @property
    def is_foreign(self) -> bool:
        """Whether there is a reader that needs a process of its own."""
        return self.foreign is not None or self.foreign_step is not None


def anything(head: bytes, path: Path) -> bool:
    """Sniffer of a format that has no mark: its extension decides."""
    return True
