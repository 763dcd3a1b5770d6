"""Measuring a mesh: a value and a status for every cell, in file order."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from .._lazy import find
from ..cells import POLYHEDRON, CellType, type_name
from ..errors import MetricError, OptionError, expect
from ..kernels.cells import aggregate
from ..kernels.threads import thread_count
from ..look import style
from ..look.bands import PoorBelow
from ..look.names import cell_entry, point_entry
from ..mesh import CellIds, Mesh, connectivity
from ..mesh.cast import frozen
from ..mesh.ghosts import without_ghosts
from ..mesh.high_order import row_of
from ..mesh.interface import is_interface
from ..mesh.labels import cell_label, point_label
from ..status import STATUSES, Purpose, Status, is_unmeasured
from . import evaluate, poor
from .collapsed import with_collapsed
from .findings import status_cells
from .frame import frame
from .metrics import METRICS, Metric
from .neighbours import with_neighbours
from .summary import Summary, summarise
from .validity import Certificate, certify
from .worst import StatusCells, WorstCell, corner_values, spacing, worst_at_points, worst_first

if TYPE_CHECKING:
    from .faces import FaceQuality
    from .polyhedra import PolyhedralQuality

Values = NDArray[np.float64]

JENS = "jens"


@dataclass(frozen=True, eq=False, repr=False)
class Quality:
    """What was measured on a mesh. Arrays are read-only and in file order; NaN means undefined and nothing else does.

    Attributes
    ----------
    mesh
        What was measured: the mesh that was given, its collapsed bricks as the shapes that they stand for.
    values
        ``(n_cells,)`` J_ENS in [-1, 1], 1 is best; NaN for a cell that could not be measured, see `status`.
    status
        ``(n_cells,)`` uint8, codes of `meshgauge.Status`.
    polyhedra
        What is known of the polyhedral cells beside: references, faults, hanging nodes, star-shapedness; None if there
        are none.
    metrics
        ``(n_cells,)`` values by name of metric, ``"jens"`` among them; NaN where a metric is not defined for a type.
    rows
        The row of each of these metrics, by name.
    collapsed_from
        The mesh that was given, if it has collapsed cells, see `meshgauge.mesh.collapsed`; else None.
    faces
        Faces with their two cells, and what finite volumes ask of them, if a metric of these was measured; else None.
    n_deciding
        Of a part of a mesh: measured cells of the whole, by which nodes are evaluated as in the whole; else None.
    beside
        What a report says beside, as far as it was told in passing; None where it was not asked for.
    """

    mesh: Mesh
    values: Values
    status: NDArray[np.uint8]
    metrics: Mapping[str, Values]
    polyhedra: PolyhedralQuality | None = None
    rows: Mapping[str, Metric] = field(default_factory=lambda: METRICS)
    collapsed_from: Mesh | None = None
    faces: FaceQuality | None = None
    n_deciding: int | None = field(default=None, repr=False)
    beside: evaluate.Beside | None = field(default=None, repr=False)

    @property
    def n_cells(self) -> int:
        return len(self.values)

    @property
    def source(self) -> Mesh:
        """The mesh that was given, as it is written: `mesh` itself unless cells of it are collapsed."""
        return self.mesh if self.collapsed_from is None else self.collapsed_from

    @property
    def poor_below(self) -> PoorBelow:
        """Below which J_ENS cells are poor."""
        return poor.limits_of_row(self.rows[JENS])

    def poor_limits(self, cells: NDArray[np.integer] | slice = slice(None)) -> Values:
        """Below which J_ENS each of some cells is poor, ``(n,)``."""
        return poor.limits_of_cells(self.mesh.types[cells], self.poor_below)

    @cached_property
    def certificate(self) -> Certificate:
        """Certified bounds on the Jacobian determinant inside every cell."""
        return certify(self.mesh)

    @cached_property
    def node_scaled_jacobian(self) -> Values:
        """J_S of every cell's nodes, flat, aligned with ``mesh.connectivity``; NaN at a node that is not a corner."""
        n = evaluate.n_deciding(self.mesh) if self.n_deciding is None else self.n_deciding
        values = evaluate.node_scaled_jacobian(self._measured, None, n)
        return values if self.polyhedra is None else self._with_polyhedra(values, self.polyhedra.node_scaled_jacobian)

    @cached_property
    def _measured(self) -> Mesh:
        """The mesh but for its ghosts."""
        return without_ghosts(self.mesh)

    @cached_property
    def node_jens(self) -> Values:
        """J_ENS of every cell's nodes, flat, aligned with ``mesh.connectivity``; NaN at a node that is not a corner."""
        values = self.node_scaled_jacobian
        out = np.full(len(values), np.nan)
        for row, _, cells in self._measured.groups():
            if row is not None and row.shape is not None:
                for part in connectivity.chunks(cells):
                    at = connectivity.positions(self.mesh, row, part)
                    out[at] = aggregate.jens(values[at], row.shape.k)
        out = frozen(out)
        return out if self.polyhedra is None else self._with_polyhedra(out, self.polyhedra.node_jens)

    @cached_property
    def point_values(self) -> Values:
        """``(n_points,)``: the worst J_ENS of the cells that have the point as a corner.

        NaN where one of them is NaN, and at a point that is no corner of a measured cell.
        """
        mesh = self.mesh
        return worst_at_points(mesh, np.repeat(self.values, np.diff(mesh.offsets)), self._is_corner)

    @cached_property
    def point_node_values(self) -> Values:
        """``(n_points,)``: the worst J_ENS that the point has as a node of its cells; NaN as for `point_values`."""
        return worst_at_points(self.mesh, self.node_jens, self._is_corner)

    @property
    def corner_points(self) -> NDArray[np.int64]:
        """Ids, ascending, of the points that are corners of measured cells."""
        is_there = np.zeros(self.mesh.n_points, np.bool_)
        is_there[self.mesh.connectivity[self._is_corner]] = True
        return np.flatnonzero(is_there)

    @cached_property
    def _is_corner(self) -> NDArray[np.bool_]:
        """True for entries of the connectivity that are measured: corners, and the nodes of polyhedra."""
        mesh = self._measured
        is_corner = np.zeros(len(mesh.connectivity), np.bool_)
        for row, vtk_id, cells in mesh.groups():
            if row is not None and row.shape is not None:
                for part in connectivity.chunks(cells):
                    is_corner[connectivity.positions(mesh, row, part)] = True
            elif vtk_id == POLYHEDRON.vtk_id and self.polyhedra is not None:
                is_corner |= ~np.isnan(self._with_polyhedra(np.full(len(is_corner), np.nan), self.polyhedra.node_k))
        return is_corner

    def _with_polyhedra(self, values: Values, of_nodes: Values) -> Values:
        """Node values with those of the polyhedra put in."""
        assert self.polyhedra is not None
        of_polyhedra = self.polyhedra.along(self.mesh.offsets, self.mesh.connectivity, of_nodes)
        return frozen(np.where(np.isnan(of_polyhedra), values, of_polyhedra))

    def values_of(self, name: str) -> Values:
        """``(n_cells,)`` values of a metric. Raises `MetricError` if it was not measured."""
        if name not in self.metrics:
            raise MetricError(f"metric {name!r} was not measured; measured are {', '.join(self.metrics)}")
        return self.metrics[name]

    def summary(self, name: str = JENS, *, threads: int | None = None) -> Summary:
        """Counts, extremes, mean and distribution of a metric, by type and over all: a record that merges exactly.

        Cohesive and gasket cells are in none of the counts.
        """
        values, status, types = self.values_of(name), self.status, self.mesh.types
        interface = is_interface(self.mesh)
        if interface is not None:
            values, status, types = values[~interface], status[~interface], types[~interface]
        return summarise(values, status, types, self.rows[name], purpose=self.mesh.purpose, threads=threads)

    def by_region(self) -> dict[str, Summary]:
        """The summary of J_ENS of each region (material, zone, physical group, block), by name, in the order of the
        file; see `meshgauge.regions`. A mesh without regions has one, called "all"."""
        return dict(find("quality.by_region", "by_region")(self)[1])

    def report(self, *, worst: int = 10, by_region: bool = False, width: int = 160) -> str:
        """What ``meshgauge report`` prints: verdict, tables, histogram, worst cells, what else is wrong, notes.

        Parameters
        ----------
        worst
            How many of the worst cells to list.
        by_region
            Add a table of the regions.
        width
            Columns; what does not fit is wrapped or left out.

        Returns
        -------
        str
            Lines without colours.

        Raises
        ------
        OptionError
            If there is less than one column, or fewer than no cells.
        """
        if worst < 0 or width < 1:
            raise OptionError(f"worst is {worst} and width {width}, expected 0 and 1 or more")
        text: str = find("report.methods", "report_text")(self, worst=worst, by_region=by_region, width=width)
        return text

    def to_html(self, path: str | os.PathLike[str], *, worst: int = 10) -> None:
        """Write the report as a page that opens offline, with charts, the worst cells and the mesh in 3D.

        Parameters
        ----------
        path
            Of the page; an older one is replaced.
        worst
            How many of the worst cells to draw.

        Returns
        -------
        None
            The page is whole or not there.

        Raises
        ------
        WriteError
            If it cannot be written, or would replace a file that the mesh was read from.
        OptionError
            If ``worst`` is negative.
        """
        if worst < 0:
            raise OptionError(f"worst is {worst}, expected 0 or more")
        find("report.methods", "write_html")(self, path, worst=worst)

    def view(self, *, worst: int = 10, height: int = 720) -> Any:
        """The page of `to_html` in a cell of a notebook, ``height`` pixels high: no server, no file.

        ``meshgauge.view.widget(mesh)`` is the viewer, for millions of cells; the notebook's process serves it.
        """
        return find("report.methods", "page_in_cell")(self, worst=worst, height=height)

    def worst(self, n: int = 10) -> list[WorstCell]:
        """The n worst cells: invalid ones first, then degenerate, then undecided ones, whatever their value; lowest
        J_ENS first among those that count alike, equal ones in file order. Cells without a value are not among them."""
        cells = worst_first(self.values, self.status, n, self.mesh.purpose)
        return [self.worst_node(int(cell)) for cell in cells]

    def worst_frame(self, n: int = 10) -> Any:
        """`worst` as a pandas DataFrame: cell, type, quality, status, node, node_quality, point, cell_label,
        point_label, x, y, z.

        Raises
        ------
        MeshgaugeError
            If pandas is not installed.
        """
        names = [name for name in WorstCell.__slots__ if name not in ("coordinates", "spacing")]
        rows = [(*(getattr(cell, name) for name in names), *cell.coordinates) for cell in self.worst(n)]
        return frame(rows, [*names, "x", "y", "z"])

    def findings(self, n: int = 5) -> list[StatusCells]:
        """The solid cells that are not ok, by status: how many, the first n, and where the first is."""
        return status_cells(self, n)

    def cell_data(self) -> dict[str, NDArray[np.generic]]:
        """Arrays to attach to the mesh's cells: every metric by its name, and ``status``."""
        return {**self.metrics, "status": self.status}

    def point_data(self) -> dict[str, NDArray[np.generic]]:
        """Arrays to attach to the mesh's points: ``jens_worst`` (`point_values`) and ``jens_node`` (the worst of the
        point as a node)."""
        return {"jens_worst": self.point_values, "jens_node": self.point_node_values}

    def with_data(self) -> Mesh:
        """The mesh that was given, with `cell_data` and `point_data` of this quality added to its own."""
        mesh = self.source
        return mesh.replace(
            cell_data={**mesh.cell_data, **self.cell_data()}, point_data={**mesh.point_data, **self.point_data()}
        )

    def worst_node(self, cell: int) -> WorstCell:
        """A cell that has a value, and the node of it that is worst."""
        node, point, node_quality = self._worst_node(cell, row_of(self.mesh, cell) or POLYHEDRON)
        if self.collapsed_from is not None:  # the position in the cell of the file
            node = int(np.flatnonzero(self.collapsed_from.nodes(cell) == point)[0])
        x, y, z = (float(v) for v in self.mesh.points[point])
        return WorstCell(
            cell=cell,
            type=type_name(int(self.mesh.types[cell])),
            quality=float(self.values[cell]),
            status=STATUSES[Status(int(self.status[cell]))].name,
            node=node,
            node_quality=node_quality,
            point=point,
            coordinates=(x, y, z),
            cell_label=cell_label(self.mesh, cell),
            point_label=point_label(self.mesh, point),
            spacing=spacing(self.mesh.points[self.mesh.nodes(cell)]),
        )

    def _worst_node(self, cell: int, row: CellType) -> tuple[int, int, float]:
        """Position in the cell, point id and J_ENS of the node with the lowest J_ENS."""
        nodes = self.mesh.nodes(cell)
        if row.shape is not None:
            values = corner_values(self.mesh, cell, row)
            corner = int(np.argmin(values))
            node = row.corners[corner]
            return node, int(nodes[node]), float(values[corner])
        assert self.polyhedra is not None  # only polyhedra have a value without a shape
        at = int(np.searchsorted(self.polyhedra.cells, cell))
        mine = slice(int(self.polyhedra.node_offsets[at]), int(self.polyhedra.node_offsets[at + 1]))
        values = self.polyhedra.node_jens[mine]
        corner = int(np.nanargmin(values))
        point = int(self.polyhedra.node_points[mine][corner])
        places = np.flatnonzero(nodes == point)
        return (int(places[0]) if len(places) else corner), point, float(values[corner])

    def __repr__(self) -> str:
        counts = np.bincount(self.status, minlength=len(Status))
        counts_text = ", ".join(f"{n} {STATUSES[Status(s)].name}" for s, n in enumerate(counts) if n) or "no cells"
        return f"<Quality of {self.n_cells} cell{'' if self.n_cells == 1 else 's'}: {counts_text}>"

    def _repr_html_(self) -> str:
        """The quality in a notebook: its summary and the worst cells."""
        from ..look import notebook  # with the colours of pages

        head = ("worst cells", "type", "quality", "worst at node", "point", "x", "y", "z")
        rows: list[list[notebook.Cell]] = []
        for cell in self.worst(5):
            value = notebook.quality(cell.quality)
            of_valid = notebook.POOR if cell.quality < poor.limit_of(self.poor_below, cell.type) else ""
            bad = notebook.INVALID if cell.status != "ok" else of_valid
            place = style.coordinates(cell.coordinates, cell.spacing)
            names = (cell_entry(cell.cell, cell.cell_label), point_entry(cell.point, cell.point_label))
            rows.append([names[0], cell.type, (value, bad), str(cell.node), names[1], *place])
        table = notebook.table(head, rows, left=2) if rows else ""
        return notebook.block(repr(self).strip("<>"), notebook.Raw(self.summary()._repr_html_()), table)


