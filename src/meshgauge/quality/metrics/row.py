"""What is known about a metric, as one row: documentation, lists, report colours and tests read the same rows."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...cells import POLYHEDRON
from ...errors import MetricError
from ...surface_cells import ALL_SHAPES
from .inputs import Cells, PolyhedralCells

if TYPE_CHECKING:
    from ..faces import FaceQuality

Interval = tuple[float, float]
Values = NDArray[np.float64]

HOLDS = {">=": np.greater_equal, ">": np.greater, "<=": np.less_equal, "<": np.less}
"""What a comparison of a rule or a limit asks of values."""

_LENGTH_POWERS = {"length": 1, "length²": 2, "length³": 3}


class Standard(NamedTuple):
    """What a metric should be for one shape of cell."""

    ideal: float  #: value on the ideal cell, edges of length 1
    acceptable: Interval  #: well-behaved cells have values in this range, ends included


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Metric:
    """A row: one named function of a cell, and how to read its values.

    A metric of one's own needs `name`, `values` (or `of_faces`), `range`, `acceptable` and `better`;
    `meshgauge.measure` takes it as it takes a name.

    Raises
    ------
    MetricError
        If the name is no identifier, the acceptable range is not within the range, or it has no function or two.

    Examples
    --------
    >>> import meshgauge
    >>> def longest_edge(cells):
    ...     a, b = zip(*cells.shape.edges)
    ...     x = cells.coordinates
    ...     return ((x[:, a] - x[:, b]) ** 2).sum(axis=2).max(axis=1) ** 0.5
    >>> own = meshgauge.Metric(
    ...     name="longest_edge",
    ...     values=longest_edge,
    ...     range=(0, float("inf")),
    ...     acceptable=(0, 2),
    ...     better="lower",
    ...     unit="length",
    ... )
    >>> mesh = meshgauge.Mesh.from_arrays([(0, 0, 0), (3, 0, 0), (0, 1, 0), (0, 0, 1)], {"tetra": [(0, 1, 2, 3)]})
    >>> meshgauge.measure(mesh, metrics=own).values_of("longest_edge").round(3)
    array([3.162])
    """

    name: str
    values: Callable[[Cells], ArrayLike] | None = field(default=None, repr=False)
    """``(n_cells,)`` values of some cells of one type, NaN where undefined. It is called with slices of them, from
    several threads, and first with one cell alone, so that what it compiles is compiled once. None: `of_faces` is."""
    range: Interval  #: every value, of valid and of invalid cells, is in this range or NaN
    acceptable: Interval  #: usual acceptable range; `standard` gives that of a shape
    better: Literal["higher", "lower"]
    ideal: float = math.nan  #: usual value on the ideal cell, edges of length 1; `standard` gives that of a shape
    is_signed: bool = False  #: only invalid cells have values below 0: none of those is good
    title: str = ""
    text: str = ""  #: one line: what it is, which cells it cannot tell apart
    source: Literal["meshgauge", "verdict", "user"] = "user"
    reference: str = ""
    where: tuple[Literal["cell", "node", "face"], ...] = ("cell",)
    shapes: tuple[str, ...] | None = None  #: names of the shapes it is defined for; None: every measured shape
    polyhedra: Callable[[PolyhedralCells], ArrayLike] | None = field(default=None, repr=False)
    """As `values`, for polyhedra; None: it is not defined for them."""
    of_faces: Callable[[FaceQuality], ArrayLike] | None = field(default=None, repr=False)
    """``(n_cells,)`` values of all cells of a mesh, from their faces and neighbours, instead of `values`."""
    unit: str = "1"
    masked: tuple[str, ...] = ()  #: values of the source that are wrong and become NaN, a phrase each
    per_shape: Mapping[str, Standard] = field(default_factory=lambda: MappingProxyType({}), repr=False)
    in_slices: bool = True  #: False: `values` takes all cells of a type in one call, on the calling thread

    def __post_init__(self) -> None:
        if not self.name.isidentifier():
            raise MetricError(f"a metric is named {self.name!r}, expected an identifier such as 'edge_length'")
        if (self.values is None) == (self.of_faces is None):
            raise MetricError(f"metric {self.name}: give one of values and of_faces, its function")
        for ends in (self.acceptable, *(standard.acceptable for standard in self.per_shape.values())):
            if not self.range[0] <= ends[0] <= ends[1] <= self.range[1]:
                raise MetricError(f"metric {self.name}: acceptable is {ends}, expected ascending, within {self.range}")

    @property
    def flat(self) -> float:
        """The value of a flat cell: 0, infinite where lower is better; the least possible if that is below 0 and says
        nothing of validity."""
        if self.better == "lower":
            return math.inf
        return 0.0 if self.is_signed else self.range[0]

    @property
    def length_power(self) -> int:
        """The value scales with this power of the unit of length."""
        return _LENGTH_POWERS.get(self.unit, 0)

    @property
    def cell_types(self) -> str:
        """The shapes it is defined for, as text."""
        if self.shapes is None:
            return "all" if len(self._defined_shapes()) > len(ALL_SHAPES) else "all but polyhedra"
        return ", ".join(self._defined_shapes())

    @property
    def known_shapes(self) -> tuple[str, ...]:
        """Names of the shapes it is defined for, but for polyhedra: `shapes`, or all."""
        return ALL_SHAPES if self.shapes is None else self.shapes

    def is_defined_for(self, shape: str) -> bool:
        """True if cells of this shape (``"tetra"``, ``"wedge"``, ..., ``"polyhedron"``) can have a value."""
        return shape in self._defined_shapes()

    def standard(self, shape: str) -> Standard:
        """Ideal value and acceptable range for a shape.

        Raises
        ------
        MetricError
            If the metric is not defined for the shape.
        """
        if not self.is_defined_for(shape):
            known = ", ".join(self._defined_shapes())
            raise MetricError(f"metric {self.name} is not defined for {shape!r}; it is for {known}")
        return self.per_shape.get(shape, Standard(self.ideal, self.acceptable))

    def of_cells(self, cells: Cells) -> Values:
        """`values`, checked: ``(n_cells,)`` float64.

        Raises
        ------
        MetricError
            If the function returns anything else.
        """
        assert self.values is not None
        return self._check_values(self.values(cells), cells.n_cells)

    def of_polyhedra(self, cells: PolyhedralCells) -> Values:
        """`polyhedra`, checked as by `of_cells`; the metric must have it."""
        assert self.polyhedra is not None
        return self._check_values(self.polyhedra(cells), cells.n_cells)

    def of_mesh(self, faces: FaceQuality) -> Values:
        """`of_faces`, checked as by `of_cells`; the metric must have it."""
        assert self.of_faces is not None
        return self._check_values(self.of_faces(faces), faces.mesh.n_cells)

    def _check_values(self, values: Any, n_cells: int) -> Values:
        try:
            array = np.asarray(values, np.float64)
        except (TypeError, ValueError) as error:
            raise MetricError(f"metric {self.name}: its function returned no array of numbers: {error}") from error
        if array.shape != (n_cells,):
            raise MetricError(
                f"metric {self.name}: its function returned an array of shape {array.shape} for {n_cells} cells, "
                f"expected ({n_cells},)"
            )
        return array

    def _defined_shapes(self) -> tuple[str, ...]:
        of_polyhedra = (POLYHEDRON.name,) if self.polyhedra is not None or self.of_faces is not None else ()
        return (*self.known_shapes, *of_polyhedra)
