"""What a reader in a process of its own may see: the folder of the file and the installation, and nothing to write to.

Guards that look for names in a file know the places where a format keeps them; a reader may know others. The kernel is
asked to refuse all else (Landlock, https://docs.kernel.org/userspace-api/landlock.html); where it cannot, Python's own
files are held to the same folders.
"""

from __future__ import annotations

import contextlib
import ctypes
import errno
import os
import sys
import sysconfig
from collections.abc import Iterable
from pathlib import Path

_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF = 444, 445, 446
_NO_NEW_PRIVILEGES = 38
_BELOW_A_PATH = 1
_EXECUTE, _WRITE_FILE, _READ_FILE, _READ_FOLDER = 1 << 0, 1 << 1, 1 << 2, 1 << 3
_ALL = (1 << 13) - 1
"""Every right of the first version: reading, writing, making and removing."""

SYSTEM = (
    *("/usr", "/lib", "/lib64", "/opt", "/nix/store", "/gnu/store"),
    *("/etc/ld.so.cache", "/proc/cpuinfo", "/proc/meminfo", "/sys/devices/system/cpu"),
)
"""Where systems keep libraries, and what those look at when they are loaded."""

MORE = "MESHGAUGE_READ_FOLDERS"
"""Environment variable: further folders that readers may see, such as those of libraries in unusual places."""

DEVICES = ("/dev/null", "/dev/urandom", "/dev/random")


class _Ruleset(ctypes.Structure):
    _fields_ = (("handled", ctypes.c_uint64),)


class _Below(ctypes.Structure):
    _pack_ = 1
    _layout_ = "ms"
    _fields_ = (("allowed", ctypes.c_uint64), ("parent", ctypes.c_int32))


def confine(folders: Iterable[str | Path], *, scratch: str | None = None, uses_kernel: bool = True) -> None:
    """Let this process read nothing but some folders and the installation, and write nothing else, from now on.

    Descriptors that are open stay so. Call it before threads are started: the kernel confines those made afterwards.

    Parameters
    ----------
    folders
        What may be read, with all below.
    scratch
        A folder that may be written to.
    uses_kernel
        False: Python's own files are held to the folders, whatever the kernel could do.
    """
    readable = [str(folder) for folder in folders] + installation()
    if not (uses_kernel and sys.platform == "linux" and _by_kernel([*readable, *SYSTEM], scratch)):
        _by_python(readable, scratch)


def installation() -> list[str]:
    """Folders of this interpreter, of what is installed for it, and of libraries that the environment names.

    Not that of the program that runs, nor the working folder, which ``sys.path`` also holds.
    """
    ours = Path(__file__).resolve().parents[2]
    installed = [entry for entry in sys.path if Path(entry).name in ("site-packages", "dist-packages")]
    named = [
        entry for name in ("LD_LIBRARY_PATH", MORE) for entry in os.environ.get(name, "").split(os.pathsep) if entry
    ]
    # Clusters have packages in folders that modules name; one without a whole path may be the working folder.
    modules = [entry for entry in os.environ.get("PYTHONPATH", "").split(os.pathsep) if Path(entry).is_absolute()]
    return [str(ours), *installed, *modules, sys.prefix, sys.base_prefix, *sysconfig.get_paths().values(), *named]


def _by_kernel(readable: list[str], scratch: str | None) -> bool:
    """False if the kernel knows no Landlock, or another barrier forbids to use it."""
    libc = ctypes.CDLL(None, use_errno=True)
    rules = _Ruleset(_ALL)
    number = libc.syscall(_CREATE_RULESET, ctypes.byref(rules), ctypes.c_size_t(ctypes.sizeof(rules)), 0)
    if number < 0:
        return False
    try:
        rights = (
            (readable, _READ_FILE, _READ_FILE | _READ_FOLDER),
            (DEVICES, _READ_FILE | _WRITE_FILE, 0),
            ([scratch] if scratch is not None else [], 0, _ALL & ~_EXECUTE),
        )
        for paths, of_file, of_folder in rights:
            for path in paths:
                with contextlib.suppress(OSError):  # what is not there needs no rule
                    _allow(libc, number, path, of_file, of_folder)
        return bool(libc.prctl(_NO_NEW_PRIVILEGES, 1, 0, 0, 0) == 0 and libc.syscall(_RESTRICT_SELF, number, 0) == 0)
    finally:
        os.close(number)


def _allow(libc: ctypes.CDLL, ruleset: int, path: str, of_file: int, of_folder: int) -> None:
    parent = os.open(path, os.O_PATH | os.O_CLOEXEC)
    try:
        rule = _Below(of_folder if os.path.isdir(path) else of_file, parent)
        libc.syscall(_ADD_RULE, ruleset, _BELOW_A_PATH, ctypes.byref(rule), 0)
    finally:
        os.close(parent)


def _by_python(readable: list[str], scratch: str | None) -> None:
    roots = [os.path.realpath(path) for path in readable]
    own = [os.path.realpath(scratch)] if scratch is not None else []

    def is_below(path: str, folders: list[str]) -> bool:
        return any(path == folder or path.startswith(folder.rstrip(os.sep) + os.sep) for folder in folders)

    def refuse(event: str, arguments: tuple[object, ...]) -> None:
        if event != "open" or not isinstance(arguments[0], str | bytes):
            return
        path, flags = os.path.realpath(os.fsdecode(arguments[0])), arguments[2]
        is_written = isinstance(flags, int) and bool(flags & (os.O_WRONLY | os.O_RDWR))
        if path not in DEVICES and not is_below(path, own if is_written else roots + own):
            raise PermissionError(errno.EACCES, "is outside of what a reader may see", path)

    sys.addaudithook(refuse)
