"""A distribution as a chart of Mermaid, which GitHub and GitLab draw where they show Markdown.

Their pages strip pictures that are in the text (addresses that begin with ``data:``), and styles, so that a picture
would have to be a file somewhere else.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from ...look.colours import DEGENERATE, FAINT, INVALID, POOR, RAMP, UNKNOWN
from ...quality.summary import Tally

BINS = 20
"""Bars from -1 to 1."""

COLOURS = {"good": RAMP[1], "poor": POOR, "undecided": UNKNOWN, "degenerate": DEGENERATE, "invalid": INVALID}
"""Of bars, the later over the earlier."""

FLOOR = FAINT
"""Of a line below them: Mermaid draws bars of 0, and those of the last would be a line of its colour."""


def chart(tally: Tally) -> Iterator[str]:
    """A fenced block of lines: bars of cells by J_ENS, in the colours of the reports.

    Bars grow by powers of ten, so that one bad cell in a million is seen: a bar of 1, 2, 3 is one of 9, 99, 999 cells.
    """
    edges, parts = tally.histogram_by_status(BINS)
    valid, poor = parts["valid"], edges[1:] <= tally.scale.acceptable[0] + 1e-9
    bars = {"good": valid * ~poor, "poor": valid * poor, **parts}
    # One over another: each is as high as it and all that are to lie over it.
    heights, below = {}, 0 * valid
    for name in reversed(COLOURS):
        below = below + bars[name]
        heights[name] = below * (bars[name] > 0)
    there = [name for name in COLOURS if bars[name].any()]
    top = max(math.ceil(math.log10(1 + int(below.max()))), 1)
    yield "```mermaid"
    yield "---"
    yield "config:"
    yield "  xyChart: {width: 720, height: 260}"
    palette = ", ".join([*(COLOURS[name] for name in there), FLOOR])
    yield f"  themeVariables: {{xyChart: {{plotColorPalette: '{palette}'}}}}"
    yield "---"
    yield "xychart-beta"
    yield f'  title "{_title(tally)}"'
    yield '  x-axis "quality J_ENS" -1 --> 1'
    yield f'  y-axis "cells, powers of ten" 0 --> {top}'
    for name in there:
        yield f"  bar [{', '.join(f'{math.log10(1 + int(n)):.3g}' for n in heights[name])}]"
    yield f"  bar [{', '.join('0' * BINS)}]"
    yield "```"


def _title(tally: Tally) -> str:
    counts = (("invalid", tally.n_invalid), ("degenerate", tally.n_degenerate), ("poor", tally.n_poor))
    return ", ".join([f"{n:,} {name}" for name, n in (*counts, ("good", tally.n_good)) if n])
