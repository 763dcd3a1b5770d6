"""The gate as GitLab's code quality report, which merge requests show."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from ...errors import FailedFile
from .. import Check, State
from .lines import messages, relative
from .sarif import fingerprint

SEVERITIES = {State.FAIL: "major", State.WARN: "minor", State.UNCHECKED: "critical"}
"""States that become an issue."""


def gitlab(checks: Sequence[Check], failures: Sequence[FailedFile] = ()) -> str:
    """The report as JSON text, ASCII only: one issue for each broken or unchecked rule of each mesh."""
    issues = [
        _issue(check.path, str(outcome.rule), "; ".join(messages(outcome)), SEVERITIES[outcome.state])
        for check in checks
        for outcome in check.outcomes
        if outcome.state in SEVERITIES
    ]
    issues += [_issue(failure.path, "the mesh is read", failure.reason, "critical") for failure in failures]
    return json.dumps(issues, indent=2)


def _issue(path: str, rule: str, text: str, severity: str) -> dict[str, Any]:
    return {
        "description": f"{rule}: {text}",
        "check_name": rule,
        "fingerprint": fingerprint(path, rule),
        "severity": severity,
        "location": {"path": relative(path), "lines": {"begin": 1}},
    }
