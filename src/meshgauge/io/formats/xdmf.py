"""XDMF (.xdmf, .xmf): by VTK's reader, or meshio's where that fails; written by meshio, its arrays as text."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ...cells import BY_NAME, type_name
from ...errors import ReadError, WriteError
from ...mesh import Mesh
from ...mesh.cast import frozen
from ...mesh.plane import seen_from
from ..plumbing import included, meshio, vtk, within, writing
from ..plumbing.format import Format
from ..plumbing.merge import Part, merge_parts
from ..plumbing.steps import Step, number_steps
from . import xdmf_places

_ROOT = re.compile(rb"<Xdmf\b", re.IGNORECASE)
_GEOMETRY = re.compile(rb"<Geometry\b[^>]*>", re.IGNORECASE)
_XY = re.compile(rb"Type\s*=\s*[\"']XY[\"']", re.IGNORECASE)


def sniff(head: bytes, path: Path) -> bool:
    return _ROOT.search(head) is not None


def steps(path: Path) -> tuple[Step, ...]:
    """As VTK lists them."""
    within.check_xml(path)
    return number_steps(vtk.times(_reader(path)))


def read(path: Path, at: int) -> Mesh:
    """The grids at a time step, a block each."""
    within.check_xml(path)
    try:
        mesh = _by_vtk(path, at)
    except ReadError as error:
        if at:
            raise
        try:
            source, notes = meshio.read(path, "xdmf")
            mesh = meshio.mesh(source, path, notes)
        except ReadError as other:
            reasons = [str(e).removeprefix(f"{path}: ") for e in (error, other)]
            raise ReadError(f"{path}: {'; '.join(dict.fromkeys(reasons))}") from other
    if not mesh.n_cells:
        raise ReadError(f"{path}: no cells were found in it")
    mesh = _simple(mesh)
    is_seen = mesh.dimension == 2 and _is_plane(path) and not mesh.points[:, 2].any()
    return seen_from(mesh, 1) if is_seen else mesh


def _is_plane(path: Path) -> bool:
    """True if all points have two coordinates: VTK's reader fills in a third."""
    text = path.read_bytes()
    return bool(_GEOMETRY.search(text)) and all(_XY.search(tag[0]) for tag in _GEOMETRY.finditer(text))


def _simple(mesh: Mesh) -> Mesh:
    """Lines of two points as lines: among cells of several types XDMF knows polylines only."""
    is_line = (mesh.types == BY_NAME["poly_line"].vtk_id) & (np.diff(mesh.offsets) == 2)
    if not is_line.any():
        return mesh
    return mesh.replace(types=frozen(np.where(is_line, BY_NAME["line"].vtk_id, mesh.types).astype(np.uint8)))


def _reader(path: Path) -> object:
    """VTK's own: PyVista's fails where a file names no time."""
    from vtkmodules.vtkIOXdmf2 import vtkXdmfReader

    reader = vtkXdmfReader()
    reader.SetFileName(str(path))
    return reader


def _by_vtk(path: Path, at: int) -> Mesh:
    data = vtk.output(_reader(path), path, at=at)
    return merge_parts(_once(vtk.parts(data)), path=path, field_data=vtk.field_data(data))


def _once(parts: list[Part]) -> list[Part]:
    """Without parts that are the mesh of another once more: a time series may refer to a grid that stands beside it."""
    kept: list[Part] = []
    for part in parts:
        same = next((k for k in kept if _is_same(k, part)), None)
        if same is None:
            kept.append(part)
            continue
        same.point_data = {**same.point_data, **part.point_data}
        same.cell_data = {**same.cell_data, **part.cell_data}
        same.notes.append(f"The grid {part.name!r} is the mesh of {same.name!r} once more, and was not added.")
    return kept


def _is_same(a: Part, b: Part) -> bool:
    return all(
        np.array_equal(getattr(a, name), getattr(b, name)) for name in ("types", "offsets", "connectivity", "points")
    )


def write(path: Path, mesh: Mesh) -> tuple[str, ...]:
    """Small integers as those of 32 bits: meshio knows no way to write them as text."""
    types = writing.type_counts(mesh.types)
    if len(types) > 1:
        others = [f"{n} {type_name(t)}" for t, n in types.items() if type_name(t) not in _TOGETHER]
        if others:
            raise WriteError(
                f"the format holds linear cells together, and others of one type only: {', '.join(others)}"
            )
    wide = {
        f"{what}_data": {
            k: v.astype(np.int32) if v.dtype.kind in "biu" and v.itemsize < 4 else v for k, v in data.items()
        }
        for what, data in (("cell", mesh.cell_data), ("point", mesh.point_data))
    }
    return meshio.write(path, mesh.replace(**wide), "xdmf", data_format="XML")


_TOGETHER = ("line", "triangle", "quad", "tetra", "pyramid", "wedge", "hexahedron")
"""Cells that meshio writes beside those of other types so that it reads them."""

XDMF = Format(
    "xdmf", "XDMF", (".xdmf", ".xmf", ".xdmf3"), sniff, write=write, has_both_wedge_orders=True,
    foreign_steps=steps, foreign_step=read, step_places=xdmf_places.places, included=included.xdmf,
)  # fmt: skip
