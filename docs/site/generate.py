"""What the site takes from the program: the reference of the API, live pages, pages that stand outside ``docs``.

Everything is written into ``docs/generated``, which Sphinx reads and Git ignores.
"""

from __future__ import annotations

import inspect
import json
import re
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import meshgauge
from meshgauge.cells import SHAPES
from meshgauge.look import colours
from meshgauge.look.bands import POOR

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
REAL = ROOT / "examples" / "real"

PAGES = {
    "measuring": ("Measuring", ("quality.arrays", "quality.measure", "quality.validity", "quality.worst")),
    "meshes": ("Meshes", ("mesh", "cells")),
    "summaries": ("Metrics, statuses, summaries", ("quality.metrics", "quality.summary", "status")),
    "large": ("Large meshes and parts", ("report",)),
    "errors": ("Errors", ("errors",)),
}
"""Pages of names at the top of the package: heading, and the modules, below the package, that they come from."""

MODULES = {
    "io": "Files",
    "repair": "Repair",
    "doctor": "Doctor",
    "check": "Gate",
    "compare": "Comparing",
    "plot": "Pictures",
    "view": "Viewer in notebooks",
}
"""Public modules, each a page of its own."""

LINKS = {"../CONTRIBUTING.md": "generated/contributing.md", "../CHANGELOG.md": "generated/changelog.md"}
"""What pages call by a path outside ``docs``, and where the site has it."""


def write_all(folder: Path) -> None:
    """Make ``docs/generated``."""
    write_api(folder / "api")
    for name in ("CONTRIBUTING", "CHANGELOG"):
        text = (ROOT / f"{name}.md").read_text(encoding="utf-8")
        text = text.replace("](docs/", "](../").replace("](CHANGELOG.md", "](changelog.md")
        put(folder / f"{name.lower()}.md", text)
    write_live(folder / "live" / "live")
    write_real(folder)


def put(path: Path, text: str) -> None:
    """Write it unless it is there: Sphinx reads what is newer again."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def write_live(folder: Path) -> None:
    """Pages of the HTML report that the site shows in frames."""
    from meshgauge.report import html

    mesh = meshgauge.read(str(ROOT / "examples/meshes/bracket.vtu")).replace(path="bracket.vtu")
    put(folder / "bracket.html", html.page([html.section(meshgauge.measure(mesh))]))


def write_real(folder: Path) -> None:
    """A card for each mesh of ``examples/real``: cut open, with its verdict, its page and the command."""
    from meshgauge import plot
    from meshgauge.report import html
    from meshgauge.report.verdict import verdict

    table = (REAL / "README.md").read_text(encoding="utf-8")
    cards = []
    for name, cells, source, licence in re.findall(r"^\| `(.+?)` \| (.+?) \| (.+?) \| (.+?) \|$", table, re.MULTILINE):
        mesh = meshgauge.read(str(REAL / name)).replace(path=f"examples/real/{name}")
        quality = meshgauge.measure(mesh)
        page = folder / "live" / "live" / f"{Path(name).stem}.html"
        picture = folder / "real" / f"{Path(name).stem}.png"
        put(page, html.page([html.section(quality)]))
        if not picture.exists():
            picture.parent.mkdir(parents=True, exist_ok=True)
            plot.save(plot.cut(quality), picture)
        words = verdict(quality.summary()).text
        sentence = f"{words[0].upper()}{words[1:]}."
        cards.append(
            f":::{{grid-item-card}} {name}\n:img-top: real/{picture.name}\n\n{cells}. "
            f"{sentence}\n\n```sh\nmeshgauge report examples/real/{name}\n```\n\n"
            f'<a href="../live/{page.name}">Its page, live</a>\n\n{source}; {licence}\n:::\n'
        )
    head = "# Real meshes\n\nMeshes of other projects that anyone may pass on, each cut open at its worst cell.\n\n"
    put(folder / "real.md", f"{head}::::{{grid}} 1 1 2 2\n:gutter: 3\n\n{chr(10).join(cards)}::::\n")


def figures(_block: Any, variables: dict[str, Any], conf: dict[str, Any]) -> str:
    """For sphinx-gallery: figures of `meshgauge.plot` that a block made, which stand in no list of pyplot."""
    from matplotlib.figure import Figure
    from sphinx_gallery.scrapers import figure_rst

    globals_ = variables["example_globals"]
    shown = globals_.setdefault("__shown__", [])
    paths = []
    for value in list(globals_.values()):
        if isinstance(value, Figure) and getattr(value, "number", None) is None and value not in shown:
            shown.append(value)
            path = next(variables["image_path_iterator"])
            value.savefig(path)
            paths.append(path)
    return str(figure_rst(paths, conf["src_dir"])) if paths else ""


def scenes(block: Any, variables: dict[str, Any], conf: dict[str, Any]) -> str:
    """For sphinx-gallery: PyVista's scraper where a program has plotters of its own.

    Those that `meshgauge.plot` drew with are forgotten: their pictures are in its figures.
    """
    import pyvista

    if any(isinstance(value, pyvista.Plotter) for value in variables["example_globals"].values()):
        return str(pyvista.Scraper()(block, variables, conf))
    pyvista.close_all()
    return ""


def write_api(folder: Path) -> None:
    homes: dict[str, str] = meshgauge._HOME
    for page, (title, sources) in PAGES.items():
        names = [n for n, home in homes.items() if any(home == s or home.startswith(f"{s}.") for s in sources)]
        put(folder / f"{page}.rst", api_page(title, "meshgauge", names))
    for module, title in MODULES.items():
        names = [n for n in import_module(f"meshgauge.{module}").__all__ if not n.startswith("_")]
        put(folder / f"{module}.rst", api_page(title, f"meshgauge.{module}", names))


def api_page(title: str, module: str, names: list[str]) -> str:
    """A page of reStructuredText: the module's own words, then an entry a name, functions first."""
    package = import_module(module)
    kinds = {"function": [], "class": [], "exception": [], "data": []}  # type: dict[str, list[str]]
    for name in names:
        kinds[kind(getattr(package, name))].append(name)
    head = f"{title}\n{'=' * len(title)}\n\n.. currentmodule:: {module}\n"
    own = inspect.cleandoc(package.__doc__ or "").split("\n\n")[0] if module != "meshgauge" else ""
    return head + (f"\n{own}\n" if own else "") + "".join(entry(module, k, n) for k, ns in kinds.items() for n in ns)


