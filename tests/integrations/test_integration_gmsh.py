"""The model open in Gmsh: values by tag, as from a file; coordinates written back; second order too."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meshgauge
from meshgauge import MeshgaugeError
from meshgauge.integrations import gmsh as ours

try:
    import gmsh
except (ImportError, OSError) as error:
    pytest.skip(f"Gmsh cannot be loaded: {error}", allow_module_level=True)

REGULAR = [(0, 0, 0), (1, 0, 0), (0.5, 3**0.5 / 2, 0), (0.5, 3**0.5 / 6, (2 / 3) ** 0.5)]


@pytest.fixture
def session() -> Iterator[Any]:
    gmsh.initialize(["-noenv"], readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    yield gmsh
    gmsh.finalize()


def box(order: int, *, swept: bool = False) -> None:
    """Two boxes side by side, meshed; with prisms and hexahedra if swept."""
    geo = gmsh.model.geo
    size = 0.45
    points = [geo.addPoint(x, y, 0, size) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    lines = [geo.addLine(points[i], points[(i + 1) % 4]) for i in range(4)]
    face = geo.addPlaneSurface([geo.addCurveLoop(lines)])
    geo.extrude([(2, face)], 0, 0, 1, numElements=[3] if swept else [], recombine=swept)
    geo.synchronize()
    group = gmsh.model.addPhysicalGroup(3, [tag for _, tag in gmsh.model.getEntities(3)], 7)
    gmsh.model.setPhysicalName(3, group, "steel")
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(order)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("swept", [False, True])
def test_the_same_as_from_a_file(session: Any, order: int, swept: bool, tmp_path: Path) -> None:
    box(order, swept=swept)
    quality = ours.measure(["scaled_jacobian"])
    gmsh.write(str(tmp_path / "box.msh"))
    read = meshgauge.read(tmp_path / "box.msh")
    solid = np.flatnonzero(np.isin(read.types, np.unique(quality.mesh.types)))
    of_file = meshgauge.measure(read)
    np.testing.assert_allclose(np.sort(quality.values), np.sort(of_file.values[solid]), atol=1e-12)
    kinds = {(False, 1): "tetra", (False, 2): "tetra10", (True, 1): "wedge", (True, 2): "wedge18"}
    assert set(quality.mesh.type_counts()) == {kinds[swept, order]}
    assert (quality.status == meshgauge.Status.OK).all()
    assert quality.mesh.field_data["steel"].tolist() == [7, 3]
    # Tag by tag: the corners of the worst element are where Gmsh has them.
    worst = quality.worst(1)[0]
    tag = int(quality.mesh.cell_data["gmsh:element"][worst.cell])
    nodes = gmsh.model.mesh.getElement(tag)[1]
    assert set(quality.mesh.point_data["gmsh:node"][quality.mesh.nodes(worst.cell)]) == set(nodes.tolist())
    node = int(quality.mesh.point_data["gmsh:node"][worst.point])
    np.testing.assert_allclose(gmsh.model.mesh.getNode(node)[0], worst.coordinates)


def test_tags_with_gaps_and_a_node_written_back(session: Any) -> None:
    volume = gmsh.model.addDiscreteEntity(3)
    tags = [1000, 7, 20, 300]
    gmsh.model.mesh.addNodes(3, volume, tags, np.ravel(REGULAR).tolist())
    gmsh.model.mesh.addElementsByType(volume, 4, [55, 9], [*tags, tags[0], tags[2], tags[1], tags[3]])
    quality = ours.measure()
    by_tag = dict(zip(quality.mesh.cell_data["gmsh:element"].tolist(), quality.values.round(12).tolist(), strict=True))
    assert by_tag == {55: 1.0, 9: -1.0}
    points = np.array(quality.mesh.points)
    at = int(np.flatnonzero(quality.mesh.point_data["gmsh:node"] == 300)[0])
    points[at] += (0, 0, 0.25)
    moved = quality.mesh.replace(points=points)
    assert ours.put(moved) == 1
    np.testing.assert_allclose(gmsh.model.mesh.getNode(300)[0], np.add(REGULAR[3], (0, 0, 0.25)))
    np.testing.assert_array_equal(ours.mesh().points, points)
    assert ours.put(moved) == 0
    gmsh.model.mesh.addNodes(3, volume, [5], [0, 0, 0])
    with pytest.raises(MeshgaugeError, match="meshed anew"):
        ours.put(moved)


def test_a_view_shows_the_values(session: Any) -> None:
    box(1)
    quality = ours.measure()
    view = ours.view(quality)
    kind, tags, values, _, n = gmsh.view.getHomogeneousModelData(view, 0)
    assert (kind, n) == ("ElementData", 1)
    np.testing.assert_array_equal(tags, quality.mesh.cell_data["gmsh:element"])
    np.testing.assert_allclose(values, quality.values)
    with pytest.raises(meshgauge.MetricError, match="was not measured"):
        ours.view(quality, "scaled_jacobian")


def test_what_cannot_be_measured(session: Any) -> None:
    with pytest.raises(MeshgaugeError, match="no volume elements"):
        ours.measure()
    plain = meshgauge.Mesh.from_arrays(REGULAR, {"tetra": [(0, 1, 2, 3)]})
    with pytest.raises(MeshgaugeError, match="not from a model"):
        ours.put(plain)


def test_without_a_session() -> None:
    with pytest.raises(MeshgaugeError, match=r"gmsh\.initialize"):
        ours.measure()


@pytest.mark.parametrize("order", [1, 2])
def test_the_model_improves_in_place(session: Any, order: int) -> None:
    box(order)
    before = ours.measure()
    points = np.array(before.mesh.points)
    inside = np.prod(np.sin(np.pi * points), axis=1)
    points[:, 0] += 0.35 * np.clip(inside, 0.0, None)  # a swelling that leaves the boundary where it is
    assert ours.put(before.mesh.replace(points=points)) > 0
    worse = ours.measure().values.min()
    after = ours.improve(everywhere=True)
    assert after.values.min() > worse
    np.testing.assert_array_equal(ours.measure().values, after.values)
    surface = np.isclose(points, 0).any(axis=1) | np.isclose(points, 1).any(axis=1)
    np.testing.assert_array_equal(after.mesh.points[surface], points[surface])


def test_the_session_of_the_page(capsys: pytest.CaptureFixture[str]) -> None:
    page = (Path(__file__).resolve().parents[2] / "docs" / "integrations.md").read_text(encoding="utf-8")
    (block,) = [b for b in re.findall(r"^```py\n(.*?)^```$", page, re.DOTALL | re.MULTILINE) if "import gmsh" in b]
    try:
        exec(compile(block, "docs/integrations.md", "exec"), {})
    finally:
        if gmsh.isInitialized():
            gmsh.finalize()
    # Gmsh prints, too.
    numbers, element, node, after = capsys.readouterr().out.splitlines()[-4:]
    assert re.fullmatch(r"0\.\d+ \d+", numbers)
    assert re.fullmatch(r"element \d+", element)
    assert re.fullmatch(r"node \d+", node)
    assert float(after) > float(numbers.split()[0])
