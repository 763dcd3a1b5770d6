"""``meshgauge formats``: every format with what becomes of its files."""

from __future__ import annotations

import json

import command_line

from meshgauge.io.registry import FORMATS


def test_every_format_is_listed() -> None:
    lines = {line.split()[0]: line.split() for line in command_line.run("formats").stdout.splitlines() if line.strip()}
    for name, one in FORMATS.items():
        marks = ["yes" if holds else "-" for holds in (one.is_readable, one.is_patched, one.write is not None)]
        assert lines[name][-3:] == marks


def test_json_says_the_same() -> None:
    data = json.loads(command_line.run("formats", "--json").stdout)
    assert (data["schema"], data["version"]) == ("meshgauge-formats", 1)
    rows = {row["name"]: row for row in data["formats"]}
    assert set(rows) == set(FORMATS)
    assert rows["abaqus"] == {
        "name": "abaqus", "title": "Abaqus", "extensions": [".inp"], "read": True, "patched": True, "written": True
    }  # fmt: skip
    assert not rows["stl"]["patched"]
