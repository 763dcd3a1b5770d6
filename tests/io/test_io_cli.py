"""Reading and writing as the command line does it: folders, limits, regions that stay, what is lost is said."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from io_meshes import LINEAR, mesh_of

from meshgauge import io
from meshgauge.cli.main import main
from meshgauge.mesh import Mesh
from meshgauge.mesh.regions import regions

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "fuzz"))
import fuzzing

Captured = pytest.CaptureFixture[str]
KEPT = {
    ".msh": "gmsh:physical",
    ".mesh": "medit:ref",
    ".meshb": "medit:ref",
    ".vtk": "material",
    ".vtkhdf": "material",
    ".vtu": "material",
    ".med": "material",
    ".xdmf": "material",
    ".avs": "avsucd:material",
}
HOLDS_NO_QUALITY = (".mesh", ".meshb", ".avs")


@pytest.fixture
def case(tmp_path: Path) -> Path:
    """The folder of an OpenFOAM case, without a .foam file."""
    for name, text in fuzzing.TEXTS["openfoam"].items():
        if not name.endswith(".foam"):
            path = tmp_path / "case" / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
    return tmp_path / "case"


@pytest.mark.parametrize("inside", ["", "constant", "constant/polyMesh"])
def test_the_folder_of_a_case_is_a_mesh(
    case: Path, inside: str, capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert main(["report", str(case / inside)]) == 0
    assert "hexahedron         1" in capsys.readouterr().out
    assert io.read(case / inside).path == str(case / inside)
    monkeypatch.chdir(case / inside)
    assert main(["report", "."]) == 0


def test_other_folders_are_errors(case: Path, tmp_path: Path, capsys: Captured) -> None:
    (tmp_path / "empty").mkdir()
    assert main(["report", str(tmp_path / "empty")]) == 2
    assert "no OpenFOAM case with constant/polyMesh in it" in capsys.readouterr().err
    (case / "constant" / "polyMesh" / "owner").unlink()
    assert main(["report", str(case)]) == 2
    assert "owner: no such file; the polyMesh is not whole" in capsys.readouterr().err
    shutil.rmtree(case / "constant" / "polyMesh")
    assert main(["report", str(case)]) == 2
    assert "there is no constant/polyMesh" in capsys.readouterr().err


def test_patches_and_zones_keep_their_names_in_what_is_written(case: Path, capsys: Captured) -> None:
    out = case.parent / "out.vtu"
    assert main(["report", str(case), "-q", "-o", str(out)]) == 0
    back = io.read(out)
    assert back.cell_data["region"].tolist() == [1, 2, 2, 2, 2, 2, 2]
    assert regions(back)[1] == ("cells", "wall")


def test_limits_of_third_party_readers_are_options(tmp_path: Path, capsys: Captured) -> None:
    path = tmp_path / "a.avs"
    path.write_text("4 1 0 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n1 0 tet 1 2 3 4\n")
    assert main(["report", str(path), "-q", "--read-seconds", "60", "--read-memory", "3"]) == 0
    assert main(["report", str(path), "-q", "--read-seconds", "0.1"]) == 2
    assert (
        "was not done after 0.1 s and was ended; the file may be broken (--read-seconds or" in capsys.readouterr().err
    )
    many = np.arange(60_000).reshape(-1, 4)
    io.write(path, Mesh.from_arrays(np.random.default_rng(0).random((60_000, 3)), {"tetra": many}), overwrite=True)
    assert main(["report", str(path), "-q", "--read-memory", "0.1"]) == 2
    assert str(path) in capsys.readouterr().err


@pytest.mark.usefixtures("readers_here")
@pytest.mark.parametrize("extension", KEPT)
def test_a_file_written_in_its_own_format_keeps_its_regions(extension: str, tmp_path: Path, capsys: Captured) -> None:
    given, out, name = tmp_path / f"a{extension}", tmp_path / f"b{extension}", KEPT[extension]
    mesh = mesh_of(*LINEAR)
    names = {"steel": np.array([7, 3]), "air": np.array([9, 3])} if extension == ".msh" else {}
    io.write(given, mesh.replace(cell_data={name: np.array([7, 9] * 4)}, field_data=names))
    before = io.read(given)
    capsys.readouterr()
    assert main(["report", str(given), "-q", "-o", str(out)]) == 0
    said = capsys.readouterr().err
    after = io.read(out)
    assert after.type_counts() == before.type_counts()
    assert after.cell_data[name].tolist() == before.cell_data[name].tolist()
    assert sorted(after.cell_data[name].tolist()) == [7] * 4 + [9] * 4
    assert regions(after)[1] == regions(before)[1]
    assert ("could not hold the cell data 'jens', 'status'" in said) == (extension in HOLDS_NO_QUALITY)
    if extension not in HOLDS_NO_QUALITY:
        np.testing.assert_allclose(after.cell_data["jens"], 1.0)


def test_an_input_is_not_overwritten(tmp_path: Path, capsys: Captured) -> None:
    path = tmp_path / "a.vtu"
    io.write(path, mesh_of("tetra"))
    before = path.read_bytes()
    assert main(["report", str(path), "-o", str(path)]) == 2
    assert "is an input; it is not overwritten" in capsys.readouterr().err
    assert path.read_bytes() == before
    assert main(["report", str(path), "-q", "--in-place", "-o", str(tmp_path / "b.vtu")]) == 2
    assert "--output and --in-place exclude each other" in capsys.readouterr().err
    assert main(["report", str(path), __file__, "-q", "--in-place"]) == 2
    assert "--in-place takes one mesh, 2 are given" in capsys.readouterr().err
    assert path.read_bytes() == before
    assert main(["report", str(path), "-q", "--in-place"]) == 0
    np.testing.assert_allclose(io.read(path).cell_data["jens"], 1.0)
    assert [p.name for p in tmp_path.iterdir()] == ["a.vtu"]
