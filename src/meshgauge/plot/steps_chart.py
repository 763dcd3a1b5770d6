"""How the quality of time steps goes: the minimum and the 1 % quantile as lines, invalid cells as bars below."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import MeshgaugeError
from ..look.colours import INK, INVALID, POOR
from ..look.style import plural
from ..quality.measure import JENS
from . import chart_style
from .distributions import Drawable, series

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LOW = 0.01
"""The quantile that is drawn beside the minimum."""


def over_time(what: Mapping[float, Drawable], *, title: str = "", axis: str = "step") -> Figure:
    """Minimum and 1 % quantile of J_ENS, and invalid cells, over the time steps of a mesh.

    Parameters
    ----------
    what
        A `Summary` or `Quality` for each time, or number of a step.
    title
        What is drawn; empty for a general one.
    axis
        What the times are called.

    Returns
    -------
    matplotlib.figure.Figure
        Not known to pyplot; ``savefig`` writes it.

    Raises
    ------
    MeshgaugeError
        If there are less than two steps, or one has no cell with a value.
    """
    if len(what) < 2:
        raise MeshgaugeError(f"{plural(len(what), 'time step')} given, expected two or more")
    known = sorted((float(at), one) for at, one in what.items())
    tallies = [series(one, JENS)[0].summary.all for _, one in known]
    times = np.array([at for at, _ in known])
    if not all(tally.n_measured for tally in tallies):
        raise MeshgaugeError("a time step has no cell with a value")
    minimum = np.array([tally.min for tally in tallies])
    low = np.array([tally.quantiles((LOW,))[LOW] for tally in tallies])
    invalid = np.array([tally.n_invalid for tally in tallies])
    poor = tallies[0].scale.acceptable[0]
    figure = chart_style.figure(8, 4.8)
    first = next((f"{at:.6g}" for at, n in zip(times.tolist(), invalid.tolist(), strict=True) if n), None)
    begin = f"first invalid at {axis} {first}" if first is not None else "no step has invalid cells"
    chart_style.title(figure, title or "Quality over time", f"{plural(len(known), 'step')}   ·   {begin}")
    above = chart_style.axes(figure, (0.09, 0.42, 0.88, 0.4))
    bottom = min(0.0, float(minimum.min()))
    above.axhspan(min(bottom, -0.02) * 1.05, 0.0, color=INVALID, alpha=0.07, linewidth=0)
    above.axhspan(0.0, poor, color=POOR, alpha=0.07, linewidth=0)
    marker = "o" if len(known) <= 40 else ""
    for n, (values, label) in enumerate(((minimum, "minimum"), (low, "1 %"))):
        colour, dash = chart_style.stroke(n)
        look: dict[str, Any] = {"color": colour, "linestyle": dash, "marker": marker, "label": label}
        above.plot(times, values, linewidth=1.6, markersize=3.5, **look)
    above.set_ylabel("quality $J_{ENS}$", fontsize=10, color=INK)
    above.set_ylim(min(bottom, -0.02) * 1.05, max(float(low.max()), poor) * 1.08)
    above.legend(loc="upper right", bbox_to_anchor=(1.0, 1.22), ncols=2, frameon=False, fontsize=9)
    below = chart_style.axes(figure, (0.09, 0.12, 0.88, 0.22))
    width = 0.7 * float(np.diff(times).min()) if float(np.diff(times).min()) > 0 else 0.7
    below.bar(times, invalid, width=width, color=INVALID, edgecolor=INK, linewidth=0.35)
    below.set_ylabel("invalid", fontsize=10, color=INK)
    below.set_ylim(0, max(int(invalid.max()), 1) * 1.08)
    below.yaxis.set_major_formatter(lambda value, _: f"{value:,.0f}" if value == round(value) else "")
    below.set_xlabel(axis, fontsize=10, color=INK)
    below.sharex(above)
    above.tick_params(labelbottom=False)
    return figure
