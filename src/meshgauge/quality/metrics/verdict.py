"""Measures of the Verdict library, asked through VTK's ``vtkCellQuality`` rather than written again.

Verdict knows tetra, pyramid, wedge and hexahedron; other cells of those shapes (voxels, quadratic cells) are measured
at their corners. What it scores wrongly becomes NaN, as the row's ``masked`` says:

- 1e30 and -1e30, its mark for a division by zero, a flat cell or an inverted one;
- any cell with a NaN or infinite coordinate: Verdict's comparisons skip NaN, so that a hexahedron with a NaN corner has
  Jacobian 1;
- the pyramid's scaled Jacobian of 0, which stands for flat, for inverted and for tangled cells alike.

Left out are: relative size, shape-and-size and shear-and-size (they depend on the whole mesh), the distortion of
linear tetrahedra (1 for every cell) and of wedges (from -56 to 13 on valid cells).

Verdict takes lengths below about 1e-15 for zero (below 1e-8 in Oddy and in the shape of pyramids), so a mesh in small
or large units is scaled by a power of two first. Its wedge has the normal of (0, 1, 2) pointing to (3, 4, 5), as
ours; the VTK at hand is asked once which way it is. The condition of wedges rounds a constant: the ideal wedge has
1.0000034.

Ranges are those of C. J. Stimpson et al., The Verdict Geometric Quality Library; the manual gives none for some
measures of wedges and pyramids, which then have those of the hexahedron and the tetrahedron.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from math import acos, degrees, inf, sqrt
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...cells import BY_NAME, CELL_TYPES, WEDGE, type_name
from ...errors import MetricError
from .row import Interval, Metric, Standard

PREFIX = "verdict_"

_REFERENCE = (
    "C. J. Stimpson, C. D. Ernst, P. Knupp, P. P. Pébay, D. Thompson, The Verdict Geometric Quality Library, "
    "SAND2007-1751, Sandia National Laboratories, 2007, https://github.com/sandialabs/verdict"
)
_LARGEST = 1e29
"""Verdict's 1e30 is a mark, not a value; pyramids have -1.4e30, so that a margin is needed."""

_HUGE = "1e30: a flat, inverted or zero-sized cell"
_NON_FINITE = "any value of a cell with a NaN or infinite coordinate"
_POSITIVE: Interval = (0.0, inf)
_RATIO: Interval = (1.0, inf)
_UNIT: Interval = (0.0, 1.0)
_ANY: Interval = (-inf, inf)
_SHAPE_TEXT = "0 if flat or inverted"
_BLIND = "blind to inversion"


class _Measure(NamedTuple):
    name: str
    title: str
    text: str
    range: Interval
    better: Literal["higher", "lower"]
    standards: Mapping[str, tuple[float, Interval]]
    length_power: int = 0  #: the value scales with this power of length
    unit: str = "1"
    masked: tuple[str, ...] = ()


