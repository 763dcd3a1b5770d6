"""``meshgauge metrics``: the metrics there are."""

from __future__ import annotations

from typing import Annotated

import typer

from . import completion, options


def metrics(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="NAME",
            help="Say everything about these.",
            show_default=False,
            autocompletion=completion.metric_names,
        ),
    ] = None,
    *,
    as_json: options.Json = False,
    purpose: options.Purpose = None,
) -> None:
    """List the metrics: range, acceptable range, value on the ideal cell, cells, reference."""
    from ..quality.metrics import METRICS, metric
    from ..report.catalogue import MetricsText, metrics_json
    from .terminal import Output, emit

    rows = [metric(name) for name in names] if names else list(METRICS.values())
    if purpose is not None:
        rows = [row for row in rows if (row.of_faces is not None) == (purpose == "fv")]
    if as_json:
        emit(metrics_json(rows))
    else:
        Output().show(MetricsText(rows, in_full=bool(names)))
