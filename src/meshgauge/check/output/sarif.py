"""The gate as SARIF 2.1.0, which GitHub code scanning, Azure and editors show."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Sequence
from typing import Any
from urllib.parse import quote

from ..._version import __version__
from ...errors import FailedFile
from ...report.json import finite
from .. import Check, FailingCell, Outcome, State
from .lines import messages, relative

VERSION = "2.1.0"
SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"

LEVELS = {State.FAIL: "error", State.WARN: "warning", State.UNCHECKED: "error"}
"""States that become a result."""


def sarif(checks: Sequence[Check], failures: Sequence[FailedFile] = ()) -> str:
    """The document as text, ASCII only: one result for each broken or unchecked rule of each mesh.

    Meshes have no lines that mean something to people: every place is line 1 of the file, and cells are logical
    locations (``cell 521``, or ``element 7000 (cell 521)``). Files that could not be read are notifications of the run,
    and results, since some readers show only those.
    """
    ids: dict[str, int] = {}
    results = [
        _result(check.path, outcome, ids) for check in checks for outcome in check.outcomes if outcome.state in LEVELS
    ]
    results += [_unreadable(failure, ids) for failure in failures]
    run = {
        "tool": {
            "driver": {
                "name": "meshgauge",
                "semanticVersion": __version__,
                "version": __version__,
                "rules": [_rule(text) for text in ids],
            }
        },
        "columnKind": "unicodeCodePoints",
        "invocations": [
            {
                "executionSuccessful": not failures,
                "toolExecutionNotifications": [
                    {"level": "error", "message": {"text": failure.reason}, "locations": [_location(failure.path)]}
                    for failure in failures
                ],
            }
        ],
        "results": results,
    }
    return json.dumps({"$schema": SCHEMA, "version": VERSION, "runs": [run]}, indent=2, allow_nan=False)


def _rule(text: str) -> dict[str, Any]:
    return {"id": text, "shortDescription": {"text": text}, "fullDescription": {"text": f"meshgauge check: {text}"}}


def _result(path: str, outcome: Outcome, ids: dict[str, int]) -> dict[str, Any]:
    rule = str(outcome.rule)
    return {
        "ruleId": rule,
        "ruleIndex": ids.setdefault(rule, len(ids)),
        "level": LEVELS[outcome.state],
        "message": {"text": "\n".join(messages(outcome))},
        "locations": [_location(path)],
        "relatedLocations": [_related_location(path, at, cell) for at, cell in enumerate(outcome.cells)],
        "partialFingerprints": {"meshgauge/v1": fingerprint(path, rule)},
        "properties": finite(
            {
                "state": outcome.state.value,
                "nCells": outcome.n_cells,
                "nFailing": outcome.n_failing,
                "nAllowed": outcome.n_allowed,
                "cells": [cell.to_dict() for cell in outcome.cells],
            }
        ),
    }


def _unreadable(failure: FailedFile, ids: dict[str, int]) -> dict[str, Any]:
    rule = "the mesh is read"
    return {
        "ruleId": rule,
        "ruleIndex": ids.setdefault(rule, len(ids)),
        "level": "error",
        "message": {"text": failure.reason},
        "locations": [_location(failure.path)],
        "partialFingerprints": {"meshgauge/v1": fingerprint(failure.path, rule)},
    }


def _location(path: str) -> dict[str, Any]:
    return {
        "physicalLocation": {
            "artifactLocation": {"uri": quote(os.fsencode(relative(path)))},
            "region": {"startLine": 1},
        }
    }


def _related_location(path: str, at: int, cell: FailingCell) -> dict[str, Any]:
    return {
        **_location(path),
        "id": at,
        "logicalLocations": [{"name": cell.name, "fullyQualifiedName": f"{cell.type} {cell.name}", "kind": "element"}],
        "message": {"text": cell.text},
    }


def fingerprint(path: str, rule: str) -> str:
    """The same for the same rule on the same file, whatever the cells are."""
    return hashlib.sha256(f"{relative(path)}\0{rule}".encode("utf-8", "backslashreplace")).hexdigest()
