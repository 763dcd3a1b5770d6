"""How Sphinx builds the site: ``sphinx-build -W docs docs/_build/html``.

Pages are the files of this folder. What is taken from the program (reference of the API, pages of reports, the gallery)
is written into ``docs/generated`` first, by ``docs/site/generate.py``.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE / "site"))

import generate  # noqa: E402  stands beside, in docs/site
import pyvista  # noqa: E402

import meshgauge  # noqa: E402

pyvista.OFF_SCREEN = True
pyvista.BUILDING_GALLERY = True  # plotters stay for the scraper

project = "meshgauge"
author = "The meshgauge authors"
copyright = author
version = release = meshgauge.__version__

extensions = [
    "myst_parser",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx_design",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = ["_build", "site", "pictures", "generated/gallery/*.ipynb"]
templates_path: list[str] = []
nitpicky = False

myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 4

autosummary_generate = True
autodoc_typehints = "none"
autodoc_member_order = "bysource"
numpydoc_show_class_members = True
numpydoc_show_inherited_class_members = False
numpydoc_class_members_toctree = False

sphinx_gallery_conf: dict[str, Any] = {
    "examples_dirs": "../examples/gallery",
    "gallery_dirs": "generated/gallery",
    "filename_pattern": "/",
    "within_subsection_order": "FileNameSortKey",
    "image_scrapers": ("generate.figures", "generate.scenes", "matplotlib"),
    "default_thumb_file": str(HERE / "pictures" / "plot-histogram.png"),
    "abort_on_example_error": True,
    "download_all_examples": False,
    "show_signature": False,
    "show_memory": False,
    "min_reported_time": 1e9,
    "write_computation_times": False,
}

html_theme = "pydata_sphinx_theme"
html_title = "meshgauge"
html_static_path = ["site/static"]
html_css_files = ["site.css"]
html_js_files = ["live.js"]
html_extra_path = ["generated/live"]
html_copy_source = False
html_show_sourcelink = False
html_theme_options: dict[str, Any] = {
    "logo": {"text": "meshgauge"},
    "navbar_align": "left",
    "header_links_before_dropdown": 7,
    "navbar_end": ["theme-switcher"],
    "secondary_sidebar_items": ["page-toc"],
    "show_prev_next": True,
    "footer_start": ["copyright"],
    "footer_end": [],
    "pygments_light_style": "tango",
    "pygments_dark_style": "github-dark",
}
html_sidebars: dict[str, list[str]] = {"index": [], "start": []}


def setup(app: Any) -> None:
    generate.write_all(HERE / "generated")
    pyvista.close_all()
    app.connect("source-read", generate.on_source_read)
