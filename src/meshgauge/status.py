"""What a cell is, one row a status. A cell has exactly one.

What is invalid, degenerate, undecided, measured or solid is defined here and nowhere else, as masks over status codes.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

Purpose = Literal["fem", "fv"]
"""What a mesh is for: finite elements or finite volumes. To finite volumes a concave, star-shaped cell is of use."""

PURPOSES: tuple[Purpose, ...] = get_args(Purpose)


class Status(IntEnum):
    """Code of a cell's status, as stored in `Quality.status` (uint8)."""

    OK = 0
    INVERTED = 1
    DEGENERATE = 2
    NON_FINITE = 3
    UNSUPPORTED = 4
    NOT_SOLID = 5
    INVERTED_INSIDE = 6
    REPEATED_POINTS = 7
    UNDECIDED = 8
    BROKEN = 9
    CONCAVE = 10
    GHOST = 11
    NOT_SURFACE = 12


class Category(IntEnum):
    """What a cell counts as. Every cell belongs to one; a measured cell that is valid is then poor or good by value."""

    VALID = 0
    INVALID = 1
    DEGENERATE = 2
    UNDECIDED = 3
    UNMEASURED = 4  #: a solid cell without a value, which nobody can vouch for
    APART = 5  #: no solid cell, or a copy of one: in no total


@dataclass(frozen=True, slots=True)
class StatusRow:
    """What a status means, for messages, files and documentation."""

    status: Status
    name: str
    is_measured: bool  #: the cell has a value
    category: Category  #: what it counts as in a mesh for finite elements; see `category` for finite volumes
    text: str


STATUSES: dict[Status, StatusRow] = {
    row.status: row
    for row in (
        StatusRow(
            Status.OK,
            "ok",
            True,
            Category.VALID,
            "valid: every corner is positive, and the inside where it could differ",
        ),
        StatusRow(Status.INVERTED, "inverted", True, Category.INVALID, "some corner is negative"),
        StatusRow(
            Status.DEGENERATE,
            "degenerate",
            True,
            Category.DEGENERATE,
            "flat at a corner or inside, and nowhere negative: rounding of the stored coordinates could turn its sign",
        ),
        StatusRow(
            Status.INVERTED_INSIDE,
            "inverted_inside",
            True,
            Category.INVALID,
            "every corner is positive, but the Jacobian determinant is zero or negative inside",
        ),
        StatusRow(
            Status.REPEATED_POINTS,
            "repeated_points",
            True,
            Category.DEGENERATE,
            "degenerate: a point occurs twice in the cell",
        ),
        StatusRow(
            Status.UNDECIDED,
            "undecided",
            True,
            Category.UNDECIDED,
            "every corner is positive, but whether the inside is valid could not be decided",
        ),
        StatusRow(
            Status.CONCAVE,
            "concave",
            True,
            Category.INVALID,
            "a corner is negative or flat, but a point sees all faces: of use to finite volumes, "
            "not to finite elements",
        ),
        StatusRow(Status.BROKEN, "broken", False, Category.INVALID, "a polyhedron whose faces make no closed solid"),
        StatusRow(Status.NON_FINITE, "non_finite", False, Category.UNMEASURED, "a coordinate is NaN or infinite"),
        StatusRow(
            Status.UNSUPPORTED,
            "unsupported",
            False,
            Category.UNMEASURED,
            "a cell of a type that is not measured",
        ),
        StatusRow(
            Status.NOT_SOLID, "not_solid", False, Category.APART, "a surface, line or vertex cell: has no volume"
        ),
        StatusRow(
            Status.NOT_SURFACE,
            "not_surface",
            False,
            Category.APART,
            "a line or vertex, or a solid cell, in a mesh whose surface cells are measured: not looked at",
        ),
        StatusRow(
            Status.GHOST, "ghost", False, Category.APART, "a copy of a cell of another piece, or hidden: not looked at"
        ),
    )
}
"""Every row, by status."""


Codes = NDArray[np.uint8]
Mask = NDArray[np.bool_]


def _categories(purpose: Purpose) -> Codes:
    table = np.full(256, Category.APART, np.uint8)
    for row in STATUSES.values():
        table[row.status] = row.category
    if purpose == "fv":
        table[Status.CONCAVE] = Category.VALID
    table.setflags(write=False)
    return table


WORST_FIRST = (
    Category.INVALID,
    Category.DEGENERATE,
    Category.UNDECIDED,
    Category.VALID,
    Category.UNMEASURED,
    Category.APART,
)
"""The order of every list and histogram: by what a cell counts as, and by its value among those that count alike."""

_CATEGORY = {purpose: _categories(purpose) for purpose in PURPOSES}
_RANK = np.array([WORST_FIRST.index(one) for one in Category], np.uint8)
_MEASURED = np.array([code in STATUSES and STATUSES[Status(code)].is_measured for code in range(256)])


def category(status: Codes, purpose: Purpose = "fem") -> Codes:
    """The `Category` of each status code, uint8 of the same shape: what the cell counts as in a mesh for a purpose."""
    return _CATEGORY[purpose][status]


def rank(status: Codes, purpose: Purpose = "fem") -> Codes:
    """The place in `WORST_FIRST` of what each cell counts as, uint8 of the same shape: 0 invalid, 1 degenerate,
    2 undecided, 3 valid, 4 without a value, 5 in no total. Status goes before value: order by this, then by value."""
    return _RANK[category(status, purpose)]


def is_invalid(status: Codes, purpose: Purpose = "fem") -> Mask:
    """True for cells that no solver takes: inverted, inverted inside or broken; concave ones too, unless the mesh is
    for finite volumes."""
    return np.equal(category(status, purpose), Category.INVALID)


def is_degenerate(status: Codes) -> Mask:
    """True for cells that are flat at a corner or inside, or have a point twice."""
    return np.equal(category(status), Category.DEGENERATE)


def is_undecided(status: Codes) -> Mask:
    """True for cells of which only the corners are known to be valid."""
    return np.equal(category(status), Category.UNDECIDED)


def is_solid(status: Codes) -> Mask:
    """True for cells that count: all but surfaces, lines, vertices and ghosts."""
    return np.not_equal(category(status), Category.APART)


def is_measured(status: Codes) -> Mask:
    """True for cells that have a value."""
    return _MEASURED[status]


def is_unmeasured(status: Codes) -> Mask:
    """True for solid cells without a value: broken, unsupported, or with a coordinate that is not finite."""
    measured: Mask = _MEASURED[status]
    return is_solid(status) & ~measured


def is_usable(status: Codes, purpose: Purpose = "fem") -> Mask:
    """True for cells that a solver takes as far as is known: valid, or undecided; neither invalid, degenerate nor
    without a value."""
    categories = category(status, purpose)
    return np.equal(categories, Category.VALID) | np.equal(categories, Category.UNDECIDED)
