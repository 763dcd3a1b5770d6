"""``meshgauge formats``: every format with what becomes of its files."""

from __future__ import annotations

import json
from pathlib import Path

import command_line

from meshgauge.io.registry import FORMATS


def test_every_format_is_listed() -> None:
    lines = {line.split()[0]: line.split() for line in command_line.run("formats").stdout.splitlines() if line.strip()}
    for name, one in FORMATS.items():
        holds = (one.is_readable, one.is_patched, one.add is not None, one.write is not None)
        assert lines[name][-4:] == ["yes" if one else "-" for one in holds]


def test_json_says_the_same() -> None:
    data = json.loads(command_line.run("formats", "--json").stdout)
    assert (data["schema"], data["version"]) == ("meshgauge-formats", 1)
    rows = {row["name"]: row for row in data["formats"]}
    assert set(rows) == set(FORMATS)
    assert rows["abaqus"] == {
        "name": "abaqus", "title": "Abaqus", "extensions": [".inp"], "read": True, "patched": True,
        "added_to": False, "written": True
    }  # fmt: skip
    assert not rows["stl"]["patched"]


def test_what_cannot_be_patched_is_named(tmp_path: Path) -> None:
    """Refused before the work; or written as another format, or anew, with a note."""
    (tmp_path / "a.neu").write_text(GAMBIT)
    done = command_line.run("improve", tmp_path / "a.neu", "-o", tmp_path / "b.neu")
    assert done.returncode == 2
    assert "GAMBIT neutral can be neither patched nor written; give -o OUT" in done.stderr
    assert not (tmp_path / "b.neu").exists()
    (tmp_path / "a.msh").write_text(FRONTISTR)
    done = command_line.run("improve", tmp_path / "a.msh", "-o", tmp_path / "b.msh")
    assert done.returncode == 0, done.stderr
    assert "note: " in done.stderr
    assert "FrontISTR and HEC-MW is not patched: the mesh is written as Gmsh" in " ".join(done.stderr.split())


GAMBIT = """        CONTROL INFO 2.4.6
** GAMBIT NEUTRAL FILE
a title
PROGRAM:  Gambit  VERSION:  2.4.6
 1 Jan 2020
     NUMNP     NELEM     NGRPS    NBSETS     NDFCD     NDFVL
         4         1         0         0         3         3
ENDOFSECTION
   NODAL COORDINATES 2.4.6
         1  0.0  0.0  0.0
         2  1.0  0.0  0.0
         3  0.0  1.0  0.0
         4  0.0  0.0  1.0
ENDOFSECTION
      ELEMENTS/CELLS 2.4.6
       1  6  4        1       2       3       4
ENDOFSECTION
"""
FRONTISTR = """!HEADER
 a title
!NODE
 1, 0.0, 0.0, 0.0
 2, 1.0, 0.0, 0.0
 3, 0.0, 1.0, 0.0
 4, 0.0, 0.0, 1.0
!ELEMENT, TYPE=341
 1, 1, 2, 3, 4
!END
"""
