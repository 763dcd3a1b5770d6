"""``meshgauge schema``: JSON Schema of what commands print with ``--json``."""

from __future__ import annotations

from typing import Annotated

import typer


def schema_names(begin: str) -> list[str]:
    """Names of schemas that begin so."""
    from ..schemas import NAMES

    return [name for name in NAMES if name.startswith(begin)]


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
