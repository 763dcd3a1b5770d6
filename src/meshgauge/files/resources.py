"""What a machine has left, and errors that say so: a full disk or too little memory is not blamed on a file."""

from __future__ import annotations

import contextlib
import errno
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import ResourceError, WriteError

if TYPE_CHECKING:
    import ctypes

_FULL = re.compile(r"no space left on device|disk full|out of disk space|disk quota exceeded", re.IGNORECASE)
_NO_SPACE = "no space left on"
_LITTLE = 1 << 16
"""Bytes: of a disk that has less even small files are cut off."""


def no_space(error: BaseException, path: str | os.PathLike[str]) -> str | None:
    """That there is no room to write a file, if that is what an error comes from; None else.

    Some libraries say so in words of their own, some say only that the file is broken: then the disk is asked.
    """
    seen: BaseException | None = error
    is_full, is_other = False, isinstance(error, OSError) and error.errno is not None
    while seen is not None:
        if isinstance(seen, OSError) and seen.errno in (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC)):
            is_full = True
        if isinstance(seen, WriteError) and str(seen).startswith(_NO_SPACE):  # of a file that had to be written first
            return str(seen)
        is_full |= _FULL.search(str(seen)) is not None
        seen = seen.__cause__ or seen.__context__
    place = disk_of(path)
    if not is_full and not is_other and hasattr(os, "statvfs"):
        with contextlib.suppress(OSError):
            left = os.statvfs(place)
            is_full = left.f_blocks > 0 and left.f_bavail * left.f_frsize < _LITTLE
    return f"{_NO_SPACE} {place} while writing {os.fspath(path)}" if is_full else None


def disk_of(path: str | os.PathLike[str]) -> Path:
    """Where the file system is mounted that holds a file; a device itself."""
    place = Path(os.path.realpath(path))
    with contextlib.suppress(OSError):  # a name that no file can have
        if place.is_char_device():
            return place
    while not os.path.ismount(place) and place != place.parent:
        place = place.parent
    return place


def free_memory() -> int | None:
    """Bytes that this process can still take: what is free, and what the system allows it; None where it does not say.

    The least of what is available, of what is left to the control groups of the process, and of the address space that
    ``ulimit -v`` allows.
    """
    limits = [_available(), _address_space(), *_control_groups()]
    known = [limit for limit in limits if limit is not None]
    return max(min(known), 0) if known else None


_TRIM_THRESHOLD, _MMAP_THRESHOLD, _ARENA_MAX = -1, -3, -8
"""Options of the C library's ``mallopt``."""

_LARGE, _KEPT = 32 << 20, 256 << 20
"""Bytes from which on an array is given back when it is freed (the most that can be asked for); that may be kept."""


def _c_library() -> ctypes.CDLL:
    import ctypes  # which small meshes do not wait for

    return ctypes.CDLL(None)


def give_back() -> None:
    """Let the C library return memory to the system that was freed in pieces: some tens of megabytes a thread."""
    with contextlib.suppress(OSError, AttributeError):  # glibc only
        _c_library().malloc_trim(0)


def keep_freed() -> None:
    """Let the C library keep what is freed for what is needed next, from here to the end of the process.

    Where arrays of the same sizes come and go, slice by slice, the system had to clear new pages for each: a fifth of
    the time. Larger arrays still go back at once. One pool for all threads: what one frees is of use to the others.
    """
    with contextlib.suppress(OSError, AttributeError):  # glibc only
        tune = _c_library().mallopt
        for option, value in ((_MMAP_THRESHOLD, _LARGE), (_TRIM_THRESHOLD, _KEPT), (_ARENA_MAX, 1)):
            tune(option, value)


def require(n_bytes: int, what: str, *, address_space: int = 0) -> None:
    """Raise `ResourceError` if less is left than something needs: libraries end the process, or loop, where it is.

    Parameters
    ----------
    n_bytes
        Of memory.
    what
        Needs it.
    address_space
        Bytes that have to be free where it is limited (``ulimit -v``): more than are ever used.
    """
    left, allowed = free_memory(), _address_space()
    if left is not None and left < n_bytes:
        raise ResourceError(f"too little memory: {what} takes {_size(n_bytes)}, {_size(left)} are free or allowed")
    if allowed is not None and allowed < address_space:
        raise ResourceError(
            f"too little memory: {what} takes {_size(address_space)} of address space, {_size(max(allowed, 0))} are "
            "allowed (ulimit -v)"
        )


def _size(n_bytes: int) -> str:
    return f"{n_bytes / 2**30:.3g} GB"


def _read(path: str | Path) -> str:
    try:
        with open(path, encoding="ascii", errors="replace") as file:
            return file.read()
    except OSError:
        return ""


def _available() -> int | None:
    match = re.search(r"^MemAvailable:\s+(\d+) kB", _read("/proc/meminfo"), re.MULTILINE)
    return int(match[1]) << 10 if match else None


def _address_space() -> int | None:
    try:
        import resource
    except ImportError:  # Windows
        return None
    allowed = resource.getrlimit(resource.RLIMIT_AS)[0]
    used = _read("/proc/self/statm").split()
    if allowed == resource.RLIM_INFINITY or not used:
        return None
    return allowed - int(used[0]) * resource.getpagesize()


def _control_groups() -> list[int]:
    """What each group leaves, from that of the process up; pages of files that it holds can be given back."""
    left = []
    for line in _read("/proc/self/cgroup").splitlines():
        _, kinds, name = (*line.split(":", 2), "", "")[:3]
        root, limit, usage = "/sys/fs/cgroup", "memory.max", "memory.current"
        if kinds:
            if "memory" not in kinds.split(","):
                continue
            root, limit, usage = "/sys/fs/cgroup/memory", "memory.limit_in_bytes", "memory.usage_in_bytes"
        folder = Path(root, name.lstrip("/"))
        while folder.is_relative_to(root):
            allowed, used = _read(folder / limit).strip(), _read(folder / usage).strip()
            if allowed.isdigit() and used.isdigit():
                cached = re.search(r"^(?:total_)?inactive_file (\d+)", _read(folder / "memory.stat"), re.MULTILINE)
                left.append(int(allowed) - int(used) + (int(cached[1]) if cached else 0))
            folder = folder.parent
    return left
