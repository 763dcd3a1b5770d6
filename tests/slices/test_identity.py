"""However a mesh is kept, read and measured, its report is the same in JSON; benchmarks/identity.py has all ways."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import meshgauge
from meshgauge import io
from meshgauge.kernels import path as kernels_path
from meshgauge.report import FileReport
from meshgauge.report.json import dumps
from meshgauge.slices import read as slices_read

SCRIPT = Path(__file__).parents[2] / "benchmarks" / "identity.py"


def test_files_and_parts_of_one_mesh(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Hexahedra and few pyramids, of which each part has fewer."""
    monkeypatch.syspath_prepend(str(SCRIPT.parent))
    import identity

    monkeypatch.setattr(kernels_path, "NUMPY_UP_TO", 200)
    monkeypatch.setattr(slices_read, "SIZE", 173)
    monkeypatch.setattr(identity, "N", 3)
    mesh = identity.write(tmp_path, 343, 30)
    plain, in_parts = identity.Row("", str), identity.Row("", str, in_parts=True)
    in_blocks = identity.Row("", str, in_parts=True, has_blocks=True)
    apart = identity.Row("", str, in_parts=True, no_diagnosis=True)
    whole = meshgauge.measure(io.read(tmp_path / "raw.vtu"), metrics=("scaled_jacobian",))
    expected = dumps([FileReport.of(whole, with_diagnosis=True)])
    parts = [tmp_path / f"part_{k}.vtu" for k in range(identity.N)]
    ways = [
        (tmp_path / name, plain) for name in ("raw.vtu", "zlib.vtu", "plain.vtkhdf", "chunked.vtkhdf", "gzip.vtkhdf")
    ]
    ways += [(parts, in_parts), (tmp_path / "parts.pvtu", in_parts), (tmp_path / "mesh.e.3.0", in_blocks)]
    made = [(meshgauge.stream(file, metrics=("scaled_jacobian",), with_diagnosis=True), row) for file, row in ways]
    made += [(meshgauge.merge([meshgauge.partial(part, metrics=("scaled_jacobian",)) for part in parts]), apart)]
    for report, row in made:
        found = identity.differences(identity.comparable(dumps([report]), row), identity.comparable(expected, row))
        assert list(found) == [], report.path
    assert 0 < whole.summary().types["pyramid"].n_cells < 200 < mesh.n_cells


@pytest.mark.long
def test_every_way(tmp_path: Path) -> None:
    command = [sys.executable, str(SCRIPT), "--cells", "30000", "--folder", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=SCRIPT.parent)
    assert done.returncode == 0, done.stdout
    assert done.stdout.rstrip().endswith("all the same")
