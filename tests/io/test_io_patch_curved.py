"""MFEM's meshes with nodes, given back with other coordinates: nodes that elements share, and those they have alone."""

from __future__ import annotations

from pathlib import Path

import command_line
import numpy as np
import pytest
from patch_files import WORD

import meshgauge
from meshgauge import ReadError
from meshgauge.files import undo
from meshgauge.io.patching import patch_of

DATA = Path(__file__).parent / "data" / "mfem"
FILES = sorted(path.name for path in DATA.glob("*.mesh"))


@pytest.mark.parametrize("is_by_axis", [False, True])
@pytest.mark.parametrize("name", FILES)
def test_only_nodes_that_moved_change(name: str, is_by_axis: bool, tmp_path: Path) -> None:
    text = (DATA / name).read_text()
    if is_by_axis:
        head, _, table = text.partition("Ordering: 1\n")
        columns = np.array(table.split()).reshape(-1, 3).T.ravel()
        text = f"{head}Ordering: 0\n\n" + "\n".join(columns) + "\n"
    path, target = tmp_path / name, tmp_path / "out.mesh"
    path.write_text(text)
    mesh = meshgauge.read(path)
    patch = patch_of(mesh, target)
    assert patch is not None
    assert not patch.is_fixed.any()
    patch.write(mesh)
    assert target.read_bytes() == path.read_bytes()
    ids = np.arange(0, mesh.n_points, 3)
    points = np.array(mesh.points)
    points[ids] += np.random.default_rng(1).uniform(-0.03, 0.03, (len(ids), 3))
    patch.write(mesh.replace(points=points), undo_file=tmp_path / "undo.npz")
    back = meshgauge.read(target)
    assert back.n_cells == mesh.n_cells
    order = [np.lexsort(one.T) for one in (back.points, points)]  # nodes of elements alone are joined by their places
    np.testing.assert_array_equal(np.asarray(back.points)[order[0]], points[order[1]])
    words = [WORD.findall(one.read_bytes()) for one in (path, target)]
    assert len(words[0]) == len(words[1])
    n_changed = sum(a != b for a, b in zip(*words, strict=True))
    assert n_changed == 3 * len(ids) if not name.startswith("l2") else n_changed > 3 * len(ids)
    assert b"".join(undo.restored(tmp_path / "undo.npz", target)[""].pieces()) == path.read_bytes()


def test_from_a_shell(tmp_path: Path) -> None:
    path, target = DATA / "fuentes.mesh", tmp_path / "out.mesh"
    done = command_line.run("improve", path, "-o", target, "--everywhere", "--target", "0.9")
    assert done.returncode in (0, 1), done.stderr
    assert "anew" not in done.stderr
    assert len(target.read_text().splitlines()) == len(path.read_text().splitlines())


def test_a_higher_order_is_refused_by_name(tmp_path: Path) -> None:
    text = (DATA / "fuentes.mesh").read_text().replace("H1_3D_P2", "H1_3D_P3")
    (tmp_path / "a.mesh").write_text(text)
    with pytest.raises(ReadError, match="elements above order 2 are not patched"):
        patch_of(meshgauge.read(tmp_path / "a.mesh"), tmp_path / "b.mesh")