def measure(
    mesh: Mesh,
    *,
    metrics: str | Metric | Iterable[str | Metric] = (),
    threads: int | None = None,
    purpose: Purpose | None = None,
    dimension: Literal[2, 3] | None = None,
    keep_bricks: bool = False,
    poor_below: float | Mapping[str, float] | PoorBelow | None = None,
) -> Quality:
    """Measure every cell of a mesh.

    Parameters
    ----------
    mesh
        From `meshgauge.read`, `meshgauge.from_pyvista`, `meshgauge.from_meshio` or `Mesh.from_arrays`.
    metrics
        What to measure beside ``"jens"``: a name or several (`meshgauge.METRICS` lists them), or a `Metric` of one's
        own.
    threads
        At most this many; None: one for each processor. It has no influence on the values.
    purpose
        What the mesh is for: "fem" or "fv", to which a concave, star-shaped cell is of use. None: ``mesh.purpose``.
    dimension
        3 to measure the solid cells, 2 the surface cells. None: ``mesh.dimension``, 3 where there are solid cells.
    keep_bricks
        Measure cells with repeated nodes as they are, not as the tetra, pyramid or wedge that they stand for.
    poor_below
        Valid cells of less J_ENS are poor: a number, or numbers by shape (``{"tetra": 0.25, "all": 0.3}``). None: 0.2.

    Returns
    -------
    Quality
        J_ENS in [-1, 1] (1 is best) and a status for each cell, and the other metrics.

    Raises
    ------
    MetricError
        If there is no such metric, two have one name, or the function of one returns no array of ``(n_cells,)``.
    MeshError
        If there is no such purpose or dimension.
    OptionError
        If there is less than one thread, or no such limit or shape.

    Notes
    -----
    J_ENS is that of C. Lobos, "Towards a unified measurement of quality for mixed-elements", section 4; of polyhedra,
    which the report leaves open, docs/definition.md says what is measured.
    """
    thread_count(threads)  # a wrong number is refused, also where there is nothing to measure
    mesh = expect(mesh, Mesh).as_measured(dimension)
    if purpose is not None and purpose != mesh.purpose:
        mesh = mesh.replace(purpose=purpose)
    rows = poor.rows_of(metrics, poor.checked(poor_below))
    return with_neighbours(measure_part(mesh, rows, threads=threads, keep_bricks=keep_bricks), threads)


