"""The report as one HTML file that opens offline, in any browser: tables, charts, and the mesh in three dimensions.

>>> import meshgauge
>>> from meshgauge.report import html
>>> quality = meshgauge.measure(meshgauge.read("examples/meshes/bracket.vtu"))
>>> text = html.page([html.section(quality)])
"""

from .in_cell import PageInCell
from .page import HtmlWriter, page, write
from .section import Section, section

__all__ = ["HtmlWriter", "PageInCell", "Section", "page", "section", "write"]
