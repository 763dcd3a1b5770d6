"""The pages of the site, without building it: each is reached, and what stands in for pages elsewhere is there.

``.ci/run`` builds the site, with warnings as errors, and follows its links.
"""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(DOCS.glob("*.md"))


def listed(page: Path) -> list[str]:
    """The pages that its tables of contents name."""
    blocks = re.findall(r"^```\{toctree\}\n(.*?)^```$", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    lines = [line for block in blocks for line in block.splitlines() if line and not line.startswith(":")]
    return [match[1] if (match := re.search(r"<(.+)>$", line)) else line for line in lines]


def test_every_page_is_in_one_table_of_contents() -> None:
    of_ours = [name for page in PAGES for name in listed(page) if not name.startswith("generated/")]
    assert sorted(of_ours) == sorted(page.stem for page in PAGES if page.stem != "index")


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_a_page_has_something_to_say(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert text.startswith("# ")
    assert len(text.split()) > 80


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_live_pieces_are_there_and_load_nothing(page: Path) -> None:
    for name in re.findall(r"<!-- live: ([a-z-]+) -->", page.read_text(encoding="utf-8")):
        piece = (DOCS / "site" / "live" / f"{name}.html").read_text(encoding="utf-8")
        assert not re.search(r"""(?:src|href)=["'](?:https?:)?//""", piece)


def test_every_public_name_is_in_the_reference(tmp_path: Path) -> None:
    pytest.importorskip("sphinx", reason="Sphinx is not installed: pip install 'meshgauge[docs]'")
    import meshgauge

    spec = importlib.util.spec_from_file_location("site_generate", DOCS / "site" / "generate.py")
    assert spec is not None
    assert spec.loader is not None
    generate = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(generate)
    generate.write_api(tmp_path)
    text = "".join(path.read_text(encoding="utf-8") for path in tmp_path.glob("*.rst"))
    entries = re.findall(r"^\.\. (?:auto\w+|py:data):: (\w+)$", text, re.MULTILINE)
    assert set(meshgauge.__all__) - {"__version__"} <= set(entries)
