"""Real meshes: cells by type as the manifest has them."""

from __future__ import annotations

import csv
import importlib.util
import re
import sys
from pathlib import Path

import pytest
from vtkmodules.vtkCommonCore import vtkVersion

from meshgauge import io
from meshgauge.cells import type_name
from meshgauge.io.patching import patch_of

ROOT = Path(__file__).resolve().parents[2]
_SPEC = importlib.util.spec_from_file_location("benchmark_formats", ROOT / "benchmarks" / "formats.py")
assert _SPEC is not None
assert _SPEC.loader is not None
formats = importlib.util.module_from_spec(_SPEC)
sys.modules[_SPEC.name] = formats
_SPEC.loader.exec_module(formats)  # not by sys.path: readers in processes of their own get that as well


def manifest(folder: Path) -> list[dict[str, str]]:
    with (folder / "meshes" / "MANIFEST.tsv").open(newline="") as file:
        return list(csv.DictReader(file, delimiter="\t"))


HEADER = ["format", "name", "extensions", "reader", "why", "written"]


def documented() -> list[dict[str, str]]:
    """Rows of the table of formats in the documentation; other tables of the page are not looked at."""
    lines = (ROOT / "docs" / "formats.md").read_text(encoding="utf-8").splitlines()
    cells = [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines]
    start = cells.index(HEADER) + 2
    end = next(n for n in range(start, len(cells)) if not cells[n])
    return [dict(zip(HEADER, row, strict=True)) for row in cells[start:end]]


def names(row: dict[str, str]) -> list[str]:
    return re.findall(r"`([^`]+)`", row["name"])


def readers() -> dict[str, str]:
    """Reader by format, the first where the documentation has two rows of it."""
    return {name: row["reader"] for row in reversed(documented()) for name in names(row)}


def test_every_format_is_in_the_table_of_the_documentation() -> None:
    assert set(readers()) == set(io.FORMATS)


def test_what_is_written_is_in_the_table_as_well() -> None:
    assert {row["written"] for row in documented()} == {"yes", "no"}
    written = {name for row in documented() if row["written"] == "yes" for name in names(row)}
    assert written == {name for name, f in io.FORMATS.items() if f.write is not None}


def test_the_reader_is_our_own_where_the_table_says_so() -> None:
    for name, reader in readers().items():
        one = io.FORMATS[name]
        is_own = any((one.read, one.read_step, one.steps))  # a collection has only a list of files
        assert is_own == reader.startswith("own"), name


@pytest.mark.long
def test_every_mesh_is_read_with_the_cells_that_the_manifest_has(shared: Path) -> None:
    found = list(formats.rows(shared / "meshes", times=1))
    assert [(row.path.name, row.wrong, row.error) for row in found if row.wrong or row.error] == []
    assert len(found) >= 30


def test_wedges_of_the_corpus_are_turned_where_the_manifest_says_so(shared: Path) -> None:
    for row in manifest(shared):
        path = shared / "meshes" / row["path"]
        if not int(row["prism"]):
            continue
        turned = [note for note in io.read(path).notes if "turned from the order that VTK" in note]
        # VTK's reader of EnSight gave them in VTK's older order, before that was changed in 9.7.
        older = path.suffix == ".case" and (vtkVersion.GetVTKMajorVersion(), vtkVersion.GetVTKMinorVersion()) < (9, 7)
        assert bool(turned) == ("prism" in row["reversed_types_as_read"] or older), path.name


@pytest.mark.parametrize("extension", [".vtu", ".vtk", ".vtkhdf"])
def test_mixed_mesh_survives_a_round_trip(shared: Path, tmp_path: Path, extension: str) -> None:
    mesh = io.read(shared / "meshes" / "fprotais+hexsmoothing" / "data" / "mixedElementMesh.vtk")
    io.write(tmp_path / f"a{extension}", mesh)
    back = io.read(tmp_path / f"a{extension}")
    assert back.notes == ()  # written in our order: nothing to turn
    assert [type_name(t) for t in back.types[:3]] == [type_name(t) for t in mesh.types[:3]]
    assert back.connectivity.tolist() == mesh.connectivity.tolist()


@pytest.mark.long
def test_a_real_mesh_of_which_nothing_moves_comes_back_to_the_last_byte(shared: Path, tmp_path: Path) -> None:
    """Every file of the manifest that is patched."""
    n = 0
    for path in [shared / "meshes" / row["path"] for row in manifest(shared)]:
        mesh = io.read(path, step="first")
        folder = tmp_path / str(n)
        folder.mkdir(exist_ok=True)
        patch = patch_of(mesh, folder / path.name, step="first")
        if patch is None:
            continue
        n += 1
        patch.write(mesh)
        assert patch.target.read_bytes() == path.read_bytes(), path
    assert n > 20
