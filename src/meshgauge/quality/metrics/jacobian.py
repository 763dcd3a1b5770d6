"""The report's two corner metrics: rows; the kernels compute their values."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

from ...cells import SHAPES
from ...look.bands import POOR, PoorBelow
from ...surface_cells import SURFACE_SHAPES
from .inputs import Cells, PolyhedralCells
from .row import Metric, Standard, Values

REPORT = (
    "C. Lobos, Towards a unified measurement of quality for mixed-elements, technical report, UTFSM, Santiago, Chile"
)


def _jens_of_polyhedra(cells: PolyhedralCells) -> Values:
    return cells.quality.values


JENS = Metric(
    name="jens",
    values=Cells.jens,
    polyhedra=_jens_of_polyhedra,
    is_signed=True,
    title="J_ENS, element normalized scaled Jacobian",
    text="1 only if every corner has the scaled Jacobian of the ideal cell, below 0 if a corner is inverted, "
    "0 if one is flat; the cell takes the worst corner, or the mildest negative one. Blind to stretching along edges.",
    range=(-1.0, 1.0),
    acceptable=(POOR, 1.0),
    ideal=1.0,
    better="higher",
    source="meshgauge",
    reference=f"{REPORT}, section 4",
    where=("cell", "node"),
)
SCALED_JACOBIAN = Metric(
    name="scaled_jacobian",
    values=Cells.scaled_jacobian,
    is_signed=True,
    title="J_S, scaled Jacobian",
    text="Determinant of the unit edge vectors at a corner; the cell takes the smallest, or the mildest negative one. "
    "The ideal cell has k, which depends on the shape, so that types cannot be compared by it.",
    range=(-1.0, 1.0),
    acceptable=(POOR, 1.0),
    ideal=1.0,
    better="higher",
    source="meshgauge",
    reference=f"{REPORT}, section 2; P. Knupp, Int. J. Numer. Meth. Engng 48 (2000) 1165-1185",
    where=("cell", "node"),
    # J_S = POOR k is J_ENS = POOR.
    per_shape=MappingProxyType(
        {s.name: Standard(s.k, (POOR * s.k, 1.0)) for s in (*SHAPES.values(), *SURFACE_SHAPES.values())}
    ),
)


def jens_row(poor_below: PoorBelow) -> Metric:
    """The row of J_ENS with limits of one's own."""
    if poor_below == PoorBelow():
        return JENS
    own = {name: Standard(1.0, (limit, 1.0)) for name, limit in poor_below.of_shapes}
    return replace(JENS, acceptable=(poor_below.all, 1.0), per_shape=MappingProxyType(own))


ROWS = (JENS, SCALED_JACOBIAN)
