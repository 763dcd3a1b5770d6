"""Pictures of quality: charts by matplotlib, scenes by PyVista. Nothing is shown and no global state is touched.

>>> from meshgauge import plot
>>> plot.histogram(quality).savefig("quality.svg")  # doctest: +SKIP

Charts take a `Summary`, a `Quality`, or several by name; scenes take a `Quality`. Importing this loads NumPy only.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from .._lazy import door

if TYPE_CHECKING:
    from .bars import histogram as histogram
    from .curves import cumulative as cumulative
    from .files import save as save
    from .gallery import worst as worst
    from .rows import types as types
    from .scene import plotter as plotter
    from .section import cut as cut

_HOME = {
    "histogram": "bars",  # modules have other names than functions, which they would hide
    "types": "rows",
    "cumulative": "curves",
    "worst": "gallery",
    "cut": "section",
    "plotter": "scene",
    "save": "files",
}
"""The module of each public name."""

__all__ = list(_HOME)


__getattr__, __dir__ = door(__name__, _HOME)
