"""Notes of a repair: sentences that begin with a number are one where several parts of a mesh have them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..look.style import number_of


class Counted(str):
    """A sentence that begins with a number, and can say the same of another."""

    n: int
    many: str
    _one: str

    def __new__(cls, n: int, one: str, many: str) -> Counted:
        """``n`` followed by the rest of the sentence, for one and for many."""
        note = super().__new__(cls, number_of(n, one, many))
        note.n, note._one, note.many = n, one, many
        return note

    def __getnewargs__(self) -> tuple[Any, ...]:
        return self.n, self._one, self.many

    def with_more(self, n: int) -> Counted:
        """The same of as many more."""
        return Counted(self.n + n, self._one, self.many)


def merged_notes(notes: Iterable[str]) -> tuple[str, ...]:
    """Each once, in their order; of those that begin with a number one, with the sum."""
    out: dict[str, str] = {}
    for note in notes:
        key = note.many if isinstance(note, Counted) else note
        had = out.get(key)
        if isinstance(note, Counted) and isinstance(had, Counted):
            out[key] = had.with_more(note.n)
        else:
            out.setdefault(key, note)
    return tuple(out.values())
