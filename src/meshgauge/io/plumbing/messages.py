"""What an error of a reader says: the file's name once, in front, and the cause by its right name."""

from __future__ import annotations

import errno
import re
from pathlib import Path

_OF_MEMORY = re.compile(
    r"cannot allocate memory|failed to map segment|out of memory|bad_alloc|can't start new thread", re.IGNORECASE
)


def named_once(path: Path, message: str) -> str:
    """The message with the file's name in front and nowhere else; names of other files stay."""
    name = re.escape(str(path))
    other = re.compile(rf"(?<![\w./\\-])(?:(?:the )?file )?['\"`]?{name}(?![\w/\\]|\.\w)['\"`]?(: )?")
    head = re.match(rf"{name}(?![\w/\\]|\.\w)(: |, line \d+: )?", message)
    start = head[0] if head is not None else f"{path}: "
    rest = message[head.end() :] if head is not None else message
    return start + other.sub(lambda match: "" if match[1] else "the file", rest)


def is_out_of_memory(error: BaseException) -> bool:
    """Whether an error was caused by too little memory: also a library that could not be loaded for want of it."""
    seen: BaseException | None = error
    while seen is not None:
        if isinstance(seen, MemoryError) or (isinstance(seen, OSError) and seen.errno == errno.ENOMEM):
            return True
        if isinstance(seen, (ImportError, OSError, RuntimeError)) and _OF_MEMORY.search(str(seen)):
            return True
        seen = seen.__cause__ or seen.__context__
    return False


def out_of_memory(path: Path) -> str:
    """That a file takes too much memory, with the limit where there is one."""
    text = f"{path}: does not fit into memory, or states sizes that do not fit"
    try:
        import resource
    except ImportError:  # Windows
        return text
    allowed = resource.getrlimit(resource.RLIMIT_AS)[0]
    if allowed == resource.RLIM_INFINITY:
        return text
    return (
        f"{text}; {allowed / 2**30:.3g} GB of address space are allowed "
        "(--read-memory, MESHGAUGE_READ_GB or ulimit -v set another limit)"
    )
