"""SU2: sections that hold no mesh."""

from __future__ import annotations

from pathlib import Path

import pytest

from meshgauge import io
from meshgauge.errors import ReadError

MESH = """NDIME= 3
NELEM= 1
10 0 1 2 3 0
NPOIN= 4
0 0 0 0
1 0 0 1
0 1 0 2
0 0 1 3
NMARK= 1
MARKER_TAG= wall
MARKER_ELEMS= 1
5 0 1 2
"""
SECTIONS = {
    "NPERIODIC": ("NPERIODIC= 1\nPERIODIC_INDEX= 0\n0 0 0\n0 0 0\n0 0 0\n", "PERIODIC_INDEX"),
    "FFD": ("FFD_NBOX= 1\nFFD_TAG= BOX\nFFD_CORNER_POINTS= 2\n0 0 0\n1 0 0\nFFD_SURFACE_POINTS= 1\nwall 0 0. 0.\n",
            "FFD_CORNER_POINTS, FFD_SURFACE_POINTS"),
    "actuator": ("% a comment\nACTDISK_POINTS= 1\nrotor 1.0, 2.0\n", "ACTDISK_POINTS"),
}  # fmt: skip


@pytest.mark.parametrize("name", SECTIONS)
@pytest.mark.parametrize("is_first", [False, True])
def test_sections_that_hold_no_mesh_are_left_out_with_a_note(tmp_path: Path, name: str, is_first: bool) -> None:
    section, listed = SECTIONS[name]
    path = tmp_path / "a.su2"
    path.write_text(section + MESH if is_first else MESH + section)
    mesh = io.read(path)
    assert mesh.type_counts() == {"triangle": 1, "tetra": 1}
    assert mesh.notes == (f"Sections that hold no mesh were left out: {listed}.",)


def test_keywords_of_the_solver_and_halo_markers_are_no_news(tmp_path: Path) -> None:
    path = tmp_path / "a.su2"
    path.write_text(MESH + "AOA= 2.0\nNCHUNK= 1\nMARKER_TAG= SEND_RECEIVE\nMARKER_ELEMS= 1\nSEND_TO= 1\n1 0\n")
    assert io.read(path).notes == ()


@pytest.mark.parametrize(("stated", "there"), [(3, 2), (2, 1), (1, 2)])
def test_another_number_of_zones_than_stated_is_refused(tmp_path: Path, stated: int, there: int) -> None:
    """A file that was cut between two zones is whole otherwise."""
    path = tmp_path / "a.su2"
    path.write_text(f"NZONE= {stated}\n" + "".join(f"IZONE= {n}\n{MESH}" for n in range(1, there + 1)))
    with pytest.raises(ReadError, match=f"states {stated} zones, but holds {there}"):
        io.read(path)
    path.write_text(path.read_text().replace(f"NZONE= {stated}", f"NZONE= {there}"))
    assert io.read(path).n_cells == 2 * there


@pytest.mark.parametrize("line", ["SEND_TO= 1\n", "SEND_RECV= -2\n", ""])
def test_what_pieces_send_each_other_is_no_boundary(line: str, tmp_path: Path) -> None:
    text = "NDIME= 3\nNELEM= 1\n10 0 1 2 3 0\nNPOIN= 4 4\n0 0 0 0\n1 0 0 1\n0 1 0 2\n0 0 1 3\nNMARK= 1\n"
    (tmp_path / "a.su2").write_text(f"{text}MARKER_TAG= SEND_RECEIVE\nMARKER_ELEMS= 2\n{line}1 0 0\n1 3 0\n")
    assert io.read(tmp_path / "a.su2").type_counts() == {"tetra": 1}
