"""Real meshes that nobody here made: values against the oracle, counts against the manifest."""

from __future__ import annotations

import csv
import os
from functools import cache
from pathlib import Path

import numpy as np
import oracle
import pytest

import meshgauge
from meshgauge.cells import CELL_TYPES
from meshgauge.mesh.connectivity import pick

pytestmark = pytest.mark.usefixtures("readers_here")

SHARED = Path(os.environ.get("MESHGAUGE_SHARED", Path(__file__).resolve().parents[2] / "shared"))
MANIFEST = SHARED / "meshes" / "MANIFEST.tsv"
TABLE = MANIFEST.read_text(encoding="utf-8").splitlines() if MANIFEST.is_file() else []
ROWS = list(csv.DictReader(TABLE, delimiter="\t"))


@cache
def measured(path: Path) -> meshgauge.Quality:
    return meshgauge.measure(meshgauge.read(path))


@pytest.mark.skipif(not ROWS, reason="no folder of real meshes beside the checkout")
@pytest.mark.parametrize("row", ROWS, ids=lambda row: row["path"].rpartition("/")[2])
def test_values_are_those_of_the_oracle(shared: Path, row: dict[str, str]) -> None:
    quality = measured(shared / "meshes" / row["path"])
    mesh = quality.mesh
    n_inverted = n_corners = 0
    curved = False
    for kind, _, cells in mesh.groups():
        if kind is None or kind.shape is None:
            continue
        curved |= kind.is_curved
        nodes = np.asarray(mesh.points, float)[pick(mesh, kind, cells, kind.corners)]
        expected = oracle.node_scaled_jacobian(kind.shape.name, nodes)
        base = expected[:, :4] if kind.shape.name == "pyramid" else expected
        base = base[:, :1] if kind.shape.name == "tetra" else base
        n_inverted += int((base < -1e-12).any(axis=1).sum())
        n_corners += int((base < -1e-12).sum())
        if not kind.is_curved:
            wanted = oracle.cell_jens(kind.shape.name, nodes)
            for cell in np.flatnonzero((np.abs(expected) < 1e-12).any(axis=1)).tolist():  # where rounding may decide
                wanted[cell] = oracle.exact_cell_jens(kind.shape.name, nodes[cell])
            np.testing.assert_allclose(quality.values[cells], wanted, rtol=0, atol=1e-13)
    is_polyhedral = row["kind"] == "poly"
    if row["n_inverted_cells"] and not curved and not is_polyhedral:
        assert (n_inverted, n_corners) == (int(row["n_inverted_cells"]), int(row["n_inverted_corners"]))
        # Negative, but by less than the coordinates that the file stores can tell: degenerate.
        n_flat = int(np.count_nonzero((quality.values < 0) & (quality.status == meshgauge.Status.DEGENERATE)))
        assert n_flat == 0 or mesh.stored == "single"
        assert quality.summary().all.n_invalid + n_flat >= n_inverted


@pytest.mark.skipif(not ROWS, reason="no folder of real meshes beside the checkout")
@pytest.mark.parametrize("row", ROWS, ids=lambda row: row["path"].rpartition("/")[2])
def test_every_solid_cell_has_a_value_or_a_reason(shared: Path, row: dict[str, str]) -> None:
    quality = measured(shared / "meshes" / row["path"])
    solid = np.array([CELL_TYPES[t].dimension == 3 for t in quality.mesh.types.tolist()])
    status = np.array([meshgauge.STATUSES[meshgauge.Status(s)].is_measured for s in quality.status.tolist()])
    np.testing.assert_array_equal(np.isfinite(quality.values), status)
    assert not status[~solid].any()
