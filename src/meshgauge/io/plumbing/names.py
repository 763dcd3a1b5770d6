"""Names of arrays and regions, as a format can hold them: what it cannot is written out, and a sentence says so."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from ...look.style import write_out
from ...mesh import CellBlock, Mesh

CONTROL = "\x00-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff"
"""In a class of a regular expression: characters that no text can hold, or that end a line in some programs."""

_LONGEST = 40


def replace_names(mesh: Mesh, also: str = "") -> tuple[Mesh, tuple[str, ...]]:
    """The mesh with names that a format can hold, and a sentence on those that changed.

    Control characters, line separators and lone surrogates become text (``\\x1b``), braces in ``also`` parentheses,
    what else is in it an underscore.
    """
    bad = re.compile(f"[{CONTROL}{re.escape(also)}]")
    notes: list[str] = []

    def plain(text: str) -> str:
        return bad.sub(lambda match: _write_out(match.group(), also), text)

    changes = {
        f"{what}_data": _rename(getattr(mesh, f"{what}_data"), plain, what, notes)
        for what in ("point", "cell", "field")
    }
    names = [plain(block.name) for block in mesh.blocks]
    if any(name != block.name for name, block in zip(names, mesh.blocks, strict=True)):
        notes.append("Names of regions have characters that the format cannot hold: written out.")
    if not notes:
        return mesh, ()
    blocks = tuple(CellBlock(name, b.start, b.stop) for name, b in zip(names, mesh.blocks, strict=True))
    return mesh.replace(blocks=blocks, **changes), tuple(notes)


def _write_out(character: str, also: str) -> str:
    if character in also:
        return {"{": "(", "}": ")"}.get(character, "_")
    return write_out(character)


def _rename(
    data: Mapping[str, NDArray[np.generic]], plain: Callable[[str], str], what: str, notes: list[str]
) -> dict[str, NDArray[np.generic]]:
    renamed: dict[str, NDArray[np.generic]] = {}
    for name, values in data.items():
        key = _free(plain(name) or "array", {*renamed, *(data if plain(name) != name else ())})
        if key != name:
            notes.append(
                f"The {what} data {name[:_LONGEST]!r} is called {key[:_LONGEST]!r}: the format cannot hold it."
            )
        if values.dtype.kind == "U" and what == "field":
            texts = [plain(str(text)) for text in values.ravel()]
            if texts != values.ravel().tolist():
                notes.append(f"Texts of the {what} data {key[:_LONGEST]!r} were changed: control characters.")
                values = np.array(texts).reshape(values.shape)
        renamed[key] = values
    return renamed


def _free(name: str, taken: Iterable[str]) -> str:
    """The name, or the first with a number behind it that is not taken."""
    if name not in taken:
        return name
    return next(f"{name} {n}" for n in range(2, 1 << 30) if f"{name} {n}" not in taken)
