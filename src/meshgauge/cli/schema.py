"""``meshgauge schema``: JSON Schema of what commands print with ``--json``."""

from __future__ import annotations

from typing import Annotated

import typer

from .completion import schema_names


def schema(
    name: Annotated[
        str | None,
        typer.Argument(metavar="NAME", help="Of which document.", show_default=False, autocompletion=schema_names),
    ] = None,
) -> None:
    """Print the schema of a document, or the names there are."""
    from ..schemas import NAMES
    from ..schemas import schema as text_of
    from .terminal import emit

    emit("\n".join(NAMES) if name is None else text_of(name).rstrip("\n"))
