"""Progress: on standard error, only on a terminal, only for what takes long."""

from __future__ import annotations

import io
import sys
import time
from typing import Any

import pytest

from meshgauge.cli import compiling, live, terminal
from meshgauge.repair import Progress


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


def test_a_clock_ticks_though_nothing_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    stream = Terminal()
    monkeypatch.setattr("sys.stderr", stream)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "120")
    now = Progress("worst", 2.0, -0.5, 0.25, 3, 1234)
    with live.ProgressLine(shown=True) as progress:
        wait_for(stream, "starting")
        progress(now)
        wait_for(stream, "1,234 evaluations")
        wait_for(stream, "2.4 s")
    assert "raising the worst" in stream.getvalue()


def wait_for(stream: io.StringIO, text: str) -> None:
    deadline = time.monotonic() + 10
    while text not in stream.getvalue():
        assert time.monotonic() < deadline, stream.getvalue()
        time.sleep(0.01)


class Events:
    """What Numba has of events."""

    class Listener:
        pass

    def register(self, kind: str, listener: Any) -> None:
        assert kind == "numba:compile"
        self.listener = listener


def test_who_waits_for_the_compiler_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    events = Events()
    monkeypatch.setattr(compiling, "_seen", [])
    monkeypatch.delitem(sys.modules, "numba.core.event", raising=False)
    assert compiling.note() == "", "Numba is not loaded for it"
    monkeypatch.setitem(sys.modules, "numba.core.event", events)
    assert compiling.note() == ""
    events.listener.on_start(None)
    assert compiling.note() == "compiling, first run only"
    assert "compiling" in str(terminal.Working("measuring").__rich__())
    assert "compiling" in str(live.line(Progress("worst", 2.0, -0.5, 0.25, 3, 1234)))
    events.listener.on_end(None)
    assert compiling.note() == "compiling, first run only", "the next kernel may follow"
    events.listener.ended -= 1
    assert compiling.note() == ""


def test_numba_tells_when_it_compiles(monkeypatch: pytest.MonkeyPatch) -> None:
    numba = pytest.importorskip("numba")
    monkeypatch.setattr(compiling, "_seen", [])
    compiling.note()
    numba.njit(lambda x: x + 1)(1)
    assert compiling.note() == ("" if numba.config.DISABLE_JIT else "compiling, first run only")
