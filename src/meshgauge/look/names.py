"""How cells and points are named for people: by the numbers that their file gives them, with the positions beside; and
what is said of a name that is none.

Formats that number their items call them elements and nodes: ``element 7000 (cell 0)``, ``node 100 (point 7)``. Where
the file gives no number, the position alone is the name: ``cell 0``, ``point 7``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from difflib import get_close_matches

MOST_NAMES = 12
"""That a message lists."""

Labels = Sequence[int | None]
"""The file's number of each item, None where it gives none; empty if it numbers nothing."""

_OF_FILE = {"cell": "element", "point": "node"}


def cell_name(cell: int, label: int | None = None) -> str:
    """``element 7000 (cell 0)``, or ``cell 0`` if the file gives no number."""
    return _name("cell", cell, label)


def point_name(point: int, label: int | None = None) -> str:
    """``node 100 (point 7)``, or ``point 7`` if the file gives no number."""
    return _name("point", point, label)


def cell_entry(cell: int, label: int | None = None) -> str:
    """For a column headed ``cell``: the position, or the whole name if the file gives a number."""
    return str(cell) if label is None else cell_name(cell, label)


def point_entry(point: int | None, label: int | None = None) -> str:
    """For a column headed ``point``; a dash for no point."""
    if point is None:
        return "-"
    return str(point) if label is None else point_name(point, label)


def natural(name: str) -> list[tuple[int, str]]:
    """A key by which ``part_9`` comes before ``part_10``."""
    return [(int(word), word) if word.isdecimal() else (-1, word) for word in re.split(r"(\d+)", name)]


def of_files(names: Sequence[str]) -> str:
    """What a mesh in several files is called."""
    return names[0] if len(names) == 1 else f"{names[0]} to {names[-1]} ({len(names)} files)"


def listed(noun: str, ids: Sequence[int], labels: Labels = (), *, more: bool = False) -> str:
    """Several at once: ``cells 0, 1``; ``elements 7000, 7001; cells 0, 1``; with ``more`` followed by dots.

    Parameters
    ----------
    noun
        ``cell`` or ``point``.
    ids
        Positions, one at least.
    labels
        The file's number of each.
    more
        Whether there are others that are not listed.
    """
    positions = _list(noun, ids, more)
    if not any(label is not None for label in labels):
        return positions
    return f"{_list(_OF_FILE[noun], ['-' if label is None else label for label in labels], more)}; {positions}"


def _name(noun: str, position: int, label: int | None) -> str:
    return f"{noun} {position}" if label is None else f"{_OF_FILE[noun]} {label} ({noun} {position})"


def _list(noun: str, items: Sequence[int | str], more: bool) -> str:
    return f"{noun}{'s' if more or len(items) != 1 else ''} {', '.join(map(str, items))}{', ...' if more else ''}"


def meant(name: str, known: Iterable[str]) -> str:
    """What stands behind a name that is none of those known: ``; did you mean 'jens'?``, or nothing."""
    by_lower = {one.lower(): one for one in known}
    close = get_close_matches(name.lower(), by_lower, 1, 0.6)
    return f"; did you mean {by_lower[close[0]]!r}?" if close else ""


def meant_or_known(name: str, known: Iterable[str], where: str = "") -> str:
    """The same, or which there are: all of them if they are few, else where they are listed."""
    names = list(known)
    if text := meant(name, names):
        return text
    if where and len(names) > MOST_NAMES:
        return f"; {where} lists those there are"
    return f"; there are {', '.join(names)}" if names else "; there are none"
