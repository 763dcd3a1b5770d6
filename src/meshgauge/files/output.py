"""How a file is written: whole or not at all, never through a link that somebody else put there.

Whatever is written, a mesh, a table, a page or a picture, is written to a folder of its own beside the target, which no
other user can look into, and takes the place of the target at the end. What a process that was killed left behind is
removed by the next one that writes to the same folder.
"""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import stat
import sys
from collections.abc import Iterator
from pathlib import Path

from ..errors import WriteError
from . import private, sources
from .resources import no_space
from .standard import drop, unwritten

STANDARD_OUTPUT = Path("-")
"""Names standard output, for outputs that are text."""

_OWN_STREAM = re.compile(r"/dev/(?:fd/(\d+)|(stdin|stdout|stderr))|/proc/(?:self|\d+)/fd/(\d+)")
_STREAMS = {"stdin": 0, "stdout": 1, "stderr": 2}
_LONGEST_NAME = 255


@contextlib.contextmanager
def replacing(path: str | os.PathLike[str], *, overwrite: bool = False, text: bool = False) -> Iterator[Path]:
    """A path to write to; what stands there at the end takes the place of ``path``, and nothing if anything went wrong.

    The mode of a file that is replaced is kept, its owner where the system allows. A link is followed: what it points
    to is replaced. Devices, pipes and open descriptors (``/dev/stdout``, ``>(...)``) are written into.

    Parameters
    ----------
    path
        The target.
    overwrite
        Allow a file that this run reads, see `sources.guard`.
    text
        Let ``-`` mean standard output.

    Raises
    ------
    WriteError
        If the folder is missing or may not be written to, the disk is full, or the target belongs to an input.
    """
    path = Path(path)
    try:
        with _standard_output(path) if text and path == STANDARD_OUTPUT else _replacing(path, overwrite) as temporary:
            yield temporary
    except Exception as error:
        if path == STANDARD_OUTPUT:
            raise
        full = no_space(error, path)
        if full is not None:
            raise WriteError(full) from error
        if isinstance(error, OSError):
            raise WriteError(f"{path}: cannot be written: {error.strerror or error}") from error
        raise


