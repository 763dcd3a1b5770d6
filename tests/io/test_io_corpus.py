"""Real meshes: cells by type as the manifest has them, or a refusal that says why; never other cells."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from meshgauge import io
from meshgauge.cells import type_name
from meshgauge.errors import ReadError
from meshgauge.mesh import Mesh

NAMES = {
    "tet": ("tetra", "tetra10"),
    "hex": ("hexahedron", "voxel", "hexahedron20", "hexahedron27"),
    "prism": ("wedge", "wedge15", "penta_prism", "hexa_prism"),
    "pyr": ("pyramid", "pyramid13", "lagrange_pyramid"),
    "poly": ("polyhedron",),
}
REFUSED: dict[str, str] = {}
PRISM_IS_MORE = {"supportedElements.vtk"}  # whose penta- and hexaprism the manifest counts under poly


def rows(folder: Path) -> list[dict[str, str]]:
    with (folder / "meshes" / "MANIFEST.tsv").open(newline="") as file:
        return list(csv.DictReader(file, delimiter="\t"))


def counted(mesh: Mesh, names: tuple[str, ...]) -> int:
    return sum(n for name, n in mesh.type_counts().items() if name in names)


def test_every_mesh_is_read_right_or_refused(shared: Path) -> None:
    wrong, refused = [], set()
    for row in rows(shared):
        path = shared / "meshes" / row["path"]
        try:
            mesh = io.read(path)
        except ReadError as error:
            refused.add(path.name)
            if REFUSED.get(path.name, "\0") not in str(error) or str(path) not in str(error):
                wrong.append((path.name, str(error)))
            continue
        groups = dict(NAMES)
        if path.name in PRISM_IS_MORE:
            groups["prism"] = ("wedge",)
            groups["poly"] = ("polyhedron", "penta_prism", "hexa_prism")
        wrong += [(path.name, column) for column, names in groups.items() if counted(mesh, names) != int(row[column])]
    assert wrong == []
    assert refused == set(REFUSED)


def test_wedges_of_the_corpus_are_turned_where_the_manifest_says_so(shared: Path) -> None:
    for row in rows(shared):
        path = shared / "meshes" / row["path"]
        if path.name in REFUSED or not int(row["prism"]):
            continue
        turned = [note for note in io.read(path).notes if "wedges were turned" in note]
        assert bool(turned) == ("prism" in row["reversed_types_as_read"]), path.name


@pytest.mark.parametrize("extension", [".vtu", ".vtk", ".vtkhdf"])
def test_mixed_mesh_survives_a_round_trip(shared: Path, tmp_path: Path, extension: str) -> None:
    mesh = io.read(shared / "meshes" / "fprotais+hexsmoothing" / "data" / "mixedElementMesh.vtk")
    io.write(tmp_path / f"a{extension}", mesh)
    back = io.read(tmp_path / f"a{extension}")
    assert back.notes == ()  # written in our order: nothing to turn
    assert [type_name(t) for t in back.types[:3]] == [type_name(t) for t in mesh.types[:3]]
    assert back.connectivity.tolist() == mesh.connectivity.tolist()
