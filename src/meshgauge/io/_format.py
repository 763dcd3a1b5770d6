"""What a file format is to the registry: one frozen record, made by one file a format."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ..mesh import Mesh

Reader = Callable[[Path], Mesh]
"""Reads a file. Wedges stay in the order of the file: `wedge_order.settled` turns them afterwards."""

Writer = Callable[[Path, Mesh], tuple[str, ...]]
"""Writes a file that does not exist yet; returns what the format could not hold, a sentence each."""

Sniffer = Callable[[bytes, Path], bool]
"""True if the first bytes of a file (up to `HEAD` of them) are of this format."""

HEAD = 4096
"""Bytes of a file that are sniffed."""


@dataclass(frozen=True, slots=True)
class Format:
    """One file format.

    Attributes
    ----------
    name
        Short name, as given to ``format=``.
    title
        What the format is called in messages.
    extensions
        Lower case, with the dot. Two formats may share one: the content then decides.
    sniff
        Tells the format by the first bytes of a file.
    read, write
        None where the format cannot be read or written.
    by_content
        False if the bytes tell this format only together with its extension.
    """

    name: str
    title: str
    extensions: tuple[str, ...]
    sniff: Sniffer
    read: Reader | None = None
    write: Writer | None = None
    by_content: bool = True


def anything(head: bytes, path: Path) -> bool:
    """Sniffer of a format that has no mark: its extension decides."""
    return True
