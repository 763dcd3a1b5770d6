"""Names that a file holds, as they are printed: nothing in them steers a terminal or a pipeline."""

from __future__ import annotations

import io

import pytest
from rich.text import Text

from meshgauge.cli import terminal
from meshgauge.look.style import printable


@pytest.mark.parametrize(
    ("raw", "shown"),
    [
        ("plain, Größe 体积 🙂", "plain, Größe 体积 🙂"),
        ("\x1b[2J", "\\x1b[2J"),
        ("a\nb\tc\rd", "a\\x0ab\\x09c\\x0dd"),
        ("\x00\x7f\x9b1m\x85", "\\x00\\x7f\\x9b1m\\x85"),
        ("\u202eutv", "\\u202eutv"),
        ("\u2066x\u2069", "\\u2066x\\u2069"),
        ("\u2028\u2029", "\\u2028\\u2029"),
        ("\udce9.vtu", "\\udce9.vtu"),
    ],
)
def test_what_would_be_obeyed_is_shown(raw: str, shown: str) -> None:
    assert printable(raw) == shown
    assert printable(printable(raw)) == shown


def test_long_names_are_shortened_where_asked() -> None:
    assert printable("x" * 300) == "x" * 300
    assert printable("a" * 300 + "b", longest=20) == "a" * 10 + "…" + "a" * 9 + "b"


def test_what_stays() -> None:
    assert printable("a\nb\x1b", keep="\n") == "a\nb\\x1b"


@pytest.mark.parametrize("is_terminal", [True, False])
def test_no_output_steers_a_terminal(
    is_terminal: bool, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    stream = io.StringIO()
    monkeypatch.setattr(stream, "isatty", lambda: is_terminal)
    monkeypatch.setattr("sys.stdout", stream)
    monkeypatch.setenv("TERM", "xterm")
    assert terminal.Output().show(Text("a\x1b[2Jb\x9bc", "bold"))
    assert "a\\x1b[2Jb\\x9bc" in stream.getvalue()
    terminal.warn("note", "f\x1b[2J\u202e.vtu\nnext")
    assert capsys.readouterr().err == "meshgauge: note: f\\x1b[2J\\u202e.vtu next\n"


def test_no_line_is_a_command_of_github_actions(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = "::error::x\n  ::set-env name=a::b\na ##[error] b\nplain :: text"
    terminal.emit(lines)
    assert capsys.readouterr().out == f"{lines}\n"
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    terminal.emit(lines)
    terminal.Output().show(Text("::warning::y"))
    out = capsys.readouterr().out.splitlines()
    assert out[-2:] == ["plain :: text", "\\::warning::y"]
    assert not any(line.lstrip().startswith("::") or "##[" in line for line in out)
