"""JSON Schema of the documents that commands print: a file each, ``NAME.json``, made of docs/json-schema.md."""

from __future__ import annotations

from pathlib import Path

from ..errors import OptionError
from ..look.names import meant_or_known

FOLDER = Path(__file__).resolve().parent

NAMES = (
    "report",
    "cell",
    "check",
    "compare",
    "trend",
    "doctor",
    "improve",
    "improve-several",
    "metrics",
    "formats",
)
"""Of the documents; most are of the command of that name."""


def schema(name: str) -> str:
    """The schema of a document, as text.

    Raises
    ------
    OptionError
        If there is none of that name.
    """
    if name not in NAMES:
        raise OptionError(f"no schema {name!r}{meant_or_known(name, NAMES)}")
    return (FOLDER / f"{name}.json").read_text(encoding="utf-8")
