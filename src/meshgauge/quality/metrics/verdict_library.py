"""Measures of the Verdict library, asked through VTK's ``vtkMeshQuality`` rather than written again.

Verdict knows tetra, pyramid, wedge, hexahedron, triangle and quad; other cells of those shapes (voxels, quadratic
cells) are measured at their corners. It does not see which way a surface cell runs. What it scores wrongly becomes NaN,
as the row's ``masked`` says:

- 1e30 and -1e30, its mark for a division by zero, a flat cell or an inverted one;
- any cell with a NaN or infinite coordinate: Verdict's comparisons skip NaN, so that a hexahedron with a NaN corner has
  Jacobian 1;
- the pyramid's scaled Jacobian of 0, which stands for flat, for inverted and for tangled cells alike;
- angles and stretches of a cell with an edge of length 0: its equiangle skew can be 0, as if it were ideal.

Left out are: relative size, shape-and-size and shear-and-size (they depend on the whole mesh), the distortion of
linear tetrahedra and triangles (1 for every cell) and of wedges (from -56 to 13 on valid cells), the edge ratio of
hexahedra (VTK 9.7 passes over three of the twelve edges), and the radius ratio of quadrilaterals (below 1 where they
are warped).

Verdict takes lengths below about 1e-15 for zero (below 1e-8 in Oddy and in the shape of pyramids), so a mesh in small
or large units is scaled by a power of two first. Its wedge has the normal of (0, 1, 2) pointing to (3, 4, 5), as
ours; the VTK at hand is asked once which way it is. The condition of wedges rounds a constant: the ideal wedge has
1.0000034. Its warpage of quadrilaterals is that of the manual (0: plane) or 1 less that, as in VTK 9.7; the VTK at hand
is asked once.

Ranges are those of C. J. Stimpson et al., The Verdict Geometric Quality Library; the manual gives none for some
measures of wedges and pyramids, which then have those of the hexahedron and the tetrahedron. Of the measures younger
than the manual, inradii and the mean ratio have Cubit's ranges, skews and the squish index end at 0.8, where meshes for
finite volumes are usually called poor, and the nodal Jacobian ratio has that of the distortion.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from math import acos, degrees, inf, sqrt
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...cells import BY_NAME, CELL_TYPES, WEDGE, type_name
from ...errors import MetricError
from ...look.names import meant_or_known
from ...surface_cells import QUAD, SURFACE_TYPES
from .inputs import Cells
from .row import Interval, Metric, Standard

PREFIX = "verdict_"

_REFERENCE = (
    "C. J. Stimpson, C. D. Ernst, P. Knupp, P. P. Pébay, D. Thompson, The Verdict Geometric Quality Library, "
    "SAND2007-1751, Sandia National Laboratories, 2007, https://github.com/sandialabs/verdict"
)
_VTK_NAMES = {5: "Triangle", 9: "Quad", 10: "Tet", 12: "Hex", 13: "Wedge", 14: "Pyramid"}
"""What ``vtkMeshQuality`` calls the types, by VTK id."""

_LARGEST = 1e29
"""Verdict's 1e30 is a mark, not a value; pyramids have -1.4e30, so that a margin is needed."""

_HUGE = "1e30: a flat, inverted or zero-sized cell"
_ZERO_EDGE = "any value of a cell with an edge of length 0"
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
    unit: str = "1"
    masked: tuple[str, ...] = ()
    is_signed: bool = False


