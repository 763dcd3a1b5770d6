"""Decomposed cases of OpenFOAM, a processor at a time: the report of the whole case."""

from __future__ import annotations

import json
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from foam_cases import Case, decompose, refined, write

import meshgauge
from meshgauge import ReadError, io
from meshgauge.cli.main import main
from meshgauge.io.formats.openfoam import pieces as foam
from meshgauge.kernels.polyhedra.codes import INNER, PATCH
from meshgauge.mesh.beyond import beyond
from meshgauge.report import FileReport
from meshgauge.report.json import report_dict
from meshgauge.report.stream import job_of
from meshgauge.slices import Ask, measure_pieces
from meshgauge.slices import read as slices_read

Captured = pytest.CaptureFixture[str]

SCATTERED = np.random.default_rng(1).integers(0, 3, 200)
"""Processors of cells in no order."""


@pytest.fixture(autouse=True)
def in_small_slices(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(slices_read, "SIZE", 13)
    monkeypatch.setattr(slices_read, "LEAST", 13)


def plain(text: str, *, notes: bool = True) -> dict[str, Any]:
    (file,) = json.loads(text)["files"]
    for name in ("path", "n_points", *(() if notes else ("notes",))):
        del file[name]
    for cell in file["worst"]:
        del cell["point"]
    return dict(file)


def without_points(item: Any) -> Any:
    """JSON without ids and counts of points, and sentences that name them."""
    if isinstance(item, list):
        return [without_points(one) for one in item]
    if not isinstance(item, dict):
        return item
    return {key: without_points(one) for key, one in item.items() if key not in ("point", "n_points", "text")}


def of(report: FileReport) -> dict[str, Any]:
    return plain(json.dumps(report_dict([report])))


def whole(path: Path, **how: Any) -> FileReport:
    return FileReport.of(meshgauge.measure(io.read(path), **how), worst=200, by_region=True, with_diagnosis=True)


def spoiled() -> Case:
    """With cells that are inverted, and faces that point the wrong way."""
    case = refined(noise=0.05)
    case.points[[7, 40, 70]] += (0.9, 0.4, -0.8)
    within = [
        at for at, (_, own, other, _) in enumerate(case.faces) if SCATTERED[own] == SCATTERED[other] and other >= 0
    ]
    for at in within[:20:4]:
        ring, *rest = case.faces[at]
        case.faces[at] = (ring[::-1], *rest)
    return case


def make(folder: Path, kind: str) -> Path:
    case = spoiled()
    part = SCATTERED[: case.n_cells]
    if kind == "regions":
        for name, seed in (("fluid", 0), ("solid", 5)):
            one = refined(seed)
            write(folder / name, one.points + np.array([4.0 * (name == "solid"), 0, 0]), one.faces)
            (folder / "constant" / name).parent.mkdir(exist_ok=True)
            (folder / name / "constant").rename(folder / "constant" / name)
            (folder / name).rmdir()
    else:
        decompose(folder, case, part, packed=kind == "packed", has_ids=kind != "not joined")
    return folder


@pytest.mark.parametrize("kind", ["joined", "packed", "not joined", "regions"])
def test_the_report_of_pieces_is_that_of_the_case(kind: str, tmp_path: Path) -> None:
    path = make(tmp_path, kind)
    expected = whole(path)
    made = meshgauge.stream(path, worst=200, by_region=True, with_diagnosis=True)
    assert of(made) == of(expected)
    assert made.summary.purpose == "fv"
    assert made.diagnosis is not None
    assert made.diagnosis.n_boundary_faces > 0
    if kind != "regions":
        assert made.summary.all.n_invalid > 0
        assert made.diagnosis.finding("misoriented_faces") is not None
    assert made.summary.types["polyhedron"].n_cells > 0


def test_nodes_hang_as_in_the_whole(tmp_path: Path) -> None:
    """Whether cells lie beyond two parts of a face, also where these are another processor's."""
    case = refined(noise=0.0)
    apart = SCATTERED[: case.n_cells]
    decompose(tmp_path, case, apart)
    quality = meshgauge.measure(io.read(tmp_path))
    assert quality.polyhedra is not None
    made = meshgauge.stream(tmp_path)
    assert made.summary == quality.summary()
    assert made.summary.types["polyhedron"].min > 0.99  # but for the points that hang these are cubes


def test_processors_as_one(tmp_path: Path) -> None:
    path = make(tmp_path, "joined")
    folders = [path / f"processor{k}" for k in range(3)]
    mesh = io.read_as_one(folders)
    expected = FileReport.of(meshgauge.measure(mesh), worst=200, by_region=True, with_diagnosis=True)
    assert of(meshgauge.stream(folders, worst=200, by_region=True, with_diagnosis=True)) == of(expected)
    assert expected.diagnosis is not None
    assert expected.diagnosis.finding("joined_points") is not None


def test_a_case_in_one_is_read_whole(tmp_path: Path) -> None:
    case = refined()
    write(tmp_path, case.points, case.faces)
    assert io.pieces(tmp_path) is None
    assert of(meshgauge.stream(tmp_path, worst=200, by_region=True, with_diagnosis=True)) == of(whole(tmp_path))


def test_few_are_kept_and_none_is_read_often(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    case = refined()
    decompose(tmp_path, case, np.arange(case.n_cells) * 6 // case.n_cells)
    expected = meshgauge.measure(io.read(tmp_path)).summary()
    read: list[str] = []
    most = 0
    own = foam.poly_mesh

    def counting(name: str, folder: Path) -> Any:
        nonlocal most
        read.append(name)
        most = max(most, len(foam._held) + 1)
        return own(name, folder)

    monkeypatch.setattr(foam, "poly_mesh", counting)
    assert meshgauge.stream(tmp_path, memory=0, threads=1).summary == expected
    assert most <= foam.KEPT
    assert len(read) <= 2 * 6 + 1  # listed, and measured


def test_another_process_reads_what_it_needs(tmp_path: Path) -> None:
    pieces = io.pieces(make(tmp_path, "joined"))
    assert pieces is not None
    job = job_of(pieces, Ask())
    expected = measure_pieces(job, threads=1)
    again = pickle.loads(pickle.dumps(job))
    foam._held.clear()
    foam._small.clear()
    assert measure_pieces(again, threads=2).summaries == expected.summaries


def test_a_case_that_is_changed_meanwhile(tmp_path: Path) -> None:
    pieces = io.pieces(make(tmp_path, "joined"))
    assert pieces is not None
    job = job_of(pieces, Ask())
    with (tmp_path / "processor1/constant/polyMesh/owner").open("a") as file:
        file.write("\n")
    with pytest.raises(ReadError, match="was changed while it was read"):
        measure_pieces(job, threads=1)


@pytest.mark.parametrize("more", [["--memory", "1kB"], pytest.param(["--scheduler", "1"], marks=pytest.mark.long)])
def test_the_command(more: list[str], tmp_path: Path, capsys: Captured) -> None:
    path = str(make(tmp_path, "joined"))
    assert main(["report", path, "--json"]) == 0
    expected = plain(capsys.readouterr().out, notes=False)
    assert expected.pop("finite_volume")  # there is memory for it
    assert expected.pop("other_metrics")
    assert main(["report", path, "--json", "--no-diagnosis", *more]) == 0
    (file,) = json.loads(capsys.readouterr().out)["files"]
    assert any(note.startswith("What finite volumes ask of faces was not measured") for note in file["notes"])
    made = plain(json.dumps({"files": [file]}), notes=False)
    assert made.pop("finite_volume") == made.pop("other_metrics") == []
    assert made == {**expected, "diagnosis": None}


def test_finite_volumes_read_the_case_whole(tmp_path: Path, capsys: Captured) -> None:
    path = str(make(tmp_path, "joined"))
    assert main(["report", path, "--json", "--memory", "1kB", "--for", "fv"]) == 0
    out, err = capsys.readouterr()
    assert json.loads(out)["files"][0]["finite_volume"]
    assert "is read whole: what finite volumes ask depends on the cells beside" in err


def test_the_gate(tmp_path: Path, capsys: Captured) -> None:
    path = str(make(tmp_path, "joined"))
    for rules in (
        [],
        ["--fail", "nothing invalid", "--fail", "jens >= 0.9 @ 1%"],
        ["--fail", "non_orthogonality <= 1"],
    ):
        outs = []
        for more in ([], ["--memory", "1kB"]):
            assert main(["check", path, "--json", *rules, *more]) == 1
            (file,) = json.loads(capsys.readouterr().out)["files"]
            outs.append(without_points(file))
        assert outs[0] == outs[1]


def test_a_broken_piece_is_an_error(tmp_path: Path, capsys: Captured) -> None:
    path = make(tmp_path, "joined")
    (path / "processor2/constant/polyMesh/faces").write_text("FoamFile { format ascii; }\n3\n(\n")
    assert main(["report", str(path), "--memory", "1kB"]) == 2
    err = capsys.readouterr().err
    assert "processor2" in err
    assert "Traceback" not in err


@pytest.mark.parametrize("kind", ["processor", "processorCyclic"])
def test_what_lies_beyond_faces_is_known(kind: str, tmp_path: Path) -> None:
    """Also where that is another processor's cell; but not behind a patch that is periodic, where points differ."""
    case = refined(noise=0.0)
    decompose(tmp_path, case, SCATTERED[: case.n_cells])
    for boundary in tmp_path.glob("processor*/constant/polyMesh/boundary"):
        boundary.write_text(boundary.read_text().replace("type processor;", f"type {kind};"))
    for ids in () if kind == "processor" else tmp_path.glob("processor*/constant/polyMesh/pointProcAddressing"):
        number = int(ids.parts[-4].removeprefix("processor"))
        head, values = ids.read_text().split("(", 1)
        ids.write_text(f"{head}(" + "\n".join(str(int(one) + 1000 * number) for one in values.split()[:-1]) + "\n)\n")
    mesh, pieces = io.read(tmp_path), io.pieces(tmp_path)
    assert mesh.polyhedra is not None
    assert pieces is not None
    expected = beyond(mesh, np.arange(len(mesh.polyhedra.cell_faces)))
    rows = [piece.polyhedra["beyond"] for piece in pieces.pieces if piece.polyhedra is not None]
    made = np.concatenate([one.read(0, one.shape[0]) for one in rows])
    assert ((made == INNER) == (expected == INNER)).all()
    cell = np.repeat(np.arange(mesh.n_cells), np.diff(mesh.polyhedra.cell_offsets))
    both = np.unique(np.stack([cell, made, expected]), axis=1)  # the same faces of a cell are of one patch
    assert both.shape[1] == np.unique(both[:2], axis=1).shape[1] == np.unique(both[[0, 2]], axis=1).shape[1]
    assert {INNER, PATCH} < set(made.tolist()) if kind == "processorCyclic" else INNER in made
    assert len(np.unique(made)) > 2
