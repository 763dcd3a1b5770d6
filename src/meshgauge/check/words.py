"""What ``nothing WORD`` may ask for, one row a word."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..report.bad_cells import is_bad
from ..status import STATUSES, Category, Mask, Status, is_degenerate, is_invalid, is_undecided, is_unmeasured

if TYPE_CHECKING:
    from ..quality.measure import Quality


class Word(NamedTuple):
    """A word, and the cells of a measured mesh that it means."""

    name: str
    mask: Callable[[Quality], Mask]
    text: str
    phrase: str  #: what such a cell is, in a sentence


def _invalid(quality: Quality) -> Mask:
    return is_invalid(quality.status, quality.mesh.purpose)


def _inside(quality: Quality) -> Mask:
    return np.equal(quality.status, Status.INVERTED_INSIDE) | is_undecided(quality.status)


def _poor(quality: Quality) -> Mask:
    return is_bad(quality)


def _degenerate(quality: Quality) -> Mask:
    return is_degenerate(quality.status)


def _unmeasured(quality: Quality) -> Mask:
    return is_unmeasured(quality.status)


def _misoriented(quality: Quality) -> Mask:
    from ..doctor import misoriented

    return misoriented(quality)


def _hanging(quality: Quality) -> Mask:
    from ..doctor import hanging

    mask = np.zeros(quality.n_cells, np.bool_)
    mask[hanging(quality).cells] = True
    return mask


def _of_status(quality: Quality, *, status: Status) -> Mask:
    return np.equal(quality.status, status)


def _word(name: str, mask: Callable[[Quality], Mask], text: str, phrase: str = "") -> Word:
    return Word(name, mask, text, phrase or name)


WORDS: dict[str, Word] = {
    word.name: word
    for word in (
        _word(
            "invalid",
            _invalid,
            "inverted, at a corner or inside, or no closed solid; concave too, unless the mesh is for finite volumes",
        ),
        _word("invalid inside", _inside, "good at every corner, but not proved to be valid inside"),
        _word("degenerate", _degenerate, "flat at a corner, or with a point twice"),
        _word("poor", _poor, "not valid, or of less J_ENS than quality.poor of the settings", "poor or worse"),
        _word("unmeasured", _unmeasured, "a solid cell without a value"),
        _word("misoriented", _misoriented, "with a face that points inward, or numbered in reverse"),
        _word("hanging", _hanging, "with an edge or face in which a point of finer cells hangs", "at a hanging point"),
        *(
            _word(row.name, partial(_of_status, status=row.status), row.text)
            for row in STATUSES.values()
            if row.name not in ("ok", "degenerate") and row.category != Category.APART
        ),
    )
}
"""Every row, by name: words that people use, and the names of the statuses."""