_MEASURES = (
    _Measure(
        "area", "area", f"area; {_BLIND}",
        _POSITIVE, "higher", {"triangle": (sqrt(3) / 4, (0.0, inf)), "quad": (1.0, (0.0, inf))}, "length²",
    ),
    _Measure(
        "aspect_frobenius", "aspect Frobenius",
        f"Frobenius condition of the corner matrix against that of the ideal cell; {_BLIND}",
        _RATIO, "lower", {"tetra": (1.0, (1.0, 1.3)), "triangle": (1.0, (1.0, 1.3))}, masked=(_HUGE,),
    ),
    _Measure(
        "aspect_gamma", "aspect gamma", f"|ARG|: cube of the root mean square edge over the volume; {_BLIND}",
        _RATIO, "lower", {"tetra": (1.0, (1.0, 3.0))}, masked=(_HUGE,),
    ),
    _Measure(
        "aspect_ratio", "aspect ratio",
        "longest edge over the radius of the inscribed sphere or circle, 1 for the ideal cell; of a quadrilateral the "
        f"longest edge times the sum of all over four times the area; {_BLIND}",
        _RATIO, "lower",
        {"tetra": (1.0, (1.0, 3.0)), "triangle": (1.0, (1.0, 1.3)), "quad": (1.0, (1.0, 1.3))}, masked=(_HUGE,),
    ),
    _Measure(
        "collapse_ratio", "collapse ratio",
        "smallest height over the longest edge of the face below; negative if inverted",
        _ANY, "higher", {"tetra": (sqrt(6) / 3, (0.1, inf))}, masked=(_HUGE,), is_signed=True,
    ),
    _Measure(
        "condition", "condition number",
        "largest condition number of the corner matrices; negative for inverted tetrahedra, undefined for "
        "inverted hexahedra and concave quadrilaterals, blind to inverted wedges",
        _ANY, "lower",
        {"tetra": (1.0, (1.0, 3.0)), "wedge": (1.0, (1.0, 4.0)), "hexahedron": (1.0, (1.0, 4.0)),
         "triangle": (1.0, (1.0, 1.3)), "quad": (1.0, (1.0, 4.0))},
        masked=(_HUGE,), is_signed=True,
    ),
    _Measure(
        "diagonal", "diagonal ratio", f"shortest over longest diagonal; {_BLIND}",
        _UNIT, "higher", {"hexahedron": (1.0, (0.65, 1.0))}, masked=(_HUGE,),
    ),
    _Measure(
        "dimension", "dimension", f"characteristic length for a stable time step; {_BLIND}",
        _POSITIVE, "higher", {"hexahedron": (sqrt(3) / 3, (0.0, inf))}, "length",
    ),
    _Measure(
        "distortion", "distortion", f"smallest Jacobian over the mean one; {_BLIND}",
        _ANY, "higher", {"hexahedron": (1.0, (0.5, 1.0)), "quad": (1.0, (0.5, 1.0))}, masked=(_HUGE,), is_signed=True,
    ),
    _Measure(
        "edge_ratio", "edge ratio", f"longest over shortest edge; {_BLIND}",
        _RATIO, "lower",
        {"tetra": (1.0, (1.0, 3.0)), "wedge": (1.0, (1.0, 3.0)), "triangle": (1.0, (1.0, 1.3)),
         "quad": (1.0, (1.0, 1.3))}, masked=(_HUGE,),
    ),
    _Measure(
        "equiangle_skew", "equiangle skew",
        "largest deviation of a face's angle (of tetrahedra also of a dihedral one) from the ideal angle, over the "
        f"most that there can be; above 1 where a quadrilateral is concave; {_BLIND}",
        (0.0, 3.0), "lower",
        {"tetra": (0.0, (0.0, 0.8)), "pyramid": (0.0, (0.0, 0.8)), "wedge": (0.0, (0.0, 0.8)),
         "hexahedron": (0.0, (0.0, 0.8)), "triangle": (0.0, (0.0, 0.8)), "quad": (0.0, (0.0, 0.8))},
        masked=(_HUGE, _ZERO_EDGE),
    ),
    _Measure(
        "equivolume_skew", "equivolume skew",
        f"by how much the volume is less than that of the regular tetrahedron of the same circumsphere; {_BLIND}",
        _UNIT, "lower", {"tetra": (0.0, (0.0, 0.8))}, masked=(_HUGE,),
    ),
    _Measure(
        "inradius", "inradius", "radius of the inscribed sphere; negative if inverted",
        _ANY, "higher", {"tetra": (sqrt(6) / 12, (0.0, inf))}, "length", masked=(_HUGE,), is_signed=True,
    ),
    _Measure(
        "jacobian", "Jacobian",
        "smallest determinant of the edges at a corner (of a hexahedron also at its centre; of a quadrilateral, in "
        "length²); negative if inverted or concave",
        _ANY, "higher",
        {"tetra": (sqrt(0.5), (0.0, inf)), "pyramid": (sqrt(0.5), (0.0, inf)), "wedge": (sqrt(0.75), (0.0, inf)),
         "hexahedron": (1.0, (0.0, inf)), "quad": (1.0, (0.0, inf))}, "length³", is_signed=True,
    ),
    _Measure(
        "max_angle", "largest angle", f"largest angle between two edges; {_BLIND}",
        (0.0, 360.0), "lower", {"triangle": (60.0, (60.0, 90.0)), "quad": (90.0, (90.0, 135.0))},
        unit="degree", masked=(_HUGE, _ZERO_EDGE),
    ),
    _Measure(
        "max_aspect_frobenius", "largest aspect Frobenius",
        "largest Frobenius condition at a corner; undefined for inverted hexahedra, blind to others that are",
        _RATIO, "lower",
        {"wedge": (1.0, (1.0, 3.0)), "hexahedron": (1.0, (1.0, 3.0)), "quad": (1.0, (1.0, 1.3))}, masked=(_HUGE,),
    ),
    _Measure(
        "max_edge_ratio", "largest edge ratio", f"largest ratio of the principal axes; {_BLIND}",
        _RATIO, "lower", {"hexahedron": (1.0, (1.0, 1.3)), "quad": (1.0, (1.0, 1.3))}, masked=(_HUGE,),
    ),
    _Measure(
        "max_stretch", "largest stretch",
        f"largest stretch of the quadrilateral faces: √2 times the shortest edge over the longest diagonal; {_BLIND}",
        _POSITIVE, "higher", {"wedge": (1.0, (0.25, inf))}, masked=(_HUGE, _ZERO_EDGE),
    ),
    _Measure(
        "mean_aspect_frobenius", "mean aspect Frobenius",
        f"mean aspect Frobenius of the corner tetrahedra, over that of the ideal wedge; {_BLIND}",
        _RATIO, "lower", {"wedge": (1.0, (1.0, 3.0))}, masked=(_HUGE,),
    ),
    _Measure(
        "mean_ratio", "mean ratio",
        "ARG_S: volume over that of the regular tetrahedron of the same root mean square edge; negative if inverted",
        (-1.0, 1.0), "higher", {"tetra": (1.0, (0.2, 1.0))}, masked=(_HUGE,), is_signed=True,
    ),
    _Measure(
        "med_aspect_frobenius", "mean aspect Frobenius",
        "mean Frobenius condition of the corner matrices; undefined for inverted hexahedra",
        _RATIO, "lower", {"hexahedron": (1.0, (1.0, 3.0)), "quad": (1.0, (1.0, 1.3))}, masked=(_HUGE,),
    ),
    _Measure(
        "min_angle", "smallest angle",
        f"smallest angle between two faces, of a surface cell between two edges; {_BLIND}",
        (0.0, 180.0), "higher",
        {"tetra": (degrees(acos(1 / 3)), (40.0, degrees(acos(1 / 3)))), "triangle": (60.0, (30.0, 60.0)),
         "quad": (90.0, (45.0, 90.0))},
        unit="degree", masked=(_HUGE, _ZERO_EDGE),
    ),
    _Measure(
        "nodal_jacobian_ratio", "nodal Jacobian ratio",
        "smallest over largest determinant of the edges at a corner; negative if some corner is inverted, undefined if "
        "all are",
        (-inf, 1.0), "higher", {"hexahedron": (1.0, (0.5, 1.0))}, masked=(_HUGE,), is_signed=True,
    ),
    _Measure(
        "normalized_inradius", "normalized inradius",
        "smallest inradius of the tetrahedra that the edges' midpoints cut it into, over the circumscribed sphere's "
        "radius, 1 for the regular one; negative if inverted; of a triangle, of its circles",
        (-inf, 1.0), "higher", {"tetra": (1.0, (0.15, 1.0)), "triangle": (1.0, (0.15, 1.0))},
        masked=(_HUGE,), is_signed=True,
    ),
    _Measure(
        "oddy", "Oddy",
        "largest deviation of the metric tensor from a cube's or square's; undefined for inverted solids",
        _POSITIVE, "lower", {"hexahedron": (0.0, (0.0, 0.5)), "quad": (0.0, (0.0, 0.5))}, masked=(_HUGE,),
    ),
    _Measure(
        "radius_ratio", "radius ratio",
        "radius of the circumscribed sphere over three times that of the inscribed one, of circles over twice; "
        f"{_BLIND}",
        _RATIO, "lower", {"tetra": (1.0, (1.0, 3.0)), "triangle": (1.0, (1.0, 3.0))}, masked=(_HUGE,),
    ),
    _Measure(
        "scaled_jacobian", "scaled Jacobian",
        "smallest J_S/k of the corners (of a hexahedron also of the centre; of a pyramid, of tetrahedra cut from it)",
        (-2 / sqrt(3), 1.0), "higher",
        {"tetra": (1.0, (0.5, 1.0)), "pyramid": (1.0, (0.5, 1.0)), "wedge": (1.0, (0.5, 1.0)),
         "hexahedron": (1.0, (0.5, 1.0)), "triangle": (1.0, (0.5, 1.0)), "quad": (1.0, (0.3, 1.0))},
        masked=(_HUGE, "0 of a pyramid: flat, inverted and tangled are not told apart"), is_signed=True,
    ),
    _Measure(
        "shape", "shape",
        f"inverse of the mean ratio, 1 for the ideal cell; {_SHAPE_TEXT} (but for some tangled pyramids)",
        _UNIT, "higher",
        {"tetra": (1.0, (0.3, 1.0)), "pyramid": (1.0, (0.3, 1.0)), "wedge": (1.0, (0.3, 1.0)),
         "hexahedron": (1.0, (0.3, 1.0)), "triangle": (1.0, (0.25, 1.0)), "quad": (1.0, (0.3, 1.0))},
        masked=(_HUGE,),
    ),
    _Measure(
        "shear", "shear", f"like shape, but 1 for every box and rectangle; {_SHAPE_TEXT}",
        _UNIT, "higher", {"hexahedron": (1.0, (0.3, 1.0)), "quad": (1.0, (0.3, 1.0))},
    ),
    _Measure(
        "skew", "skew", f"largest cosine between two principal axes; {_BLIND}",
        _UNIT, "lower", {"hexahedron": (0.0, (0.0, 0.5)), "quad": (0.0, (0.0, 0.5))}, masked=(_HUGE,),
    ),
    _Measure(
        "squish_index", "squish index",
        "1 less the cosine between a face's normal and the way from the cell's centre to the face's, the largest; "
        "above 1 if inverted",
        (0.0, 2.0), "lower", {"tetra": (0.0, (0.0, 0.8))}, masked=(_HUGE, _ZERO_EDGE),
    ),
    _Measure(
        "stretch", "stretch",
        f"√3 (of a quadrilateral √2) times the shortest edge over the longest diagonal; {_BLIND}",
        _POSITIVE, "higher", {"hexahedron": (1.0, (0.25, 1.0)), "quad": (1.0, (0.25, 1.0))}, masked=(_HUGE,),
    ),
    _Measure(
        "taper", "taper", f"largest cross derivative over the principal axes; {_BLIND}",
        _POSITIVE, "lower", {"hexahedron": (0.0, (0.0, 0.5)), "quad": (0.0, (0.0, 0.7))}, masked=(_HUGE,),
    ),
    _Measure(
        "volume", "volume", "signed volume",
        _ANY, "higher",
        {"tetra": (sqrt(2) / 12, (0.0, inf)), "pyramid": (sqrt(2) / 6, (0.0, inf)), "wedge": (sqrt(3) / 4, (0.0, inf)),
         "hexahedron": (1.0, (0.0, inf))}, "length³", is_signed=True,
    ),
    _Measure(
        "warpage", "warpage", "1 less the least cube of the cosine between the normals at opposite corners; 0 if plane",
        (0.0, 2.0), "lower", {"quad": (0.0, (0.0, 0.7))}, masked=(_ZERO_EDGE,),
    ),
)  # fmt: skip


