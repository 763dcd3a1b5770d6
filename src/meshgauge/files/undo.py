"""Undo: the old bytes of what changed in a file, so that the first file comes back to its last byte."""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
import zipfile
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ReadError, WriteError
from .hunks import Hunks
from .output import new_folder, replacing

KIND = "meshgauge-undo-3"


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
        old, new = change.old.read_bytes(), change.new.read_bytes()
        arrays[f"{number}.digests"] = np.array([_digest(old), _digest(new)])
        if change.hunks is None:
            kept = old
        else:
            arrays[f"{number}.hunks"] = np.concatenate([change.hunks.old, change.hunks.new], axis=1)
            kept = b"".join(old[start:end] for start, end in change.hunks.old.tolist())
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
            for name, data in files.items():
                (new / name).write_bytes(data)
        return True
    if len(files) > 1 and target != file and os.path.realpath(target.parent) == os.path.realpath(file.parent):
        raise WriteError(
            f"{target}: {len(files) - 1} more files changed with {file}: undo in place or in another folder"
        )
    here, there = (one if file.is_dir() else one.parent for one in (file, target))
    targets = {name: there / name if name else target for name in files}
    changed = any(data != (here / name if name else file).read_bytes() for name, data in files.items())
    with contextlib.ExitStack() as stack:
        for name, data in files.items():
            stack.enter_context(replacing(targets[name], overwrite=True)).write_bytes(data)
    return changed


def restored(path: str | os.PathLike[str], target: Path) -> dict[str, bytes]:
    """The bytes of each file as it was, by its name as in `Change`.

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
    files: dict[str, bytes] = {}
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


def _restored(path: str | os.PathLike[str], data: Any, number: int, target: Path) -> bytes:
    was, written = data[f"{number}.digests"].tolist()
    now = target.read_bytes()
    kept: bytes = data[f"{number}.bytes"].tobytes()
    digest = _digest(now)
    if digest == was:
        return now
    if digest != written:
        raise ReadError(f"{path}: undo data of another file, or {target} was changed since")
    if f"{number}.hunks" not in data:
        old = kept
    else:
        pieces, at, begin = [], 0, 0
        for old_start, old_end, start, end in data[f"{number}.hunks"].tolist():
            pieces += [now[at:start], kept[begin : begin + old_end - old_start]]
            at, begin = end, begin + old_end - old_start
        old = b"".join([*pieces, now[at:]])
    if _digest(old) != was:
        raise ReadError(f"{path}: undo data that are damaged: the old file does not come back")
    return old


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
