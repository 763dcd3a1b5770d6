"""The command line without a process of its own, which takes a second to start."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Iterator
from pathlib import Path
from subprocess import CompletedProcess

from meshgauge.cli.main import main


def run(*arguments: object, cwd: Path | None = None) -> CompletedProcess[str]:
    """Run ``meshgauge`` with these arguments; what it printed, and its exit code.

    For tests of what a command does. Signals, closed pipes and what is loaded are tested in processes of their own
    (`tests/cli/test_cli_process.py`).
    """
    words = [str(argument) for argument in arguments]
    with _captured() as (out, err), contextlib.chdir(cwd or Path.cwd()):
        code = main(words)
    return CompletedProcess(words, code, *(stream.getvalue().decode("utf-8") for stream in (out, err)))


@contextlib.contextmanager
def _captured() -> Iterator[tuple[io.BytesIO, io.BytesIO]]:
    """Both streams as a pipe would have them: of bytes, and no terminal."""
    out, err = io.BytesIO(), io.BytesIO()
    texts = [io.TextIOWrapper(stream, encoding="utf-8", write_through=True) for stream in (out, err)]
    with contextlib.redirect_stdout(texts[0]), contextlib.redirect_stderr(texts[1]):
        yield out, err
    for text in texts:
        text.detach()
