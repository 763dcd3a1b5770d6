"""The page of a report in a cell of a notebook."""

from __future__ import annotations

import html
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class PageInCell:
    """A page of a report that shows itself in a notebook, in a frame that holds all of it: no server, no file."""

    text: str = field(repr=False)  #: the page, a whole HTML document
    height: int = 720  #: of the frame, in pixels

    def _repr_html_(self) -> str:
        page = html.escape(self.text, quote=True)
        return f'<iframe srcdoc="{page}" width="100%" height="{self.height}" style="border:0" title="report"></iframe>'
