"""Parameters of which only a run with ``--long`` takes all."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def quick(values: Iterable[Any], *some: Any) -> list[Any]:
    """The values as parameters; those that are not among ``some`` are marked ``long``."""
    rows = list(values)
    assert all(one in rows for one in some), "a quick one is no longer there"
    return [one if one in some else pytest.param(*_columns(one), marks=pytest.mark.long) for one in rows]


def _columns(row: Any) -> tuple[Any, ...]:
    return row if isinstance(row, tuple) else (row,)