def measure_part(
    mesh: Mesh,
    rows: Mapping[str, Metric],
    *,
    threads: int | None = None,
    keep_bricks: bool = False,
    n_deciding: int | None = None,
    beyond: Callable[[NDArray[np.int64]], NDArray[np.int64]] | None = None,
    with_companions: bool = False,
) -> Quality:
    """Measure a mesh, or a part of one to the last bit as if it were measured with the whole.

    Parameters
    ----------
    mesh
        What is measured.
    rows
        J_ENS and other metrics, by name.
    threads, keep_bricks
        As for `measure`.
    n_deciding
        Measured cells of the whole mesh, which decide whether kernels are taken, see `kernels.path`; None: of this one.
    beyond
        What lies beyond faces of polyhedra in the whole mesh, see `measure_polyhedra`; None: `mesh.beyond` of this one.
    with_companions
        `quality.companions` of it will be asked for: they are told in passing, where that is possible.
    """
    n = evaluate.n_deciding(mesh) if n_deciding is None else n_deciding
    quality = replace(_measure_all(mesh, rows, threads, n, beyond, with_companions), n_deciding=n_deciding)
    if keep_bricks or mesh.dimension == 2:
        return quality
    return with_collapsed(quality, lambda part: _measure_all(part, rows, threads, n, None, with_companions))


