"""The gate for programs (docs/check.md)."""

from __future__ import annotations

import json
from collections.abc import Sequence

from ..._version import __version__
from ...errors import FailedFile
from ...report.json import finite
from ...report.over_time import trends_of
from .. import Check
from ..outcome import first_step
from .statistics import statistics

SCHEMA, VERSION = "meshgauge-check", 3


def checks_json(
    checks: Sequence[Check],
    failures: Sequence[FailedFile] = (),
    *,
    settings: str | None = None,
    with_statistics: bool = False,
) -> str:
    """Checks as JSON text, indented, ASCII only; numbers that are undefined or infinite are null.

    ``settings`` is the file that the rules or meshes are from, if they are from one; statistics are of every rule.
    """
    first = first_step(checks)
    plain = finite(
        {
            "schema": SCHEMA,
            "version": VERSION,
            "meshgauge": __version__,
            "settings": settings,
            "passed": not failures and all(check.is_passed for check in checks),
            "first_failing_step": None if first is None else first.path,
            "over_time": [one.to_dict() for one in trends_of((c.step, c.tally) for c in checks if c.step and c.tally)],
            **({"statistics": [one.to_dict() for one in statistics(checks)]} if with_statistics else {}),
            "files": [check.to_dict() for check in checks],
            "errors": [{"path": failure.path, "message": failure.reason} for failure in failures],
        }
    )
    return json.dumps(plain, indent=2, allow_nan=False)
