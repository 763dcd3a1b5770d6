"""``meshgauge explain``: what a rule, metric, status or purpose means."""

from __future__ import annotations

from typing import Annotated

import typer

from . import completion


def explain(
    names: Annotated[
        list[str],
        typer.Argument(
            metavar="NAME",
            help="Metrics, statuses, rules in quotes, fem, fv or explicit.",
            autocompletion=completion.explained,
        ),
    ],
) -> None:
    """Say what each means."""
    from ..check.explain import Explanation
    from .terminal import Output

    explained = [Explanation(name) for name in names]
    output = Output()
    for at, one in enumerate(explained):
        if at:
            output.print()
        output.show(one)
