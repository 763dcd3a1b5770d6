"""Formats that say that all is in a plane: it is seen from +z, in the library and on the command line."""

from __future__ import annotations

import json
from pathlib import Path

import meshio
import numpy as np
import pytest

import meshgauge
from meshgauge.cli.main import main

POINTS = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (2.0, 0.0), (2.0, 1.0)])
CLOCKWISE = np.array([(3, 2, 1, 0), (2, 5, 4, 1)])

XDMF = """<Xdmf Version="3.0"><Domain><Grid Name="Grid"><Geometry GeometryType="{kind}">
<DataItem DataType="Float" Dimensions="6 {n}" Format="XML" Precision="8">{points}</DataItem></Geometry>
<Topology TopologyType="Quadrilateral" NumberOfElements="2"><DataItem DataType="Int" Dimensions="2 4" Format="XML"
 Precision="8">{cells}</DataItem></Topology></Grid></Domain></Xdmf>"""


def written(path: Path, *, in_plane: bool) -> Path:
    if path.suffix == ".xdmf":
        points = POINTS if in_plane else np.pad(POINTS, ((0, 0), (0, 1)))
        numbers = (" ".join(map(str, array.reshape(-1))) for array in (points, CLOCKWISE))
        text = dict(zip(("points", "cells"), numbers, strict=True))
        path.write_text(XDMF.format(kind="XY" if in_plane else "XYZ", n=points.shape[1], **text))
    else:
        meshio.Mesh(POINTS, [("quad", CLOCKWISE)]).write(path)
    return path


@pytest.mark.parametrize("name", ["a.xdmf", "a.su2"])
def test_clockwise_cells_of_a_plane_are_inverted(name: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path / name, in_plane=True)
    mesh = meshgauge.read(path)
    assert mesh.up == 1
    assert mesh.notes == ()
    assert meshgauge.measure(mesh).values.tolist() == [-1.0, -1.0]
    main(["report", str(path), "--json"])
    assert "seen from -z" not in json.dumps(json.loads(capfd.readouterr().out))
    assert main(["check", str(path), "-q"]) == 1
    (tmp_path / "more").mkdir()
    both = [str(path), str(written(tmp_path / "more" / name, in_plane=True))]
    from meshgauge.io.as_one import read_as_one

    assert read_as_one(both).up == 1


def test_three_coordinates_do_not_say_plane(tmp_path: Path) -> None:
    path = written(tmp_path / "a.xdmf", in_plane=False)
    mesh = meshgauge.read(path)
    assert mesh.up == -1
    assert any("seen from -z" in note for note in mesh.notes)
    assert main(["check", str(path), "-q"]) == 0
