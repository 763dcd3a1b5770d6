"""The formats for people and for programs: what becomes of a file of each."""

from __future__ import annotations

from typing import Any

from rich import box
from rich.console import Console, ConsoleOptions, RenderResult
from rich.table import Table
from rich.text import Text

from .registry import ALL

_MARKS = {True: "yes", False: "-"}


def rows() -> list[dict[str, Any]]:
    """A row a format: name, title, extensions, and what becomes of its files.

    They are read; patched: they come back with other coordinates and nothing else touched; added to: a report adds its
    arrays to a copy; written: a mesh of another format is converted to it.
    """
    return [
        {
            "name": one.name,
            "title": one.title,
            "extensions": list(one.extensions),
            "read": one.is_readable,
            "patched": one.is_patched,
            "added_to": one.add is not None,
            "written": one.write is not None,
        }
        for one in sorted(ALL, key=lambda one: one.name)
    ]


class FormatsText:
    """One line a format."""

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1))
        for name in ("format", "title", "extensions", "read", "patched", "added to", "written"):
            table.add_column(name, overflow="fold", no_wrap=name == "format")
        for row in rows():
            marks = (_MARKS[row[key]] for key in ("read", "patched", "added_to", "written"))
            table.add_row(Text(row["name"], "bold"), Text(row["title"]), " ".join(row["extensions"]), *marks)
        yield table
        yield Text(
            "patched: improve gives the file back with other coordinates and nothing else touched\n"
            "added to: report -o adds its arrays to a copy of the file, of which all else stays\n"
            "written: a mesh of another format is converted to it",
            "dim",
        )
