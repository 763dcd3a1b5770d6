"""Measure every cell of a mesh, of every type, with one number.

>>> import meshgauge
>>> mesh = meshgauge.read("part.vtu")  # doctest: +SKIP
>>> meshgauge.measure(mesh).worst(3)  # doctest: +SKIP

Importing this loads NumPy only; Numba, VTK and the rest are loaded by what needs them.
"""

from __future__ import annotations

from ._lazy import door
from ._version import __version__

TYPE_CHECKING = False
"""As that of ``typing``, which takes longer to load than all of this: a command that is stopped meanwhile says so."""

if TYPE_CHECKING:
    from . import check as check
    from . import compare as compare
    from . import doctor as doctor
    from . import io as io
    from . import plot as plot
    from . import repair as repair
    from . import view as view
    from .cells import CELL_TYPES as CELL_TYPES
    from .cells import CellType as CellType
    from .cells import Shape as Shape
    from .errors import BaselineError as BaselineError
    from .errors import MeshError as MeshError
    from .errors import MeshgaugeError as MeshgaugeError
    from .errors import MetricError as MetricError
    from .errors import OptionError as OptionError
    from .errors import ReadError as ReadError
    from .errors import RuleError as RuleError
    from .errors import WriteError as WriteError
    from .io import from_meshio as from_meshio
    from .io import from_pyvista as from_pyvista
    from .io import read as read
    from .io import write as write
    from .mesh import CellBlock as CellBlock
    from .mesh import Mesh as Mesh
    from .mesh.polyhedra import Polyhedra as Polyhedra
    from .mesh.regions import regions as regions
    from .quality.arrays import aspect_ratio_gamma as aspect_ratio_gamma
    from .quality.arrays import jens as jens
    from .quality.arrays import scaled_aspect_ratio_gamma as scaled_aspect_ratio_gamma
    from .quality.arrays import scaled_jacobian as scaled_jacobian
    from .quality.measure import Quality as Quality
    from .quality.measure import measure as measure
    from .quality.metrics import METRICS as METRICS
    from .quality.metrics import Metric as Metric
    from .quality.summary import Summary as Summary
    from .quality.summary import Tally as Tally
    from .quality.summary import summarise as summarise
    from .quality.validity import Certificate as Certificate
    from .quality.validity import certify as certify
    from .quality.worst import WorstCell as WorstCell
    from .repair import Improvement as Improvement
    from .repair import RepairReport as RepairReport
    from .repair import improve as improve
    from .report.merging import merge as merge
    from .report.partial_report import PartialReport as PartialReport
    from .report.parts import partial as partial
    from .report.stream import stream as stream
    from .status import STATUSES as STATUSES
    from .status import Status as Status

_HOME = {
    "aspect_ratio_gamma": "quality.arrays",
    "jens": "quality.arrays",
    "scaled_aspect_ratio_gamma": "quality.arrays",
    "scaled_jacobian": "quality.arrays",
    "CELL_TYPES": "cells",
    "CellType": "cells",
    "Shape": "cells",
    "BaselineError": "errors",
    "MeshError": "errors",
    "MeshgaugeError": "errors",
    "MetricError": "errors",
    "OptionError": "errors",
    "ReadError": "errors",
    "RuleError": "errors",
    "WriteError": "errors",
    "Improvement": "repair",
    "RepairReport": "repair",
    "improve": "repair",
    "from_meshio": "io",
    "from_pyvista": "io",
    "read": "io",
    "write": "io",
    "CellBlock": "mesh",
    "Mesh": "mesh",
    "Polyhedra": "mesh.polyhedra",
    "regions": "mesh.regions",
    "METRICS": "quality.metrics",
    "Metric": "quality.metrics",
    "Quality": "quality.measure",
    "WorstCell": "quality.worst",
    "measure": "quality.measure",
    "merge": "report.merging",
    "PartialReport": "report.partial_report",
    "partial": "report.parts",
    "stream": "report.stream",
    "STATUSES": "status",
    "Status": "status",
    "Summary": "quality.summary",
    "Tally": "quality.summary",
    "summarise": "quality.summary",
    "Certificate": "quality.validity",
    "certify": "quality.validity",
}
"""The module of each public name."""

_MODULES = ("check", "compare", "doctor", "io", "plot", "repair", "view")
"""Modules with public names of their own."""

__all__ = ["__version__", *_HOME]

if not TYPE_CHECKING:  # to type checkers a name that is not imported above is an error
    __getattr__, __dir__ = door(__name__, _HOME, _MODULES)
