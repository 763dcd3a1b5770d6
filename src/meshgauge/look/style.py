"""How numbers, bands and bars look. Shared by everything that is printed for people."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

SPARKS = " ▁▂▃▄▅▆▇█"
SPARKS_ASCII = " .:-=+*%#"
EIGHTHS = " ▏▎▍▌▋▊▉█"


STYLES = {
    "invalid": "bold red",
    "degenerate": "bold magenta",
    "undecided": "yellow",
    "poor": "yellow",
    "good": "bright_blue",  # as in pages and pictures
}
"""Of the columns of counts, where the count is not 0: the palette of `look.colours` in the terminal's own colours."""

LEVELS = {
    "bad": "bold red",
    "unknown": "bold yellow",
    "poor": "bold yellow",
    "good": "bold green",
    "nothing": "bold yellow",
}
"""Of the verdict."""

MARKS = {"bad": "✗", "unknown": "?", "poor": "!", "good": "✓", "nothing": "?"}
MARKS_ASCII = {"bad": "x", "unknown": "?", "poor": "!", "good": "ok", "nothing": "?"}


_UNPRINTABLE = re.compile(
    "[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2060-\u2069\ufeff\ufffe\uffff\ud800-\udfff]"
)
"""Control characters, separators of lines, what turns the direction of writing, and halves of characters."""


def printable(text: str, *, longest: int | None = None, keep: str = "") -> str:
    """A text of a file, such as a name or a path, that cannot steer a terminal, break a line or turn what is around it.

    Parameters
    ----------
    text
        Whatever a file holds.
    longest
        Shorten what has more characters, in its middle; None: never.
    keep
        Characters that may stay.

    Returns
    -------
    str
        The text with ``\\x1b`` and the like in place of such characters.
    """
    if longest is not None and len(text) > longest:
        text = f"{text[: longest // 2]}…{text[-(longest // 2) :]}"
    return _UNPRINTABLE.sub(lambda match: match[0] if match[0] in keep else write_out(match[0]), text)


def write_out(character: str) -> str:
    """A character by its number: ``\\x1b`` or ``\\u2028``."""
    code = ord(character)
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}"


def number(n: int) -> str:
    """A count: ``1,234,567``."""
    return f"{n:,}"


def plural(n: int, noun: str) -> str:
    """``1 cell``, ``2 cells``."""
    return f"{number(n)} {noun}{'' if n == 1 else 's'}"


def share_of(n: int, whole: int, noun: str) -> str:
    """``2 of 3 cells``, ``1 of 1 cell``."""
    return f"{number(n)} of {plural(whole, noun)}"


def number_of(n: int, one: str, several: str) -> str:
    """A count with words that agree: ``number_of(1, "cell was", "cells were")`` is ``1 cell was``."""
    return f"{number(n)} {one if n == 1 else several}"


def quality(value: float) -> str:
    """A value of J_ENS or another metric in at most seven characters; a small one never looks like 0."""
    if math.isnan(value):
        return "-"
    size = abs(value)
    if math.isinf(value) or size == 0 or size >= 1e5:
        return f"{value:.3g}"
    if size < 5e-4:
        return f"{value:.0e}"
    return f"{value:.3f}" if size < 100 else f"{value:.4g}"


def coordinates(place: Sequence[float], spacing: float = 0.0, *, digits: int = 6) -> list[str]:
    """The coordinates of a point in so many digits, or as many as tell it from points at a distance.

    Far from the origin six digits may be more than a cell: at 500 000.25 they are a whole unit.

    Parameters
    ----------
    place
        Coordinates.
    spacing
        The distance, in the same unit, as between two nodes of a cell; 0 if it is not known.
    digits
        Significant digits at least.
    """
    places = 1 - math.floor(math.log10(spacing)) if 0.0 < spacing < math.inf else -_MOST_DIGITS
    return [f"{x:.{min(max(digits, _before_point(x) + places), _MOST_DIGITS)}g}" for x in place]


_MOST_DIGITS = 17
"""Significant digits that tell every double from the next."""


def _before_point(x: float) -> int:
    """Digits before the decimal point, below 0 for zeros behind it."""
    return math.floor(math.log10(abs(x))) + 1 if x and math.isfinite(x) else 0


def percent(part: int, whole: int) -> str:
    """A share; one that is not 0 or 100 % never looks so."""
    if whole == 0:
        return "-"
    share = 100.0 * part / whole
    if 0 < share < 0.05:
        return "<0.1 %"
    if 99.95 <= share < 100:
        return ">99.9 %"
    return f"{share:.1f} %"


def enumeration(items: Sequence[str]) -> str:
    """``a``, ``a and b``, ``a, b and c``."""
    return items[0] if len(items) == 1 else f"{', '.join(items[:-1])} and {items[-1]}" if items else ""


def spark(counts: Sequence[int], *, ascii_only: bool = False) -> str:
    """One character a count, its height linear in the count; a count of 1 shows, whatever the others are."""
    characters = SPARKS_ASCII if ascii_only else SPARKS
    top = max(counts, default=0)
    return "".join(characters[math.ceil(8 * n / top)] if n else " " for n in counts)


def bar(n: int, top: int, width: int, *, ascii_only: bool = False) -> str:
    """A bar at most ``width`` characters long, its length linear in ``n``; that of 1 shows, whatever ``top`` is."""
    if n == 0:
        return ""
    if ascii_only:
        return "#" * max(round(width * n / top), 1)
    eighths = max(round(8 * width * n / top), 1)
    return EIGHTHS[8] * (eighths // 8) + (EIGHTHS[eighths % 8] if eighths % 8 else "")
