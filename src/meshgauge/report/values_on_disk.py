"""Values of cells and points of a mesh that is measured slice by slice, kept on the disk until they are written."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import WriteError
from ..files import private
from ..files.resources import no_space
from ..io.plumbing.pieces import FileRows, Rows
from ..slices.partial import CellRows

_AT_ONCE = 1 << 18
"""Points whose values are set at a time."""


@dataclass(frozen=True)
class _PointRows:
    """Least values of points, infinite where there is none: then they are NaN."""

    path: Path
    n: int

    @property
    def dtype(self) -> np.dtype[Any]:
        return np.dtype(np.float64)

    @property
    def shape(self) -> tuple[int, ...]:
        return (self.n,)

    def read(self, start: int, stop: int) -> NDArray[np.float64]:
        values = FileRows(str(self.path), 0, self.dtype, self.shape).read(start, stop)
        values[np.isinf(values)] = np.nan
        return values


@dataclass
class ValuesOnDisk:
    """What `Quality.cell_data` and `Quality.point_data` hold of a mesh, taken slice by slice; to be used with ``with``.

    Attributes
    ----------
    target
        In the folder of this file the values are kept, for as long as they are needed.
    n_cells, n_points
        Of the mesh.
    """

    target: Path
    n_cells: int
    n_points: int
    _kinds: dict[str, np.dtype[Any]] = field(default_factory=dict)
    _held: contextlib.ExitStack = field(default_factory=contextlib.ExitStack)

    def __enter__(self) -> ValuesOnDisk:
        try:
            self._path = self._held.enter_context(private.folder(self.target.parent))
        except OSError as error:
            raise WriteError(f"{self.target}: cannot be written: {error.strerror or error}") from error
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._held.close()

    def take(self, first: int, rows: CellRows) -> None:
        """Keep those of a slice, which begins with a cell; in the order of cells."""
        try:
            of_cells: dict[str, NDArray[Any]] = {**rows.values, "status": rows.status}
            for name, values in of_cells.items():
                self._kinds[name] = values.dtype
                with open(self._path / f"cell-{list(self._kinds).index(name)}", "ab") as file:
                    file.write(np.ascontiguousarray(values).data)
            assert rows.points is not None  # they were asked for
            for name, values in (("jens_worst", rows.points.worst), ("jens_node", rows.points.as_node)):
                self._least(self._path / name, rows.points.ids, values)
        except OSError as error:
            full = no_space(error, self.target)
            raise WriteError(full or f"{self.target}: cannot be written: {error.strerror or error}") from error

    def _least(self, path: Path, ids: NDArray[np.int64], values: NDArray[np.float64]) -> None:
        if not path.exists():
            with open(path, "wb") as file:
                for start in range(0, self.n_points, _AT_ONCE):
                    file.write(np.full(min(_AT_ONCE, self.n_points - start), np.inf).data)
        if len(ids):
            kept = np.memmap(path, np.float64, "r+")
            with np.errstate(invalid="ignore"):  # NaN is to stay NaN
                kept[ids] = np.minimum(kept[ids], values)

    def cells(self) -> dict[str, Rows]:
        """By name, of all cells."""
        return {
            name: FileRows(str(self._path / f"cell-{number}"), 0, kind, (self.n_cells,))
            for number, (name, kind) in enumerate(self._kinds.items())
        }

    def points(self) -> dict[str, Rows]:
        """By name, of all points."""
        return {name: _PointRows(self._path / name, self.n_points) for name in ("jens_worst", "jens_node")}
