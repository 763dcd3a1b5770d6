"""Between `Mesh` and the meshes of PyVista, VTK and meshio that live in the same program."""

from __future__ import annotations

from typing import Any

from ..errors import MeshError, ReadError
from ..mesh import Mesh
from .plumbing.wedge_order import check_order, normalise
from .plumbing.writing import with_regions


def from_pyvista(grid: Any, *, wedge_order: str = "auto") -> Mesh:
    """A mesh from a PyVista or VTK data set.

    Parameters
    ----------
    grid
        A `pyvista.DataSet` or vtkDataSet: images and rectilinear grids become voxels, structured grids hexahedra. Of a
        composite one (`pyvista.MultiBlock`) each leaf becomes a block; points are not merged.
    wedge_order
        As for `meshgauge.read`.

    Returns
    -------
    Mesh
        With the cells in their order and all data. It shares no memory with the grid, which may be changed afterwards.

    Raises
    ------
    ReadError
        If it is no data set, or the wedge order is unknown.
    MeshError
        If its arrays do not make a mesh.
    """
    from .plumbing import vtk

    check_order(wedge_order)
    if not hasattr(grid, "IsA"):
        raise ReadError(f"a {type(grid).__name__} is not a PyVista or VTK data set")
    return normalise(_detach(vtk.mesh(grid)), wedge_order)


def _detach(mesh: Mesh) -> Mesh:
    """The same with memory of its own, in place of arrays that VTK may still write to; others are kept."""
    names = ("points", "types", "offsets", "connectivity", "polyhedra", "point_data", "cell_data", "field_data")
    return mesh.replace(**{name: getattr(mesh, name) for name in names})


def from_meshio(mesh: Any, *, wedge_order: str = "auto") -> Mesh:
    """A mesh from a meshio mesh.

    Parameters
    ----------
    mesh
        A `meshio.Mesh`. Cell sets become cell data of 0 and 1.
    wedge_order
        As for `meshgauge.read`.

    Returns
    -------
    Mesh
        Its blocks in their order; it shares no memory with the meshio mesh.

    Raises
    ------
    MeshError
        If it is no meshio mesh, has cells of a type that is not known, or its arrays do not make a mesh.
    ReadError
        If the wedge order is unknown.
    """
    from .plumbing import meshio

    check_order(wedge_order)
    if not hasattr(mesh, "cells") or not hasattr(mesh, "points"):
        raise MeshError(f"a {type(mesh).__name__} is not a meshio mesh")
    return normalise(meshio.mesh(mesh, copy=True), wedge_order)


def to_pyvista(mesh: Mesh) -> Any:
    """What `Mesh.to_pyvista` is."""
    import pyvista

    from .plumbing import vtk

    shared, _ = vtk.grid(with_regions(mesh))
    grid = pyvista.UnstructuredGrid()
    grid.DeepCopy(shared)
    return grid


def to_meshio(mesh: Mesh) -> Any:
    """What `Mesh.to_meshio` is."""
    import meshio as package

    from .plumbing import meshio

    made = meshio.from_mesh(with_regions(mesh))
    data = [{name: values.copy() for name, values in held.items()} for held in (made.point_data, made.field_data)]
    return package.Mesh(made.points.copy(), made.cells, data[0], made.cell_data, data[1])
