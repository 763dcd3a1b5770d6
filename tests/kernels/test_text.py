"""Numbers of long texts: what the kernels parse is, to the last bit, what NumPy and Python read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import meshgauge
from meshgauge.io.plumbing import text
from meshgauge.kernels.text import driver


@pytest.fixture(autouse=True)
def _compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(driver, "COMPILED_FROM", 0)


def test_reals_are_the_nearest_there_are() -> None:
    rng = np.random.default_rng(3)
    values = np.concatenate([rng.normal(size=300), 10.0 ** rng.uniform(-9, 15, 300), [0.0, -0.0, 1e22, 1e23, 2.0**53]])
    values = np.concatenate([values, 10.0 ** rng.uniform(-300, 300, 40)])  # these one by one
    formats = (".3e", ".6g", ".11g", ".4e")
    words = [format(value, one) for value in values.tolist() for one in formats]
    words += ["+1", "-.5", "7.", "1.E3", "00012.500", "9007199254740993e0", "0e99", "1e-22"]
    parsed = driver.parse(("  " + "\n".join(words)).encode(), np.float64)
    assert parsed is not None
    np.testing.assert_array_equal(parsed.view(np.int64), np.array([float(word) for word in words]).view(np.int64))


def test_integers_and_brackets() -> None:
    given = b"4(0 1\t2 -3)\n3(+7 8 123456789012345678)"
    parsed = driver.parse(given, np.int64, b"()")
    assert parsed is not None
    assert parsed.tolist() == [4, 0, 1, 2, -3, 3, 7, 8, 123456789012345678]
    assert driver.parse(given, np.int64) is None


@pytest.mark.parametrize("word", ["1.5.2", "x", "1e", "1e+", "-", ".", "1_0", "0x10", "nan", "1d5", "1.0\x00", "--1"])
def test_what_is_no_plain_number_is_left_to_the_slow_way(word: str) -> None:
    given = f"1 2 {word} 3".encode()
    assert driver.parse(given, np.float64) is None
    assert driver.parse(given, np.int64) is None
    assert driver.parse(b"1 12345678901234567890", np.int64) is None
    if word not in ("nan", "1d5"):
        with pytest.raises(text.NotNumbers):
            text.numbers(given, np.float64)


def test_rows_that_begin_with_their_size() -> None:
    flat = np.array([3, 5, 6, 7, 4, 1, 2, 3, 4])
    rows = driver.split_rows(flat, 2)
    assert rows is not None
    assert [row.tolist() for row in rows] == [[3, 4], [5, 6, 7, 1, 2, 3, 4]]
    for wrong, n in (([3, 5, 6], 1), ([3, 5, 6, 7], 2), ([3, 5, 6, 7, 9], 1), ([-1, 5], 1), ([2**62, 1], 1)):
        assert driver.split_rows(np.array(wrong), n) is None


def test_a_case_in_text_is_read_the_same_by_both(tmp_path: Path, path: str) -> None:
    folder = tmp_path / "constant" / "polyMesh"
    folder.mkdir(parents=True)
    rings = ["3(0 2 1)", "3(0 1 3)", "4(1 2 4 3) // a comment", "4(0 3 4 2)"]
    files = {
        "points": "5\n(\n(0 0 0)\n(1e0 0 0) /* to\nhere */\n(0.5 1 0)\n(.1234567890123456789 0 1)\n(0.5 1 1)\n)\n",
        "faces": f"// of all\n4\n(\n{chr(10).join(rings)}\n)\n// ***\n",
        "owner": "4{0}",
        "neighbour": "0()",
        "boundary": "1(wall{type wall; nFaces 4; startFace 0;})",
    }
    for name, content in files.items():
        head = f"FoamFile {{ format ascii; object {name}; }}\n// * * * //\n\n"
        (folder / name).write_text(head + content)
    mesh = meshgauge.read(tmp_path)
    assert mesh.points[3].tolist() == [0.1234567890123456789, 0.0, 1.0]
    assert mesh.n_points == 5
    assert mesh.type_counts() == {"triangle": 2, "quad": 2, "polyhedron": 1}
    bad = (folder / "faces").read_text().replace("3(0 2 1)", "9(0 2 1)")
    (folder / "faces").write_text(bad)
    with pytest.raises(meshgauge.MeshgaugeError, match="states"):
        meshgauge.read(tmp_path)
