"""Undo: the old bytes of what changed in a file, so that the first file comes back to its last byte."""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ..errors import ReadError, WriteError
from .hunks import Hunks
from .output import new_folder, replacing

KIND = "meshgauge-undo-3"

PART = 1 << 22
"""Bytes of a file that are copied at a time."""


@dataclass(frozen=True, eq=False)
class Change:
    """A file before and after.

    Attributes
    ----------
    old, new
        Where each stands now.
    hunks
        Where they differ; None: everywhere.
    name
        Its path from the folder that is undone, or from that of the file that is undone; "" for the file itself.
    """

    old: Path
    new: Path
    hunks: Hunks | None = None
    name: str = ""


def store(path: str | os.PathLike[str], changes: Sequence[Change]) -> None:
    """Keep what stood in files before they changed. It is on the disk when this returns.

    Raises
    ------
    WriteError
        If the file cannot be written.
    """
    arrays: dict[str, Any] = {"kind": np.array(KIND), "names": np.array([change.name for change in changes], np.str_)}
    for number, change in enumerate(changes):
        arrays[f"{number}.digests"] = np.array([_digest(change.old), _digest(change.new)])
        if change.hunks is None:
            kept = change.old.read_bytes()
        else:
            arrays[f"{number}.hunks"] = np.concatenate([change.hunks.old, change.hunks.new], axis=1)
            kept = b"".join(_pieces(change.old, change.hunks.old.tolist()))
        arrays[f"{number}.bytes"] = np.frombuffer(kept, np.uint8)
    with replacing(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, **arrays)


def bring_back(path: str | os.PathLike[str], file: Path, target: Path) -> bool:
    """Write a file as it was before it changed, and with it others that changed with it.

    Parameters
    ----------
    path
        The undo data.
    file
        What was written.
    target
        Where to: the file itself, or another.

    Returns
    -------
    bool
        False if the file was what it had been already.

    Raises
    ------
    ReadError
        As `restored`.
    WriteError
        If a file cannot be written; or others changed with it that would be replaced, unasked.
    """
    files = restored(path, file)
    if file.is_dir() and target != file:
        with new_folder(target) as new:
            shutil.copytree(file, new, symlinks=True, dirs_exist_ok=True)
            for name, old in files.items():
                old.write(new / name)
        return True
    if len(files) > 1 and target != file and os.path.realpath(target.parent) == os.path.realpath(file.parent):
        raise WriteError(
            f"{target}: {len(files) - 1} more files changed with {file}: undo in place or in another folder"
        )
    there = target if file.is_dir() else target.parent
    with contextlib.ExitStack() as stack:
        for name, old in files.items():
            place = there / name if name else target
            old.write(stack.enter_context(replacing(place, overwrite=True)))
    return any(old.has_changed for old in files.values())


@dataclass(frozen=True, eq=False)
class Old:
    """A file as it was before it changed, made of what it is now.

    Attributes
    ----------
    undo
        The undo data.
    now
        The file that changed.
    has_changed
        False if it is what it was already.
    hunks
        ``(n, 4)`` where it changed: first byte and that behind the last, before and now; None: everywhere.
    kept
        The bytes that stood there.
    digest
        Of the file as it was.
    """

    undo: str
    now: Path
    has_changed: bool
    hunks: np.ndarray | None
    kept: bytes
    digest: str

    def pieces(self) -> Iterator[bytes]:
        """Its bytes, some at a time. Raises `ReadError` at the end if they are not what they were."""
        digest = hashlib.sha256()
        try:
            for piece in self._pieces():
                digest.update(piece)
                yield piece
        except (ValueError, TypeError, AttributeError) as error:  # numbers of no places
            raise ReadError(f"{self.undo}: not a file of undo data") from error
        if digest.hexdigest() != self.digest:
            raise ReadError(f"{self.undo}: undo data that are damaged: the old file does not come back")

    def _pieces(self) -> Iterator[bytes]:
        if self.hunks is None and self.has_changed:
            yield self.kept
            return
        hunks = self.hunks.tolist() if self.has_changed and self.hunks is not None else []
        at, begin = 0, 0
        with self.now.open("rb") as file:
            for old_start, old_end, start, end in hunks:
                file.seek(at)
                yield from _parts(file, start - at)
                yield self.kept[begin : begin + old_end - old_start]
                at, begin = end, begin + old_end - old_start
            file.seek(at)
            yield from _parts(file)

    def write(self, path: Path) -> None:
        """Write it. Raises `ReadError` as `pieces`."""
        with path.open("wb") as file:
            for piece in self.pieces():
                file.write(piece)


def restored(path: str | os.PathLike[str], target: Path) -> dict[str, Old]:
    """Each file as it was, by its name as in `Change`.

    Parameters
    ----------
    path
        The undo data.
    target
        The file, or the folder, that changed. A file that is what it was already stays so.

    Raises
    ------
    ReadError
        If one cannot be read, the undo data are none, or a file is neither the old one nor the one that was written.
    """
    files: dict[str, Old] = {}
    folder = target if target.is_dir() else target.parent
    try:
        with np.load(path, allow_pickle=False) as data:
            if str(data["kind"]) != KIND:
                raise ReadError(f"{path}: undo data of the kind {str(data['kind'])!r}, expected {KIND!r}")
            for number, name in enumerate(data["names"].tolist()):
                if os.path.isabs(name) or ".." in Path(name).parts:
                    raise ReadError(f"{path}: not undo data: names the file {name!r}")
                files[name] = _restored(path, data, number, folder / name if name else target)
    except OSError as error:
        raise ReadError(f"{error.filename or path}: cannot be read: {error.strerror or error}") from error
    except (KeyError, ValueError, TypeError, AttributeError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise ReadError(f"{path}: not a file of undo data") from error
    return files


def _restored(path: str | os.PathLike[str], data: Any, number: int, target: Path) -> Old:
    was, written = data[f"{number}.digests"].tolist()
    digest = _digest(target)
    if digest not in (was, written):
        raise ReadError(f"{path}: undo data of another file, or {target} was changed since")
    hunks = data.get(f"{number}.hunks")
    return Old(os.fspath(path), target, digest != was, hunks, data[f"{number}.bytes"].tobytes(), was)


def _pieces(path: Path, ranges: Iterable[tuple[int, int]]) -> Iterator[bytes]:
    """Bytes of a file from each first up to a last."""
    with path.open("rb") as file:
        for start, end in ranges:
            file.seek(start)
            yield file.read(end - start)


def _parts(file: BinaryIO, size: int | None = None) -> Iterator[bytes]:
    """So many bytes from where a file stands, some at a time; None: all."""
    while size is None or size > 0:
        part = file.read(PART if size is None else min(size, PART))
        if not part:
            return
        size = None if size is None else size - len(part)
        yield part


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