def _row(m: _Measure) -> Metric:
    ideal, acceptable = next(iter(m.standards.values()))
    return Metric(
        name=PREFIX + m.name,
        values=_values(m.name),
        title=f"Verdict {m.title}",
        text=f"{m.text[0].upper()}{m.text[1:]}.",
        range=m.range,
        acceptable=acceptable,
        ideal=ideal,
        better=m.better,
        is_signed=m.is_signed,
        source="verdict",
        reference=_REFERENCE,
        shapes=tuple(m.standards),
        unit=m.unit,
        masked=(*m.masked, _NON_FINITE),
        per_shape=MappingProxyType({name: Standard(*standard) for name, standard in m.standards.items()}),
        in_slices=False,  # VTK has threads of its own, and a slice might be scaled by another power of two
    )


def _values(measure: str) -> Callable[[Cells], NDArray[np.float64]]:
    def values(cells: Cells) -> NDArray[np.float64]:
        return verdict_quality(cells.points, cells.corners, BY_NAME[cells.shape.name].vtk_id, measure)

    return values


ROWS = tuple(_row(m) for m in _MEASURES)
_BY_NAME = {row.name.removeprefix(PREFIX): row for row in ROWS}


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
    name = measure.removeprefix(PREFIX)
    asked = _BY_NAME.get(name)
    if asked is None:
        raise MetricError(f"no Verdict measure {measure!r}{meant_or_known(measure, _BY_NAME)}")
    row = CELL_TYPES.get(int(vtk_id))
    if row is not None and row.dimension == 2:
        row = SURFACE_TYPES[row.vtk_id]
    if row is None or row.shape is None or not asked.is_defined_for(row.shape.name):
        raise MetricError(
            f"Verdict measure {name} is not defined for {type_name(vtk_id)}; it is for {asked.cell_types}"
        )
    shape = row.shape.name
    cells = np.asarray(connectivity)
    corners: tuple[int, ...] = row.corners
    if row.shape.other_order and _wedge_is_legacy():
        corners = corners[3:] + corners[:3]
    if corners != tuple(range(cells.shape[1])):
        cells = cells[:, corners]
    if len(cells) == 0:
        return np.empty(0, np.float64)
    points, exponent = _in_range(np.asarray(points), cells)
    values = _ask(points, np.ascontiguousarray(cells), BY_NAME[shape].vtk_id, name)
    values[~(np.abs(values) < _LARGEST)] = np.nan
    if name == "scaled_jacobian" and row.shape.is_collapsed:
        values[values == 0.0] = np.nan
    if _ZERO_EDGE in asked.masked:
        for a, b in row.shape.edges:  # the wedge's edges are those of both orders of its nodes
            values[(points[cells[:, a]] == points[cells[:, b]]).all(axis=1)] = np.nan
    finite = np.isfinite(points).all(axis=1)
    if not finite.all():
        values[~finite[cells].all(axis=1)] = np.nan
    if name == "warpage" and _warpage_of_plane() > 0.5:
        values = 1.0 - values
    power = min(asked.length_power, row.shape.dimension)  # the Jacobian of a quadrilateral is an area
    if exponent and power:
        with np.errstate(over="ignore"):
            values = np.ldexp(values, exponent * power)
    return values


