"""The page of a mesh that there is no memory for has all but its pictures, the same as that of the whole."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from slice_meshes import garden

from meshgauge import io
from meshgauge.cli import batch
from meshgauge.cli.main import main
from meshgauge.kernels import path as kernels_path
from meshgauge.report.html.section import NOT_DRAWN

pytestmark = pytest.mark.usefixtures("readers_here")


def parts(page: str) -> tuple[list[str], list[str], str]:
    """Its tables, its histograms, and the verdict."""
    verdict = re.search(r'<p class="verdict.*?</p>', page, re.S)
    assert verdict is not None
    return (
        re.findall(r'<table class="numbers.*?</table>', page, re.S),
        re.findall(r'<figure class="histogram".*?</figure>', page, re.S),
        verdict[0],
    )


def test_it_has_the_tables_and_histograms_of_the_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(kernels_path, "NUMPY_UP_TO", 150)
    monkeypatch.setattr("meshgauge.slices.run.slice_size", lambda memory: 97)
    path, page = tmp_path / "a.vtkhdf", tmp_path / "a.html"
    io.write(path, garden(shuffled=True))
    asked = ["report", str(path), "--html", str(page), "--json", "--memory", "40MB"]
    assert main(asked) == 0
    whole, expected = page.read_text(), json.loads(capsys.readouterr().out)
    assert NOT_DRAWN not in whole
    monkeypatch.setattr("meshgauge.cli.slices.WHOLE", 1e9)  # more than there is memory for
    monkeypatch.setattr(batch.Batch, "read", None)  # nothing is read whole
    assert main(asked) == 0
    made = page.read_text()
    assert NOT_DRAWN in made
    (tables, histograms, verdict), of_whole = parts(made), parts(whole)
    assert len(tables) == 3
    assert len(histograms) > 3
    assert set(tables) <= set(of_whole[0])
    assert histograms == of_whole[1]
    assert verdict == of_whole[2]
    document = json.loads(capsys.readouterr().out)
    for one in (document, expected):
        del one["files"][0]["notes"]
    assert document == expected
