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
    path = tmp_path / "a.cas"
    path.write_text(FLUENT)
    done = command_line.run("improve", path, "-o", tmp_path / "b.cas")
    assert done.returncode == 2
    assert "Fluent can be neither patched nor written; give -o OUT" in done.stderr
    done = command_line.run("improve", path, "-o", tmp_path / "b.msh")
    assert done.returncode == 0, done.stderr
    assert "note: " in done.stderr
    assert "Fluent is not patched: the mesh is written as Gmsh" in " ".join(done.stderr.split())
    assert not (tmp_path / "b.cas").exists()


FLUENT = """(2 3)
(10 (0 1 4 0 3))
(10 (1 1 4 1 3)(
0 0 0
1 0 0
0 1 0
0 0 1
))
(12 (0 1 1 0))
(12 (2 1 1 1 2))
(13 (0 1 4 0))
(13 (3 1 4 3 3)(
1 2 3 1 0
1 4 2 1 0
2 4 3 1 0
3 4 1 1 0
))
"""
