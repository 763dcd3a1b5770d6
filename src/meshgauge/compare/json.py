"""A comparison for programs (docs/compare.md)."""

from __future__ import annotations

import json
from collections.abc import Sequence

from .._version import __version__
from ..errors import FailedFile
from ..report.json import finite
from . import Comparison
from .sentences import sentences

SCHEMA, VERSION = "meshgauge-compare", 3


def comparison_json(comparison: Comparison | None, failures: Sequence[FailedFile] = (), *, bins: int = 20) -> str:
    """A comparison as JSON text, indented, ASCII only; numbers that are undefined or infinite are null."""
    plain = finite(
        {
            "schema": SCHEMA,
            "version": VERSION,
            "meshgauge": __version__,
            "comparison": None
            if comparison is None
            else {**comparison.to_dict(bins), "sentences": [text for text in sentences(comparison) if text]},
            "errors": [{"path": failure.path, "message": failure.reason} for failure in failures],
        }
    )
    return json.dumps(plain, indent=2, allow_nan=False)
