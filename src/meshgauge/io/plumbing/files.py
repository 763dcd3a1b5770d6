"""Files at the door: what is checked before a reader sees one."""

from __future__ import annotations

import contextlib
import gzip
import shutil
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path

from ...errors import ReadError
from ...files import private, sources
from ...files.resources import no_space
from .format import HEAD

_GZIP = b"\x1f\x8b"
_ASKED_WHOLE = (b"\x89HDF", b"CDF")
"""Beginnings of containers: what is in them is not at their beginning."""


@contextlib.contextmanager
def open_input(path: Path, detect: Callable[[Path, bytes], object] | None = None) -> Iterator[tuple[Path, bytes]]:
    """The path to read and its first bytes; a gzipped file is unpacked beside nothing, in a folder of its own.

    Parameters
    ----------
    path
        Of the file.
    detect
        Raises for first bytes of no known format: a packed file is then not unpacked.

    Raises
    ------
    ReadError
        If there is no such file, it is a folder, it may not be read, it is not a whole gzip file, or there is no room
        to unpack it.
    """
    head = _head(path)
    sources.note(path)
    if not head.startswith(_GZIP):
        with private.plain_file(path) as plain, _named(plain, path):
            yield plain, head
        return
    with private.folder() as folder:
        name = path.name[:-3] if path.suffix.lower() == ".gz" else path.name
        name = name if private.is_plain(name) else f"mesh.{name.partition('.')[2]}"
        plain = folder / name
        with _named(plain, path):
            try:
                with gzip.open(path, "rb") as packed, plain.open("wb") as file:
                    start = packed.read(HEAD)
                    if detect is not None and not start.startswith(_ASKED_WHOLE):
                        detect(plain, start)
                    file.write(start)
                    shutil.copyfileobj(packed, file, 1 << 20)
            except (gzip.BadGzipFile, EOFError, zlib.error) as error:
                raise ReadError(f"{path}: not a whole gzip file: {error}") from error
            except OSError as error:
                reason = f"{path}: cannot be unpacked in {folder}: {error.strerror or error}"
                raise ReadError(no_space(error, plain) or reason) from error
            yield plain, _head(plain)


def is_packed(path: Path) -> bool:
    """Whether a file is packed by gzip."""
    return _head(path).startswith(_GZIP)


@contextlib.contextmanager
def _named(plain: Path, path: Path) -> Iterator[None]:
    """Errors of the file that is read name the one that was asked for."""
    try:
        yield
    except ReadError as error:
        if plain == path:
            raise
        raise ReadError(str(error).replace(str(plain), str(path))) from error


def _head(path: Path) -> bytes:
    try:
        if path.is_dir():
            raise ReadError(f"{path}: is a folder, not a mesh file")
        if not path.exists():
            raise ReadError(f"{path}: no such file")
        if not path.is_file():
            raise ReadError(f"{path}: is not a regular file")
        with path.open("rb") as file:
            return file.read(HEAD)
    except PermissionError:
        raise ReadError(f"{path}: may not be read (permission denied)") from None
    except (OSError, ValueError) as error:  # a name too long, or with a zero byte in it
        raise ReadError(f"{path}: cannot be opened: {getattr(error, 'strerror', None) or error}") from error
