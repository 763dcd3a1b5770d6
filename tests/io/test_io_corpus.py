"""Real meshes: cells by type as the manifest has them."""

from __future__ import annotations

import csv
import re
import time
from pathlib import Path

import pytest

from meshgauge import io
from meshgauge.cells import type_name
from meshgauge.io import _files, _isolate, _registry
from meshgauge.mesh import Mesh

ROOT = Path(__file__).resolve().parents[2]
NAMES = {
    "tet": ("tetra", "tetra10"),
    "hex": ("hexahedron", "voxel", "hexahedron20", "hexahedron27"),
    "prism": ("wedge", "wedge15", "penta_prism", "hexa_prism"),
    "pyr": ("pyramid", "pyramid13", "lagrange_pyramid"),
    "poly": ("polyhedron",),
}
PRISM_IS_MORE = {"supportedElements.vtk"}  # whose penta- and hexaprism the manifest counts under poly


def rows(folder: Path) -> list[dict[str, str]]:
    with (folder / "meshes" / "MANIFEST.tsv").open(newline="") as file:
        return list(csv.DictReader(file, delimiter="\t"))


def counted(mesh: Mesh, names: tuple[str, ...]) -> int:
    return sum(n for name, n in mesh.type_counts().items() if name in names)


def readers() -> dict[str, str]:
    """Reader by format, as the table in the documentation has it."""
    lines = (ROOT / "docs" / "formats.md").read_text(encoding="utf-8").splitlines()
    table = [line.split("|") for line in lines if line.startswith("|") and "`" in line]
    return {name: row[4].strip() for row in table for name in re.findall(r"`([^`]+)`", row[2])}


def test_every_format_is_in_the_table_of_the_documentation() -> None:
    assert set(readers()) == set(io.FORMATS)


def test_every_mesh_is_read_with_the_cells_that_the_manifest_has(shared: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The table of all files, printed with ``pytest -s``: result, time, format, reader, cells."""
    wrong, lines, by, isolated = [], [], readers(), []
    in_child = _isolate.read

    def recorded(path: Path, name: str, limits: io.Limits | None = None) -> Mesh:
        isolated.append(path.name)
        return in_child(path, name, limits)

    monkeypatch.setattr(_isolate, "read", recorded)
    for row in rows(shared):
        path = shared / "meshes" / row["path"]
        start = time.perf_counter()
        mesh = io.read(path)
        seconds = time.perf_counter() - start
        groups = dict(NAMES)
        if path.name in PRISM_IS_MORE:
            groups["prism"] = ("wedge",)
            groups["poly"] = ("polyhedron", "penta_prism", "hexa_prism")
        bad = [column for column, names in groups.items() if counted(mesh, names) != int(row[column])]
        wrong += [(path.name, column) for column in bad]
        plain = path.with_suffix("") if path.suffix == ".gz" else path
        with _files.opened(path) as (_, head):
            name = _registry.told(plain, head).name
        reader = by[name] if plain.name in isolated else "own"
        cells = " ".join(f"{column}:{row[column]}" for column in NAMES if row[column] != "0")
        lines.append(f"{path.name:<36}{'WRONG' if bad else 'equal':<7}{seconds:6.2f} s  {name:<9}{reader:<18}{cells}")
    print("", *lines, sep="\n")
    assert wrong == []
    assert len(lines) >= 30


def test_wedges_of_the_corpus_are_turned_where_the_manifest_says_so(shared: Path) -> None:
    for row in rows(shared):
        path = shared / "meshes" / row["path"]
        if not int(row["prism"]):
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
