"""What ``nothing WORD`` may ask for, one row a word."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from ..status import (
    STATUSES,
    Category,
    Codes,
    Mask,
    Purpose,
    Status,
    is_degenerate,
    is_invalid,
    is_undecided,
    is_unmeasured,
)


class Word(NamedTuple):
    """A word, and the cells that it means: their mask from status codes and the purpose of the mesh."""

    name: str
    mask: Callable[[Codes, Purpose], Mask]
    text: str


def _inside(codes: Codes, purpose: Purpose) -> Mask:
    return np.equal(codes, Status.INVERTED_INSIDE) | is_undecided(codes)


def _degenerate(codes: Codes, purpose: Purpose) -> Mask:
    return is_degenerate(codes)


def _unmeasured(codes: Codes, purpose: Purpose) -> Mask:
    return is_unmeasured(codes)


def _of_status(codes: Codes, purpose: Purpose, *, status: Status) -> Mask:
    return np.equal(codes, status)


WORDS: dict[str, Word] = {
    word.name: word
    for word in (
        Word(
            "invalid",
            is_invalid,
            "inverted, at a corner or inside, or no closed solid; concave too, unless the mesh is for finite volumes",
        ),
        Word("invalid inside", _inside, "good at every corner, but not proved to be valid inside"),
        Word("degenerate", _degenerate, "flat at a corner, or with a point twice"),
        Word("unmeasured", _unmeasured, "a solid cell without a value"),
        *(
            Word(row.name, partial(_of_status, status=row.status), row.text)
            for row in STATUSES.values()
            if row.name not in ("ok", "degenerate") and row.category != Category.APART
        ),
    )
}
"""Every row, by name: four words that people use, and the names of the statuses."""