def _measure_all(
    mesh: Mesh,
    rows: Mapping[str, Metric],
    threads: int | None,
    n: int,
    beyond_faces: Callable[[NDArray[np.int64]], NDArray[np.int64]] | None,
    with_companions: bool,
) -> Quality:
    """Every cell as it is; ``n``: see `evaluate.n_deciding`."""
    values = {name: np.full(mesh.n_cells, np.nan) for name in rows}
    others = [row for name, row in rows.items() if name != JENS and row.of_faces is None]
    status = np.full(mesh.n_cells, Status.NOT_SOLID if mesh.dimension == 3 else Status.NOT_SURFACE, np.uint8)
    polyhedra: PolyhedralQuality | None = None
    measured: list[tuple[CellType, CellIds]] = []
    whole, mesh = mesh, without_ghosts(mesh)
    for row, _, cells in mesh.groups():
        if row is None or row.dimension == mesh.dimension:
            status[cells] = Status.UNSUPPORTED
        if row is POLYHEDRON and mesh.polyhedra is not None:
            given = evaluate.polyhedral_cells(mesh, mesh.polyhedra, cells, threads, beyond_faces)
            polyhedra = given.quality
            status[cells] = polyhedra.status
            for one in rows.values():
                if one.polyhedra is not None:
                    values[one.name][cells] = evaluate.of_polyhedra(one, given, threads)
        if row is not None and row.shape is not None:
            measured.append((row, cells))
            for one in others:
                if one.is_defined_for(row.shape.name):
                    evaluate.of_cells(one, mesh, row, cells, n, values[one.name], threads)
    beside = evaluate.Beside(*np.empty((2, mesh.n_cells))) if with_companions else None
    evaluate.jens(mesh, measured, n, values[JENS], status, threads, beside)
    if mesh.purpose == "fv" and mesh.dimension == 3:
        from .concave import mark_concave

        mark_concave(mesh, status, polyhedra)
    interface = is_interface(mesh)
    if interface is not None:
        status[interface] = Status.UNSUPPORTED
        values[JENS][interface] = np.nan
    for one in others:
        values[one.name][is_unmeasured(status)] = np.nan
    if whole.is_ghost is not None:
        status[whole.is_ghost] = Status.GHOST
    return Quality(
        mesh=whole,
        values=frozen(values[JENS]),
        status=frozen(status),
        metrics=MappingProxyType({name: frozen(array) for name, array in values.items()}),
        polyhedra=polyhedra,
        beside=beside,
        rows=MappingProxyType(rows),
    )
