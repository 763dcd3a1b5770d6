"""A repair report made ready to be shown whatever keys there are."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, is_dataclass
from typing import Any, NamedTuple

import numpy as np

from .page_words import name_of

ROWS, DEPTH = 20, 5
"""Entries of a list that are shown, and levels."""


class Moment(NamedTuple):
    """The state of an improvement at one time."""

    seconds: float
    worst: float
    mean: float  #: NaN if it is not known
    phase: str


def history(entries: Any) -> list[Moment]:
    """The entries that have a time and a worst quality: of a list of mappings or records, or of a mapping of lists."""
    if isinstance(entries, Mapping):
        columns = {key: value for key, value in entries.items() if isinstance(value, Sequence | np.ndarray)}
        length = min((len(column) for column in columns.values()), default=0)
        entries = [{key: column[n] for key, column in columns.items()} for n in range(length)]
    if not isinstance(entries, Sequence) or isinstance(entries, str):
        return []
    moments = []
    for entry in entries:
        seconds, worst, mean = (_number(_of(entry, key)) for key in ("seconds", "worst", "mean"))
        if math.isfinite(seconds) and math.isfinite(worst):
            moments.append(Moment(seconds, worst, mean, str(_of(entry, "phase") or "")))
    return moments


def _of(entry: Any, key: str) -> Any:
    return entry.get(key) if isinstance(entry, Mapping) else getattr(entry, key, None)


def _number(value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        return math.nan


class Node(NamedTuple):
    """A part of a repair report: a text, named parts, or a table."""

    kind: str  #: "text", "parts" or "table"
    text: str = ""
    parts: tuple[tuple[str, Node], ...] = ()
    head: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()


def tree(item: Any, depth: int = 0, within: str = "") -> Node:
    """Any plain data as nodes; what is too deep or too long is cut, and says so.

    ``within`` is the key that it has in what it is in.
    """
    item = _plain(item)
    if isinstance(item, Mapping):
        if depth >= DEPTH:
            return Node("text", f"{len(item)} entries")
        parts = ((name_of(key, within), tree(value, depth + 1, str(key))) for key, value in item.items())
        return Node("parts", parts=tuple(parts))
    if isinstance(item, list | tuple):
        entries = [_plain(entry) for entry in item[:ROWS]]
        more = f", … ({len(item):,} in all)" if len(item) > ROWS else ""
        if entries and all(isinstance(entry, Mapping) for entry in entries):
            head = tuple(dict.fromkeys(key for entry in entries for key in entry))
            rows = tuple(tuple(_id_or_text(key, entry.get(key, "")) for key in head) for entry in entries)
            return Node("table", more.removeprefix(", "), head=tuple(map(name_of, head)), rows=rows)
        return Node("text", ", ".join(map(_entry, entries)) + more if entries else "none")
    return Node("text", _text(item))


class Claim(NamedTuple):
    """Something that was checked on the result."""

    name: str
    holds: bool
    text: str


def claims(entries: Any) -> list[Claim]:
    """The entries that say whether something holds."""
    if not isinstance(entries, Sequence) or isinstance(entries, str):
        return []
    return [
        Claim(name_of(_of(entry, "name") or ""), bool(_of(entry, "holds")), str(_of(entry, "text") or ""))
        for entry in entries
        if _of(entry, "holds") is not None
    ]


def _plain(item: Any) -> Any:
    if is_dataclass(item) and not isinstance(item, type):
        return asdict(item)
    if isinstance(item, np.ndarray):
        return item.tolist() if item.size <= 10_000 else f"{' × '.join(map(str, item.shape))} numbers"
    return item.item() if isinstance(item, np.generic) else item


def _id_or_text(key: Any, item: Any) -> str:
    """Ids are written without marks between thousands, as everywhere else."""
    return str(item) if key in ("cell", "node", "point") else _text(item)


def _entry(item: Any) -> str:
    """An entry of a list, which has commas of its own."""
    return str(item) if isinstance(item, int) and not isinstance(item, bool) else _text(item)


def _text(item: Any) -> str:
    item = _plain(item)
    if item is None:
        return "–"
    if isinstance(item, bool):
        return "yes" if item else "no"
    if isinstance(item, int):
        return f"{item:,}"
    if isinstance(item, float):
        return f"{item:.5g}"
    if isinstance(item, Mapping):
        return ", ".join(f"{name_of(key)} {_text(value)}" for key, value in item.items())
    if isinstance(item, list | tuple):
        return ", ".join(map(_entry, item[:ROWS])) + (", …" if len(item) > ROWS else "")
    return str(item) or "–"
