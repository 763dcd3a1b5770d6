"""Histograms as numbers ready to be drawn: no text is made here, the templates do that."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...look import style
from ...look.colours import DASHES, ON_ANY, SERIES, STATUS, bar_fill, shade
from ...quality.summary import Summary, Tally

WIDTH, HEIGHT = 960.0, 190.0
"""Of the space for the bars, in units of the drawing."""

LEAST = 3.0
"""Height of a bar that stands for one cell, whatever the others are: none that holds a cell looks empty."""

ROOM = 40.0
"""Width from which a bar has its number above it."""


CHARACTER = 7.0
"""Width of a digit above a bar."""


class Layer(NamedTuple):
    """A part of a bar that stands at its foot; the later over the earlier."""

    name: str
    n: int
    height: float
    height_log: float
    fill: str


class Bar(NamedTuple):
    """A bin that holds cells."""

    bin: int
    n: int
    low: float
    high: float
    x: float
    width: float
    height: float
    height_log: float
    fill: str  #: of valid cells
    layers: list[Layer]  #: over it, from the foot of the bar up: cells that are not valid, whatever their value
    is_last: bool  #: closed at its upper end
    has_number: bool  #: its number is above it: as many have as there is room for


class Tick(NamedTuple):
    x: float
    text: str


class Histogram(NamedTuple):
    """The bars of some cells."""

    key: str
    label: str
    n: int
    bars: list[Bar]
    zero: float  #: where 0 is: all to its left is invalid
    poor: float  #: where what is poor ends
    ticks: list[Tick]


def histograms(summary: Summary, bins: int, *, start: float | None = None) -> list[Histogram]:
    """Of all cells, then of each type if there are several; all over the same range, from ``start`` or the lowest."""
    rows = {name: tally for name, tally in summary.types.items() if tally.n_measured}
    if not rows:
        return []
    if start is None:
        start = lowest(summary, bins)
    groups = [("all", "all cells", summary.all)]
    if len(rows) > 1:
        groups += [(name, name, tally) for name, tally in rows.items()]
    return [_histogram(key, label, tally, bins, start) for key, label, tally in groups]


def lowest(summary: Summary, bins: int) -> float:
    """The lower edge of the lowest bar, 0 if that is above."""
    edges, counts = summary.all.histogram(bins)
    return min([0.0, *(float(edge) for edge, n in zip(edges, counts, strict=False) if n)])


def _histogram(key: str, label: str, tally: Tally, bins: int, start: float) -> Histogram:
    edges, parts = tally.histogram_by_status(bins)
    counts, poor = np.sum(list(parts.values()), axis=0), tally.scale.acceptable[0]
    fills = bar_fill(shade((edges[:-1] + edges[1:]) / 2, poor))
    top = int(counts.max())

    def at(value: float) -> float:
        return WIDTH * (value - start) / (1.0 - start)

    bars: list[Bar] = []
    free = -math.inf  # where the numbers of the bars before end
    for n, count in enumerate(counts.tolist()):
        if not count:
            continue
        low, high = float(edges[n]), float(edges[n + 1])
        linear = max(HEIGHT * count / top, LEAST)
        logarithmic = max(HEIGHT * (math.log10(count) + 0.3) / (math.log10(top) + 0.3), LEAST)
        width = at(high) - at(low)
        gap = min(2.0, width / 5)
        middle, half = (at(low) + at(high)) / 2, CHARACTER * len(f"{count:,}") / 2
        has_number = width >= ROOM and middle - half >= free
        free = middle + half + 4.0 if has_number else free
        bars.append(
            Bar(
                bin=n,
                n=count,
                low=low,
                high=high,
                x=round(at(low) + gap / 2, 2),
                width=round(width - gap, 2),
                height=round(linear, 2),
                height_log=round(logarithmic, 2),
                fill=fills[n],
                layers=layers({name: int(of_name[n]) for name, of_name in parts.items()}, linear, logarithmic),
                is_last=n == bins - 1,
                has_number=has_number,
            )
        )
    step = 0.1 if start > -0.55 else 0.2
    first = math.ceil(start / step - 1e-9)
    ticks = [
        Tick(round(at(i * step), 2), f"{i * step:.1f}".replace("-0.0", "0.0"))
        for i in range(first, round(1 / step) + 1)
    ]
    return Histogram(
        key,
        label,
        tally.n_measured,
        bars,
        round(at(0.0), 2),
        round(at(poor), 2),
        ticks,
    )


def layers(parts: dict[str, int], height: float, height_log: float) -> list[Layer]:
    """What lies over a bar of so many cells by status: the highest first, each as high as it and all that are worse."""
    n, below, made = sum(parts.values()), 0, []
    for name, fill in STATUS.items():
        below += parts[name]
        if parts[name]:
            share = below / n
            made.append(
                Layer(
                    name,
                    parts[name],
                    round(max(height * share, min(LEAST, height)), 2),
                    round(max(height_log * share, min(LEAST, height_log)), 2),
                    "url(#stripes)" if name == "invalid" else fill,
                )
            )
    return made[::-1]


class Spark(NamedTuple):
    """A bar of a small histogram over -1 to 1, 100 units wide and 20 high."""

    x: float
    width: float
    height: float
    fill: str


def spark(tally: Tally, bins: int = 20) -> list[Spark]:
    """The small histogram of a row of a table."""
    edges, parts = tally.histogram_by_status(bins)
    counts, poor = np.sum(list(parts.values()), axis=0), tally.scale.acceptable[0]
    fills = bar_fill(shade((edges[:-1] + edges[1:]) / 2, poor))
    top = max(int(counts.max()), 1)
    made = []
    for n, count in enumerate(counts.tolist()):
        if not count:
            continue
        place = round(50 * (float(edges[n]) + 1), 2), round(50 * float(edges[n + 1] - edges[n]) - 0.6, 2)
        height = max(20 * count / top, 1.5)
        made.append(Spark(*place, round(height, 2), fills[n]))
        own = layers({name: int(of_name[n]) for name, of_name in parts.items()}, height, height)
        made += [Spark(*place, min(layer.height, round(height, 2)), STATUS[layer.name]) for layer in own]
    return made


class Outline(NamedTuple):
    """The distribution of one mesh among others, as a line."""

    name: str
    colour: str
    dash: str  #: lengths of strokes and gaps, as SVG writes them; empty for a whole line
    points: str
    note: str  #: cells and what is not good of them


class Overlay(NamedTuple):
    """Distributions of several meshes over each other, each in shares of its own cells."""

    outlines: list[Outline]
    zero: float
    poor: float
    ticks: list[Tick]
    top: str  #: the share at the top


def overlay(summaries: Sequence[tuple[str, Summary]], bins: int) -> Overlay | None:
    """Of meshes by name, as far as they have values; None if fewer than two have."""
    there = [(name, one.all) for name, one in summaries if one.all.n_measured]
    if len(there) < 2:
        return None
    start = min(lowest(one, bins) for _, one in summaries if one.all.n_measured)
    parts = [(name, tally, tally.histogram(bins)) for name, tally in there]
    top = max(float(counts.max()) / tally.n_measured for _, tally, (_, counts) in parts)
    outlines = []
    for n, (name, tally, (edges, counts)) in enumerate(parts):
        corners = [(WIDTH * (float(edges[0]) - start) / (1 - start), HEIGHT)]
        for low, high, count in zip(edges[:-1].tolist(), edges[1:].tolist(), counts.tolist(), strict=True):
            y = HEIGHT * (1 - count / tally.n_measured / top)
            corners += [(WIDTH * (x - start) / (1 - start), y) for x in (low, high)]
        corners.append((WIDTH, HEIGHT))
        points = " ".join(f"{x:.1f},{y:.1f}" for x, y in corners if x >= -0.1)
        dash = " ".join(map(str, DASHES[n % len(DASHES)]))
        bad = [f"{k:,} {what}" for k, what in ((tally.n_invalid, "invalid"), (tally.n_poor, "poor")) if k]
        note = ", ".join([style.plural(tally.n_cells, "cell"), *bad])
        outlines.append(Outline(name, ON_ANY["good"] if n == 0 else SERIES[n % len(SERIES)], dash, points, note))
    first = _histogram("all", "", there[0][1], bins, start)
    return Overlay(outlines, first.zero, first.poor, first.ticks, style.percent(round(1e6 * top), 1_000_000))
