"""Colours for ParaView are those of every other output."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from meshgauge.cli.main import main
from meshgauge.look import colours
from meshgauge.status import STATUSES


def test_both_maps_have_the_colours_of_the_reports(tmp_path: Path) -> None:
    path = tmp_path / "quality.json"
    assert main(["paraview-plugin", "--preset", str(path)]) == 0
    quality, status = json.loads(path.read_text())
    table = np.array(quality["RGBPoints"]).reshape(-1, 4)
    assert (np.diff(table[:, 0]) > 0).all()
    assert (table[0, 0], table[-1, 0]) == (-1.0, 1.0)
    for value in (-0.9, -0.01, 0.0, 0.1, 0.199, 0.2, 0.5, 0.77, 1.0):
        mixed = [np.interp(value, table[:, 0], table[:, channel]) for channel in (1, 2, 3)]
        np.testing.assert_allclose(mixed, colours.rgb(colours.colour(value)), atol=0.006)
    assert status["Annotations"][::2] == [str(int(code)) for code in sorted(STATUSES)]
    assert len(status["IndexedColors"]) == 3 * len(STATUSES)
    at = status["Annotations"][1::2].index("inverted_inside")
    np.testing.assert_allclose(status["IndexedColors"][3 * at : 3 * at + 3], colours.rgb(colours.INVALID), atol=1e-6)


def test_vtk_takes_the_points(tmp_path: Path) -> None:
    vtk = pytest.importorskip("vtkmodules.vtkRenderingCore")
    from meshgauge.plot.paraview_preset import presets

    function = vtk.vtkColorTransferFunction()
    for x, r, g, b in np.array(presets()[0]["RGBPoints"]).reshape(-1, 4).tolist():
        function.AddRGBPoint(x, r, g, b)
    np.testing.assert_allclose(function.GetColor(-0.5), colours.rgb(colours.INVALID), atol=1e-6)
    np.testing.assert_allclose(function.GetColor(0.1), colours.rgb(colours.POOR), atol=1e-5)
