"""A mesh: points, cells in file order, and the data that came with them. Immutable."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import InitVar, dataclass, field, fields, replace
from types import MappingProxyType
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._lazy import find
from ..cells import CELL_TYPES, IS_SOLID, CellType, cell_type, type_name
from ..errors import MeshError
from ..look.records import shorten
from ..status import Purpose
from ..surface_cells import IS_SURFACE, rows_of, varies
from . import cast
from .polyhedra import IndexArray, Polyhedra

CellIds = slice | NDArray[np.int64]
"""Cells of a mesh: a slice if they follow one another, else their ids, ascending."""

Precision = Literal["single", "double"]
"""How exactly a file stores coordinates."""

GHOST_TYPE = "vtkGhostType"
"""Cell data that marks copies of cells of other pieces and hidden cells, by bits, as VTK does."""

GHOST_BITS = 1 | 32
"""Of `GHOST_TYPE`: a duplicate, a hidden cell."""

DECIDED: Any = None
"""Given for `Mesh.dimension` and `Mesh.up`: what the cells and the points say, which a mesh then has."""

IS_SOLID_OR_UNKNOWN = IS_SOLID | ~np.isin(np.arange(256), list(CELL_TYPES))

_ARRAYS = ("points", "types", "offsets", "connectivity")
_DATA = ("point_data", "cell_data", "field_data")


@dataclass(frozen=True, slots=True)
class CellBlock:
    """Cells that the file keeps together (an element block, a zone, a piece): ``start <= cell < stop``."""

    name: str
    start: int
    stop: int


@dataclass(frozen=True, eq=False, repr=False)
class Mesh:
    """Points and cells of any type, as flat read-only arrays in file order. Nothing changes a mesh once it is made.

    Make one with `meshgauge.read`, `meshgauge.from_pyvista`, `meshgauge.from_meshio` or `Mesh.from_arrays`. Arrays are
    copied, but for those that nobody can write to (``array.flags.writeable`` is False, also of what it is a view of).
    ``Mesh(..., copy=False)`` takes them all as they are, and makes them read-only: for arrays that nobody else holds;
    ``is_checked=True`` does not look whether they make cells either: for arrays that were made so.

    Raises
    ------
    MeshError
        If the arrays do not make a mesh: wrong shape or type, a point id out of range, a wrong number of nodes.

    Attributes
    ----------
    points
        ``(n_points, 3)`` float32 or float64, in the file's unit of length.
    types
        ``(n_cells,)`` uint8, VTK ids.
    offsets
        ``(n_cells + 1,)`` integer: nodes of cell ``c`` are ``connectivity[offsets[c]:offsets[c + 1]]``.
    connectivity
        Point ids, int32 or int64. Wedges have the normal of (0, 1, 2) pointing to (3, 4, 5).
    polyhedra
        Faces of the polyhedral cells, or None if there are none.
    blocks
        How the file groups its cells; together they cover every cell once, in order.
    point_data, cell_data, field_data
        Arrays by name; the first axis of point and cell data is that of the points and the cells.
    path
        Where the mesh came from, or None.
    notes
        What was noticed or changed while reading, a sentence each.
    purpose
        "fem" (finite elements), or "fv" (finite volumes: formats that give cells by their faces), to which concave
        cells are of use.
    stored
        "single" or "double": how exactly the file stores the coordinates; by the dtype of the points if not given.
    sources
        Absolute paths of all files that were read for it: pieces, includes, files beside.
    counted
        "cells", "points": those that the file numbers from 1 on in their order. Their labels are their positions plus
        1, and no array holds them.
    dimension
        What is measured: 3, solid cells, or 2, surface cells. None: 3 if there is a solid cell or one of an unknown
        type, or no surface cell; else 2.
    up
        Of surface cells: 1 or -1 if they are in a plane, seen from +z or -z: a cell that runs clockwise is inverted.
        0: in space, where each has its own normal. None: 1 if the points are given by two coordinates; if z is the same
        at all surface cells, the sign of their area together; else 0.
    parts
        The first point of each of several parts that were put together, points not merged; of one mesh none.
    """

    points: NDArray[np.floating]
    types: NDArray[np.uint8]
    offsets: IndexArray
    connectivity: IndexArray
    polyhedra: Polyhedra | None = None
    blocks: tuple[CellBlock, ...] = ()
    point_data: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    cell_data: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    field_data: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    path: str | None = None
    notes: tuple[str, ...] = ()
    purpose: Purpose = "fem"
    stored: Precision | None = None
    sources: tuple[str, ...] = ()
    counted: tuple[str, ...] = ()
    dimension: Literal[2, 3] = DECIDED
    up: Literal[-1, 0, 1] = DECIDED
    parts: tuple[int, ...] = ()
    copy: InitVar[bool] = field(default=True, kw_only=True)
    is_checked: InitVar[bool] = field(default=False, kw_only=True)

    def __post_init__(self, copy: bool, is_checked: bool) -> None:
        put, given = object.__setattr__, self.points
        for name, array in (
            ("points", cast.points(self.points)),
            ("types", cast.types(self.types)),
            ("offsets", cast.indices(self.offsets, "offsets")),
            ("connectivity", cast.indices(self.connectivity, "connectivity")),
        ):
            put(self, name, cast.own(array, getattr(self, name), copy=copy))
        if self.stored is None:
            put(self, "stored", "single" if self.points.dtype == np.float32 else "double")
        for what, value, known in (("purpose", self.purpose, Purpose), ("stored", self.stored, Precision)):
            if value not in get_args(known):
                raise MeshError(f"{what} is {value!r}, expected one of {', '.join(get_args(known))}")
        if not is_checked:
            cast.check_cells(self.types, self.offsets, self.connectivity, len(self.points))
        self._decide_dimension(cast.in_plane(given))
        if self.polyhedra is not None:
            put(self, "polyhedra", cast.own_polyhedra(self.polyhedra, copy=copy))
            cast.check_polyhedra(self.polyhedra, self.n_cells, len(self.points))
        put(self, "blocks", _check_blocks(self.blocks, self.n_cells))
        for name, n in zip(_DATA, (self.n_points, self.n_cells, None), strict=True):
            put(self, name, _own_data(getattr(self, name), name, n, copy=copy))

    @classmethod
    def from_arrays(
        cls,
        points: ArrayLike,
        cells: Mapping[str, ArrayLike] | Sequence[tuple[str | int, ArrayLike]],
        *,
        point_data: Mapping[str, ArrayLike] | None = None,
        cell_data: Mapping[str, ArrayLike] | None = None,
    ) -> Mesh:
        """A mesh from points and, for each block of cells of one type, its connectivity.

        Parameters
        ----------
        points
            ``(n_points, 3)`` real, in any unit of length; of surface cells in a plane ``(n_points, 2)`` too.
        cells
            For each block a cell type (name, VTK id) and point ids ``(n, n_nodes)``, as a mapping or as pairs, which
            may name a type twice. Wedges must have the normal of (0, 1, 2) pointing to (3, 4, 5).
        point_data, cell_data
            Arrays by name, of ``n_points`` and ``n_cells`` rows.

        Returns
        -------
        Mesh
            It shares no memory with the arrays. Masked coordinates and data are NaN.

        Raises
        ------
        MeshError
            If the arrays do not make a mesh, an id is masked, or rows differ in length.

        Examples
        --------
        >>> import meshgauge
        >>> points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
        >>> meshgauge.Mesh.from_arrays(points, {"tetra": [(0, 1, 2, 3)]})
        <Mesh: 4 points; 1 tetra>
        """
        pairs = list(cells.items()) if isinstance(cells, Mapping) else list(cells)
        types, sizes, nodes, blocks, start = [], [], [], [], 0
        for which, connectivity in pairs:
            try:
                row = cell_type(which)
            except KeyError as error:
                raise MeshError(error.args[0]) from None
            dense = cast.connectivity(connectivity, row)
            n, width = dense.shape
            types.append(np.full(n, row.vtk_id, np.uint8))
            sizes.append(np.full(n, width, np.int64))
            nodes.append(dense.ravel())
            blocks.append(CellBlock(row.name, start, start + n))
            start += n
        in_plane = cast.in_plane(points)
        if in_plane and any(IS_SOLID[of_block].any() for of_block in types):
            raise MeshError(f"points have shape {np.shape(points)}, expected (n_points, 3)")
        offsets = np.zeros(start + 1, np.int64)
        if sizes:
            np.cumsum(np.concatenate(sizes), out=offsets[1:])
        return cls(
            points=cast.own(cast.points(points), points, copy=True),
            types=np.concatenate(types) if types else np.empty(0, np.uint8),
            offsets=offsets,
            connectivity=np.concatenate(nodes) if nodes else np.empty(0, np.int64),
            blocks=tuple(blocks),
            point_data=_own_data(point_data or {}, "point_data", None, copy=True),
            cell_data=_own_data(cell_data or {}, "cell_data", None, copy=True),
            up=1 if in_plane else DECIDED,
            copy=False,
        )

    def _decide_dimension(self, has_two_coordinates: bool) -> None:
        """Fill in `dimension` and `up` where they are not given."""
        if self.dimension not in (None, 2, 3):
            raise MeshError(f"dimension is {self.dimension!r}, expected 2 or 3")
        if self.up not in (None, -1, 0, 1):
            raise MeshError(f"up is {self.up!r}, expected -1, 0 or 1")
        if self.dimension is None:
            object.__setattr__(self, "dimension", self._dimension_of_cells())
        if has_two_coordinates and self.dimension == 3 and self.n_cells and IS_SOLID[self.types].any():
            raise MeshError(f"points have shape ({self.n_points}, 2), expected (n_points, 3)")
        if self.up is None:
            from .plane import side

            up, note = (1, "") if has_two_coordinates else side(self) if self.dimension == 2 else (0, "")
            object.__setattr__(self, "up", up)
            object.__setattr__(self, "notes", (*self.notes, note) if note else self.notes)

    def _dimension_of_cells(self) -> Literal[2, 3]:
        has_surface = False
        for start in range(0, self.n_cells, cast.CHUNK):  # the first solid cell is enough
            types = self.types[start : start + cast.CHUNK]
            if IS_SOLID_OR_UNKNOWN[types].any():
                return 3
            has_surface |= bool(IS_SURFACE[types].any())
        return 2 if has_surface else 3

    @property
    def n_points(self) -> int:
        return len(self.points)

    @property
    def n_cells(self) -> int:
        return len(self.types)

    def as_measured(self, dimension: Literal[2, 3] | None) -> Mesh:
        """The same with this `dimension`; None: as it is."""
        return self if dimension in (None, self.dimension) else self.replace(dimension=dimension, up=DECIDED)

    def type_counts(self) -> dict[str, int]:
        """Number of cells by type name, in the order of the VTK ids."""
        counts = cast.count_types(self.types)
        return {type_name(int(t)): int(counts[t]) for t in np.flatnonzero(counts)}

    def groups(self) -> Iterator[tuple[CellType | None, int, CellIds]]:
        """For each type in the mesh: its row (None if unknown), its VTK id, and its cells.

        Rows of surface cells have a shape in a mesh of `dimension` 2, those of solids in one of 3. Polygons, Lagrange
        and Bézier cells come once for each number of nodes that is known, and once more for the others.
        """
        from .high_order import by_nodes

        rows = rows_of(self.dimension)
        for vtk_id in (int(t) for t in np.flatnonzero(cast.count_types(self.types))):
            row, cells = rows.get(vtk_id), self.cells_of_type(vtk_id)
            if row is not None and varies(row):
                yield from ((known, vtk_id, some) for known, some in by_nodes(self, row, cells))
            else:
                yield row, vtk_id, cells

    def cells_of_type(self, vtk_id: int) -> CellIds:
        """The cells of one type: a slice if they follow one another, else their ids."""
        of_type = self.types == vtk_id
        n = int(np.count_nonzero(of_type))
        first = int(np.argmax(of_type)) if n else 0
        return slice(first, first + n) if bool(of_type[first : first + n].all()) else np.flatnonzero(of_type)

    def nodes(self, cell: int) -> IndexArray:
        """Point ids of one cell."""
        return self.connectivity[self.offsets[cell] : self.offsets[cell + 1]]

    @property
    def is_ghost(self) -> NDArray[np.bool_] | None:
        """``(n_cells,)``: cells that are copies of those of another piece, or hidden; None if there are none.

        They are those that cell data `GHOST_TYPE` marks with bit 1 or 32, whatever the format.
        """
        marks = self.cell_data.get(GHOST_TYPE)
        return None if marks is None else ghost_mask(marks)

    def __getitem__(self, cells: ArrayLike | slice) -> Mesh:
        """A mesh of some cells: a mask ``(n_cells,)``, ids (negative ones count from the end), one id, or a slice.

        As PyVista's ``extract_cells``: cells stay in the order of this mesh, each once, whatever the order of the ids;
        points that no cell needs are left out, the others keep their order. Data, blocks (hence regions), polyhedra and
        notes follow.

        Raises
        ------
        MeshError
            If an id is out of range, a mask has another length, or it is neither ids nor a mask.
        """
        from .subset import subset

        return subset(self, cells)

    __iter__ = None  # a mesh of one cell for each cell is never what is meant

    def replace(self, **changes: Any) -> Mesh:
        """A new mesh with some attributes changed. New arrays are copied as when a mesh is made; the others are shared.

        Raises `MeshError` if they do not fit.
        """
        for name, value in changes.items():
            if name in _ARRAYS:
                changes[name] = cast.own(cast.plain(value, name), value, copy=True)
            elif name in _DATA:
                changes[name] = _own_data(value, name, None, copy=True)
        if changes.get("polyhedra") is not None:
            changes["polyhedra"] = cast.own_polyhedra(changes["polyhedra"], copy=True)
        if "counted" not in changes:  # another number of items is another numbering
            sizes = {"cells": (self.n_cells, "types"), "points": (self.n_points, "points")}
            same = {what for what, (n, array) in sizes.items() if len(changes.get(array, range(n))) == n}
            changes["counted"] = tuple(what for what in self.counted if what in same)
        if len(changes.get("points", self.points)) != self.n_points:
            changes["parts"] = ()
        return replace(self, **changes, copy=False, is_checked=False)

    def to_pyvista(self) -> Any:
        """As a `pyvista.UnstructuredGrid` with all data, which shares no memory with the mesh.

        Regions given by named blocks become cell data, as in files. Data that VTK cannot hold are left out.
        """
        return find("io.objects", "to_pyvista")(self)

    def to_meshio(self) -> Any:
        """As a `meshio.Mesh`: a block for each run of cells of one type; shares no memory with the mesh.

        Raises `WriteError` if a cell has no type in meshio.
        """
        return find("io.objects", "to_meshio")(self)

    def __reduce__(self) -> tuple[Any, ...]:
        # Mapping proxies cannot be pickled, and arrays come back writeable: made anew, both are as they were.
        state = {own.name: getattr(self, own.name) for own in fields(self)}
        return _restore, ({k: dict(v) if isinstance(v, MappingProxyType) else v for k, v in state.items()},)

    def __repr__(self) -> str:
        cells = ", ".join(f"{n} {name}" for name, n in self.type_counts().items()) or "no cells"
        where = f" from {shorten(self.path)}" if self.path else ""
        return f"<Mesh{where}: {self.n_points} points; {cells}>"

    def _repr_html_(self) -> str:
        """The mesh in a notebook: cells by type, size, data, notes."""
        from ..look import notebook  # with the colours of pages

        rows = [(name, f"{n:,}") for name, n in self.type_counts().items()]
        rows += [("points", f"{self.n_points:,}")]
        if self.n_points:
            with np.errstate(invalid="ignore", over="ignore"):
                low, high = self.points.min(axis=0), self.points.max(axis=0)
            rows += [(axis, f"{a:.6g} to {b:.6g}") for axis, a, b in zip("xyz", low, high, strict=True)]
        held = (("point data", self.point_data), ("cell data", self.cell_data))
        data = [
            f"{what}: {', '.join(f'{k} ({v.dtype})' for k, v in arrays.items())}" for what, arrays in held if arrays
        ]
        where = f" from {self.path}" if self.path else ""
        return notebook.block(f"Mesh{where}", notebook.table((), rows), *data, *self.notes)


def ghost_mask(marks: NDArray[Any]) -> NDArray[np.bool_] | None:
    """``(n,)`` True where `GHOST_TYPE` marks a ghost or a hidden cell; None if there are none."""
    if marks.ndim != 1 or marks.dtype.kind not in "iufb":
        return None
    if marks.dtype.kind == "f":  # where pieces without the array were filled with NaN
        marks = np.nan_to_num(marks, posinf=0, neginf=0)
    is_ghost = np.asarray(marks.astype(np.uint8, copy=False) & GHOST_BITS, np.bool_)
    return is_ghost if is_ghost.any() else None


# The defaults of parameters are left on the class, where ``mesh.copy`` would be True and no method.
delattr(Mesh, "copy")
delattr(Mesh, "is_checked")


def _restore(state: dict[str, Any]) -> Mesh:
    return Mesh(**state, copy=False)


def _check_blocks(blocks: Sequence[CellBlock], n_cells: int) -> tuple[CellBlock, ...]:
    """The blocks, or one of all cells if there are none."""
    end = 0
    for block in blocks:
        if block.start != end or block.stop < block.start:
            raise MeshError(
                f"block {block.name!r} is of cells {block.start} to {block.stop}, expected it to start at {end}"
            )
        end = block.stop
    if blocks and end != n_cells:
        raise MeshError(f"the blocks end at cell {end}, expected {n_cells}")
    return tuple(blocks) or (CellBlock("", 0, n_cells),)


def _own_data(data: Mapping[str, Any], name: str, n: int | None, *, copy: bool) -> Mapping[str, NDArray[Any]]:
    owned = {}
    for key, values in data.items():
        array = cast.plain(values, f"{name}[{key!r}]")
        if n is not None and (array.ndim == 0 or len(array) != n):
            raise MeshError(f"{name}[{key!r}] has shape {array.shape}, expected {n} rows")
        owned[str(key)] = cast.own(array, values, copy=copy)
    return MappingProxyType(owned)