_MEASURES = (
    _Measure(
        "aspect_frobenius", "aspect Frobenius",
        f"Frobenius condition of the corner matrix against the regular tetrahedron; {_BLIND}",
        _RATIO, "lower", {"tetra": (1.0, (1.0, 1.3))}, masked=(_HUGE,),
    ),
    _Measure(
        "aspect_gamma", "aspect gamma", f"|ARG|: cube of the root mean square edge over the volume; {_BLIND}",
        _RATIO, "lower", {"tetra": (1.0, (1.0, 3.0))}, masked=(_HUGE,),
    ),
    _Measure(
        "aspect_ratio", "aspect ratio", f"longest edge over the inscribed sphere's radius, divided by 2√6; {_BLIND}",
        _RATIO, "lower", {"tetra": (1.0, (1.0, 3.0))}, masked=(_HUGE,),
    ),
    _Measure(
        "collapse_ratio", "collapse ratio",
        "smallest height over the longest edge of the face below; negative if inverted",
        _ANY, "higher", {"tetra": (sqrt(6) / 3, (0.1, inf))}, masked=(_HUGE,),
    ),
    _Measure(
        "condition", "condition number",
        "largest condition number of the corner matrices; negative for inverted tetrahedra, undefined for "
        "inverted hexahedra, blind to inverted wedges",
        _ANY, "lower",
        {"tetra": (1.0, (1.0, 3.0)), "wedge": (1.0, (1.0, 4.0)), "hexahedron": (1.0, (1.0, 4.0))}, masked=(_HUGE,),
    ),
    _Measure(
        "diagonal", "diagonal ratio", f"shortest over longest diagonal; {_BLIND}",
        _UNIT, "higher", {"hexahedron": (1.0, (0.65, 1.0))}, masked=(_HUGE,),
    ),
    _Measure(
        "dimension", "dimension", f"characteristic length for a stable time step; {_BLIND}",
        _POSITIVE, "higher", {"hexahedron": (sqrt(3) / 3, (0.0, inf))}, 1, "length",
    ),
    _Measure(
        "distortion", "distortion", f"smallest Jacobian over the mean one; {_BLIND}",
        _ANY, "higher", {"hexahedron": (1.0, (0.5, 1.0))}, masked=(_HUGE,),
    ),
    _Measure(
        "jacobian", "Jacobian",
        "smallest determinant of the edges at a corner (of a hexahedron also at its centre); negative if inverted",
        _ANY, "higher",
        {"tetra": (sqrt(0.5), (0.0, inf)), "pyramid": (sqrt(0.5), (0.0, inf)), "wedge": (sqrt(0.75), (0.0, inf)),
         "hexahedron": (1.0, (0.0, inf))}, 3, "length³",
    ),
    _Measure(
        "max_aspect_frobenius", "largest aspect Frobenius",
        "largest Frobenius condition at a corner; undefined for inverted hexahedra, blind to inverted wedges",
        _RATIO, "lower", {"wedge": (1.0, (1.0, 3.0)), "hexahedron": (1.0, (1.0, 3.0))}, masked=(_HUGE,),
    ),
    _Measure(
        "max_edge_ratio", "largest edge ratio", f"largest ratio of the principal axes; {_BLIND}",
        _RATIO, "lower", {"hexahedron": (1.0, (1.0, 1.3))}, masked=(_HUGE,),
    ),
    _Measure(
        "med_aspect_frobenius", "mean aspect Frobenius",
        "mean Frobenius condition of the corner matrices; undefined for inverted hexahedra",
        _RATIO, "lower", {"hexahedron": (1.0, (1.0, 3.0))}, masked=(_HUGE,),
    ),
    _Measure(
        "min_angle", "smallest dihedral angle", f"smallest angle between two faces; {_BLIND}",
        (0.0, 180.0), "higher", {"tetra": (degrees(acos(1 / 3)), (40.0, degrees(acos(1 / 3))))},
        unit="degree", masked=(_HUGE,),
    ),
    _Measure(
        "oddy", "Oddy", "largest deviation of the metric tensor from a cube's; undefined for inverted cells",
        _POSITIVE, "lower", {"hexahedron": (0.0, (0.0, 0.5))}, masked=(_HUGE,),
    ),
    _Measure(
        "radius_ratio", "radius ratio", f"circumscribed over three times the inscribed sphere's radius; {_BLIND}",
        _RATIO, "lower", {"tetra": (1.0, (1.0, 3.0))}, masked=(_HUGE,),
    ),
    _Measure(
        "scaled_jacobian", "scaled Jacobian",
        "smallest J_S/k of the corners (of a hexahedron also of the centre; of a pyramid, of tetrahedra cut from it)",
        (-2 / sqrt(3), 1.0), "higher",
        {"tetra": (1.0, (0.5, 1.0)), "pyramid": (1.0, (0.5, 1.0)), "wedge": (1.0, (0.5, 1.0)),
         "hexahedron": (1.0, (0.5, 1.0))},
        masked=(_HUGE, "0 of a pyramid: flat, inverted and tangled are not told apart"),
    ),
    _Measure(
        "shape", "shape",
        f"inverse of the mean ratio, 1 for the ideal cell; {_SHAPE_TEXT} (but for some tangled pyramids)",
        _UNIT, "higher",
        {"tetra": (1.0, (0.3, 1.0)), "pyramid": (1.0, (0.3, 1.0)), "wedge": (1.0, (0.3, 1.0)),
         "hexahedron": (1.0, (0.3, 1.0))}, masked=(_HUGE,),
    ),
    _Measure(
        "shear", "shear", f"like shape, but 1 for every box; {_SHAPE_TEXT}",
        _UNIT, "higher", {"hexahedron": (1.0, (0.3, 1.0))},
    ),
    _Measure(
        "skew", "skew", f"largest cosine between two principal axes; {_BLIND}",
        _UNIT, "lower", {"hexahedron": (0.0, (0.0, 0.5))}, masked=(_HUGE,),
    ),
    _Measure(
        "stretch", "stretch", f"√3 times the shortest edge over the longest diagonal; {_BLIND}",
        _POSITIVE, "higher", {"hexahedron": (1.0, (0.25, 1.0))}, masked=(_HUGE,),
    ),
    _Measure(
        "taper", "taper", f"largest cross derivative over the principal axes; {_BLIND}",
        _POSITIVE, "lower", {"hexahedron": (0.0, (0.0, 0.5))}, masked=(_HUGE,),
    ),
    _Measure(
        "volume", "volume", "signed volume",
        _ANY, "higher",
        {"tetra": (sqrt(2) / 12, (0.0, inf)), "pyramid": (sqrt(2) / 6, (0.0, inf)), "wedge": (sqrt(3) / 4, (0.0, inf)),
         "hexahedron": (1.0, (0.0, inf))}, 3, "length³",
    ),
)  # fmt: skip
_BY_NAME = {m.name: m for m in _MEASURES}


def _row(m: _Measure) -> Metric:
    ideal, acceptable = next(iter(m.standards.values()))
    return Metric(
        name=PREFIX + m.name,
        title=f"Verdict {m.title}",
        text=f"{m.text[0].upper()}{m.text[1:]}.",
        range=m.range,
        acceptable=acceptable,
        ideal=ideal,
        better=m.better,
        source="verdict",
        reference=_REFERENCE,
        shapes=tuple(m.standards),
        unit=m.unit,
        masked=(*m.masked, _NON_FINITE),
        per_shape=MappingProxyType({name: Standard(*standard) for name, standard in m.standards.items()}),
    )


