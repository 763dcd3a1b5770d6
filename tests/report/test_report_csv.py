"""The CSV: one row a cell, read back exactly; whole or not there."""

from __future__ import annotations

import contextlib
import csv
from pathlib import Path

import numpy as np
import pytest

from meshgauge.errors import WriteError
from meshgauge.report import csv as report_csv
from meshgauge.report.csv import CsvWriter

TYPES = np.array([10, 12, 9, 200], np.uint8)
STATUS = np.array([0, 1, 5, 4], np.uint8)
VALUES = {"jens": np.array([0.1 + 0.2, -1e-300, np.nan, np.nan]), "other": np.array([1.0, np.inf, 2.5, np.nan])}


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def test_rows_read_back_exactly(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(report_csv, "CHUNK", 3)
    with CsvWriter(tmp_path / "o.csv", ("jens", "other"), with_file=False) as writer:
        writer.add("a.vtu", TYPES, STATUS, VALUES)
    read = rows(tmp_path / "o.csv")
    assert [row["cell"] for row in read] == ["0", "1", "2", "3"]
    assert [row["type"] for row in read] == ["tetra", "hexahedron", "quad", "vtk_200"]
    assert [row["status"] for row in read] == ["ok", "inverted", "not_solid", "unsupported"]
    assert [row["jens"] for row in read] == ["0.30000000000000004", "-1e-300", "", ""]
    assert [row["other"] for row in read] == ["1.0", "inf", "2.5", ""]


def test_several_files_are_told_apart(tmp_path: Path) -> None:
    names = ["a.vtu", 'b, "c".vtu']
    with CsvWriter(tmp_path / "o.csv", ("jens",), with_file=True) as writer:
        for name in names:
            writer.add(name, TYPES, STATUS, VALUES)
    assert [row["file"] for row in rows(tmp_path / "o.csv")] == [name for name in names for _ in TYPES]


def test_a_failure_leaves_what_was_there(tmp_path: Path) -> None:
    target = tmp_path / "o.csv"
    target.write_text("mine")
    with contextlib.suppress(RuntimeError), CsvWriter(target, ("jens",), with_file=False) as writer:
        writer.add("a.vtu", TYPES, STATUS, VALUES)
        raise RuntimeError
    assert target.read_text() == "mine"
    assert list(tmp_path.iterdir()) == [target]


def test_a_folder_that_is_not_there_is_a_clear_error(tmp_path: Path) -> None:
    with pytest.raises(WriteError, match=r"o\.csv: there is no folder"):
        CsvWriter(tmp_path / "none" / "o.csv", ("jens",), with_file=False).__enter__()
