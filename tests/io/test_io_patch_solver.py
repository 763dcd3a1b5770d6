"""A deck that CalculiX analyses, before and after repair: its loads, boundary conditions and output stay."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import command_line
import numpy as np
import pytest
from patch_files import CUBE

import meshgauge
from meshgauge.io.patching import patch_of
from meshgauge.status import is_invalid

pytestmark = pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX (ccx) is not installed")

SIZE = (8, 4, 4)
TIP = 1e-3
"""Share by which the displacement of the tip may be another: the beam is the same, its elements are others."""


def beam(path: Path, pull: float) -> Path:
    """A beam of 4 by 1 by 1 that is fixed at one end and bent at the other; inner points are pulled aside."""
    ticks = [np.linspace(0, length, n + 1) for length, n in zip((4.0, 1.0, 1.0), SIZE, strict=True)]
    points = np.stack(np.meshgrid(*ticks, indexing="ij"), axis=-1).reshape(-1, 3)
    ids = np.arange(len(points)).reshape([n + 1 for n in SIZE]) + 1
    cells = np.stack([ids[i : SIZE[0] + i, j : SIZE[1] + j, k : SIZE[2] + k].ravel() for i, j, k in CUBE], axis=1)
    is_inner = ((points > 0) & (points < points.max(axis=0))).all(axis=1)
    points[is_inner] += np.random.default_rng(5).uniform(-pull, pull, (int(is_inner.sum()), 3))
    lines = ["** a beam, bent", "*HEADING", "of steel", "*NODE, NSET=ALL"]
    lines += [f"{n}, {x:.9g}, {y:.9g}, {z:.9g}" for n, (x, y, z) in enumerate(points.tolist(), 1)]
    lines += ["*ELEMENT, TYPE=C3D8, ELSET=BEAM", *(f"{n}, {', '.join(map(str, c))}" for n, c in enumerate(cells, 1))]
    for name, own in (("ROOT", ids[0]), ("TIP", ids[-1])):
        lines += [f"*NSET, NSET={name}", *map(str, own.ravel().tolist())]
    lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", "210000., 0.3", "*SOLID SECTION, ELSET=BEAM, MATERIAL=STEEL"]
    lines += ["*BOUNDARY", "ROOT, 1, 3", "*STEP", "*STATIC", "*CLOAD", "TIP, 3, -1.", "*NODE PRINT, NSET=TIP", "U"]
    path.write_text("\n".join([*lines, "*END STEP", ""]))
    return path


def analysed(deck: Path) -> tuple[str, np.ndarray]:
    """What CalculiX prints, and the displacements of the tip; none if it gives up."""
    done = subprocess.run(
        ["ccx", "-i", deck.stem], cwd=deck.parent, capture_output=True, text=True, timeout=120, check=False
    )
    table = deck.with_suffix(".dat")
    rows = [line.split()[1:] for line in table.read_text().splitlines()[3:] if line.strip()] if table.exists() else []
    return done.stdout, np.array(rows, float).reshape(-1, 3)


def repaired(deck: Path) -> Path:
    better = deck.with_stem("better")
    done = command_line.run("improve", deck, "-o", better, "--everywhere", "--quiet")
    assert done.returncode == 0, done.stderr
    lines = [path.read_text().splitlines() for path in (deck, better)]
    assert len(lines[0]) == len(lines[1])
    changed = [a for a, b in zip(*lines, strict=True) if a != b]
    mesh, back = meshgauge.read(deck), meshgauge.read(better)
    assert len(changed) == np.count_nonzero((mesh.points != back.points).any(axis=1)) > 0
    return better


def test_a_poor_mesh_gives_the_same_result_as_a_good_one(tmp_path: Path) -> None:
    """The tip of a beam of distorted elements is off; of the repaired deck it is nearer to that of straight ones."""
    _, straight = analysed(beam(tmp_path / "straight.inp", 0.0))
    deck = beam(tmp_path / "deck.inp", 0.11)
    _, poor = analysed(deck)
    _, better = analysed(repaired(deck))
    assert len(straight) == len(poor) == len(better) == 25
    reference, before, after = (float(table[:, 2].mean()) for table in (straight, poor, better))
    print(f"tip: straight {reference:.6e}, distorted {before:.6e}, repaired {after:.6e}")
    assert abs(after - reference) < abs(before - reference)
    assert abs(after / reference - 1) < TIP


def test_pressure_stays_on_its_faces_when_elements_are_renumbered(tmp_path: Path) -> None:
    """Pressure from above on eight elements, of which some are numbered in reverse, and named by other faces then."""
    deck = beam(tmp_path / "deck.inp", 0.0)
    above = [n for n in range(1, 129) if n % 4 == 0 and n > 64]  # upper elements of the half that is away from the root
    loads = f"*ELSET, ELSET=ABOVE\n{','.join(map(str, above[:8]))}\n*DLOAD\nABOVE, P2, 5.\n{above[9]}, P2, 3.\n"
    deck.write_text(deck.read_text().replace("*CLOAD", f"{loads}*CLOAD"))
    text, right = analysed(deck)
    assert "job finished" in text.lower()
    mesh = meshgauge.read(deck)
    connectivity = np.array(mesh.connectivity)
    for element in (3, above[2], above[5], above[9]):
        nodes = connectivity[8 * (element - 1) : 8 * element]
        nodes[:] = nodes[[4, 5, 6, 7, 0, 1, 2, 3]]
    patch = patch_of(mesh, tmp_path / "reversed.inp", changes="order")
    assert patch is not None
    patch.write(mesh.replace(connectivity=connectivity))
    assert f"{above[2]}, P1, 5.\n" in patch.target.read_text()
    text, none = analysed(patch.target)
    assert "nonpositive jacobian" in text.lower()
    assert not len(none)
    done = command_line.run("orient", patch.target, "-o", tmp_path / "better.inp")
    assert done.returncode == 0, done.stderr
    text, table = analysed(tmp_path / "better.inp")
    print(f"tip: {right[:, 2].mean():.6e}, renumbered {table[:, 2].mean():.6e}")
    np.testing.assert_allclose(table, right, rtol=1e-5)


def test_a_deck_that_cannot_be_analysed_can_be_once_it_is_repaired(tmp_path: Path) -> None:
    deck = beam(tmp_path / "deck.inp", 0.2)
    assert is_invalid(meshgauge.measure(meshgauge.read(deck)).status).any()
    text, none = analysed(deck)
    assert "nonpositive jacobian" in text.lower()
    assert not len(none)
    text, table = analysed(repaired(deck))
    assert "job finished" in text.lower()
    assert len(table) == 25
    assert (table[:, 2] < 0).all()
