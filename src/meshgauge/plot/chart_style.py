"""The sheet that charts are drawn on: a figure of its own, bands, and the words of counts.

matplotlib's state machine (pyplot) and its global settings are left alone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..look import style
from ..look.bands import NAMES
from ..look.colours import DASHES, FAINT, GRID, INK, INVALID, POOR, SERIES, SOFT, WORDS
from ..quality.summary import Summary, Tally
from ..quality.summary.scale import Scale

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MINUS = "\N{MINUS SIGN}"


def figure(width: float, height: float, dpi: float = 150) -> Figure:
    """An empty white figure, in inches, that pyplot does not know of."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    from .notebook_figure import Picture

    made = Picture(figsize=(width, height), dpi=dpi, facecolor="white")
    FigureCanvasAgg(made)
    return made


def axes(on: Figure, box: tuple[float, float, float, float]) -> Axes:
    """Axes in a box (left, bottom, width, height; 0 to 1) with nothing but what is needed."""
    made = on.add_axes(box)
    made.set_facecolor("white")
    for side, spine in made.spines.items():
        spine.set_visible(side == "bottom")
        spine.set_color(FAINT)
        spine.set_linewidth(0.8)
    made.tick_params(colors=INK, labelsize=9, length=3, width=0.8, direction="out")
    made.tick_params(which="minor", length=0)
    made.tick_params(axis="y", length=0)
    made.grid(axis="y", color=GRID, linewidth=0.8)
    made.set_axisbelow(True)
    return made


def shade(on: Axes, scale: Scale, low: float, high: float) -> None:
    """Tint what is invalid and what is poor."""
    start, end = scale.acceptable
    zero = max(low, 0.0) if scale.is_signed else low
    tints: tuple[tuple[float, float, str], ...] = ((low, zero, INVALID), (zero, start, POOR), (end, high, POOR))
    for left, right, colour in tints:
        if right > left:
            on.axvspan(left, min(right, high), color=colour, alpha=0.07, linewidth=0)
    on.set_xlim(low, high)


def title(on: Figure, text: str, below: str = "") -> None:
    """Two lines at the top left."""
    height = on.get_figheight()
    # A $ in the name of a file begins no formula.
    look: dict[str, Any] = {"fontsize": 12, "fontweight": "bold", "parse_math": False}
    on.text(0.02, 1 - 0.12 / height, short(text, 80), ha="left", va="top", color=INK, **look)
    if below:
        on.text(0.02, 1 - 0.37 / height, below, ha="left", va="top", fontsize=9.5, color=SOFT)


def axis_label(scale: Scale) -> str:
    """The metric in a few words, for an axis."""
    if scale.metric == "jens":
        return "quality $J_{ENS}$"
    return scale.metric if scale.unit == "1" else f"{scale.metric} ({scale.unit})"


def stroke(n: int) -> tuple[str, Any]:
    """Colour and dash of the n-th mesh; the dashes of a second round of colours are others."""
    dash = DASHES[(n + n // len(SERIES)) % len(DASHES)]
    return SERIES[n % len(SERIES)], (0, dash) if dash else "-"


def short(text: str, length: int) -> str:
    """Text of at most so many characters; what is too long loses its middle."""
    if len(text) <= length:
        return text
    return f"{text[: (length - 1) // 2]}…{text[len(text) - length // 2 :]}"


def number(value: float) -> str:
    """A value, not NaN, as `look.style.quality` writes it, with a real minus sign."""
    return style.quality(value).replace("-", MINUS)


def band_counts(tally: Tally) -> dict[str, int]:
    """Cells in each of `look.bands.NAMES`."""
    n = (tally.n_invalid, tally.n_degenerate, tally.n_undecided, tally.n_poor, tally.n_good, tally.n_unmeasured)
    return dict(zip(NAMES, n, strict=True))


def words(tally: Tally, *, without: tuple[str, ...] = ()) -> list[tuple[str, str]]:
    """What there is of each band, as text and its colour: ``"3 invalid"`` in that of `WORDS`."""
    names = {"unknown": "not measured"}
    return [
        (f"{n:,} {names.get(band, band)}", WORDS[band])
        for band, n in band_counts(tally).items()
        if n and band not in without
    ]


def sentence(summary: Summary) -> str:
    """Cells, extremes and median in one line; and what was not measured."""
    every = summary.all
    parts = [style.plural(every.n_cells, "cell")]
    if every.n_measured:
        parts += [f"min {number(every.min)}", f"median {number(every.quantiles((0.5,))[0.5])}"]
    if inside := every.statuses.get("inverted_inside"):
        parts.append(f"{inside:,} inverted inside, between good corners")
    if every.n_unmeasured:
        parts.append(f"{every.n_unmeasured:,} not measured")
    return "   ·   ".join(parts)


def line_of_words(on: Axes, x: float, y: float, parts: list[tuple[str, str]], **options: Any) -> None:
    """Pieces of text one under the other, each in its colour, in coordinates of the axes."""
    for n, (text, colour) in enumerate(parts):
        on.annotate(
            text,
            (x, y),
            xytext=(0, -12 * n),
            xycoords="axes fraction",
            textcoords="offset points",
            color=colour,
            fontsize=9,
            va="top",
            annotation_clip=False,
            **options,
        )
