"""Counts in sentences: what stands behind a number agrees with it, everywhere in the program."""

from __future__ import annotations

import re
from pathlib import Path

import meshgauge
from meshgauge.look.style import number_of, plural

PLURAL = re.compile(
    r"\{[^{}]*\}( [a-z]+)? (cells|points|faces|edges|nodes) (were|belong|stay|take|slide|coincide|look)\b"
)
SOURCES = Path(meshgauge.__file__).parent


def test_words_agree_with_their_number() -> None:
    assert [plural(n, "cell") for n in (0, 1, 2000)] == ["0 cells", "1 cell", "2,000 cells"]
    assert [number_of(n, "face is", "faces are") for n in (0, 1, 2000)] == [
        "0 faces are",
        "1 face is",
        "2,000 faces are",
    ]


def test_no_sentence_has_one_cells() -> None:
    assert PLURAL.search("f'{n:,} cells were repaired'")
    found = [
        f"{path.relative_to(SOURCES)}: {line.strip()}"
        for path in sorted(SOURCES.rglob("*.py"))
        for line in path.read_text(encoding="utf-8").splitlines()
        if PLURAL.search(line) and "number_of(" not in line
    ]
    assert found == []
