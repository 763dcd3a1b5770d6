"""Progress: on standard error, only on a terminal, only for what takes long."""

from __future__ import annotations

import io
import time

import pytest

from meshgauge.cli import terminal


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(
    ("stream", "shown", "patience", "is_seen"),
    [
        (Terminal(), True, 0.0, True),
        (Terminal(), True, 60.0, False),  # done before a spinner is due
        (Terminal(), False, 0.0, False),  # --quiet
        (io.StringIO(), True, 0.0, False),  # a file or a pipe
    ],
)
def test_a_spinner_shows_only_where_it_helps(
    stream: io.StringIO, shown: bool, patience: float, is_seen: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stderr", stream)
    monkeypatch.setattr(terminal, "PATIENCE", patience)
    monkeypatch.setenv("TERM", "xterm")
    with terminal.activity("reading wing.vtu", shown=shown):
        deadline = time.monotonic() + (5 if is_seen else 0.1)
        while "wing.vtu" not in stream.getvalue() and time.monotonic() < deadline:
            time.sleep(0.01)
    assert ("reading wing.vtu" in stream.getvalue()) == is_seen
    size = len(stream.getvalue())
    time.sleep(0.15)
    assert len(stream.getvalue()) == size  # it has stopped
