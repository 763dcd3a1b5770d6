"""What was written is held against what was to be written: whatever differs is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from meshgauge.errors import WriteError
from meshgauge.io.plumbing import verify
from meshgauge.mesh import Mesh


def test_polyhedra_may_number_their_faces_otherwise_but_not_have_others(polyhedral: Mesh) -> None:
    poly = polyhedral.polyhedra
    assert poly is not None
    n_faces = len(poly.face_offsets) - 1
    turned = np.arange(n_faces)[::-1]
    starts, sizes = poly.face_offsets[:-1], np.diff(poly.face_offsets)
    points = np.concatenate([poly.face_points[starts[f] : starts[f] + sizes[f]] for f in turned])
    offsets = np.concatenate([[0], np.cumsum(sizes[turned])])
    same = replace(poly, cell_faces=n_faces - 1 - poly.cell_faces, face_offsets=offsets, face_points=points)
    verify.check(polyhedral, polyhedral.replace(polyhedra=same), is_exact=True)
    first = slice(starts[0], starts[0] + sizes[0])
    rolled = poly.face_points.copy()
    rolled[first] = np.roll(rolled[first], 1)[::-1]  # seen from its other cell
    verify.check(polyhedral, polyhedral.replace(polyhedra=replace(poly, face_points=rolled)), is_exact=True)
    crossed = poly.face_points.copy()
    crossed[first] = crossed[first][[0, 1, 3, 2]]
    for wrong in (replace(poly, face_points=crossed), replace(poly, cell_faces=poly.cell_faces[::-1].copy())):
        with pytest.raises(WriteError, match="the faces of polyhedra do not read back"):
            verify.check(polyhedral, polyhedral.replace(polyhedra=wrong), is_exact=True)


@pytest.mark.parametrize("what", ["points", "connectivity", "point_data", "cell_data"])
def test_a_bit_that_differs_is_refused(what: str, solid: Mesh) -> None:
    mesh = solid.replace(point_data={"a": np.arange(solid.n_points)}, cell_data={"b": np.arange(solid.n_cells)})
    verify.check(mesh, mesh, is_exact=True)
    value = getattr(mesh, what)
    if what.endswith("data"):
        ((name, array),) = value.items()
        other = {name: np.append(array[:-1], array[-1] + 1)}
    elif what == "points":
        other = value.copy()
        other[0, 0] = np.nextafter(other[0, 0], 2.0)
    else:
        other = value.copy()
        other[:2] = other[:2][::-1]
    wrong = mesh.replace(**{what: other})
    with pytest.raises(WriteError, match="read back as they were"):
        verify.check(mesh, wrong, is_exact=True)
