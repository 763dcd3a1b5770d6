"""The report for programs: strictly valid JSON in the versioned schema of ``docs/json-schema.md``."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import Any

from .._version import __version__
from ..errors import FailedFile
from .comparison import comparison_dict
from .over_time import trends
from .record import FileReport
from .verdict import verdict

SCHEMA = "meshgauge-report"
VERSION = 3


def report_dict(
    reports: Sequence[FileReport], failures: Sequence[FailedFile] = (), *, bins: int = 20
) -> dict[str, Any]:
    """The report as plain data; numbers that are undefined or infinite are None."""
    plain: dict[str, Any] = finite(
        {
            "schema": SCHEMA,
            "version": VERSION,
            "meshgauge": __version__,
            "files": [_file(report, bins) for report in reports],
            "comparison": comparison_dict(reports),
            "over_time": [trend.to_dict() for trend in trends(reports)],
            "errors": [{"path": failure.path, "message": failure.reason} for failure in failures],
        }
    )
    return plain


def dumps(reports: Sequence[FileReport], failures: Sequence[FailedFile] = (), *, bins: int = 20) -> str:
    """The report as JSON text, indented, ASCII only."""
    return json.dumps(report_dict(reports, failures, bins=bins), indent=2, allow_nan=False)


def _file(report: FileReport, bins: int) -> dict[str, Any]:
    opinion = verdict(report.summary)
    return {
        "path": report.path,
        "step": None if report.step is None else report.step.to_dict(),
        "n_points": report.n_points,
        "n_cells": report.n_cells,
        "dimension": report.dimension,
        "verdict": {"level": opinion.level, "text": opinion.text},
        **report.summary.to_dict(bins),
        "worst": [
            {
                "cell": cell.cell,
                "cell_label": cell.cell_label,
                "type": cell.type,
                "quality": cell.quality,
                "status": cell.status,
                "node": cell.node,
                "node_quality": cell.node_quality,
                "point": cell.point,
                "point_label": cell.point_label,
                "coordinates": list(cell.coordinates),
            }
            for cell in report.worst
        ],
        **_regions(report, bins),
        "findings": [
            {
                "status": finding.status,
                "text": finding.text,
                "n_cells": finding.n_cells,
                "cells": list(finding.cells),
                "cell_labels": list(finding.labels),
                "location": list(finding.location),
            }
            for finding in report.findings
        ],
        "diagnosis": report.diagnosis.to_dict() if report.diagnosis is not None else None,
        "companions": [summary.to_dict(bins) for summary in report.companions],
        "other_metrics": [summary.to_dict(bins) for summary in report.others],
        "finite_volume": [measure.to_dict() for measure in report.finite_volume],
        "mixed_processors": report.mixed_processors,
        "notes": list(report.notes),
    }


def _regions(report: FileReport, bins: int) -> dict[str, Any]:
    return {
        "regions": {name: summary.all.to_dict(bins) for name, summary in report.regions},
        "region_companions": {
            name: {one.metric: one.all.to_dict(bins) for one in companions}
            for (name, _), companions in zip(report.regions, report.region_companions, strict=False)
        },
        "worst_regions": list(report.worst_regions),
    }


def finite(item: Any) -> Any:
    """A copy in which every float that JSON cannot hold is None."""
    if isinstance(item, dict):
        return {key: finite(value) for key, value in item.items()}
    if isinstance(item, list):
        return [finite(value) for value in item]
    return None if isinstance(item, float) and not math.isfinite(item) else item
