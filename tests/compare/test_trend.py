"""Meshes over a history of stored reports: the numbers of the reports, in order, as text, JSON and a page."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
from html import unescape
from pathlib import Path

import pytest
from compare_meshes import measured

from meshgauge.cli.main import main
from meshgauge.compare.trend import KEYS, charts, files_of, trends
from meshgauge.report import FileReport
from meshgauge.report.json import dumps

Captured = pytest.CaptureFixture[str]


@pytest.fixture
def history(tmp_path: Path) -> Path:
    """Three reports on two meshes; the second is not in all of them."""
    heights = {"r_9": (0.1, 0.8), "r_10": (0.5, 0.8), "r_11": (0.3, 0.8)}
    for name, of_cells in heights.items():
        reverse = [0] if name == "r_10" else []
        reports = [FileReport.of(measured(of_cells, reverse=reverse), path="a.vtu")]
        if name != "r_10":
            reports.append(FileReport.of(measured((0.6,)), path="b <i>.vtu"))
        (tmp_path / f"{name}.json").write_text(dumps(reports))
    return tmp_path


def test_numbers_are_those_of_the_reports_in_order(history: Path, capsys: Captured) -> None:
    files = files_of([str(history)])
    assert [file.stem for file in files] == ["r_9", "r_10", "r_11"], "by their numbers"
    first, second = trends(files)
    assert ([point.report for point in second.points], second.path) == (["r_9", "r_11"], "b <i>.vtu")
    for key, stored in (("n_invalid", "n_invalid"), ("min", "min"), ("mean", "mean")):
        expected = [json.loads(file.read_text())["files"][0]["all"][stored] for file in files]
        assert first.values(key) == expected
    assert [first.change("n_invalid", at) for at in range(3)] == [0, -1, 1]
    assert [second.change(key, 1) for key in KEYS] == [0] * len(KEYS)
    assert main(["trend", str(history), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["meshes"][0]["values"]["min"] == first.values("min")
    assert main(["trend", str(history)]) == 0
    assert [line.split()[:2] for line in capsys.readouterr().out.splitlines() if line.startswith(" r_")][:3] == [
        ["r_9", "0"],
        ["r_10", "1"],
        ["r_11", "0"],
    ]


def test_the_page_has_a_chart_of_each_criterion(history: Path) -> None:
    page = history / "trend.html"
    assert main(["trend", str(history), "--html", str(page)]) == 0
    text = page.read_text(encoding="utf-8")
    assert "b &lt;i&gt;.vtu" in text
    assert "b <i>.vtu" not in text
    first, second = trends(files_of([str(history)]))
    assert text.count("<figure") == len(charts(first)) + len(charts(second)) == 2 * len(KEYS)
    (least,) = [chart for chart in charts(first) if chart.label == "min"]
    assert [text for _, _, text in least.dots] == [
        f"{point.report}: {value:.3f}" for point, value in zip(first.points, first.values("min"), strict=True)
    ]
    tops = [y for _, y, _ in least.dots]
    assert tops.index(min(tops)) == first.values("min").index(max(first.values("min")))
    (table, _) = re.findall(r"data-trend>(.*?)</table>", unescape(text), re.DOTALL)
    assert re.findall(r'<th scope="row"><bdi>(.*?)</bdi>', table) == ["r_9", "r_10", "r_11"]


@pytest.mark.parametrize(
    ("content", "message"),
    [("{", "is not JSON"), ("{}", "is no report"), (None, "No such file"),
     ('{"schema": "meshgauge-report", "version": 3, "files": [{"path": "a"}]}', "is damaged")],
)  # fmt: skip
def test_what_is_no_report_is_named(content: str | None, message: str, tmp_path: Path, capsys: Captured) -> None:
    path = tmp_path / "a.json"
    if content is not None:
        path.write_text(content)
    assert main(["trend", str(path), "--html", str(tmp_path / "t.html")]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert f"{path}: {message}" in err
    assert not (tmp_path / "t.html").exists()


@pytest.mark.skipif(shutil.which("git") is None, reason="git is not installed")
def test_a_baseline_is_followed_over_its_commits(history: Path, tmp_path: Path, capsys: Captured) -> None:
    place = tmp_path / "repository"
    place.mkdir()
    baseline = place / "quality.json"

    def git(*words: str) -> None:
        own = {"GIT_CONFIG_GLOBAL": os.devnull, "GIT_CONFIG_SYSTEM": os.devnull}
        author = ("-c", "user.name=a", "-c", "user.email=a@b")
        subprocess.run(["git", *author, *words], cwd=place, check=True, capture_output=True, env={**os.environ, **own})

    git("init", "-q")
    assert main(["trend", str(baseline), "--git"]) == 2
    assert "git" in capsys.readouterr().err
    texts = [(history / f"{name}.json").read_text() for name in ("r_9", "r_10", "r_11")]
    for text in (texts[0], '{"schema": "meshgauge-report", "version": 1}', *texts[1:]):
        baseline.write_text(text)
        git("add", "quality.json")
        git("commit", "-qm", "renewed")
    assert main(["trend", str(baseline), "--git", "--json"]) == 0
    out, err = capsys.readouterr()
    assert err.count("\n") == err.count("is no report of version 3") == 1
    first = json.loads(out)["meshes"][0]
    stored = trends(files_of([str(history)]))[0]
    assert first["values"]["min"] == stored.values("min")
    assert all(re.fullmatch(r"\d{4}-\d\d-\d\d [0-9a-f]{7,}", name) for name in first["reports"])
    assert main(["trend", str(history / "r_9.json"), "--git"]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_folder_without_reports(tmp_path: Path, capsys: Captured) -> None:
    assert main(["trend", str(tmp_path)]) == 2
    assert "has no .json files" in capsys.readouterr().err
