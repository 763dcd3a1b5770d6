"""``meshgauge improve``: what is written, printed and left alone."""

from __future__ import annotations

import dataclasses
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import command_line
import numpy as np
import pytest

import meshgauge
from meshgauge import Mesh, WriteError, repair
from meshgauge.cli.main import main
from meshgauge.files import undo as undo_data
from meshgauge.repair.claims import Promise
from meshgauge.repair.report import Claim
from meshgauge.repair.run import Progress

ROOT = Path(__file__).resolve().parents[2]
BRACKET = ROOT / "examples" / "meshes" / "bracket.vtu"


def grid(n: int, noise: float) -> Mesh:
    """Cubes, their inner points moved at random by up to a share of an edge; point data ``left`` mark x < 0.3."""
    ticks = np.arange(n + 1)
    points = np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), axis=-1).reshape(-1, 3) / n
    ids = np.arange(len(points)).reshape(n + 1, n + 1, n + 1)
    low, high = slice(None, -1), slice(1, None)
    at = [(low, low, low), (high, low, low), (high, high, low), (low, high, low)]
    at += [(a, b, high) for a, b, _ in at]
    cells = np.stack([ids[where].ravel() for where in at], axis=1)
    inside = ((points > 0) & (points < 1)).all(axis=1)
    shift = np.random.default_rng(7).uniform(-1, 1, points.shape) * inside[:, None] * noise / n
    mesh = Mesh.from_arrays(points + shift, {"hexahedron": cells})
    return mesh.replace(point_data={"left": (points[:, 0] < 0.3).astype(np.int32)})


def run(*arguments: object) -> subprocess.CompletedProcess[str]:
    return command_line.run("improve", *arguments)


def undone(*arguments: object) -> subprocess.CompletedProcess[str]:
    return command_line.run("undo", *arguments)


@pytest.fixture(scope="module")
def tangled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("tangled") / "grid.vtu"
    meshgauge.write(path, grid(5, 0.8))
    return path


@pytest.fixture(scope="module")
def repaired(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    folder = tmp_path_factory.mktemp("repaired")
    done = run(BRACKET, "-o", folder / "out.vtu", "--undo", folder / "undo.npz", "--html", folder / "page.html")
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return folder, done.stdout


def test_the_bracket_is_repaired(repaired: tuple[Path, str]) -> None:
    folder, text = repaired
    assert "3 invalid cells were repaired" in text
    for part in ("before", "after", "2,976 tetra", "points moved", "volume", "surface", "checked on the result"):
        assert part in text
    assert "does NOT hold" not in text
    assert "6,192 all" in text  # several types: their sum too
    before, after = meshgauge.read(BRACKET), meshgauge.read(folder / "out.vtu")
    assert meshgauge.measure(after).values.min() > 0.2
    np.testing.assert_array_equal(after.connectivity, before.connectivity)
    assert set(after.cell_data) == set(before.cell_data)


def test_the_page_holds_the_repair_report(repaired: tuple[Path, str]) -> None:
    page = (repaired[0] / "page.html").read_text(encoding="utf-8")
    assert "Repair report" in page
    assert "to the last bit" in page


def test_undone_to_the_last_bit(repaired: tuple[Path, str], tmp_path: Path) -> None:
    folder, _ = repaired
    done = undone(folder / "out.vtu", folder / "undo.npz", "-o", tmp_path / "back.vtu")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "back.vtu").read_bytes() == BRACKET.read_bytes()


@pytest.mark.parametrize("suffix", ["msh", "mesh", "vtk", "inp"])
def test_undone_through_formats_that_round(tmp_path: Path, suffix: str) -> None:
    start = grid(3, 0.7)
    start = start.replace(points=start.points.astype(np.float32))
    meshgauge.write(tmp_path / "in.vtu", start)
    better = tmp_path / f"out.{suffix}"
    assert run(tmp_path / "in.vtu", "-o", better, "--undo", tmp_path / "undo.npz").returncode == 0
    assert meshgauge.measure(meshgauge.read(better)).values.min() > 0.9
    done = undone(better, tmp_path / "undo.npz", "-o", tmp_path / "back.vtu")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "back.vtu").read_bytes() == (tmp_path / "in.vtu").read_bytes()


def test_undo_data_of_another_mesh_are_refused(repaired: tuple[Path, str], tangled: Path, tmp_path: Path) -> None:
    done = undone(tangled, repaired[0] / "undo.npz", "-o", tmp_path / "back.vtu")
    assert done.returncode == 2
    assert "undo data of another file" in done.stderr
    done = undone(tangled, BRACKET, "-o", tmp_path / "back.vtu")
    assert done.returncode == 2
    assert "not a file of undo data" in done.stderr
    assert not list(tmp_path.iterdir())


