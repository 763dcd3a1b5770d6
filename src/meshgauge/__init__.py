"""Measure every cell of a 3D mesh, of every type, with one number.

>>> import meshgauge
>>> mesh = meshgauge.read("part.vtu")  # doctest: +SKIP
>>> meshgauge.measure(mesh).worst(3)  # doctest: +SKIP

Importing this loads NumPy only; Numba, VTK and the rest are loaded by what needs them.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from ._quality import Quality as Quality
    from ._quality import WorstCell as WorstCell
    from ._quality import measure as measure
    from ._quality import quality as quality
    from .arrays import aspect_ratio_gamma as aspect_ratio_gamma
    from .arrays import jens as jens
    from .arrays import scaled_aspect_ratio_gamma as scaled_aspect_ratio_gamma
    from .arrays import scaled_jacobian as scaled_jacobian
    from .cells import CELL_TYPES as CELL_TYPES
    from .cells import CellType as CellType
    from .cells import Shape as Shape
    from .errors import BaselineError as BaselineError
    from .errors import MeshError as MeshError
    from .errors import MeshgaugeError as MeshgaugeError
    from .errors import MetricError as MetricError
    from .errors import ReadError as ReadError
    from .errors import RuleError as RuleError
    from .errors import WriteError as WriteError
    from .improvement import Improvement as Improvement
    from .improvement import improve as improve
    from .io import from_meshio as from_meshio
    from .io import from_pyvista as from_pyvista
    from .io import read as read
    from .io import write as write
    from .mesh import CellBlock as CellBlock
    from .mesh import Mesh as Mesh
    from .metrics import METRICS as METRICS
    from .metrics import Metric as Metric
    from .status import STATUSES as STATUSES
    from .status import Status as Status
    from .summary import Summary as Summary
    from .summary import Tally as Tally
    from .summary import summarise as summarise
    from .validity import Certificate as Certificate
    from .validity import certify as certify

_HOME = {
    "aspect_ratio_gamma": "arrays",
    "jens": "arrays",
    "scaled_aspect_ratio_gamma": "arrays",
    "scaled_jacobian": "arrays",
    "CELL_TYPES": "cells",
    "CellType": "cells",
    "Shape": "cells",
    "BaselineError": "errors",
    "MeshError": "errors",
    "MeshgaugeError": "errors",
    "MetricError": "errors",
    "ReadError": "errors",
    "RuleError": "errors",
    "WriteError": "errors",
    "Improvement": "improvement",
    "improve": "improvement",
    "from_meshio": "io",
    "from_pyvista": "io",
    "read": "io",
    "write": "io",
    "CellBlock": "mesh",
    "Mesh": "mesh",
    "METRICS": "metrics",
    "Metric": "metrics",
    "Quality": "_quality",
    "WorstCell": "_quality",
    "measure": "_quality",
    "quality": "_quality",  # the module is private, so that its name does not hide the function
    "STATUSES": "status",
    "Status": "status",
    "Summary": "summary",
    "Tally": "summary",
    "summarise": "summary",
    "Certificate": "validity",
    "certify": "validity",
}
"""The module of each public name."""

__all__ = ["__version__", *_HOME]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        value = getattr(import_module(f".{_HOME[name]}", __name__), name)
        globals()[name] = value
        return value
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
