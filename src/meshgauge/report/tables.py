"""Tables of numbers for terminals: where one is too wide, its columns go on below; no word and no number is broken."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Sequence

from rich.box import Box
from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.measure import Measurement
from rich.table import Column, Table
from rich.text import Text


class _Lines(Box):
    """A line below the header and nothing else, also where the terminal has only ASCII."""

    def substitute(self, options: ConsoleOptions, safe: bool = True) -> Box:
        return _Lines(_HEADER_LINE.replace("─", "-"), ascii=True) if options.ascii_only else self


_HEADER_LINE = "    \n    \n ── \n    \n    \n    \n    \n    \n"
LINES = _Lines(_HEADER_LINE)


class NumbersTable(Table):
    """A table that is parted if its words have no room side by side: each part has the first column, and others."""

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        room = options.max_width
        if self.width_in_lines(console, options) <= room or len(self.columns) < 2:
            yield from with_widths(self).__rich_console__(console, options)
            return
        first, *others = self.columns
        for part in self._parts(first, others, console, options):
            _give_widths(part, room, console, options)
            yield from Table.__rich_console__(part, console, options)

    def width_in_lines(self, console: Console, options: ConsoleOptions) -> int:
        """The characters of a line in which nothing has to be wrapped."""
        return _measured(with_widths(self), console, options).maximum

    def _parts(
        self, first: Column, others: Sequence[Column], console: Console, options: ConsoleOptions
    ) -> Iterator[NumbersTable]:
        """Tables of the first column and as many others as their longest words allow, one at least."""
        taken: list[Column] = []
        for column in others:
            wider = self._of([first, *taken, column])
            if taken and _measured(wider, console, options).minimum > options.max_width:
                yield self._of([first, *taken])
                taken = []
            taken.append(column)
        yield self._of([first, *taken])

    def _of(self, columns: Sequence[Column]) -> NumbersTable:
        """The same with some of the columns."""
        part = copy.copy(self)
        part.columns = [copy.copy(column) for column in columns]
        for n, column in enumerate(part.columns):
            column._index = n
        return part


def with_widths(table: Table) -> Table:
    """The same table of words and texts with the width that each column needs, which Rich finds at great length."""
    plain = Table.__new__(Table)
    plain.__dict__.update(table.__dict__)
    plain.columns = [copy.copy(column) for column in table.columns]
    for column in plain.columns:
        column.width = max(map(_longest_line, (column.header, *column.cells)))
    return plain


def _longest_line(item: RenderableType) -> int:
    lines = (item.plain if isinstance(item, Text) else str(item)).splitlines()
    return max(map(cell_len, lines), default=0)


def new_table(first: str, *others: str) -> NumbersTable:
    """A table whose first column is text and whose others are numbers; what does not fit goes on below, never cut."""
    table = NumbersTable(box=LINES, header_style="dim", padding=(0, 1), pad_edge=False, collapse_padding=True)
    table.add_column(first, overflow="fold")
    for name in others:
        table.add_column(name, justify="right", overflow="fold")
    return table


def _measured(table: Table, console: Console, options: ConsoleOptions) -> Measurement:
    """The width of a table with all its words side by side in lines, and with each word on a line of its own."""
    return Table.__rich_measure__(table, console, options.update_width(10_000))


def _give_widths(table: Table, room: int, console: Console, options: ConsoleOptions) -> None:
    """Every column as wide as its longest word, and what room is left to those that need least to be whole."""
    total = _measured(table, console, options)
    ends = [_ends(column, console, options) for column in table.columns]
    spare = room - (total.maximum - sum(end.maximum for end in ends)) - sum(end.minimum for end in ends)
    if spare < 0:
        return  # a word is longer than a line: it is folded
    for column, end in sorted(zip(table.columns, ends, strict=True), key=lambda pair: pair[1].span):
        more = min(end.span, spare)
        column.width, spare = end.minimum + more, spare - more


def _ends(column: Column, console: Console, options: ConsoleOptions) -> Measurement:
    wide = options.update_width(10_000)
    each = [Measurement.get(console, wide, item) for item in (column.header, *column.cells)]
    return Measurement(max(one.minimum for one in each), max(one.maximum for one in each))
