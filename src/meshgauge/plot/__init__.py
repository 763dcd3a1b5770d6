"""Pictures of quality: charts by matplotlib, scenes by PyVista. Nothing is shown and no global state is touched.

>>> from meshgauge import plot
>>> plot.histogram(quality).savefig("quality.svg")  # doctest: +SKIP

Charts take a `Summary`, a `Quality`, or several by name (`over_time`: by time); scenes take a `Quality`. Importing this
loads NumPy only.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from .._lazy import door

if TYPE_CHECKING:
    from .cumulative_chart import cumulative as cumulative
    from .cut_scene import cut as cut
    from .figure_file import save as save
    from .histogram_chart import histogram as histogram
    from .interactive_scene import plotter as plotter
    from .steps_chart import over_time as over_time
    from .type_chart import types as types
    from .worst_cells_scene import one_cell as one_cell
    from .worst_cells_scene import worst as worst
    from .worst_faces_scene import worst_faces as worst_faces

_HOME = {
    "histogram": "histogram_chart",
    "types": "type_chart",
    "cumulative": "cumulative_chart",
    "over_time": "steps_chart",
    "worst": "worst_cells_scene",
    "worst_faces": "worst_faces_scene",
    "one_cell": "worst_cells_scene",
    "cut": "cut_scene",
    "plotter": "interactive_scene",
    "save": "figure_file",
}
"""The module of each public name; none has the name of a function, which it would hide."""

__all__ = list(_HOME)


if not TYPE_CHECKING:  # to type checkers a name that is not imported above is an error
    __getattr__, __dir__ = door(__name__, _HOME)
