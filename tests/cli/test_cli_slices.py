"""Large meshes on the command line: measured slice by slice, with the output of the whole."""

from __future__ import annotations

import gzip
import json
import re
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from meshgauge import Mesh, io
from meshgauge.cli import batch, slices, terminal
from meshgauge.cli.main import main
from meshgauge.errors import OptionError, WriteError
from meshgauge.io.adding import CannotAdd
from meshgauge.report.values_on_disk import ValuesOnDisk
from meshgauge.slices import run

Captured = pytest.CaptureFixture[str]

LITTLE = ("--memory", "1kB", "--no-diagnosis")


@pytest.fixture
def large(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A file that counts as large; it is cut into slices of 50 cells."""
    monkeypatch.setattr(batch, "LARGE", 0)
    monkeypatch.setattr("meshgauge.slices.read.SIZE", 50)
    rng = np.random.default_rng(0)
    corner = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
    points = (corner + rng.normal(size=(170, 4, 3)) * 0.3).reshape(-1, 3)
    mesh = Mesh.from_arrays(points, {"tetra": np.arange(680).reshape(-1, 4)}, cell_data={"zone": np.arange(170) % 3})
    path = tmp_path / "large.vtkhdf"
    io.write(path, mesh)
    return path


@pytest.fixture
def sliced(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many slices were measured."""
    done: list[int] = []
    results = run._results

    def counted(*arguments: Any) -> Any:
        for result in results(*arguments):
            done.append(1)
            yield result

    monkeypatch.setattr(run, "_results", counted)
    return done


def without_notes(text: str) -> Any:
    document = json.loads(text)
    for file in document["files"]:
        del file["notes"]
    return document


@pytest.mark.parametrize(
    "more", [(), ("--by", "region", "--metric", "scaled_jacobian", "--worst", "30", "--for", "fem")]
)
def test_the_json_is_that_of_the_whole(large: Path, more: tuple[str, ...], sliced: list[int], capsys: Captured) -> None:
    assert main(["report", str(large), "--json", "--no-diagnosis", *more]) == 0
    expected = capsys.readouterr().out
    assert not sliced
    assert main(["report", str(large), "--json", *LITTLE, *more]) == 0
    out, err = capsys.readouterr()
    assert len(sliced) == 4
    assert without_notes(out) == without_notes(expected)
    assert re.search(r"note: .*: points are read \d+ times, about \d+ s; --memory \S+ reads them once", err)


def test_the_table_is_that_of_the_whole(large: Path, sliced: list[int], tmp_path: Path) -> None:
    whole, made = tmp_path / "whole.csv", tmp_path / "made.csv"
    assert main(["report", str(large), "--csv", str(whole), "-q"]) == 0
    assert main(["report", str(large), "--csv", str(made), "-q", *LITTLE]) == 0
    assert len(sliced) == 4
    assert made.read_bytes() == whole.read_bytes()


def test_the_diagnosis_says_that_it_was_left_out(large: Path, sliced: list[int], capsys: Captured) -> None:
    assert main(["report", str(large), "--json", "--memory", "1kB"]) == 0
    (why,) = json.loads(capsys.readouterr().out)["files"][0]["diagnosis"]["skipped"]
    assert "more than --memory allows" in why
    assert sliced


def test_the_diagnosis_is_that_of_the_whole(
    large: Path, sliced: list[int], monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    assert main(["report", str(large), "--json"]) == 0
    expected = capsys.readouterr().out
    assert not sliced
    monkeypatch.setattr("meshgauge.report.diagnosis.bytes_needed", lambda n_cells, n_points: 0)
    monkeypatch.setattr("meshgauge.report.diagnosis.CELLS", 13)
    assert main(["report", str(large), "--json", "--memory", "1kB"]) == 0
    assert sliced
    assert without_notes(capsys.readouterr().out) == without_notes(expected)
    assert json.loads(expected)["files"][0]["diagnosis"]["n_boundary_faces"] > 0


@pytest.mark.parametrize("tolerance", ["1e-9", "0.01"])
def test_the_doctor_says_the_same_in_slices(
    large: Path, sliced: list[int], tolerance: str, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    asked = ["doctor", str(large), "--json", "--tolerance", tolerance]
    code, expected = main(asked), capsys.readouterr().out
    assert not sliced
    monkeypatch.setattr(batch, "DIAGNOSED", 100)
    monkeypatch.setattr("meshgauge.report.diagnosis.CELLS", 13)
    assert main(asked) == code == 1
    assert sliced
    assert capsys.readouterr().out == expected
    assert ("duplicate_points" in expected) == (tolerance != "1e-9")


def test_the_doctor_looks_at_the_whole_where_slices_do_not_tell(
    large: Path, sliced: list[int], monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    monkeypatch.setattr(batch, "DIAGNOSED", 100)
    monkeypatch.setattr("meshgauge.report.diagnosis.bytes_needed", lambda n_cells, n_points: 1 << 60)
    assert main(["doctor", str(large), "-q"]) == 1
    assert sliced
    assert "not diagnosed" not in capsys.readouterr().out


def test_a_mesh_that_fits_is_read_whole(large: Path, sliced: list[int], capsys: Captured) -> None:
    assert main(["report", str(large), "--memory", "1GB"]) == 0
    assert "not diagnosed" not in capsys.readouterr().out
    assert not sliced


def test_what_has_to_be_read_whole_says_why(large: Path, sliced: list[int], capsys: Captured) -> None:
    assert main(["report", str(large), "--metric", "verdict_condition", *LITTLE]) == 0
    assert "is read whole: metric verdict_condition" in capsys.readouterr().err
    assert not sliced


@pytest.mark.parametrize(
    ("asked", "why"),
    [
        (("--csv", "cells.csv", "--bad-set", "bad.msh"), "bad.msh holds the whole mesh, and is written at once"),
        (("-o", "out.med"), "out.med is written at once: only VTKHDF and VTU are written slice by slice"),
    ],
)
def test_outputs_that_take_all_cells_say_so(
    asked: tuple[str, ...], why: str, large: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(large.parent)
    assert main(["report", str(large), *asked, *LITTLE]) == 0
    assert f"is read whole: {why}" in capsys.readouterr().err


def test_what_finite_volumes_ask_takes_all_cells(large: Path, sliced: list[int], capsys: Captured) -> None:
    assert main(["report", str(large), "--for", "fv", *LITTLE]) == 0
    out, err = capsys.readouterr()
    assert "is read whole: what finite volumes ask depends on the cells beside" in err
    assert "non_orthogonality" in out
    assert not sliced


def added(path: Path) -> dict[str, bytes]:
    """All arrays of a file, to the bit."""
    with h5py.File(path) as file:
        arrays: dict[str, bytes] = {}
        file["VTKHDF"].visititems(
            lambda name, one: arrays.update({name: one[...].tobytes()}) if isinstance(one, h5py.Dataset) else None
        )
    return arrays


@pytest.mark.parametrize(
    "more", [("--metric", "shape"), ("--threads", "2"), pytest.param(("--scheduler", "2"), marks=pytest.mark.long)]
)
def test_what_is_added_is_that_of_the_whole(large: Path, more: tuple[str, ...], sliced: list[int]) -> None:
    whole, made = large.with_name("whole.vtkhdf"), large.with_name("made.vtkhdf")
    assert main(["report", str(large), "-o", str(whole), "-q", *(more if "--metric" in more else ())]) == 0
    assert not sliced
    assert main(["report", str(large), "-o", str(made), "-q", *LITTLE, *more]) == 0
    assert len(sliced) == 4
    assert added(made) == added(whole)
    assert {"CellData/zone", "CellData/jens", "CellData/status", "PointData/jens_node"} <= {*added(made)}
    assert {path.name for path in large.parent.iterdir()} == {"large.vtkhdf", "whole.vtkhdf", "made.vtkhdf"}
    assert main(["report", str(large), "--in-place", "-q", *LITTLE, *more]) == 0
    assert added(large) == added(whole)


@pytest.mark.parametrize("ending", [".vtkhdf", ".vtu"])
def test_what_is_read_again_is_read_before_the_input_is_replaced(
    large: Path, ending: str, tmp_path: Path, sliced: list[int], capsys: Captured
) -> None:
    """The diagnosis, the page and the bad cells read from the file once more after it is measured."""
    mesh, made = large.with_name(f"mesh{ending}"), large.with_name(f"made{ending}")
    page, bad = tmp_path / "page.html", tmp_path / "bad.vtu"
    io.write(mesh, io.read(large))
    little = ("--memory", "40MB")  # the diagnosis has room
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(slices, "takes_more", lambda *_: True)
        more = ("--html", str(page), "--bad", str(bad), "--json")
        assert main(["report", str(mesh), "-o", str(mesh.with_name(f"made{ending}")), *little, *more]) == 0
        expected, expected_bad = capsys.readouterr().out, bad.read_bytes()
        before = mesh.read_bytes()
        assert main(["report", str(mesh), "--in-place", *little, "--bad", str(tmp_path / "bad.nothing"), "-q"]) == 2
        assert mesh.read_bytes() == before
        capsys.readouterr()
        assert main(["report", str(mesh), "--in-place", *little, *more]) == 0
    assert sliced
    assert capsys.readouterr().out == expected
    assert bad.read_bytes() == expected_bad
    assert (added(mesh) == added(made)) if ending == ".vtkhdf" else (mesh.read_bytes() == made.read_bytes())
    assert "jens" in io.read(mesh).cell_data
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(
        ["bad.vtu", "large.vtkhdf", f"made{ending}", f"mesh{ending}", "page.html"]
    )


def test_what_a_killed_process_kept_is_removed(tmp_path: Path) -> None:
    """Values of all cells may be gigabytes."""
    dies = (
        "import os; from pathlib import Path; from meshgauge.report.values_on_disk import ValuesOnDisk\n"
        f"with ValuesOnDisk(Path({str(tmp_path / 'out.vtu')!r}), 1, 1): os._exit(0)"
    )
    subprocess.run([sys.executable, "-c", dies], check=True)
    left = set(tmp_path.iterdir())
    assert len(left) == 1
    with ValuesOnDisk(tmp_path / "out.vtu", 1, 1), ValuesOnDisk(tmp_path / "other.vtu", 1, 1):
        assert len({*tmp_path.iterdir()} - left) == len({*tmp_path.iterdir()}) == 2  # none that is in use is removed
    assert not list(tmp_path.iterdir())


def _no_space(*_: object) -> str:
    raise WriteError("no space left")


def test_points_of_few_and_of_many_cells_are_evaluated_as_in_the_whole(
    large: Path, sliced: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of cells that are many in the whole a slice has few; they share points with those of other slices."""
    monkeypatch.setattr("meshgauge.kernels.path.NUMPY_UP_TO", 100)
    points, cells = (
        np.random.default_rng(1).random((90, 3)),
        np.random.default_rng(2).permuted(np.tile(np.arange(90), (300, 1)), axis=1),
    )
    mesh = Mesh.from_arrays(
        np.vstack([points, np.full((1, 3), np.nan)]),
        [("tetra", np.vstack([cells[:200, :4], [[1, 2, 3, 90]]])), ("hexahedron", cells[200:230, :8])],
    )
    io.write(large, mesh)
    whole, made = large.with_name("whole.vtkhdf"), large.with_name("made.vtkhdf")
    main(["report", str(large), "-o", str(whole), "-q", "--no-diagnosis"])
    main(["report", str(large), "-o", str(made), "-q", *LITTLE])
    assert sliced
    assert added(made) == added(whole)
    values = np.frombuffer(added(made)["PointData/jens_worst"])
    assert np.isnan(values[[1, 2, 3, 90]]).all()
    assert np.isfinite(values).any()


def test_nothing_is_left_of_an_output_that_is_not_made(
    large: Path, sliced: list[int], monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    """A copy that is not as it should be takes the place of nothing."""
    monkeypatch.setattr("meshgauge.io.adding._same", lambda *_: False)
    before = large.read_bytes()
    assert main(["report", str(large), "--in-place", "-q", *LITTLE]) == 2
    assert sliced
    assert "does not read back as it was to be: points differ" in capsys.readouterr().err
    assert large.read_bytes() == before
    assert [path.name for path in large.parent.iterdir()] == ["large.vtkhdf"]


def test_a_file_whose_grid_moves_is_read_whole(large: Path, sliced: list[int], capsys: Captured) -> None:
    reason = "holds time steps of which each has points or cells of its own"

    def cannot(*_: object, **__: object) -> None:
        raise CannotAdd(reason)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("meshgauge.io.adding.add_to_pieces", cannot)
        assert main(["report", str(large), "-o", str(large.with_name("out.vtkhdf")), *LITTLE]) == 0
    assert sliced
    assert f"nothing is added in slices to a file that {reason}" in capsys.readouterr().err
    assert "CellData/jens" in added(large.with_name("out.vtkhdf"))


def test_outputs_of_all_cells_are_made_of_the_whole(large: Path, sliced: list[int], tmp_path: Path) -> None:
    assert main(["report", str(large), "-o", str(tmp_path / "out.msh"), "-q", *LITTLE]) == 0
    assert io.read(tmp_path / "out.msh").cell_data["jens"].shape == (170,)
    assert not sliced


def test_a_broken_file_has_the_message_of_reading(large: Path, capsys: Captured) -> None:
    large.write_bytes(large.read_bytes()[:3000])
    assert main(["report", str(large), *LITTLE]) == 2
    sliced = capsys.readouterr().err
    assert main(["report", str(large)]) == 2
    assert capsys.readouterr().err == sliced


def test_a_packed_array_that_is_broken_names_the_file_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    """Slices are read by the path from the root, whatever path is given."""
    points, path = np.random.default_rng(0).random((40, 3)), tmp_path / "packed.vtu"
    io.write(path, Mesh.from_arrays(points, {"tetra": np.arange(40).reshape(10, 4)}))
    data = path.read_bytes()
    at = data.index(b"_", data.index(b"<AppendedData")) + 60
    path.write_bytes(data[:at] + bytes([255] * 40) + data[at + 40 :])
    monkeypatch.chdir(tmp_path)
    assert main(["report", "packed.vtu", "--scheduler", "1", "-q"]) == 2
    message = capsys.readouterr().err
    assert message.count("packed.vtu") == 1, message


def test_a_cell_that_is_wrong_has_its_number_in_the_mesh(large: Path, capsys: Captured) -> None:
    with h5py.File(large, "r+") as file:
        file["VTKHDF/Connectivity"][4 * 120 + 1] = 10**6
    messages = []
    for more in (LITTLE, ()):
        assert main(["report", str(large), *more]) == 2
        messages.append(capsys.readouterr().err)
    assert "cell 120 (tetra): point id 1000000 is outside" in messages[1]
    assert messages[0].splitlines()[-1] == messages[1].splitlines()[-1]


def test_ctrl_c_says_how_far_it_was(large: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured) -> None:
    results = run._results

    def stopped(*arguments: Any) -> Any:
        for number, result in enumerate(results(*arguments)):
            if number == 2:
                raise KeyboardInterrupt
            yield result

    monkeypatch.setattr(run, "_results", stopped)
    assert main(["report", str(large), *LITTLE]) == 130
    assert "large.vtkhdf: stopped, 100 of 170 cells were measured" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["report", "doctor"])
def test_ctrl_c_in_the_diagnosis_says_that_all_were_measured(
    command: str, large: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    def stopped(*_: Any, **__: Any) -> Any:
        raise KeyboardInterrupt

    monkeypatch.setattr("meshgauge.doctor.streamed.diagnose.diagnosis_of", stopped)
    monkeypatch.setattr(batch, "DIAGNOSED", 100)
    assert main([command, str(large)]) == 130
    err = capsys.readouterr().err
    assert "large.vtkhdf: stopped, all cells were measured, the diagnosis was not finished" in err


def test_a_file_that_takes_more_than_allowed_as_a_whole_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    """Also a small one, where ``--memory`` is given: of packed files nobody sees what they hold."""
    monkeypatch.setattr(batch, "LARGE", 0)
    path = tmp_path / "a.msh"
    io.write(path, Mesh.from_arrays(np.eye(4, 3), {"tetra": [(3, 0, 1, 2)]}))
    for more, is_said in (["--memory", "100B"], True), (["--memory", "1MB"], False), ([], False):
        assert main(["report", str(path), *more]) == 0
        assert ("a.msh: is read whole: " in capsys.readouterr().err) == is_said


def test_stopped_before_any_slice_there_are_no_counts(capsys: Captured) -> None:
    with pytest.raises(KeyboardInterrupt), slices.progress("a.vtu", shown=False):
        raise KeyboardInterrupt
    assert capsys.readouterr().err == "meshgauge: a.vtu: stopped, none measured\n"


def test_progress_tells_the_time_left(monkeypatch: pytest.MonkeyPatch, capsys: Captured) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    monkeypatch.setattr(terminal, "PATIENCE", 0.0)
    shown, deadline = "", time.monotonic() + 10
    with slices.progress("a.vtu", shown=True) as update:
        update(1, 4)
        update(3, 4)
        while "a.vtu: 75%, 0 s left" not in shown:
            assert time.monotonic() < deadline, shown
            time.sleep(0.02)
            shown += capsys.readouterr().err


def test_ctrl_c_in_the_diagnosis_says_how_much_of_it_was_done(
    large: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    def stopped(*_: Any, **__: Any) -> Any:
        raise KeyboardInterrupt

    monkeypatch.setattr("meshgauge.doctor.streamed.diagnose.keep", stopped)  # the last pass
    monkeypatch.setattr(batch, "DIAGNOSED", 100)
    assert main(["doctor", str(large)]) == 130
    err = capsys.readouterr().err
    found = re.search(r"all cells were measured, the diagnosis was not finished; (\d+)% of it was done", err)
    assert found is not None, err
    assert 50 < int(found[1]) < 100


def test_progress_of_the_diagnosis(monkeypatch: pytest.MonkeyPatch, capsys: Captured) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    monkeypatch.setattr(terminal, "PATIENCE", 0.0)
    shown, deadline = "", time.monotonic() + 10
    with slices.diagnosing("a.vtu", shown=True, then="drawing") as tell:
        for share, text in (0.75, "diagnosing a.vtu: 75%, 0 s left"), (1.0, "drawing a.vtu"):
            tell(share)
            while text not in shown:
                assert time.monotonic() < deadline, shown
                time.sleep(0.02)
                shown += capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "n"),
    [("512MB", 512_000_000), ("1.5 GB", 1_500_000_000), ("4GiB", 1 << 32), ("64KiB", 1 << 16), ("100b", 100)],
)
def test_sizes(text: str, n: int) -> None:
    assert slices.n_bytes(text) == n


@pytest.mark.parametrize("text", ["", "4", "GB", "-1MB", "4XB", "4MB!"])
def test_what_is_no_size(text: str) -> None:
    with pytest.raises(OptionError, match="expected a size"):
        slices.n_bytes(text)


def test_a_size_comes_back() -> None:
    for n in (1_000, 64_000_000, 1_500_000_000, 2_000_000_000_000):
        assert slices.n_bytes(slices.size_text(n)) == n


def test_the_gate_is_that_of_the_whole(large: Path, sliced: list[int], capsys: Captured) -> None:
    rules = ("--fail", "nothing invalid", "--warn", "jens >= 0.4 @ 1% in 'zone 1'", "--json")
    code = main(["check", str(large), *rules])
    expected = json.loads(capsys.readouterr().out)
    assert not sliced
    assert main(["check", str(large), *rules, *LITTLE[:2]]) == code == 1
    assert json.loads(capsys.readouterr().out) == expected
    assert len(sliced) == 4


def test_a_baseline_is_that_of_the_whole(large: Path, sliced: list[int], tmp_path: Path) -> None:
    whole, made = tmp_path / "whole.json", tmp_path / "made.json"
    assert main(["check", str(large), "--write-baseline", str(whole), "-q"]) == 0
    assert main(["check", str(large), "--write-baseline", str(made), "-q", *LITTLE[:2]]) == 0
    assert sliced
    assert made.read_bytes() == whole.read_bytes()


def test_rules_about_neighbours_take_memory(
    large: Path, sliced: list[int], capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = ["check", str(large), "--fail", "nothing hanging"]
    assert main([*asked, *LITTLE[:2]]) == 0
    assert "is read whole: 'nothing hanging' depends on the cells beside, and that takes" in capsys.readouterr().err
    assert not sliced
    monkeypatch.setattr(batch, "DIAGNOSED", 0)
    monkeypatch.setattr(batch.Batch, "read", None)  # nothing is read whole
    assert main(asked) == 0
    assert sliced


def test_a_small_file_that_names_large_ones(large: Path, sliced: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    writer = vtkXMLUnstructuredGridWriter()
    writer.SetFileName(str(large.with_suffix(".vtu")))
    writer.SetInputData(io.read(large).to_pyvista())
    writer.EncodeAppendedDataOff()
    assert writer.Write() == 1
    path = large.with_suffix(".pvtu")
    path.write_text(
        '<VTKFile type="PUnstructuredGrid"><PUnstructuredGrid><Piece Source="large.vtu"/></PUnstructuredGrid></VTKFile>'
    )
    monkeypatch.setattr(batch, "LARGE", 1 << 40)
    assert main(["report", str(path), "-q", *LITTLE]) == 0
    assert len(sliced) == 4


@pytest.mark.parametrize("text", ["foo", "0", "-3", "1025", ""])
def test_a_wrong_scheduler_is_refused_whatever_the_size(text: str, tmp_path: Path, capsys: Captured) -> None:
    io.write(tmp_path / "a.vtu", Mesh.from_arrays(np.eye(4, 3), {"tetra": [(3, 0, 1, 2)]}))
    assert main(["report", str(tmp_path / "a.vtu"), f"--scheduler={text}"]) == 2
    assert "--scheduler is" in capsys.readouterr().err


def test_a_large_file_that_slices_do_not_read_says_why(
    tmp_path: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("meshgauge.cli.batch.LARGE", 0)
    monkeypatch.setattr("meshgauge.cli.batch.SAID", 1000)
    mesh, written = io.read("examples/meshes/bracket.vtu"), dict[str, list[str]]()
    for name in ("a.msh", "a.vtu", "a.vtkhdf"):
        io.write(tmp_path / name, mesh)
    (tmp_path / "b.vtu.gz").write_bytes(gzip.compress((tmp_path / "a.vtu").read_bytes()))
    encoded = (tmp_path / "a.vtu").read_bytes().replace(b"vtkZLibDataCompressor", b"vtkLZ4DataCompressor")
    (tmp_path / "c.vtu").write_bytes(encoded)
    for name in ("a.msh", "a.vtu", "a.vtkhdf", "b.vtu.gz", "c.vtu"):
        main(["report", str(tmp_path / name), "--no-diagnosis"])
        written[name] = [line for line in capsys.readouterr().err.splitlines() if "is read whole" in line]
        written[name] = [line.split(": ", 4)[-1] for line in written[name]]
    assert written == {
        "a.msh": ["files of Gmsh are not read in slices"],
        "a.vtu": [],
        "a.vtkhdf": [],
        "b.vtu.gz": ["it is packed by gzip"],
        "c.vtu": ["its arrays are packed, encoded or arranged in a way that is not read in slices"],
    }
