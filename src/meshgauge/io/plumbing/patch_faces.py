"""What a file says of faces of cells by their local numbers: it is renumbered with the cells, or refused by name."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import WriteError
from .numerals import Ints

Hunk = tuple[int, int, bytes]
"""First byte of a piece of a file, the byte behind its last, and what is to stand there."""

Tables = Mapping[str, Sequence[tuple[int, ...]]]
"""By the name of a shape the corners of each of its faces, from 1, both as a format numbers them."""


class Renumbered(NamedTuple):
    """A cell whose nodes change places: its shape, and its nodes as they stand in the file and as they will."""

    name: str
    shape: str
    old: Sequence[int]
    new: Sequence[int]


@dataclass(frozen=True, eq=False)
class Faces:
    """What names faces of some cells, or something else of them that is another once they are renumbered.

    Attributes
    ----------
    path
        The file.
    what
        What an error calls it, such as "*DLOAD in line 12".
    cells
        ``(n,)`` the numbers of the cells as `Nodes` has them, or their places among all of the file, from 0.
    numbers
        ``(n,)`` the face of each, from 1.
    tables
        The faces of cells that can be given another number; nothing of other shapes can.
    write
        From the new numbers, ``(n,)``, what changes in the file. Raises `WriteError`.
    """

    path: Path
    what: str
    cells: Ints
    numbers: Ints | None = None
    tables: Tables = field(default_factory=dict)
    write: Callable[[Ints], Iterable[Hunk]] | None = None

    def edited(self, renumbered: Mapping[int, Renumbered]) -> Iterable[Hunk]:
        """What changes in the file.

        Raises
        ------
        WriteError
            If it names something of a cell that is renumbered, and cannot name it as it will be.
        """
        rows = [row for row, key in enumerate(self.cells.tolist()) if key in renumbered]
        if not rows:
            return ()
        if self.numbers is None or self.write is None:
            raise self.fail(renumbered[int(self.cells[rows[0]])])
        numbers: NDArray[np.int64] = self.numbers.copy()
        for row in rows:
            numbers[row] = self._face(renumbered[int(self.cells[row])], int(numbers[row]))
        return () if np.array_equal(numbers, self.numbers) else self.write(numbers)

    def _face(self, cell: Renumbered, number: int) -> int:
        """The number of a face of a cell once it is renumbered."""
        faces = self.tables.get(cell.shape, ())
        if not 0 < number <= len(faces):
            raise self.fail(cell)
        nodes = {cell.old[corner - 1] for corner in faces[number - 1]}
        return 1 + [{cell.new[corner - 1] for corner in face} for face in faces].index(nodes)

    def fail(self, cell: Renumbered) -> WriteError:
        """The error of what cannot follow a cell."""
        return WriteError(
            f"{self.path}: {self.what} names faces or sides of {cell.name} by local numbers, which are others once it "
            "is renumbered; --convert writes the mesh anew, without what the file holds beside it"
        )
