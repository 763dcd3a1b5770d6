"""Tables of pandas, which is loaded on use."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from ..errors import MeshgaugeError


def frame(rows: Iterable[Sequence[Any]], columns: Sequence[str], *, index: str | None = None) -> Any:
    """A `pandas.DataFrame`, with one of the columns as its index if given.

    Raises
    ------
    MeshgaugeError
        If pandas is not installed.
    """
    try:
        import pandas
    except ImportError:
        raise MeshgaugeError("a table needs pandas: pip install 'meshgauge[notebook]'") from None
    table = pandas.DataFrame(list(rows), columns=list(columns))
    return table if index is None else table.set_index(index)
