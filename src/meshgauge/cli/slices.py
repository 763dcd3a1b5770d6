"""Large meshes, measured slice by slice: which they are, how far it is, and where a run was stopped."""

from __future__ import annotations

import contextlib
import os
import re
import sys
import time
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from ..errors import OptionError, ReadError
from ..files.resources import free_memory, keep_freed
from ..io import pieces_as_one
from ..io.reading import takes
from ..look.style import number, number_of
from .terminal import activity

if TYPE_CHECKING:
    from ..doctor.streamed.passes import Share
    from ..io.plumbing.pieces import Pieces
    from ..io.plumbing.steps import StepChoice
    from ..slices import Progress

WHOLE = 3.0
"""Times the bytes of its arrays that a mesh takes where it is read and measured whole."""

_UNITS = {"": 1, "k": 1000, "m": 1000**2, "g": 1000**3, "t": 1000**4}
_SIZE = re.compile(r"\s*(\d+(?:\.\d*)?)\s*([kmgt]?)(i?)b\s*", re.IGNORECASE)


_last: list[tuple[object, Pieces]] = []


def listed(files: Sequence[str], file_format: str | None, step: StepChoice) -> Pieces | None:
    """Where the arrays of a mesh stand, see `pieces_as_one`. The last is kept: a run asks for its outputs as well, and
    to list some formats all of a mesh is read."""
    key = (tuple(map(os.path.abspath, files)), file_format, step)
    if _last and _last[0][0] == key:
        with contextlib.suppress(ReadError, OSError):
            _last[0][1].check_unchanged()
            return _last[0][1]
    _last.clear()
    made = pieces_as_one(files, file_format=file_format, step=step)
    if made is not None:
        _last.append((key, made))
    return made


def takes_more(listed: Pieces | None, memory: int | None) -> bool:
    """Whether a mesh in pieces takes more memory as a whole than is allowed, or free if nothing is said."""
    allowed = memory if memory is not None else free_memory()
    return listed is not None and allowed is not None and WHOLE * listed.n_bytes > allowed


def has_room(files: Sequence[str], file_format: str | None, memory: int | None) -> bool | None:
    """Whether cases, of which all is read to list their pieces, take no more than is allowed, or free; None of files of
    another kind."""
    needed = [n for file in files if (n := takes(file, file_format)) is not None]
    if len(needed) < len(files):
        return None
    allowed = memory if memory is not None else free_memory()
    return allowed is None or sum(needed) <= allowed


def n_bytes(text: str) -> int:
    """Bytes of a size such as ``512MB``, ``1.5 GB`` or ``4GiB``.

    Raises
    ------
    OptionError
        If it is none.
    """
    match = _SIZE.fullmatch(text)
    if match is None:
        raise OptionError(f"--memory is {text!r}, expected a size such as 512MB or 4GB")
    unit = _UNITS[match[2].lower()]
    return int(float(match[1]) * (1024 ** (len(str(unit)) // 3) if match[3] else unit))


def size_text(n: float) -> str:
    """``1.5GB``, as `n_bytes` takes it."""
    for unit in ("TB", "GB", "MB"):
        size = _UNITS[unit[0].lower()]
        if n >= size:
            return f"{n / size:.3g}{unit}"
    return f"{n / 1000:.3g}kB"


@contextlib.contextmanager
def progress(path: str, *, shown: bool) -> Iterator[Progress]:
    """A line on standard error, if that is a terminal, with what is done and the time that is left.

    Where Ctrl-C or another signal stops it, a line says how far it was. Slices use the memory of those before.
    """
    keep_freed()
    start, at = time.monotonic(), (0, 0)
    with activity(f"measuring {path}", shown=shown) as working:

        def update(done: int, total: int) -> None:
            nonlocal at
            at = done, total
            left = (time.monotonic() - start) * (total - done) / done
            working.text = f"measuring {path}: {done / total:.0%}, {duration(left)} left"

        try:
            yield update
        except KeyboardInterrupt:
            done, total = at
            of_all = f"{number(done)} of {number_of(total, 'cell was', 'cells were')} measured"
            _say_stopped(path, of_all if total else "none measured")
            raise


@contextlib.contextmanager
def diagnosing(path: str, *, shown: bool, then: str = "diagnosing") -> Iterator[Share]:
    """A line as `progress` has it while a mesh that was measured is diagnosed, and ``then`` drawn; where that is
    stopped, it says how far it was."""
    start, far = time.monotonic(), 0.0
    with activity(f"diagnosing {path}", shown=shown) as working:

        def update(share: float) -> None:
            nonlocal far
            far = share
            if share >= 1.0:
                working.text = f"{then} {path}"
            elif share > 0.0:
                left = (time.monotonic() - start) * (1.0 - share) / share
                working.text = f"diagnosing {path}: {share:.0%}, {duration(left)} left"

        try:
            yield update
        except KeyboardInterrupt:
            how_far = f"; {far:.0%} of it was done" if 0.0 < far < 1.0 else ""
            of_diagnosis = "diagnosed" if far >= 1.0 else f"the diagnosis was not finished{how_far}"
            _say_stopped(path, f"all cells were measured{' and ' if far >= 1.0 else ', '}{of_diagnosis}")
            raise


def _say_stopped(path: str, far: str) -> None:
    with contextlib.suppress(OSError, ValueError, RuntimeError):
        print(f"meshgauge: {path}: stopped, {far}", file=sys.stderr)


def duration(seconds: float) -> str:
    """``40 s``, or ``10 min``."""
    return f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.0f} min"
