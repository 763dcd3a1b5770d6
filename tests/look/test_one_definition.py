"""The bands and the colours are written once, in look/: every output takes them from there."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from meshgauge.look import bands, colours, theme

ROOT = Path(__file__).resolve().parent.parent.parent
SRC = ROOT / "src" / "meshgauge"
COLOUR = re.compile(r"""(?<![&\w])#(?:[0-9a-fA-F]{6}|[0-9a-fA-F]{3})\b(?![-\w])""")
TEXTS = [
    path
    for path in sorted(SRC.rglob("*"))
    if path.suffix in (".py", ".js", ".css", ".jinja") and path.parent.name not in ("look", "vendor")
]


def test_no_colour_is_written_elsewhere() -> None:
    colours_in = {str(path.relative_to(SRC)): COLOUR.findall(path.read_text(encoding="utf-8")) for path in TEXTS}
    assert len(colours_in) > 250
    assert {path: codes for path, codes in colours_in.items() if codes} == {}


def test_both_themes_have_the_same_roles_and_the_page_no_others() -> None:
    assert set(theme.LIGHT) == set(theme.DARK) == set(theme.PRINT)
    css = (SRC / "report" / "html" / "assets" / "page.css").read_text(encoding="utf-8")
    assert set(re.findall(r"var\(--([\w-]+)\)", css)) == set(theme.LIGHT) | set(theme.ALWAYS)


def luminance(code: str) -> float:
    full = code if len(code) == 7 else "#" + "".join(2 * digit for digit in code[1:])
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in colours.rgb(full).tolist()]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: str, other: str) -> float:
    high, low = sorted((luminance(one), luminance(other)), reverse=True)
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("of", [theme.LIGHT, theme.DARK], ids=["light", "dark"])
def test_text_can_be_read_on_its_ground(of: dict[str, str]) -> None:
    for ground in ("page", "card"):
        for text in ("ink", "soft", "accent", "bad", "poor", "good"):
            assert contrast(of[text], of[ground]) >= 4.5, (text, ground)
    for band in ("bad", "poor", "good"):
        assert contrast(of[band], of[f"{band}-weak"]) >= 4.5, band
    for zone in ("zone", "zone-weak"):
        assert contrast(of["soft"], of[zone]) >= 4.5, zone


@pytest.mark.parametrize(
    ("value", "name"),
    [
        (-1, "invalid"),
        (-1e-300, "invalid"),
        (0.0, "degenerate"),
        (-0.0, "degenerate"),
        (1e-300, "poor"),
        (bands.POOR - 1e-12, "poor"),
        (bands.POOR, "good"),
        (1.0, "good"),
        (float("nan"), "unknown"),
    ],
)
def test_every_value_has_a_band(value: float, name: str) -> None:
    assert bands.name(value) == name
    assert name in bands.NAMES


PROGRAM = """
import json, sys, types
source = open(sys.argv[1], encoding="utf-8").read().replace("POOR = 0.2", "POOR = 0.35")
import meshgauge.look
module = types.ModuleType("meshgauge.look.bands")
sys.modules["meshgauge.look.bands"] = module
meshgauge.look.bands = module
exec(compile(source, sys.argv[1], "exec"), module.__dict__)
from meshgauge.cli.main import main
for arguments in json.loads(sys.argv[2]):
    main(arguments)
    print(chr(0), flush=True)
"""
"""meshgauge with another end of what is poor: the outputs of several commands, a NUL behind each."""

OUTPUTS = {
    "report GOOD --no-diagnosis": ("poor (< 0.35)", "below 0.35 poor"),
    "report --help": ("below 0.35 poor",),
    "compare MESH GOOD": ("not good",),
    "check MESH": ("jens >= 0.35 @ 1%",),
    "check --help": ("below 0.35",),
    "metrics jens": ("acceptable 0.35 to 1",),
    "report MESH --html PAGE": (),
}
"""Commands, and what stands in their output."""


def test_outputs_follow_the_band(tmp_path: Path) -> None:
    folder, page = ROOT / "examples" / "meshes", tmp_path / "page.html"
    meant = {"MESH": str(folder / "bracket_small.msh"), "GOOD": str(folder / "bracket_good.vtu"), "PAGE": str(page)}
    commands = json.dumps([[meant.get(word, word) for word in line.split()] for line in OUTPUTS])
    program = [sys.executable, "-c", PROGRAM, str(SRC / "look" / "bands.py"), commands]
    done = subprocess.run(program, capture_output=True, text=True, check=True)
    for (line, expected), output in zip(OUTPUTS.items(), done.stdout.split("\0\n")[:-1], strict=True):
        text = re.sub(r"\s+", " ", output)
        for phrase in expected:
            assert phrase in text, line
        if expected and "--help" not in line:
            assert not re.search(r"(below|<|>=) 0\.2\b(?! @)", text), line
    text = page.read_text(encoding="utf-8")
    for phrase in ("below 0.35 poor", "poor, below 0.35", '<i style="left:35%">0.35</i>', '"poorBelow":0.35'):
        assert phrase in text
    assert "below 0.2" not in text
