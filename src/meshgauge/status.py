"""What a cell is, one row a status. A cell has exactly one."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum


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
    )
}
"""Every row, by status."""
