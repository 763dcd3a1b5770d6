"""The versions of a stored report in a git history, as a baseline that is renewed from commit to commit leaves them."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import NamedTuple

from ..errors import ReadError

MOST = 200
"""Commits that are followed, the newest."""


class Version(NamedTuple):
    """A file as a commit has it."""

    file: Path
    stem: str  #: date and abbreviated hash of the commit
    contents: bytes

    def __str__(self) -> str:
        return f"{self.file} of {self.stem}"


def versions(file: Path) -> list[Version]:
    """What a file was after each commit that changed it, oldest first; commits that deleted it are left out.

    Raises
    ------
    ReadError
        If git is not installed, the file is in no repository, or no commit has it.
    """
    folder, name = file.parent, file.name
    log = ["log", f"--max-count={MOST}", "--diff-filter=AMRT", "--format=%cs %h", "--", f"./{name}"]
    lines = _git(file, *log).decode("utf-8", "replace").splitlines()
    if not lines:
        raise ReadError(f"{file}: no commit has it; 'git log {name}' in {folder} is empty")
    return [
        Version(file, line, _git(file, "cat-file", "blob", f"{line.split()[-1]}:./{name}")) for line in reversed(lines)
    ]


def _git(file: Path, *arguments: str) -> bytes:
    """What git prints in the folder of a file."""
    try:
        done = subprocess.run(
            ["git", "-C", str(file.parent), *arguments], stdin=subprocess.DEVNULL, capture_output=True, check=False
        )
    except OSError as error:
        raise ReadError(f"{file}: git cannot be run: {error.strerror or error}") from error
    if done.returncode:
        lines = done.stderr.decode("utf-8", "replace").strip().splitlines() or [f"exit code {done.returncode}"]
        raise ReadError(f"{file}: git says: {lines[0].removeprefix('fatal: ')}")
    return done.stdout