def kind(value: Any) -> str:
    if inspect.isclass(value):
        return "exception" if issubclass(value, Exception) else "class"
    return "function" if inspect.isroutine(value) else "data"


def entry(module: str, of_kind: str, name: str) -> str:
    value = getattr(import_module(module), name)
    if of_kind == "data":
        text = data_text(module, name)
        return f"\n.. py:data:: {name}\n\n" + "".join(f"   {line}\n" for line in text.splitlines())
    members = "   :members:\n" if of_kind == "class" else ""
    if of_kind == "class" and not (inspect.getdoc(value) or "").strip():
        raise ValueError(f"{module}.{name} has no docstring")
    return f"\n.. auto{of_kind}:: {name}\n{members}"


def data_text(module: str, name: str) -> str:
    """The docstring that stands behind an assignment, in whatever module that is; else the value."""
    from sphinx.pycode import ModuleAnalyzer

    value = getattr(import_module(module), name)
    for source in [m for m, loaded in sys.modules.items() if m.startswith("meshgauge") and name in vars(loaded)]:
        found = ModuleAnalyzer.for_module(source).find_attr_docs().get(("", name))
        if found and getattr(sys.modules[source], name) is value:
            return "\n".join(found).strip()
    return f"``{str(value).replace('meshgauge.', '')}``"


def on_source_read(_app: Any, _docname: str, content: list[str]) -> None:
    """Links out of ``docs`` lead to the site's own pages; ``<!-- live: NAME -->`` becomes that piece of HTML."""
    text = content[0]
    for path, page in LINKS.items():
        text = text.replace(f"]({path}", f"]({page}")
    content[0] = re.sub(r"<!-- live: ([a-z-]+) -->", lambda match: live(match[1]), text)


def live(name: str) -> str:
    """A piece of HTML from ``live/``, with the shapes of cells and the colours of quality that it asks for."""
    piece = (HERE / "live" / f"{name}.html").read_text(encoding="utf-8")
    piece = piece.replace("{{ shapes }}", json.dumps(live_data()))
    options = "".join(f"<option{' selected' * (n == 'hexahedron')}>{n}</option>" for n in SHAPES)
    return f"````{{raw}} html\n{piece.replace('{{ options }}', options)}````\n"


def live_data() -> dict[str, Any]:
    """What ``static/live.js`` draws and computes with."""
    shapes = {
        name: {key: getattr(shape, key) for key in ("points", "edges", "faces", "triples", "k")}
        for name, shape in SHAPES.items()
    }
    return {"shapes": shapes, "poor": POOR, "colours": {**colours.ON_ANY, "degenerate": colours.DEGENERATE}}
