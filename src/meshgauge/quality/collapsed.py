"""Collapsed cells measured as what they stand for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from ..mesh import Mesh
from ..mesh.cast import frozen
from ..mesh.collapsed import resolve

if TYPE_CHECKING:
    from .measure import Quality

JENS = "jens"


def with_collapsed(quality: Quality, measure: Callable[[Mesh], Quality]) -> Quality:
    """What was measured, with collapsed cells measured again as what they stand for; the same if there are none.

    An edge without length leaves no positive value, so that few cells are looked at.
    """
    given = quality.mesh
    mesh = resolve(given, ~(quality.values > 0.0))
    if mesh is given:
        return quality
    cells = np.flatnonzero(mesh.types != given.types)
    part = measure(mesh[cells])
    if quality.beside is not None and part.beside is not None:
        quality.beside.put(cells, part.beside)
    status, metrics = quality.status.copy(), {name: values.copy() for name, values in quality.metrics.items()}
    status[cells] = part.status
    for name, values in metrics.items():
        values[cells] = part.metrics[name]
    return replace(
        quality,
        mesh=mesh,
        values=frozen(metrics[JENS]),
        status=frozen(status),
        metrics=MappingProxyType({name: frozen(array) for name, array in metrics.items()}),
        collapsed_from=given,
    )
