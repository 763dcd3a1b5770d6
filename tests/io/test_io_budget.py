"""Every reader of ours draws on one budget: what a file may take grows with its size, and no faster."""

from __future__ import annotations

import re
import signal
import time
import tracemalloc
from pathlib import Path

import grown_files
import pytest

from meshgauge import io
from meshgauge.errors import ReadError
from meshgauge.io import registry
from meshgauge.io.plumbing import budget
from meshgauge.io.plumbing.budget import DENSEST, LEAST, LIMITS, Budget, Limit
from meshgauge.io.plumbing.isolate import Limits
from meshgauge.mesh import Mesh

OWN = [one.name for one in registry.ALL if one.read is not None or one.read_step is not None]
N = 80
"""Cells and names: more names than are kept as data."""


def read(path: Path) -> tuple[Mesh, dict[str, int], int]:
    """What a file holds, what was drawn, and the bytes that were held at once."""
    tracemalloc.start()
    with budget.of(path) as own:
        mesh = io.read(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return mesh, dict(own.drawn), peak


@pytest.mark.parametrize("name", OWN)
def test_twice_the_input_draws_at_most_twice_the_budget(name: str, tmp_path: Path) -> None:
    results = {}
    for n in (N, 2 * N):
        path = grown_files.MAKERS[name](_folder(tmp_path, str(n)), n)
        if n == N:
            io.read(path)  # the first time modules are loaded
        results[n] = read(path)
        mesh = results[n][0]
        assert registry.detect(path, path.read_bytes()[:4096]).name == name
        assert (mesh.types == (12 if name == "plot3d" else 10)).sum() == n
    (_, once, peak), (_, twice, more) = results[N], results[2 * N]
    assert once["mesh"] > 0
    for what, amount in twice.items():
        assert amount <= 2.2 * once[what] + 1000, what
    assert more <= 2.3 * peak + 50_000


def test_text_and_what_is_packed_are_drawn_before_anything_is_made(tmp_path: Path) -> None:
    drawn = {name: read(grown_files.MAKERS[name](_folder(tmp_path, name), 10))[1] for name in OWN}
    lacking = [name for name, own in drawn.items() if not set(own) - {"mesh"}]
    assert lacking == ["ugrid"]  # its arrays are those of the file


def _folder(parent: Path, name: str) -> Path:
    folder = parent / name
    folder.mkdir()
    return folder


def test_the_docs_have_every_limit() -> None:
    text = (Path(__file__).parents[2] / "docs" / "formats.md").read_text(encoding="utf-8")
    rows = text.split("## Limits of our own readers")[1].split("## ")[0]
    for limit in LIMITS.values():
        row = next(line for line in rows.splitlines() if line.startswith(f"| {limit.unit}"))
        mib = limit.least / (1 << 20)
        assert f" {mib:.0f} MiB " in row if mib >= 20 else f" {limit.least:,} " in row
        assert not limit.per_byte or limit.unit.startswith("seconds") or f"| {limit.per_byte} |" in row


def test_a_budget_names_what_is_too_much(tmp_path: Path) -> None:
    path = tmp_path / "a.vtu"
    path.write_bytes(bytes(100_000))
    own = Budget(path)
    own.draw("unpacked", LEAST + 100_000 * DENSEST, "array 'x'")
    with pytest.raises(ReadError, match=r"a\.vtu: array 'y': 177,108,865 bytes of packed arrays, .* 100,000 bytes"):
        own.draw("unpacked", 1, "array 'y'")
    with pytest.raises(ReadError, match="more than the"):
        Budget(path).draw("stored", -1, "x")


@pytest.mark.parametrize("what", LIMITS)
def test_more_files_allow_more(what: str, tmp_path: Path) -> None:
    small, large = tmp_path / "a", tmp_path / "b"
    small.write_bytes(b"")
    large.write_bytes(bytes(1 << 20))
    own, limit = Budget(small), LIMITS[what]
    if what == "seconds":
        return
    own.draw(what, int(limit.least))
    if limit.per_byte:
        own.files.add(str(large))
        own.draw(what, int(limit.per_byte * (1 << 20)))
    with pytest.raises(ReadError, match=re.escape(limit.unit)):
        own.draw(what, 1)


def test_the_time_of_our_readers_is_limited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = grown_files.MAKERS["abaqus"](tmp_path, 20)
    with pytest.raises(ReadError, match=r"a\.inp: .*seconds of processor time"):
        io.read(path, limits=Limits(seconds=1e-9))
    monkeypatch.setenv("MESHGAUGE_READ_SECONDS", "1e-9")
    with pytest.raises(ReadError, match="seconds of processor time"):
        io.read(path)
    monkeypatch.setenv("MESHGAUGE_READ_SECONDS", "10")
    assert io.read(path).n_cells == 20


def test_long_names_of_groups_packed_to_nothing(tmp_path: Path) -> None:
    """Of med: an array of names takes as much for each as for the longest."""
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "a.med"
    io.write(path, grown_files.named(60))
    assert io.read(path).n_cells == 60
    with h5py.File(path, "r+") as file:
        families = next(iter(file["FAS"].values()))["ELEME"]
        group = next(iter(families.values()))["GRO"]
        del group["NOM"]
        group.create_dataset("NOM", data=[[65] * 80] * 20_000, dtype="i1", compression="gzip", chunks=(20_000, 80))
    with pytest.raises(ReadError, match=r"the names of groups: .* bytes of arrays made of it"):
        io.read(path)


def test_instances_are_copies(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(LIMITS, "generated", Limit(LIMITS["generated"].unit, 1000))
    deck = "*PART, NAME=P\n" + grown_files.abaqus(40) + "*END PART\n"
    instances = "".join(f"*INSTANCE, NAME=I{k}, PART=P\n{k},0,0\n*END INSTANCE\n" for k in range(6))
    (tmp_path / "a.inp").write_text(deck + instances)
    with pytest.raises(ReadError, match=r"the instance 'I\d+': .* nodes and elements generated or copied"):
        io.read(tmp_path / "a.inp")


SMALL_AND_WIDE = {
    "ansys: columns of short lines": (
        "a.cdb",
        "/PREP7\nET,1,285\nEBLOCK,19,SOLID,1,1\n(100i64)\n" + "1\n" * 400_000 + "-1\n",
        "a block",
    ),
    "gmsh: views of few nodes": (
        "a.msh",
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n"
        '$Elements\n1\n1 4 2 1 1 1 2 3 4\n$EndElements\n$NodeData\n1\n"v"\n1\n0\n3\n0\n9000000\n0\n$EndNodeData\n',
        "a view",
    ),
    "openfoam: patches of the same faces": ("a.foam", "", "patch"),
    "tecplot: zones that share their points": (
        "a.dat",
        'VARIABLES = "X" "Y" "Z"\nZONE N=40000, E=1, F=FEPOINT, ET=TETRAHEDRON\n'
        + "0 0 0\n" * 40_000
        + "1 2 3 4\n"
        + "ZONE N=40000, E=1, F=FEPOINT, ET=TETRAHEDRON, VARSHARELIST=([1-3]=1), CONNECTIVITYSHAREZONE=1\n1\n" * 200,
        "a zone",
    ),
}


@pytest.mark.parametrize("name", SMALL_AND_WIDE)
def test_what_a_small_file_multiplies_is_drawn(name: str, tmp_path: Path) -> None:
    file, content, what = SMALL_AND_WIDE[name]
    path = tmp_path / file
    if file == "a.foam":
        path = grown_files.MAKERS["openfoam"](tmp_path, 1500)
        patches = "p { type wall; nFaces 6000; startFace 0; }\n" * 6000
        boundary = tmp_path / "constant" / "polyMesh" / "boundary"
        boundary.write_text(boundary.read_text().split("(")[0] + f"({patches})\n")
    else:
        path.write_text(content)
    tracemalloc.start()
    with pytest.raises(ReadError, match=rf"{what}.*: .* more than the .* bytes may take"):
        io.read(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 200e6 + 10 * path.stat().st_size


def test_one_long_search_is_ended(tmp_path: Path) -> None:
    """It draws nothing itself: the clock is looked at while it goes on."""
    path = tmp_path / "a.txt"
    path.write_text("x")
    start = time.monotonic()
    with pytest.raises(ReadError, match=r"a\.txt: .* seconds of processor time, more than"), budget.of(path, 1.0):
        re.search(r"(a+)+$", "a" * 60 + "b")
    assert time.monotonic() - start < 60
    assert signal.getsignal(signal.SIGVTALRM) is signal.SIG_DFL
    assert signal.getitimer(signal.ITIMER_VIRTUAL) == (0.0, 0.0)


def test_timers_of_others_stay(tmp_path: Path) -> None:
    rung = []
    before = signal.signal(signal.SIGVTALRM, lambda *_: rung.append(1))
    try:
        with budget.of(tmp_path / "a.txt", 0.5):
            mine = signal.getsignal(signal.SIGVTALRM)
            mine(0, None)  # type: ignore[operator,misc,arg-type]
        assert rung == [1]
    finally:
        signal.signal(signal.SIGVTALRM, before)
