"""One row a cell, as CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from contextlib import ExitStack
from itertools import repeat
from pathlib import Path
from types import TracebackType
from typing import TextIO

import numpy as np
from numpy.typing import NDArray

from ..cells import type_name
from ..errors import WriteError
from ..files.output import replacing
from ..status import STATUSES, Status

FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""A text that begins with one of these is a formula to spreadsheets; with a ``'`` before it, it is a text."""

CHUNK = 1 << 16
"""Rows formatted at a time."""


class CsvWriter:
    """Writes cells to a CSV file; the file appears, whole, when the ``with`` block ends without an exception.

    An older file stays if no mesh was added. ``-`` means standard output.

    Columns: ``file`` (if asked for), ``cell`` (position in the file, from 0), ``cell_label`` (the file's own number,
    empty if it gives none), ``type``, ``status``, and each metric. Numbers are the shortest that read back to the same
    double; a cell without a value has an empty field.
    A file whose name begins like a formula of a spreadsheet (``=``, ``+``, ``-``, ``@``) has a ``'`` before it.

    Raises
    ------
    WriteError
        If the file cannot be written; nothing is left half-written then.
    """

    def __init__(self, path: str | Path, metrics: tuple[str, ...], *, with_file: bool) -> None:
        self.path = Path(path)
        self.metrics = metrics
        self.with_file = with_file
        self._stack = ExitStack()
        self._is_empty = True

    def __enter__(self) -> CsvWriter:
        try:
            temporary = self._stack.enter_context(replacing(self.path, text=True))
            # newline: rows end the same way on every system.
            self._stream: TextIO = open(temporary, "w", encoding="utf-8", errors="surrogateescape", newline="\n")
            columns = ("cell", "cell_label", "type", "status", *self.metrics)
            self._stream.write(",".join(("file", *columns) if self.with_file else columns) + "\n")
        except OSError as error:
            self._stack.__exit__(OSError, error, None)
            raise WriteError(f"{self.path}: {error.strerror or error}") from error
        return self

    def mark(self) -> int:
        """What `back_to` takes to be here again."""
        self._stream.flush()
        return self._stream.tell()

    def back_to(self, mark: int) -> None:
        """Drop the rows since a mark."""
        self._stream.flush()
        self._stream.seek(mark)
        self._stream.truncate()

    def add(
        self,
        file: str,
        types: NDArray[np.uint8],
        status: NDArray[np.uint8],
        values: Mapping[str, NDArray[np.float64]],
        labels: NDArray[np.int64] | None = None,
        *,
        first: int = 0,
    ) -> None:
        """Append cells of one mesh, from the ``first`` on: VTK ids, status codes and the values of each metric,
        ``(n_cells,)`` each; and the file's own numbers, if it has any, below 0 where it gives none."""
        self._is_empty = False
        prefix = f"{_quote(file)}," if self.with_file else ""
        # Type and status together have few values: one lookup a row in a table of ready text.
        texts = [f",{type_name(t)},{STATUSES[s].name}," for t in range(256) for s in Status]
        try:
            for start in range(0, len(types), CHUNK):
                here = slice(start, start + CHUNK)
                kinds = (types[here].astype(np.intp) * len(Status) + status[here]).tolist()
                columns = [_texts(values[name][here]) for name in self.metrics]
                cells = columns[0] if len(columns) == 1 else map(",".join, zip(*columns, strict=True))
                numbers = repeat("") if labels is None else ["" if n < 0 else str(n) for n in labels[here].tolist()]
                self._stream.write(
                    "".join(
                        f"{prefix}{cell},{number}{texts[kind]}{row}\n"
                        for cell, (number, kind, row) in enumerate(
                            zip(numbers, kinds, cells, strict=False), first + start
                        )
                    )
                )
        except OSError as error:
            raise WriteError(f"{self.path}: {error.strerror or error}") from error

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self._stream.close()
        except OSError as failure:
            error = WriteError(f"{self.path}: {failure.strerror or failure}")
            self._stack.__exit__(WriteError, error, None)
            raise error from failure
        if kind is None and self._is_empty:
            kind, error = _Nothing, _Nothing()
        self._stack.__exit__(kind, error, trace)


class _Nothing(Exception):
    """No mesh was added."""


def _texts(values: NDArray[np.float64]) -> list[str]:
    return ["" if value != value else repr(value) for value in values.tolist()]


def _quote(text: str) -> str:
    if text.startswith(FORMULA):
        text = f"'{text}"
    line = io.StringIO()
    csv.writer(line, lineterminator="").writerow([text])
    return line.getvalue()