def test_json_is_strict_and_versioned(tangled: Path, tmp_path: Path) -> None:
    done = run(tangled, "-o", tmp_path / "out.vtu", "--json", "--strict")

    def refuse(text: str) -> None:
        raise AssertionError(f"{text} is not JSON")

    data = json.loads(done.stdout, parse_constant=refuse)
    assert (data["schema"], data["version"]) == ("meshgauge-improve", 3)
    assert data["outcome"] == "improved"
    assert data["after"]["status"] == {"ok": 125}
    assert {claim["name"] for claim in data["claims"]} >= {"fixed", "valid", "worst", "topology", "strict"}
    assert all(claim["holds"] for claim in data["claims"])


def test_fixed_points_by_data_region_and_box(tmp_path: Path) -> None:
    poor, out = tmp_path / "poor.vtu", tmp_path / "out.vtu"
    meshgauge.write(poor, grid(4, 0.5))
    before = meshgauge.read(poor).points
    run(poor, "-o", out, "--everywhere", "--fixed-points", "left")
    left = meshgauge.read(poor).point_data["left"] != 0
    after = meshgauge.read(out).points
    np.testing.assert_array_equal(after[left], before[left])
    assert (after[~left] != before[~left]).any()
    run(poor, "-o", out, "--everywhere", "--fixed-box", "0.4,0.9,,,,")
    box = (before[:, 0] >= 0.4) & (before[:, 0] <= 0.9)
    after = meshgauge.read(out).points
    np.testing.assert_array_equal(after[box], before[box])
    assert (after[~box] != before[~box]).any()
    two = tmp_path / "two.vtu"
    meshgauge.write(two, grid(4, 0.5).replace(cell_data={"material": np.arange(64) // 32}))
    mesh = meshgauge.read(two)
    of_cells, names = meshgauge.regions(mesh)
    for region, name in enumerate(names):
        run(two, "-o", out, "--everywhere", "--fixed-region", name)
        used = np.unique(mesh.connectivity.reshape(-1, 8)[of_cells == region])
        after = meshgauge.read(out).points
        np.testing.assert_array_equal(after[used], mesh.points[used])
        assert (after != mesh.points).any()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--fixed-points", "right"], "no point data 'right'"),
        (["--fixed-region", "hexahedra"], "no region"),
        (["--fixed-ids", "1-99999"], "has no point 99999 for --fixed-ids; it has points 0 to "),
        (["--fixed-box", "1,2,3"], "expected xmin"),
        (["--fixed-box", "2,1,0,1,0,1"], "lower end"),
        (["--target", "2"], "target"),
        (["--floor", "-1"], "floor"),
        (["--surface", "no.stl", "--boundary", "slide"], "no such file"),
        (["--in-place"], "exclude"),
        (["--html", "nowhere/page.html"], "no folder"),
    ],
)
def test_what_cannot_be_is_an_error_of_one_line(
    tangled: Path, tmp_path: Path, arguments: list[str], message: str
) -> None:
    done = run(tangled, "-o", tmp_path / "out.vtu", *arguments)
    assert done.returncode == 2
    assert message in done.stderr
    assert done.stderr.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_the_input_is_not_overwritten_unless_asked(tangled: Path, tmp_path: Path) -> None:
    path = tmp_path / "grid.vtu"
    shutil.copy(tangled, path)
    had = path.read_bytes()
    assert run(path, "-o", path).returncode == 2
    assert run(path).returncode == 2
    assert path.read_bytes() == had
    done = run(path, "--in-place", "-q")
    assert done.returncode == 0
    assert done.stdout.count("\n") == 1
    assert meshgauge.measure(meshgauge.read(path)).values.min() > 0.99


@pytest.fixture
def interrupted(monkeypatch: pytest.MonkeyPatch) -> Callable[[int], None]:
    """Have the repair get so many SIGINT once it is at work."""

    def patch(times: int) -> None:
        def slow(mesh: Mesh, *, progress: Callable[[Progress], None], **options: Any) -> repair.Improvement:
            left = [times]

            def once(now: Progress) -> None:
                while now.phase != "end" and left[0]:
                    left[0] -= 1
                    os.kill(os.getpid(), signal.SIGINT)
                progress(now)

            return real(mesh, progress=once, **options)

        monkeypatch.setattr(repair, "improve", slow)

    real = repair.improve
    return patch


@pytest.mark.skipif(os.name == "nt", reason="no SIGINT between processes")
def test_ctrl_c_once_writes_and_twice_writes_nothing(
    interrupted: Callable[[int], None], tangled: Path, tmp_path: Path
) -> None:
    interrupted(1)
    done = run(tangled, "-o", tmp_path / "out.vtu")
    assert done.returncode in (0, 1)
    assert "interrupted" in done.stdout + done.stderr
    before, after = (meshgauge.measure(meshgauge.read(p)) for p in (tangled, tmp_path / "out.vtu"))
    assert after.values.min() >= before.values.min()
    interrupted(2)
    assert run(tangled, "-o", tmp_path / "not.vtu").returncode == 130
    assert not (tmp_path / "not.vtu").exists()


STARTED = """
import sys
from meshgauge.cli.main import main
print("started", flush=True)
sys.exit(main(sys.argv[1:]))
"""
"""Says when Python itself is no longer the one that Ctrl-C would hit."""


@pytest.mark.long
@pytest.mark.skipif(os.name == "nt", reason="no SIGINT between processes")
def test_ctrl_c_from_outside(tmp_path: Path) -> None:
    path, out = tmp_path / "large.vtu", tmp_path / "out.vtu"
    meshgauge.write(path, grid(20, 0.8))
    process = subprocess.Popen(
        [sys.executable, "-c", STARTED, "improve", str(path), "-o", str(out)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "started\n"
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    text, errors = process.communicate(timeout=60)
    assert "Traceback" not in errors
    if process.returncode != 130:  # it had not begun yet
        assert process.returncode in (0, 1)
        assert out.is_file()
        assert "worst" in text


def test_what_breaks_a_claim_is_not_written(tangled: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = Promise.claims

    def never(self: Promise, after: meshgauge.Quality) -> tuple[Claim, ...]:
        same = after.mesh is self.before.mesh
        return tuple(dataclasses.replace(one, holds=one.holds and same) for one in real(self, after))

    monkeypatch.setattr(Promise, "claims", never)
    done = run(tangled, "-o", tmp_path / "out.vtu", "--undo", tmp_path / "undo.npz")
    assert done.returncode == 3
    assert "Nothing was changed, since a claim would not have held" in " ".join(done.stdout.split())
    assert "written to" not in done.stdout
    assert not list(tmp_path.iterdir())


KILLED = """
import os, sys
import meshgauge.files.undo as undo
from meshgauge.cli.main import main
real = undo.store
def store(path, changes):
    real(path, changes)
    os._exit(9)
undo.store = store
sys.exit(main(["improve", sys.argv[1], "--in-place", "--undo", sys.argv[2]]))
"""


def test_undo_data_are_on_the_disk_before_the_mesh_changes(tangled: Path, tmp_path: Path) -> None:
    path, undo = tmp_path / "mesh.vtu", tmp_path / "undo.npz"
    shutil.copy(tangled, path)
    had = path.read_bytes()

    def full(path: Path, changes: object) -> None:
        raise WriteError("a full rack")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(undo_data, "store", full)
        failed = run(path, "--in-place", "--undo", undo)
    assert failed.returncode == 2
    assert "a full rack" in failed.stderr
    assert path.read_bytes() == had
    assert not undo.exists()
    killed = subprocess.run([sys.executable, "-c", KILLED, path, undo], capture_output=True, timeout=60)
    assert killed.returncode == 9
    assert path.read_bytes() == had
    assert undo.exists()
    done = run(path, "--in-place", "--undo", undo)
    assert done.returncode == 0, done.stderr
    assert path.read_bytes() != had
    back = undone(path, undo, "--in-place")
    assert back.returncode == 0, back.stderr
    assert path.read_bytes() == had


@pytest.mark.parametrize("number", ["", "-2"])
def test_in_place_keeps_the_old_bytes_beside(tangled: Path, tmp_path: Path, number: str) -> None:
    path, older = tmp_path / "mesh.vtu", tmp_path / "mesh.vtu.undo.npz"
    shutil.copy(tangled, path)
    if number:
        older.write_bytes(b"of an older change")
    had = path.read_bytes()
    done = run(path, "--in-place")
    assert done.returncode == 0, done.stderr
    assert path.read_bytes() != had
    assert undone(path, tmp_path / f"mesh.vtu.undo{number}.npz", "-o", tmp_path / "back.vtu").returncode == 0
    assert (tmp_path / "back.vtu").read_bytes() == had
    assert not number or older.read_bytes() == b"of an older change"


def test_an_undo_file_that_cannot_be_written_is_known_before_the_work(tangled: Path, tmp_path: Path) -> None:
    path = tmp_path / "mesh.vtu"
    shutil.copy(tangled, path)
    had = path.read_bytes()
    done = run(path, "--in-place", "--undo", tmp_path / "no" / "undo.npz")
    assert done.returncode == 2
    assert "there is no folder" in done.stderr
    assert path.read_bytes() == had


def test_how_a_mesh_is_written_is_said_when_it_is(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What is refused for another reason is refused without a word on that."""
    points = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0.3), (0.5, 0.5, 0.1)])
    cells = [(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)]
    path, out = tmp_path / "a.stl", tmp_path / "b.stl"
    meshgauge.write(path, Mesh.from_arrays(points, {"triangle": cells}))
    assert main(["improve", str(path), "-o", str(out), "--topology"]) == 2
    assert capsys.readouterr().err.splitlines() == [
        f"meshgauge: error: {path}: --topology is for solid cells, and the cells here are surface cells"
    ]
    assert main(["improve", str(path), "-o", str(out)]) == 0
    assert "STL is not patched: the mesh is written anew" in capsys.readouterr().err
