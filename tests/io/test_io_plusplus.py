"""Formats read by meshio++ and VTK's CGNS reader: all linear cells come back, and are as good as they were."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from io_meshes import LINEAR, mesh_of

import meshgauge
from meshgauge import io
from meshgauge.cells import BY_NAME
from meshgauge.errors import ReadError
from meshgauge.io.formats import plusplus

TRIED = {
    "cgns": ("cgns", ".cgns", LINEAR),
    "febio": ("febio", ".feb", LINEAR),
    "frd": ("frd", ".frd", ("tetra", "wedge", "hexahedron")),
    "comsol": ("mphtxt", ".mphtxt", LINEAR),
    "code_aster": ("code_aster", ".mail", LINEAR),
    "patran": ("patran", ".pat", LINEAR),
    "libmesh": ("libmesh", ".xda", LINEAR),
    "radioss": ("radioss", ".rad", LINEAR),
}


def test_every_format_is_tried() -> None:
    assert {f.name for f in plusplus.PLUSPLUS} | {"cgns"} == set(TRIED)


@pytest.mark.usefixtures("readers_here")
@pytest.mark.parametrize("name", TRIED)
def test_cells_come_back(name: str, tmp_path: Path) -> None:
    package = pytest.importorskip("meshioplusplus")
    module, extension, types = TRIED[name]
    mesh = mesh_of(*types)
    rows = mesh.connectivity.tolist()
    by_type = {t: [rows[mesh.offsets[c] : mesh.offsets[c + 1]] for c in np.flatnonzero(mesh.types == BY_NAME[t].vtk_id)]
               for t in types}  # fmt: skip
    path = tmp_path / f"a{extension}"
    package.write(str(path), package.Mesh(mesh.points, [(t, np.array(c)) for t, c in by_type.items()]),
                  file_format=module)  # fmt: skip
    back = io.read(path)
    assert back.type_counts() == mesh.type_counts()
    assert float(meshgauge.measure(back).values.min()) == pytest.approx(1, abs=1e-4)  # frd has six digits


@pytest.mark.usefixtures("readers_here")
@pytest.mark.parametrize("equals", [" = ", "\t=  ", " "])
def test_code_aster_may_put_an_equals_sign_behind_a_name(equals: str, tmp_path: Path) -> None:
    pytest.importorskip("meshioplusplus")
    path = tmp_path / "a.mail"
    points = "N0 0. 0. 0.\nN1 1. 0. 0.\nN2 0. 1. 0.\nN3 0. 0. 1.\n"
    path.write_text(
        f"COOR_3D\n{points}FINSF\n\nTETRA4\nVOLUME{equals}N0 N1 N2 N3\n  V2{equals}N0 N1 N2 N3\nFINSF\nFIN\n"
    )
    assert io.read(path).connectivity.tolist() == [0, 1, 2, 3, 0, 1, 2, 3]


def test_includes_are_not_followed(tmp_path: Path) -> None:
    path = tmp_path / "a.rad"
    path.write_text("#RADIOSS STARTER\n#include /etc/passwd\n/END\n")
    with pytest.raises(ReadError, match=r"a\.rad: includes other files, which are not followed"):
        io.read(path)


def test_what_is_missing_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "packages" / "meshioplusplus"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("raise ImportError('none')")
    monkeypatch.syspath_prepend(package.parent)
    path = tmp_path / "a.mail"
    path.write_text("TITRE\nFINSF\nFIN\n")
    with pytest.raises(ReadError, match=r"pip install 'meshgauge\[meshioplusplus\]'"):
        io.read(path)
