"""The commands of docs/plots.md run and write what they say; options that do not go together are told."""

from __future__ import annotations

import ctypes.util
import json
import re
import shlex
import struct
import subprocess
import sys
from pathlib import Path

import command_line
import numpy as np
import pytest

from meshgauge.cli.main import main

ROOT = Path(__file__).resolve().parent.parent.parent
PAGE = (ROOT / "docs" / "plots.md").read_text(encoding="utf-8")
COMMANDS = re.findall(r"^meshgauge plot .*$", PAGE, re.MULTILINE)
BRACKET = str(ROOT / "examples" / "meshes" / "bracket.vtu")

can_draw = pytest.mark.skipif(
    sys.platform.startswith("linux") and not any(map(ctypes.util.find_library, ("EGL", "GL", "OSMesa"))),
    reason="there is no library to draw scenes with",
)


CUT_AWAY = "meshgauge plot examples/meshes/bracket.vtu --scene cut --at 0 -o cut.png"


DRAW = """
import json, os, sys
from meshgauge.cli.main import main
sys.exit(max(os.chdir(folder) or main(words[1:]) for folder, words in json.loads(sys.argv[1])))
"""


@pytest.fixture(scope="module")
def scenes(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Commands that draw scenes, and the folders they were run in.

    In a process of its own, as drawing may fail hard where there is no libGL; one for all, as its start takes seconds.
    """
    every = [command for command in COMMANDS if "--scene" in command]
    commands = [*(every if request.config.getoption("--long") else every[:1]), CUT_AWAY]
    folders = {command: folder_with_examples(tmp_path_factory.mktemp("scene")) for command in commands}
    asked = json.dumps([(str(folder), shlex.split(command)) for command, folder in folders.items()])
    done = subprocess.run([sys.executable, "-c", DRAW, asked], capture_output=True, text=True, timeout=240, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    return folders


def folder_with_examples(folder: Path) -> Path:
    (folder / "examples").symlink_to(ROOT / "examples", target_is_directory=True)
    return folder


def marks(command: str) -> list[pytest.MarkDecorator]:
    """Of the scenes, which take seconds to draw, the first is enough for a quick run."""
    if "--scene" not in command:
        return []
    is_first = command == next(one for one in COMMANDS if "--scene" in one)
    return [can_draw] if is_first else [can_draw, pytest.mark.long]


@pytest.mark.parametrize("command", [pytest.param(c, marks=marks(c)) for c in COMMANDS])
def test_commands_of_the_page(command: str, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    words = shlex.split(command)[1:]
    if "--scene" in words:
        tmp_path = request.getfixturevalue("scenes")[command]
    else:
        done = command_line.run(*words, cwd=folder_with_examples(tmp_path))
        assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    output = tmp_path / words[-1]
    shown = ROOT / "docs" / "pictures" / f"plot-{output.name}"
    if output.suffix == ".png":
        assert size(output) == size(shown)
        assert shown.stat().st_size < 250e3
        from PIL import Image

        # What the page shows is what the command draws; not to the pixel, fonts and libraries differ.
        now, then = (np.asarray(Image.open(path).convert("L").resize((80, 45)), float) for path in (output, shown))
        assert np.abs(now - then).mean() < 4
    else:
        text = output.read_text(encoding="utf-8")
        assert text.count("<path") > 20
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(["examples", output.name])


def size(path: Path) -> tuple[int, int]:
    """Width and height of a PNG."""
    return struct.unpack(">II", path.read_bytes()[16:24])  # type: ignore[return-value]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["a.jpg"], "png, svg, pdf"),
        (["a.png", "--scene", "cut", "--kind", "types"], "one of them"),
        (["a.png", BRACKET.replace(".vtu", "_good.vtu"), "--scene", "cut"], "takes one mesh, 2 are given"),
        (["a.png", "--scene", "cut", "--metric", "scaled_jacobian"], "coloured by jens"),
        (["a.png", "--scene", "worst", "--at", "0.5"], "--normal and --at"),
        (["a.png", "--scene", "faces", "--cell", "3"], "give one of them"),
        (["a.png", "--scene", "faces", "--worst", "13"], "1 to 12"),
        (["a.png", "--scene", "faces", "--metric", "aspect_ratio"], "no measure of faces"),
        (["a.png", "--kind", "types", "--log"], "--log is of"),
        (["a.png", "--metric", "none"], "no metric 'none'"),
        ([BRACKET], "is an input"),
    ],
)
def test_what_cannot_be_drawn(
    arguments: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["plot", BRACKET, "-o", *arguments]) == 2
    captured = capsys.readouterr()
    assert said in captured.err
    assert captured.err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_one_unreadable_mesh_does_not_hide_the_others(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plot", str(tmp_path / "none.vtu"), BRACKET, "-o", str(tmp_path / "a.png")]) == 2
    assert "none.vtu" in capsys.readouterr().err
    assert (tmp_path / "a.png").is_file()


def test_several_metrics_are_a_picture_each(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    metrics = ["--metric", "jens", "--metric", "scaled_jacobian"]
    assert main(["plot", BRACKET, "-o", str(tmp_path / "a.png"), *metrics]) == 0
    assert {path.name for path in tmp_path.iterdir()} == {"a-jens.png", "a-scaled_jacobian.png"}
    pictures = [path.read_bytes() for path in tmp_path.iterdir()]
    assert pictures[0] != pictures[1]
    assert main(["plot", BRACKET, "-o", str(tmp_path / "b.png"), *metrics[2:]]) == 0
    assert (tmp_path / "b.png").is_file()


@can_draw
def test_invalid_cells_are_seen_wherever_they_are(scenes: dict[str, Path]) -> None:
    """Also those in the part that is cut away: with everything cut away only they are left, in red."""
    from PIL import Image

    pixels = np.asarray(Image.open(scenes[CUT_AWAY] / "cut.png").convert("RGB"), int)[100:, 300:1180]
    red = (pixels[..., 0] > 110) & (pixels[..., 1] < 75) & (pixels[..., 2] < 60)
    blue = pixels[..., 2] - pixels[..., 0] > 60
    assert red.sum() > 300
    assert blue.sum() < 50
