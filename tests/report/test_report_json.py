"""The JSON report against its documented schema: the tables of docs/json-schema.md are read and held."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_up import report_of

from meshgauge import Mesh, measure
from meshgauge.cells import SHAPES
from meshgauge.doctor import diagnosis
from meshgauge.errors import FailedFile
from meshgauge.report import FileReport
from meshgauge.report.json import dumps

DOC = Path(__file__).resolve().parents[2] / "docs" / "json-schema.md"

PLAIN = {"string": str, "integer": int, "number": (int, float)}


def schema() -> dict[str, dict[str, str]]:
    """Fields and their types, by object, as the document's tables say."""
    objects: dict[str, dict[str, str]] = {}
    for section in re.split(r"^## ", DOC.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]:
        name = section.split("\n", 1)[0].strip()
        objects[name] = dict(re.findall(r"^\| `(\w+)` \| ([\w ]+?) \|", section, flags=re.MULTILINE))
    return objects


def check(value: Any, kind: str, where: str) -> None:
    """Assert that a value is of a documented type, all the way down."""
    if kind.startswith("list of "):
        assert isinstance(value, list), where
        for i, item in enumerate(value):
            check(item, kind.removeprefix("list of "), f"{where}[{i}]")
    elif kind.startswith("map of "):
        assert isinstance(value, dict), where
        for key, item in value.items():
            check(item, kind.removeprefix("map of "), f"{where}.{key}")
    elif kind.endswith(" or null"):
        if value is not None:
            check(value, kind.removesuffix(" or null"), where)
    elif kind == "boolean":
        assert isinstance(value, bool), where
    elif kind in PLAIN:
        assert isinstance(value, PLAIN[kind]), f"{where} is {value!r}, expected {kind}"
        assert not isinstance(value, bool), where
    else:
        assert isinstance(value, dict), where
        assert set(value) == set(schema()[kind]), where
        for key, item in value.items():
            check(item, schema()[kind][key], f"{where}.{key}")


def strict(text: str) -> Any:
    """Parse, refusing NaN and infinities, which are no JSON."""

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is not JSON")

    return json.loads(text, parse_constant=refuse)


def test_the_document_describes_objects() -> None:
    assert set(schema()) > {
        *("report", "file", "verdict", "tally", "histogram", "cell", "finding", "metric", "comparison", "error"),
        *("trend", "step", "diagnosis", "defect", "orientation", "block", "measure", "face"),
    }
    assert all(fields for name, fields in schema().items() if name != "Other documents")


def test_a_report_is_what_the_document_says(mixed: FileReport) -> None:
    reports = [mixed, report_of("b.vtu", tetra=[0.5]), report_of("c.vtu", quad=[np.nan]), report_of("d.vtu")]
    check(strict(dumps(reports, [FailedFile("e.vtu", "no such file")])), "report", "report")
    check(strict(dumps([])), "report", "report")


def test_a_real_report_is_what_the_document_says() -> None:
    """With findings and a diagnosis: two cubes, one numbered in reverse, and a point of no cell."""
    cube = np.array(SHAPES["hexahedron"].points, float)
    points = np.vstack([cube, cube + np.array((5, 0, 0)), [(9, 9, 9)]])
    mesh = Mesh.from_arrays(points, [("hexahedron", [range(8), (12, 13, 14, 15, 8, 9, 10, 11)])])
    quality = measure(mesh)
    found = diagnosis(mesh, quality)
    report = FileReport("a", mesh.n_points, 2, quality.summary(), findings=tuple(quality.findings()), diagnosis=found)
    document = strict(dumps([report]))
    check(document, "report", "report")
    file = document["files"][0]
    assert file["findings"][0]["cells"] == [1]
    assert file["findings"][0]["location"] == pytest.approx((cube.mean(axis=0) + np.array((5, 0, 0))).tolist())
    assert file["diagnosis"]["n_parts"] == 2
    assert file["diagnosis"]["orientation"]["blocks"]


def test_numbers_are_those_of_the_summary(mixed: FileReport) -> None:
    file = strict(dumps([mixed], bins=4))["files"][0]
    assert list(file["cell_types"]) == ["tetra", "hexahedron", "lagrange_pyramid"]
    every = file["all"]
    assert (every["n_cells"], every["n_measured"]) == (8, 7)
    assert [every[f"n_{what}"] for what in ("invalid", "degenerate", "undecided", "poor", "good")] == [1, 1, 1, 1, 3]
    assert every["min"] == -0.25
    assert every["histogram"] == {
        "edges": [-1.0, -0.5, 0.0, 0.5, 1.0],
        "counts": [0, 1, 2, 4],
        "invalid": [0, 1, 0, 0],
        "degenerate": [0, 0, 1, 0],
        "undecided": [0, 0, 0, 1],
    }
    assert file["not_measured"] == {"quad": {"not_solid": 2}, "tetra": {"non_finite": 1}}
    assert file["corners_only"] == {"lagrange_pyramid": 1}
    assert file["other_metrics"][0]["all"]["max"] is None  # infinite


@pytest.mark.parametrize("path", ["spaß.vtu", 'a"b\\c.vtu', "a\udcffb.vtu"])
def test_any_path_survives(path: str) -> None:
    text = dumps([report_of(path)])
    assert text.isascii()
    assert strict(text)["files"][0]["path"] == path