def _ask(
    points: NDArray[np.floating], cells: NDArray[np.signedinteger], vtk_id: int, measure: str
) -> NDArray[np.float64]:
    """The values of ``vtkMeshQuality`` as they are, on a grid that borrows the arrays."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkUnstructuredGrid
    from vtkmodules.vtkFiltersVerdict import vtkMeshQuality

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
    quality = vtkMeshQuality()
    quality.SetInputData(grid)
    setter = f"Set{_VTK_NAMES[vtk_id]}QualityMeasureTo{measure.title().replace('_', '')}"
    if not hasattr(quality, setter):
        raise MetricError(f"the VTK at hand has no measure {measure} of cells of type {type_name(vtk_id)}")
    getattr(quality, setter)()
    quality.Update()
    return np.array(vtk_to_numpy(quality.GetOutput().GetCellData().GetArray("Quality")), np.float64)


@cache
def _wedge_is_legacy() -> bool:
    """True if the VTK at hand has the wedge's normal of (0, 1, 2) pointing away from (3, 4, 5)."""
    points = np.array(WEDGE.points)
    return bool(_ask(points, np.arange(6)[None], BY_NAME[WEDGE.name].vtk_id, "volume")[0] < 0)


@cache
def _warpage_of_plane() -> float:
    """What the VTK at hand calls the warpage of a square."""
    return float(_ask(np.array(QUAD.points), np.arange(4)[None], BY_NAME[QUAD.name].vtk_id, "warpage")[0])


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
