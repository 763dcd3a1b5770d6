"""No folder of the machine that something was made on: in what is committed, and in what pictures are taken of."""

from __future__ import annotations

import importlib.util
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
# Spelt so that this file is not found itself.
OF_A_MACHINE = re.compile(
    rb"(?<![\w.~/-])/(?:home|root|Users|work|workspace|tmp|mnt|opt|srv|private|scratch|builds)/[\w.-]"
    rb"|[A-Za-z]:\\{1,2}(?:Users|Windows|Documents)"
)


def committed() -> list[Path]:
    """The files under version control; all but caches where there is none, as in a source archive."""
    done = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=False)
    if done.returncode == 0 and done.stdout:
        return [ROOT / name.decode() for name in done.stdout.split(b"\0") if name]
    return [p for p in ROOT.rglob("*") if p.is_file() and not {".git", "__pycache__"} & set(p.relative_to(ROOT).parts)]


@pytest.mark.parametrize("text", ["/home" + "/me/a.vtu", "in /tmp" + "/x", "file:'/work" + "/y'", "C:" + "\\Users\\me"])
def test_a_folder_of_a_machine_is_seen(text: str) -> None:
    assert OF_A_MACHINE.search(text.encode())


@pytest.mark.parametrize("text", ["https://a.org/home" + "/x", "docs/tmp" + "/x", "/etc/passwd", "/constant/polyMesh"])
def test_other_paths_are_not(text: str) -> None:
    assert not OF_A_MACHINE.search(text.encode())


def test_nothing_committed_names_one() -> None:
    found = {}
    for path in committed():
        if path.is_file() and (match := OF_A_MACHINE.search(path.read_bytes())):
            found[str(path.relative_to(ROOT))] = match[0]
    assert found == {}


def test_pages_that_pictures_are_taken_of_name_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Wherever the script is started: the page shows the mesh from the root of the repository."""
    monkeypatch.chdir(tmp_path)
    spec = importlib.util.spec_from_file_location("html_pictures", ROOT / "docs" / "html_pictures.py")
    assert spec is not None
    assert spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    page = script.page_of(script.MESH)
    assert "examples/meshes/bracket.vtu" in page
    assert str(ROOT) not in page
    assert not OF_A_MACHINE.search(page.encode())