ROWS = tuple(_row(m) for m in _MEASURES)


def verdict_quality(
    points: NDArray[np.floating], connectivity: NDArray[np.signedinteger], vtk_id: int, measure: str
) -> NDArray[np.float64]:
    """A measure of Verdict for cells of one type.

    Parameters
    ----------
    points
        ``(n_points, 3)`` float32 or float64, C-contiguous; not copied, unless in units far from the size of a cell.
    connectivity
        ``(n_cells, n_nodes)`` point ids, in range. Wedges have the normal of (0, 1, 2) pointing to (3, 4, 5).
    vtk_id
        A type whose shape Verdict knows; of a curved cell the corners are measured.
    measure
        Name of the measure, with or without ``verdict_``.

    Returns
    -------
    NDArray[np.float64]
        ``(n_cells,)``; NaN where Verdict has no value or a wrong one.

    Raises
    ------
    MetricError
        If there is no such measure, or not for this type.
    """
    asked = _BY_NAME.get(measure.removeprefix(PREFIX))
    if asked is None:
        raise MetricError(f"no Verdict measure {measure!r}; there are {', '.join(_BY_NAME)}")
    row = CELL_TYPES.get(int(vtk_id))
    if row is None or row.shape is None or row.shape.name not in asked.standards:
        known = ", ".join(asked.standards)
        raise MetricError(f"Verdict measure {asked.name} is not defined for {type_name(vtk_id)}; it is for {known}")
    shape = row.shape.name
    cells = np.asarray(connectivity)
    corners: tuple[int, ...] = row.corners
    if shape == WEDGE.name and _wedge_is_legacy():
        corners = corners[3:] + corners[:3]
    if corners != tuple(range(cells.shape[1])):
        cells = cells[:, corners]
    if len(cells) == 0:
        return np.empty(0, np.float64)
    points, exponent = _in_range(np.asarray(points), cells)
    values = _ask(points, np.ascontiguousarray(cells), BY_NAME[shape].vtk_id, asked.name)
    values[~(np.abs(values) < _LARGEST)] = np.nan
    if asked.name == "scaled_jacobian" and shape == "pyramid":
        values[values == 0.0] = np.nan
    finite = np.isfinite(points).all(axis=1)
    if not finite.all():
        values[~finite[cells].all(axis=1)] = np.nan
    if exponent and asked.length_power:
        with np.errstate(over="ignore"):
            values = np.ldexp(values, exponent * asked.length_power)
    return values


def _ask(
    points: NDArray[np.floating], cells: NDArray[np.signedinteger], vtk_id: int, measure: str
) -> NDArray[np.float64]:
    """The values of ``vtkCellQuality`` as they are, on a grid that borrows the arrays."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkUnstructuredGrid
    from vtkmodules.vtkFiltersVerdict import vtkCellQuality

    flat = cells.reshape(-1)
    borrowed: Any = (
        numpy_to_vtk(flat) if cells.dtype == np.int32 else numpy_to_vtkIdTypeArray(flat.astype(np.int64, copy=False))
    )
    positions = vtkPoints()
    positions.SetData(numpy_to_vtk(points))
    array = vtkCellArray()
    array.SetData(cells.shape[1], borrowed)
    grid = vtkUnstructuredGrid()
    grid.SetPoints(positions)
    grid.SetCells(vtk_id, array)
    quality = vtkCellQuality()
    quality.SetInputData(grid)
    quality.SetUndefinedQuality(np.nan)
    quality.SetUnsupportedGeometry(np.nan)
    getattr(quality, "SetQualityMeasureTo" + measure.title().replace("_", ""))()
    quality.Update()
    return np.array(vtk_to_numpy(quality.GetOutput().GetCellData().GetArray("CellQuality")), np.float64)


@cache
def _wedge_is_legacy() -> bool:
    """True if the VTK at hand has the wedge's normal of (0, 1, 2) pointing away from (3, 4, 5)."""
    points = np.array(WEDGE.points)
    return bool(_ask(points, np.arange(6)[None], BY_NAME["wedge"].vtk_id, "volume")[0] < 0)


def _in_range(points: NDArray[np.floating], cells: NDArray[np.signedinteger]) -> tuple[NDArray[np.floating], int]:
    """The points, scaled by ``2**-exponent`` if the cells are far from size 1, and the exponent (else 0)."""
    sample = np.asarray(points[cells[:: max(len(cells) // 1000, 1), :2]], np.float64)
    with np.errstate(over="ignore", invalid="ignore"):
        edges = np.abs(sample[:, 1] - sample[:, 0]).max(axis=1)
    edges = edges[np.isfinite(edges) & (edges > 0)]
    if len(edges) == 0 or 1e-3 < (size := float(np.median(edges))) < 1e3:
        return points, 0
    exponent = int(np.frexp(size)[1])
    with np.errstate(over="ignore", under="ignore"):
        return np.ldexp(np.asarray(points, np.float64), -exponent), exponent
