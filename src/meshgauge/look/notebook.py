"""Small tables for notebooks: plain HTML, everything escaped, nothing loaded from anywhere, on dark and on light.

Text has the colour of the notebook; the colours of bands stand beside it, as dots and bars, never alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from .colours import ON_ANY

INVALID, POOR, GOOD = (ON_ANY[band] for band in ("invalid", "poor", "good"))
"""Of dots and bars; a number always stands beside."""

FAINT = "rgba(128, 128, 128, 0.45)"

Cell = str | tuple[str, str]
"""Text of a cell, or text and the colour of a dot before it."""


class Raw(str):
    """Text that is HTML already."""

    __slots__ = ()


def table(head: Sequence[str], rows: Iterable[Sequence[Cell]], *, left: int = 1) -> Raw:
    """A table; the first ``left`` columns are text, the others numbers."""
    lines = [_row(head, "th", left)] if head else []
    lines += [_row(row, "td", left) for row in rows]
    style = "border-collapse: collapse; border: none; margin: 0.3em 0; color: inherit; font-size: inherit"
    style += "; font-variant-numeric: tabular-nums"
    return Raw(f'<table style="{style}">{"".join(lines)}</table>')


def block(title: str, *parts: str) -> Raw:
    """A heading and what is below it; text that is not `Raw` is a paragraph."""
    shown = (
        part if isinstance(part, Raw) else f'<div style="opacity: 0.75; margin: 0.2em 0">{escape(part)}</div>'
        for part in parts
        if part
    )
    return Raw(f'<div style="overflow-x: auto"><div><b>{escape(title)}</b></div>{"".join(shown)}</div>')


def bars(counts: Sequence[int], colours: Sequence[str], *, width: int = 132, height: int = 20) -> Raw:
    """A small histogram; a count of 1 is seen, whatever the others are."""
    top, step = max(counts, default=0), width / max(len(counts), 1)
    parts = []
    for n, (count, colour) in enumerate(zip(counts, colours, strict=True)):
        if count:
            tall = max(height * count / top, 1.5)
            box = f'x="{n * step:.1f}" y="{height - tall:.1f}" width="{step * 0.85:.1f}" height="{tall:.1f}"'
            parts.append(f'<rect {box} fill="{colour}"/>')
    line = f'<line x1="0" x2="{width}" y1="{height}" y2="{height}" stroke="{FAINT}"/>'
    label = "histogram from -1 to 1"
    size = f'width="{width}" height="{height + 1}"'
    return Raw(f'<svg role="img" aria-label="{label}" {size}>{"".join(parts)}{line}</svg>')


def quality(value: float) -> str:
    """A value in at most seven characters; a dash for NaN."""
    if value != value:
        return "–"
    size = abs(value)
    text = f"{value:.0e}" if 0 < size < 5e-4 else f"{value:.3f}" if size < 100 else f"{value:.4g}"
    return text.replace("-", "\N{MINUS SIGN}")


def count(n: int, colour: str) -> Cell:
    """A number of cells, with a dot if there are any."""
    return (f"{n:,}", colour) if n else "0"


def _row(cells: Sequence[Cell], tag: str, left: int) -> str:
    parts = []
    for n, cell in enumerate(cells):
        text, colour = cell if isinstance(cell, tuple) else (cell, "")
        inner = text if isinstance(text, Raw) else escape(text)
        if colour:
            inner = f'<span style="color: {colour}">●</span> <b>{inner}</b>'
        style = f"text-align: {'left' if n < left else 'right'}; padding: 0.15em 0.7em; background: none; border: none"
        if tag == "th":
            style += f"; font-weight: normal; opacity: 0.75; border-bottom: 1px solid {FAINT}"
        parts.append(f'<{tag} style="{style}">{inner}</{tag}>')
    return f'<tr style="background: none">{"".join(parts)}</tr>'
