"""EnSight's cases (.case), by VTK's reader."""

from __future__ import annotations

import re
from pathlib import Path

from ...errors import ReadError
from ...mesh import Mesh
from ..plumbing import vtk, within
from ..plumbing.format import Format
from ..plumbing.steps import Step, number_steps

_TYPE = re.compile(rb"^\s*type:\s*ensight", re.IGNORECASE | re.MULTILINE)
_MODEL = re.compile(r"^\s*model:\s*(.*)$", re.IGNORECASE | re.MULTILINE)


def sniff(head: bytes, path: Path) -> bool:
    return _TYPE.search(head) is not None


def steps(path: Path) -> tuple[Step, ...]:
    """As VTK lists them; the geometry is the same at all where its name has no wildcards."""
    within.check_ensight(path)
    listed = vtk.times(_reader(path))
    model = _MODEL.search(path.read_bytes().decode("utf-8", "replace"))
    moves = model is not None and "*" in model.group(1)
    return number_steps(listed, geometries=None if moves else [0] * len(listed))


def read(path: Path, at: int) -> Mesh:
    """The parts at a time step, a block each."""
    within.check_ensight(path)
    mesh = vtk.mesh(vtk.output(_reader(path), path, at=at), path)
    if not mesh.n_cells:
        raise ReadError(f"{path}: no cells were found in it")
    return mesh


def _reader(path: Path) -> object:
    from vtkmodules.vtkIOEnSight import vtkGenericEnSightReader

    reader = vtkGenericEnSightReader()
    reader.SetCaseFileName(str(path))
    return reader


ENSIGHT = Format(
    "ensight", "EnSight", (".case",), sniff, has_both_wedge_orders=True, foreign_steps=steps, foreign_step=read
)
