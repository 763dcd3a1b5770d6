"""``meshgauge formats``: the formats there are, and what becomes of a file of each."""

from __future__ import annotations

import json

from . import options


def formats(*, as_json: options.Json = False) -> None:
    """List the formats: name, extensions, whether they are read, patched and written."""
    from ..io.catalogue import FormatsText, rows
    from .terminal import Output, emit

    if as_json:
        emit(json.dumps({"schema": "meshgauge-formats", "version": 1, "formats": rows()}, indent=2))
    else:
        Output().show(FormatsText())
