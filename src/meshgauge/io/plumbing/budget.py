"""What a reader may make of a file: a small one must not take all memory."""

from __future__ import annotations

from pathlib import Path

from ...errors import ReadError

DENSEST = 1100
"""Bytes that one packed byte can stand for: zlib packs 1032 zero bytes into one."""

LEAST = 64 << 20
"""Bytes that any file may stand for: HDF5 keeps arrays of one value in none."""


class Budget:
    """Bytes that arrays may take together: no more than a file of its size can hold, however it is packed.

    An array may be counted more than once: where many names stand for one place of the file, the file holds it once and
    memory would hold it as often as it is named.

    Parameters
    ----------
    path
        The file, for the error.
    size
        Its bytes, with those of the files that belong to it.
    is_packed
        True if arrays may be packed.
    """

    def __init__(self, path: Path, size: int, *, is_packed: bool) -> None:
        self.path, self.size = path, size
        self.most = max(LEAST, size * DENSEST) if is_packed else max(LEAST, size)
        self.drawn = 0

    def draw(self, n_bytes: int, name: str) -> None:
        """Raise `ReadError` if so many bytes for this array are more than is left."""
        self.drawn += n_bytes
        if n_bytes < 0 or self.drawn > self.most:
            raise ReadError(
                f"{self.path}: the arrays up to {name!r} take {self.drawn:,} bytes, more than a file of {self.size:,} "
                "bytes can hold"
            )
