"""What a cell is, one row a status. A cell has exactly one.

What is invalid, degenerate, undecided, measured or solid is defined here and nowhere else, as masks over status codes.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Purpose = Literal["fem", "fv"]
"""What a mesh is for: finite elements or finite volumes. To finite volumes a concave, star-shaped cell is of use."""


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


@dataclass(frozen=True, slots=True)
class StatusRow:
    """What a status means, for messages, files and documentation."""

    status: Status
    name: str
    is_measured: bool  #: the cell has a value
    is_valid: bool  #: the cell passes as valid
    text: str


STATUSES: dict[Status, StatusRow] = {
    row.status: row
    for row in (
        StatusRow(Status.OK, "ok", True, True, "valid: every corner is positive, and the inside where it could differ"),
        StatusRow(Status.INVERTED, "inverted", True, False, "some corner is negative"),
        StatusRow(Status.DEGENERATE, "degenerate", True, False, "no corner is negative, some is exactly flat"),
        StatusRow(
            Status.INVERTED_INSIDE,
            "inverted_inside",
            True,
            False,
            "every corner is positive, but the Jacobian determinant is zero or negative inside",
        ),
        StatusRow(
            Status.REPEATED_POINTS, "repeated_points", True, False, "degenerate: a point occurs twice in the cell"
        ),
        StatusRow(
            Status.UNDECIDED,
            "undecided",
            True,
            False,
            "every corner is positive, but whether the inside is valid could not be decided",
        ),
        StatusRow(
            Status.CONCAVE,
            "concave",
            True,
            False,
            "a polyhedron with a negative corner, but star-shaped: of use to finite volumes",
        ),
        StatusRow(Status.BROKEN, "broken", False, False, "a polyhedron whose faces make no closed solid"),
        StatusRow(Status.NON_FINITE, "non_finite", False, False, "a coordinate is NaN or infinite"),
        StatusRow(Status.UNSUPPORTED, "unsupported", False, False, "a solid cell of a type that is not measured"),
        StatusRow(Status.NOT_SOLID, "not_solid", False, False, "a surface, line or vertex cell: has no volume"),
        StatusRow(Status.GHOST, "ghost", False, False, "a copy of a cell of another piece, or hidden: not looked at"),
    )
}
"""Every row, by status."""


Codes = NDArray[np.uint8]
Mask = NDArray[np.bool_]


def _table(*statuses: Status) -> Mask:
    """A mask over all codes, true for these."""
    table = np.zeros(256, np.bool_)
    table[list(statuses)] = True
    table.setflags(write=False)
    return table


_INVALID = {
    "fem": _table(Status.INVERTED, Status.INVERTED_INSIDE, Status.BROKEN, Status.CONCAVE),
    "fv": _table(Status.INVERTED, Status.INVERTED_INSIDE, Status.BROKEN),
}
_DEGENERATE = _table(Status.DEGENERATE, Status.REPEATED_POINTS)
_MEASURED = _table(*(row.status for row in STATUSES.values() if row.is_measured))
_APART = _table(Status.NOT_SOLID, Status.GHOST)


def is_invalid(status: Codes, purpose: Purpose = "fem") -> Mask:
    """True for cells that no solver takes: inverted, inverted inside or broken; concave ones too, unless the mesh is
    for finite volumes."""
    return _INVALID[purpose][status]


def is_degenerate(status: Codes) -> Mask:
    """True for cells that are exactly flat at a corner, or have a point twice."""
    return _DEGENERATE[status]


def is_undecided(status: Codes) -> Mask:
    """True for cells of which only the corners are known to be valid."""
    return np.equal(status, np.uint8(Status.UNDECIDED))


def is_solid(status: Codes) -> Mask:
    """True for cells that count: all but surfaces, lines, vertices and ghosts."""
    return ~_APART[status]


def is_measured(status: Codes) -> Mask:
    """True for cells that have a value."""
    return _MEASURED[status]


def is_unmeasured(status: Codes) -> Mask:
    """True for solid cells without a value: broken, unsupported, or with a coordinate that is not finite."""
    return ~_MEASURED[status] & ~_APART[status]
