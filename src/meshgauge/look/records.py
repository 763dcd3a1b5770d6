"""How a record shows itself where it is printed: its fields, each in few words, never more than fits a screen."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from itertools import islice
from typing import Any

import numpy as np

LONGEST = 72
"""Characters of a field; what is longer is counted instead."""


def brief(record: Any) -> str:
    """A ``__repr__`` for dataclasses: as theirs, but arrays by type and shape, what is long by its number of items."""
    shown = (f"{own.name}={_value(getattr(record, own.name))}" for own in fields(record) if own.repr)
    return f"{type(record).__name__}({', '.join(shown)})"


def shorten(text: str) -> str:
    """A text, or its beginning and its end, which is what tells paths apart."""
    half = (LONGEST - 1) // 2
    return text if len(text) <= LONGEST else f"{text[:half]}…{text[-half:]}"


def _value(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"<{value.dtype} {value.shape}>"
    if isinstance(value, str):
        return repr(shorten(value))
    if isinstance(value, Mapping):
        return _list("{}", (f"{key!r}: {_value(item)}" for key, item in value.items()), len(value))
    if isinstance(value, tuple | list) and not hasattr(value, "_fields"):
        return _list("()" if isinstance(value, tuple) else "[]", map(_value, value), len(value))
    text = repr(value)
    if len(text) <= LONGEST:
        return text
    return f"<{type(value).__name__}>" if is_dataclass(value) else shorten(text)


def _list(ends: str, items: Iterable[str], n: int) -> str:
    """All items, or how many there are."""
    text = ", ".join(islice(items, LONGEST // 3))
    return f"{ends[0]}{text}{ends[1]}" if len(text) <= LONGEST and n <= LONGEST // 3 else f"<{n:,} items>"
