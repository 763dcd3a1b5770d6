"""The model that is open in a ``gmsh`` Python session: measured, shown and improved in place, without a file."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..cells import BY_NAME
from ..errors import MeshgaugeError
from ..io.formats.gmsh.cells import BY_ID
from ..mesh import CellBlock, Mesh
from ..quality.measure import JENS, Quality
from ..quality.measure import measure as measure_mesh

ELEMENT, NODE = "gmsh:element", "gmsh:node"
"""Cell data and point data of the mesh: Gmsh's tags."""


def mesh() -> Mesh:
    """The volume elements of the current model as a mesh.

    Returns
    -------
    Mesh
        Points in the order of ``gmsh.model.mesh.getNodes``, cells by volume, in the order of ``getElements``. Point
        data `NODE` and cell data `ELEMENT` hold Gmsh's tags, cell data ``gmsh:geometrical`` the tag of the volume,
        ``gmsh:physical`` that of its first physical group, 0 if it has none.

    Raises
    ------
    MeshgaugeError
        If Gmsh is not installed or not initialised, the model has no volume elements, or some are of a type that is
        not known.
    """
    gmsh = _session()
    node_tags, coordinates, _ = gmsh.model.mesh.getNodes()
    node_tags = np.asarray(node_tags, np.int64)
    place = np.full(int(node_tags.max(initial=0)) + 1, -1, np.int64)
    place[node_tags] = np.arange(len(node_tags))
    types, sizes, ids, tags, volumes, groups, blocks = [], [], [], [], [], [], []
    start = 0
    for dimension, volume in gmsh.model.getEntities(3):
        of_volume = gmsh.model.getPhysicalGroupsForEntity(dimension, volume)
        first = start
        for kind, element_tags, nodes in zip(*gmsh.model.mesh.getElements(dimension, volume), strict=True):
            row = BY_ID.get(int(kind))
            if row is None:
                raise MeshgaugeError(f"volume {volume} has elements of Gmsh's type {kind}, which is not known")
            n = len(element_tags)
            table = place[np.asarray(nodes, np.int64)].reshape(n, row.n_nodes)
            ids.append((table[:, row.order] if row.order else table).ravel())
            types.append(np.full(n, BY_NAME[row.name].vtk_id, np.uint8))
            sizes.append(np.full(n, row.n_nodes, np.int64))
            tags.append(np.asarray(element_tags, np.int64))
            volumes.append(np.full(n, volume, np.int64))
            groups.append(np.full(n, of_volume[0] if len(of_volume) else 0, np.int64))
            start += n
        if start > first:
            blocks.append(CellBlock(f"volume {volume}", first, start))
    if not start:
        raise MeshgaugeError(f"the model {gmsh.model.getCurrent()!r} has no volume elements; generate(3) makes them")
    return Mesh(
        points=np.asarray(coordinates, np.float64).reshape(-1, 3),
        types=np.concatenate(types),
        offsets=np.r_[0, np.cumsum(np.concatenate(sizes))],
        connectivity=np.concatenate(ids),
        blocks=tuple(blocks),
        point_data={NODE: node_tags},
        cell_data={
            ELEMENT: np.concatenate(tags),
            "gmsh:geometrical": np.concatenate(volumes),
            "gmsh:physical": np.concatenate(groups),
        },
        field_data=_group_names(gmsh),
        copy=False,
    )


def measure(metrics: Iterable[str] = (JENS,)) -> Quality:
    """Measure the volume elements of the current model.

    ``quality.mesh.cell_data["gmsh:element"]`` has the tag of each cell, ``point_data["gmsh:node"]`` that of each point.
    Errors as `mesh`, and `MetricError` if there is no such metric.
    """
    return measure_mesh(mesh(), metrics=metrics)


def view(quality: Quality, metric: str = JENS) -> int:
    """Add a view that colours the elements by a metric; returns its tag.

    Parameters
    ----------
    quality
        From `measure`, of the current model. Elements without a value are left out.
    metric
        One that was measured.

    Raises
    ------
    MetricError
        If it was not.
    MeshgaugeError
        If the quality is not of a model of Gmsh.
    """
    gmsh = _session()
    values = quality.values_of(metric)
    tags = _tags(quality.mesh.cell_data, ELEMENT)
    shown = np.isfinite(values)
    tag = int(gmsh.view.add(metric))
    gmsh.view.addHomogeneousModelData(
        tag, 0, gmsh.model.getCurrent(), "ElementData", tags[shown].tolist(), values[shown].tolist()
    )
    return tag


def improve(*, everywhere: bool = False, boundary: str = "fixed", seconds: float | None = None) -> Quality:
    """Improve the current model by moving its nodes, which are written back; returns the quality reached.

    Parameters
    ----------
    everywhere
        True: all nodes move, not only those near bad cells. See `meshgauge.improve`.
    boundary
        "fixed": nodes of the boundary stay; "slide": they move on it. See `meshgauge.improve`.
    seconds
        Time after which the best so far is the result; None: no limit.

    Raises
    ------
    MeshgaugeError
        As `mesh`, and what `meshgauge.improve` raises; the model is as it was then.
    """
    from ..repair import improve as improve_mesh

    after = improve_mesh(mesh(), everywhere=everywhere, boundary=boundary, seconds=seconds).mesh
    put(after)
    return measure_mesh(after)


def put(moved: Mesh) -> int:
    """Write the coordinates of a mesh from `mesh`, with moved points, back to the nodes; returns how many moved.

    Raises
    ------
    MeshgaugeError
        If the mesh is not of a model of Gmsh, or a node of it is not there any more.
    """
    gmsh = _session()
    tags = _tags(moved.point_data, NODE)
    now, coordinates, _ = gmsh.model.mesh.getNodes()
    if not np.array_equal(tags, np.asarray(now, np.int64)):
        raise MeshgaugeError("the nodes of the model are not those of the mesh: it was meshed anew meanwhile")
    points = np.asarray(moved.points, np.float64)
    changed = np.flatnonzero((points != np.reshape(coordinates, (-1, 3))).any(axis=1))
    for at in changed.tolist():
        gmsh.model.mesh.setNode(int(tags[at]), points[at].tolist(), [])
    return len(changed)


def _session() -> Any:
    try:
        import gmsh
    except (ImportError, OSError) as error:  # OSError: its library lacks libraries
        raise MeshgaugeError(f"Gmsh cannot be loaded ({error}): pip install 'meshgauge[gmsh]'") from None
    if not gmsh.isInitialized():
        raise MeshgaugeError("there is no Gmsh session: call gmsh.initialize() and open or make a model first")
    return gmsh


def _tags(data: Any, name: str) -> NDArray[np.int64]:
    if name not in data:
        raise MeshgaugeError(f"not from a model of Gmsh: there is no data {name!r}")
    return np.asarray(data[name], np.int64)


def _group_names(gmsh: Any) -> dict[str, NDArray[np.int64]]:
    """Names of the physical groups of volumes, as files of Gmsh are read."""
    named = ((gmsh.model.getPhysicalName(3, tag), tag) for _, tag in gmsh.model.getPhysicalGroups(3))
    return {name: np.array([tag, 3]) for name, tag in named if name}
