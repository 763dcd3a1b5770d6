"""What ``nothing WORD`` may ask for, one row a word."""

from __future__ import annotations

from typing import NamedTuple

from ..status import STATUSES, Status


class Word(NamedTuple):
    """A word, and the statuses of the cells that it means."""

    name: str
    statuses: tuple[Status, ...]
    text: str


WORDS: dict[str, Word] = {
    word.name: word
    for word in (
        Word(
            "invalid",
            (Status.INVERTED, Status.INVERTED_INSIDE, Status.CONCAVE, Status.BROKEN),
            "inverted, at a corner or inside, or no closed convex solid",
        ),
        Word(
            "invalid inside",
            (Status.INVERTED_INSIDE, Status.UNDECIDED),
            "good at every corner, but not proved to be valid inside",
        ),
        Word("degenerate", (Status.DEGENERATE, Status.REPEATED_POINTS), "exactly flat, or with a point twice"),
        Word(
            "unmeasured",
            tuple(row.status for row in STATUSES.values() if not row.is_measured and row.status != Status.NOT_SOLID),
            "a solid cell without a value",
        ),
        *(
            Word(row.name, (row.status,), row.text)
            for row in STATUSES.values()
            if row.name not in ("ok", "degenerate", "not_solid")
        ),
    )
}
"""Every row, by name: four words that people use, and the names of the statuses."""
