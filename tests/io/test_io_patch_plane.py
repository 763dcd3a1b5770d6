"""Files of two coordinates are patched: x and y of the points that moved, and nothing else."""

from __future__ import annotations

import re
from pathlib import Path

import meshio
import numpy as np
import pytest
from command_line import run

import meshgauge

SIDE = 4


def points() -> np.ndarray:
    x, y = (side.ravel() for side in np.meshgrid(np.linspace(0, 1, SIDE), np.linspace(0, 1, SIDE)))
    moved = np.stack([x, y], axis=1)
    moved[5] = (0.62, 0.64)  # beyond the opposite corner of a cell
    return moved


def cells() -> np.ndarray:
    first = (np.arange(SIDE - 1)[:, None] * SIDE + np.arange(SIDE - 1)).ravel()
    return np.stack([first, first + 1, first + SIDE + 1, first + SIDE], axis=1)


def su2() -> str:
    rows = [f"9 {' '.join(map(str, cell))} {n}" for n, cell in enumerate(cells())]
    places = [f"  {x:.12f}\t{y:.12f} {n}" for n, (x, y) in enumerate(points())]
    body = [f"NDIME= 2 % in a plane\nNELEM= {len(rows)}", *rows, f"NPOIN= {len(places)}", *places]
    return "\n".join([*body, "NMARK= 1", "MARKER_TAG= low", "MARKER_ELEMS= 1", "3 0 1", ""])


def medit() -> str:
    rows = [f"{' '.join(str(node + 1) for node in cell)} 7" for cell in cells()]
    places = [f"{x:.12f} {y:.12f} 3" for x, y in points()]
    head = ["MeshVersionFormatted 2", "Dimension 2", "# kept", "Vertices", str(len(places))]
    return "\n".join([*head, *places, "Quadrilaterals", str(len(rows)), *rows, "End", ""])


def mfem() -> str:
    rows = [f"1 3 {' '.join(map(str, cell))}" for cell in cells()]
    places = [f"{x:.12f} {y:.12f}" for x, y in points()]
    head = ["MFEM mesh v1.0", "# kept", "dimension", "2", "elements", str(len(rows))]
    return "\n".join([*head, *rows, "boundary", "0", "vertices", str(len(places)), "2", *places, ""])


@pytest.mark.parametrize(("name", "make"), [("a.su2", su2), ("b.mesh", medit), ("c.mesh", mfem)])
def test_only_what_moved_is_written(name: str, make: object, tmp_path: Path) -> None:
    path, better, again = tmp_path / name, tmp_path / f"better_{name}", tmp_path / f"again_{name}"
    path.write_text(make())  # type: ignore[operator]
    before = meshgauge.measure(meshgauge.read(path))
    assert before.summary().all.n_invalid > 0
    done = run("improve", path, "-o", better, "--undo", tmp_path / "undo.npz")
    assert done.returncode == 0, done.stderr
    after = meshgauge.measure(meshgauge.read(better))
    assert after.summary().all.n_invalid == 0
    assert after.mesh.up == 1
    moved = (after.mesh.points != before.mesh.points).any(axis=1)
    assert moved[5]
    lines = zip(path.read_text().splitlines(), better.read_text().splitlines(), strict=True)
    changed = [(old, new) for old, new in lines if old != new]
    assert len(changed) == moved.sum()
    for old, new in changed:  # the label behind, and what is between, are as they were
        assert re.sub(r"[\d.]+", "#", old) == re.sub(r"[\d.e+-]+", "#", new)
        assert old.split()[2:] == new.split()[2:]
    assert run("undo", better, tmp_path / "undo.npz", "-o", again).returncode == 0
    assert again.read_bytes() == path.read_bytes()


def test_a_third_party_reader_takes_the_result(tmp_path: Path) -> None:
    (tmp_path / "a.su2").write_text(su2().replace(" % in a plane", ""))
    assert run("improve", tmp_path / "a.su2", "-o", tmp_path / "b.su2").returncode == 0
    theirs = meshio.read(tmp_path / "b.su2")
    np.testing.assert_array_equal(theirs.points[:, :2], meshgauge.read(tmp_path / "b.su2").points[:, :2])
