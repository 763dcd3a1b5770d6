"""The gate as annotations of GitHub Actions: lines on standard output that the runner understands."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ...errors import FailedFile
from .. import Check, State
from .lines import messages, printable, relative

COMMANDS = {State.FAIL: "error", State.WARN: "warning", State.UNCHECKED: "error"}
"""States that become an annotation."""


def github(checks: Sequence[Check], failures: Sequence[FailedFile] = ()) -> Iterator[str]:
    """One line for each broken or unchecked rule of each mesh. GitHub shows the first ten of each kind in a step."""
    for check in checks:
        for outcome in check.outcomes:
            if outcome.state in COMMANDS:
                yield _line(COMMANDS[outcome.state], check.path, str(outcome.rule), "\n".join(messages(outcome)))
    for failure in failures:
        yield _line("error", failure.path, "the mesh cannot be read", failure.reason)


def _line(command: str, path: str, title: str, text: str) -> str:
    return f"::{command} file={_property(relative(path))},title={_property(title)}::{_data(text)}"


def _data(text: str) -> str:
    return printable(text).replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _property(text: str) -> str:
    return _data(text).replace(":", "%3A").replace(",", "%2C")