@contextlib.contextmanager
def new_folder(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A folder to write to; it becomes ``path`` at the end, and nothing if anything went wrong.

    Raises
    ------
    WriteError
        If there is something at ``path`` already, or it cannot be written.
    """
    path = Path(path)
    if os.path.lexists(path):
        raise WriteError(f"{path}: exists; a folder is written only where there is nothing")
    if not path.absolute().parent.is_dir():
        raise WriteError(f"{path}: there is no folder {path.parent}")
    try:
        with private.folder(path.absolute().parent) as outer:
            temporary = outer / path.absolute().name
            temporary.mkdir()
            yield temporary
            for file in temporary.rglob("*"):
                if file.is_file() and not file.is_symlink():
                    _sync(file)
            os.rename(temporary, path)
            _sync(path.absolute().parent)
    except OSError as error:
        full = no_space(error, path)
        raise WriteError(full or f"{path}: cannot be written: {error.strerror or error}") from error


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write a file of text, whole or not at all; ``-`` means standard output.

    Raises
    ------
    WriteError
        If it cannot be written.
    """
    with replacing(path, text=True) as temporary:
        # A name of bytes that are no text must not end the program.
        temporary.write_text(text, encoding="utf-8", errors="backslashreplace", newline="\n")


def check(path: str | os.PathLike[str], *, text: bool = False) -> None:
    """Raise `WriteError` if a target could not be written to: so that it is known before the work, not after."""
    path = Path(path)
    if text and path == STANDARD_OUTPUT:
        return
    try:
        target = _target(path)
        if _is_stream(target):
            return
        sources.check(target)
        folder = target.parent
        if not os.access(folder, os.W_OK | os.X_OK):
            raise WriteError(f"{path}: the folder {folder} may not be written to")
    except OSError as error:
        raise WriteError(f"{path}: cannot be written: {error.strerror or error}") from error


@contextlib.contextmanager
def _replacing(path: Path, overwrite: bool) -> Iterator[Path]:
    target = _target(path)
    if _is_stream(target):
        with _copy_into(target) as temporary:
            yield temporary
        return
    with (
        sources.pending(target, overwrite=overwrite),
        private.folder(target.parent) as folder,
        private.plain_folder(folder) as shown,
    ):
        name = target.name if private.is_plain(target.name) else f"output.{target.name.partition('.')[2]}"
        temporary = folder / name
        yield shown / name
        if not overwrite:
            sources.check(target)
        _like(temporary, target)
        _sync(temporary)
        os.replace(temporary, target)
        _sync(target.parent)


def _target(path: Path) -> Path:
    """The file that is meant, links followed; a stream as it is named."""
    if path == STANDARD_OUTPUT:
        raise WriteError("-: standard output takes text only; name a file")
    if _OWN_STREAM.fullmatch(os.path.abspath(path)):
        return path
    if not path.parent.is_dir():
        raise WriteError(f"{path}: there is no folder {path.parent}")
    if path.is_dir():
        raise WriteError(f"{path}: is a folder")
    if path.is_symlink():
        followed = path
        for _ in range(40):
            followed = followed.parent / os.readlink(followed)
            if _OWN_STREAM.fullmatch(os.path.abspath(followed)):
                return followed
            if not followed.is_symlink():
                return _target(followed)
        raise WriteError(f"{path}: is a link that leads to itself")
    if len(os.fsencode(path.name)) > _LONGEST_NAME:
        raise WriteError(f"{path.name[:40]}...: cannot be written: File name too long")
    return path


def _is_stream(target: Path) -> bool:
    """A device, a pipe or a descriptor: it has no content that could be replaced."""
    if _OWN_STREAM.fullmatch(os.path.abspath(target)):
        return True
    try:
        return not stat.S_ISREG(os.stat(target).st_mode)
    except FileNotFoundError:
        return False


@contextlib.contextmanager
def _standard_output(path: Path) -> Iterator[Path]:
    with _scratch("out") as temporary:
        yield temporary
        try:
            binary = getattr(sys.stdout, "buffer", None)
            sys.stdout.flush()
            if binary is None:
                sys.stdout.write(temporary.read_text(encoding="utf-8", errors="surrogateescape"))
            else:
                with temporary.open("rb") as file:
                    shutil.copyfileobj(file, binary)
            sys.stdout.flush()
        except BrokenPipeError:  # nobody reads any more
            drop(sys.stdout)
        except OSError as error:
            raise WriteError(unwritten(error)) from error


@contextlib.contextmanager
def _copy_into(target: Path) -> Iterator[Path]:
    own = _OWN_STREAM.fullmatch(os.path.abspath(target))
    with _scratch(target.name) as temporary:
        yield temporary
        if own is not None:
            number = int(own[1] or own[3]) if own[2] is None else _STREAMS[own[2]]
            if number in (1, 2):  # which may have been moved
                stream = sys.stdout if number == 1 else sys.stderr
                stream.flush()
                with contextlib.suppress(OSError, ValueError):  # of a stream in memory
                    number = stream.fileno()
            into = os.dup(number)  # opened anew it would begin at its first byte
        else:
            into = os.open(target, os.O_WRONLY)
        with contextlib.suppress(BrokenPipeError), os.fdopen(into, "wb") as sink, temporary.open("rb") as file:
            shutil.copyfileobj(file, sink)


@contextlib.contextmanager
def _scratch(name: str) -> Iterator[Path]:
    with private.folder() as folder:
        yield folder / name


def _like(temporary: Path, target: Path) -> None:
    """Owner and mode of the file that is to be replaced."""
    try:
        old = os.stat(target)
    except FileNotFoundError:
        return
    new, mode = os.stat(temporary), stat.S_IMODE(old.st_mode)
    if hasattr(os, "chown") and (old.st_uid, old.st_gid) != (new.st_uid, new.st_gid):
        try:
            os.chown(temporary, old.st_uid, old.st_gid)
        except OSError:
            mode &= ~(stat.S_ISUID | stat.S_ISGID)
            with contextlib.suppress(OSError):
                os.chown(temporary, -1, old.st_gid)
    os.chmod(temporary, mode)


def _sync(path: Path) -> None:
    """Have the system write a file, or the names in a folder, to the disk."""
    if path.is_dir() and os.name != "posix":
        return
    number = os.open(path, os.O_RDONLY if os.name == "posix" else os.O_RDWR | getattr(os, "O_BINARY", 0))
    try:
        os.fsync(number)
    except OSError as error:
        if not path.is_dir():  # some file systems know no such thing of folders
            raise error
    finally:
        os.close(number)
