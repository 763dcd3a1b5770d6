"""A diagnosis for people, as Rich renderables; for programs, `Diagnosis.to_dict` is plain data already."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from rich.console import Console, ConsoleOptions, RenderResult
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from .._version import __version__
from ..errors import FailedFile
from ..look import style

if TYPE_CHECKING:
    from . import Changes, Diagnosis, Finding

SCHEMA, VERSION = "meshgauge-doctor", 2

_LEVELS = {"defect": "bad", "notice": "poor"}
_NOTICE = ("•", "-")


class DiagnosisText:
    """A title and a line for each finding, defects first marked; one line if nothing was found."""

    def __init__(self, diagnosis: Diagnosis, *, title: str = "diagnosis") -> None:
        self.diagnosis = diagnosis
        self.title = title

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        diagnosis = self.diagnosis
        table = Table.grid(padding=(0, 1))
        table.add_column(no_wrap=True)
        table.add_column(overflow="fold")
        for finding in diagnosis.findings:
            table.add_row(*_line(finding, ascii_only=options.ascii_only))
        for why in diagnosis.skipped:
            table.add_row(Text("?", style.LEVELS["unknown"]), Text(why))
        if not diagnosis.findings and not diagnosis.skipped:
            marks = style.MARKS_ASCII if options.ascii_only else style.MARKS
            table.add_row(Text(marks["good"], style.LEVELS["good"]), Text(diagnosis.all_clear))
        if diagnosis.n_interior_faces is not None:
            what = "faces" if diagnosis.dimension == 3 else "edges"
            faces = f"{diagnosis.n_interior_faces:,} interior {what}, {diagnosis.n_boundary_faces:,} on the boundary"
            table.add_row("", Text(faces, "dim"))
        yield Text(self.title, "bold")
        yield Padding(table, (0, 0, 0, 1), expand=False)


class DiagnosisLine:
    """One line: how many defects and notices, and which."""

    def __init__(self, path: str, diagnosis: Diagnosis) -> None:
        self.path = style.printable(path)
        self.diagnosis = diagnosis

    def __rich__(self) -> Text:
        parts = []
        for level in _LEVELS:
            names = [finding.name for finding in self.diagnosis.findings if finding.level == level]
            if names:
                parts.append(f"{style.plural(len(names), level)} ({', '.join(names)})")
        verdict = ", ".join(parts) or ("not diagnosed" if self.diagnosis.skipped else "nothing is wrong")
        return Text(f"{self.path}: {verdict}")


class ChangesLine:
    """What `meshgauge orient` did, in one line."""

    def __init__(self, path: str, changes: Changes) -> None:
        self.path = style.printable(path)
        self.changes = changes

    def __rich__(self) -> Text:
        left = f", {len(self.changes.left):,} left" if len(self.changes.left) else ""
        return Text(f"{self.path}: {style.plural(len(self.changes.cells), 'cell')} renumbered{left}")


class ChangesText:
    """What `meshgauge orient` did, a line each, after what the reader noticed or did."""

    def __init__(self, path: str, changes: Changes, *, notes: Sequence[str] = ()) -> None:
        self.path = style.printable(path)
        self.changes = changes
        self.notes = notes

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        lines = list(self.changes.texts)
        if len(self.changes.cells) == 0 and len(self.changes.left) == 0:
            lines.insert(0, "No cell is numbered in reverse: nothing to renumber.")
        yield Text(self.path, "bold", overflow="fold")
        for line in lines:
            yield Padding(Text(line), (0, 0, 0, 1), expand=False)
        for note in self.notes:
            yield Padding(Text(note, "dim"), (0, 0, 0, 1), expand=False)


def diagnosis_json(diagnoses: Sequence[tuple[str, Diagnosis]], failures: Sequence[FailedFile] = ()) -> str:
    """The diagnoses of several files as JSON text, indented, ASCII only (docs/doctor.md)."""
    plain: dict[str, Any] = {
        "schema": SCHEMA,
        "version": VERSION,
        "meshgauge": __version__,
        "files": [{"path": path, **diagnosis.to_dict()} for path, diagnosis in diagnoses],
        "errors": [{"path": failure.path, "message": failure.reason} for failure in failures],
    }
    return json.dumps(plain, indent=2, allow_nan=False)


def _line(finding: Finding, *, ascii_only: bool) -> tuple[Text, Text]:
    level = _LEVELS[finding.level]
    if finding.level == "notice":
        return Text(_NOTICE[ascii_only], style.LEVELS[level]), Text(finding.text)
    marks = style.MARKS_ASCII if ascii_only else style.MARKS
    return Text(marks[level], style.LEVELS[level]), Text(finding.text)
