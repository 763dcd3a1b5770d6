"""What is drawn: looked at pixel by pixel, off the screen; skipped where the system has no OpenGL."""

from __future__ import annotations

import io
import re
import shlex
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from view_meshes import cubes

import meshgauge
from meshgauge.cli.main import main
from meshgauge.look.colours import INVALID, POOR, rgb
from meshgauge.view import actors, controls, faces, opengl
from meshgauge.view.camera import Camera
from meshgauge.view.filters import Filters, Plane, ViewError
from meshgauge.view.link import _READ, View, view
from meshgauge.view.model import Model
from meshgauge.view.picture import png
from meshgauge.view.scene import Scene

pytestmark = pytest.mark.usefixtures("drawing")

SIZE = (360, 300)


def reds(picture: NDArray[np.uint8]) -> int:
    """Pixels in the colour of invalid cells, lit or in shadow."""
    r, g, b = (picture[..., channel].astype(int) for channel in range(3))
    return int(np.count_nonzero((r > 70) & (r > 3 * g) & (r > 3 * b)))


def inks(picture: NDArray[np.uint8]) -> int:
    """Pixels that are not the background."""
    return int(np.count_nonzero(np.abs(picture.astype(int) - picture[0, 0].astype(int)).max(axis=-1) > 8))


@pytest.fixture(scope="module")
def scene(bracket: Model) -> Scene:
    return Scene([bracket], size=SIZE)


def test_the_mesh_fills_much_of_the_picture_and_none_of_its_rim(scene: Scene) -> None:
    scene.show(View())
    picture = scene.picture()
    assert picture.shape == (300, 360, 3)
    assert 0.15 < inks(picture) / (300 * 360) < 0.9
    assert inks(np.concatenate([picture[:4].reshape(-1, 3), picture[:, :4].reshape(-1, 3)])[None]) == 0


def test_invalid_cells_are_red_and_gone_when_filtered(scene: Scene) -> None:
    scene.show(view("quality=-1,0"))
    assert scene.n_shown == [3]
    assert reds(scene.picture()) > 20
    scene.show(view("quality=0,1"))
    assert scene.n_shown == [6189]
    assert reds(scene.picture()) == 0
    scene.show(view("types="))
    assert (scene.n_shown, scene.n_faces, scene.pick(0.5, 0.5)) == ([0], 0, None)
    assert 0 < inks(scene.picture()) < 10_000  # the outline stays


def test_what_is_picked_is_the_cell_in_the_middle_of_a_picture_flown_to(scene: Scene, bracket: Model) -> None:
    on_surface = np.unique(bracket.topology.cells[bracket.topology.mates == -1])
    seen = 0
    for cell in on_surface[:: len(on_surface) // 12].tolist():
        scene.show(replace(View(), camera=scene.home.looking_at(*bracket.place_of(cell)), filters=Filters()))
        alone = Filters(low=max(float(bracket.values[cell]) - 1e-9, -1.0), high=min(bracket.values[cell] + 1e-9, 1.0))
        scene.show(replace(scene.view, filters=alone))
        picked = scene.pick(0.5, 0.5)
        seen += picked == (0, cell)
    assert seen >= 10  # of a concave cell the middle may lie outside


def test_a_pick_agrees_with_the_pixel(scene: Scene, bracket: Model) -> None:
    scene.show(replace(view("quality=-1,0.5"), edges=False))
    picture = scene.picture()
    for x in np.linspace(0.1, 0.9, 9):
        for y in np.linspace(0.1, 0.9, 9):
            picked = scene.pick(float(x), float(y))
            pixel = picture[int((1 - y) * 300), int(x * 360)]
            if picked is None:
                assert inks(np.stack([picture[0, 0], pixel])[None]) == 0 or pixel.std() < 12  # or the outline
            else:
                assert inks(np.stack([picture[0, 0], pixel])[None]) == 1


def test_a_picked_cell_is_seen_through_all_others(scene: Scene, bracket: Model) -> None:
    inside = 1743
    assert bracket.layers[inside] == 4
    close = scene.home.looking_at(*bracket.place_of(inside))
    scene.show(View(camera=replace(close, position=scene.home.position)))
    before = scene.picture()
    scene.show(replace(scene.view, cell=inside))
    after = scene.picture()
    assert 20 < np.count_nonzero((after != before).any(axis=-1)) < 3000
    with pytest.raises(ViewError, match="no cell 9999"):
        scene.show(View(cell=9999))
    with pytest.raises(ViewError, match="second mesh"):
        scene.show(View(cell=1, mesh=1))
    assert scene.view.cell == inside


def test_a_slice_and_a_peel_open_the_mesh(scene: Scene, bracket: Model) -> None:
    scene.show(View(filters=Filters(planes=(Plane((0.0, 0.0, 1.0), 0.5),))))
    assert 0 < scene.n_shown[0] < bracket.n_cells
    scene.show(View(filters=Filters(peel=3)))
    assert scene.n_shown == [int((bracket.layers >= 3).sum())]


def test_cells_that_shrink_are_drawn_apart_and_can_be_picked(scene: Scene, bracket: Model) -> None:
    scene.show(replace(view("types=hexahedron"), shrink=0.5))
    assert (scene.n_shown, scene.n_faces) == ([576], 6 * 576)
    gaps = inks(scene.picture())
    scene.show(view("types=hexahedron"))
    assert inks(scene.picture()) > 1.05 * gaps
    surface, points = bracket.apart(bracket.is_solid & (np.arange(bracket.mesh.n_cells) == 521), 0.5)
    whole = bracket.points[bracket.mesh.nodes(521)]
    assert (surface.n_faces, set(surface.cells.tolist())) == (6, {521})
    assert np.ptp(points, axis=0) == pytest.approx(0.5 * np.ptp(whole, axis=0), rel=1e-3)


def test_hollows_are_darker_and_what_stands_out_is_not(bracket: Model) -> None:
    pit = Filters(planes=(Plane((0.0, 0.0, 1.0), 0.5),), types=frozenset({"tetra"}))
    scene = Scene([bracket], size=SIZE)
    pictures = []
    for hollows in (True, False):
        scene.show(View(filters=pit, hollows=hollows, edges=False))
        pictures.append(scene.picture().astype(int))
    darker = (pictures[1] - pictures[0]).max(axis=-1)
    assert darker.max() > 25
    assert (pictures[0] - pictures[1]).max() <= 2


def test_axes_turn_with_the_camera_in_each_pane(scene: Scene) -> None:
    corner = []
    for camera in (None, Camera(position=(0.0, 0.0, 4.0), up=(0.0, 1.0, 0.0))):
        scene.show(replace(view("types="), camera=camera))
        corner.append(scene.picture()[:76, -76:])
    assert min(map(inks, corner)) > 60
    assert np.abs(corner[0].astype(int) - corner[1]).mean() > 1


def test_two_meshes_share_a_camera_and_are_picked_apart(bracket: Model) -> None:
    pair = Scene([bracket, replace(bracket, name="again")], size=(700, 300))
    picture = pair.picture().astype(int)
    assert np.abs(picture[:, :350] - picture[:, 350:]).mean() < 0.5
    assert inks(picture) > 0.1 * 700 * 300
    left = pair.pick(0.25, 0.45)
    right = pair.pick(0.75, 0.45)
    assert left is not None
    assert right == (1, left[1])


def test_while_it_moves_less_is_drawn_of_many_faces() -> None:
    model = cubes(30, noise=0.3, name="rough")
    scene = Scene([model], size=SIZE)
    scene.show(View(filters=Filters(high=0.4)))
    assert scene.n_faces > actors.BUDGET
    shown = model.surface(scene.masks[0])
    few, points = actors.coarse(shown, model.points[shown.points])
    whole = scene.picture()
    scene.moving(True)
    visible = [actor.GetVisibility() for pane in scene._panes for actor in (*pane.fine, *pane.coarse)]
    assert visible == [0] * (len(visible) - 1) + [1]
    assert len(points) >= few.n_faces <= actors.BUDGET
    assert inks(whole) > 0.2 * whole[..., 0].size
    assert np.array_equal(scene.picture(), whole)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_mesh_of_the_plane_is_seen_from_above(side: float) -> None:
    """All of it, x to the right and y upwards; one in space, and two of which one is, as always."""
    points = [(x, side * y, 0.0) for y in range(3) for x in range(5)]
    cells = [(5 * y + x, 5 * y + x + 1, 5 * y + x + 6, 5 * y + x + 5) for y in range(2) for x in range(4)]
    flat = meshgauge.Mesh.from_arrays(points, {"quad": cells})
    plane = Scene([Model.of(flat, "plane")], size=SIZE)
    forward, right, up = plane.home.axes
    np.testing.assert_allclose([right, up, -forward], np.eye(3), atol=1e-12)
    assert inks(plane.picture()) > 0.3 * np.prod(SIZE)
    bent = Model.of(flat.replace(points=np.array(points) + np.outer(np.arange(15) % 2, (0, 0, 0.2)), up=None), "shell")
    for models in ([bent], [Model.of(flat, "plane"), bent]):
        assert abs(Scene(models, size=SIZE).home.forward[2]) < 0.9


def test_points_of_no_cell_do_not_move_the_camera() -> None:
    model = cubes(3)
    far = np.vstack([model.mesh.points, [(1e9, 0, 0)]])
    with_one = Model.of(model.mesh.replace(points=far), "with a point far away")
    assert Scene([with_one], size=SIZE).home == Scene([model], size=SIZE).home


def test_without_opengl_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(opengl.CHOICE, raising=False)
    monkeypatch.setattr(opengl, "LIBRARIES", (("vtkEGLRenderWindow", ("libno_such.so.1",)),))
    monkeypatch.setattr("sys.platform", "linux")
    with pytest.raises(ViewError, match="apt install libegl1"):
        opengl.render_window()


def test_without_the_extra_it_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, pytestconfig: pytest.Config, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("meshgauge.view.app.find_spec", lambda name: None)  # imported by then, or not
    assert main(["view", str(pytestconfig.rootpath / "examples/meshes/bracket.vtu")]) == 2
    assert "pip install 'meshgauge[view]'" in capsys.readouterr().err


def test_a_png_has_a_legend(scene: Scene) -> None:
    from PIL import Image

    scene.show(view("quality=0.2,1"))
    with_legend = np.asarray(Image.open(io.BytesIO(png(scene))))
    assert reds(with_legend[-60:]) > 50
    assert reds(with_legend[:-60]) == 0


def test_a_screenshot_from_the_command_line(
    tmp_path: Path, pytestconfig: pytest.Config, capsys: pytest.CaptureFixture[str]
) -> None:
    from PIL import Image

    mesh, target = str(pytestconfig.rootpath / "examples/meshes/bracket.vtu"), tmp_path / "bad.png"
    code = main(["view", mesh, "--link", "quality=-1,0.2&cell=521", "--screenshot", str(target), "--size", "500x400"])
    assert code == 0
    assert capsys.readouterr().out == f"{target}: bracket.vtu, 39 of 6,192 cells\n"
    with Image.open(target) as image:
        assert image.size == (500, 400)


def test_the_documentation_holds(
    tmp_path: Path, pytestconfig: pytest.Config, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    page = (pytestconfig.rootpath / "docs/viewer.md").read_text(encoding="utf-8")
    (tmp_path / "examples").symlink_to(pytestconfig.rootpath / "examples", target_is_directory=True)
    monkeypatch.chdir(tmp_path)
    commands = [line.split("  #")[0] for line in page.splitlines() if line.startswith("meshgauge view ")]
    assert len(commands) == 3
    for command in commands:
        arguments = shlex.split(command)[1:]
        if "--screenshot" not in arguments:
            arguments += ["--screenshot", "out.png", "--size", "300x200"]
        assert main(arguments) == 0, capsys.readouterr().err
    rows = [line.split("|")[1] for line in page.splitlines() if line.startswith("| `")]
    parts = [part for row in rows for part in re.findall(r"`([^`]+)`", row)]
    assert {part.split("=")[0] for part in parts} == set(_READ)
    for part in parts:
        if part != "camera=...":
            assert view(part) != View()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--link", "hue=red"], "'hue=red' in a link is not understood"),
        (["--link", "cell=9999"], "no cell 9999"),
        (["--size", "big"], "--size is 'big'"),
        (["--size", "9x9"], "expected 200 to 8000"),
    ],
)
def test_what_cannot_be_drawn_is_said_in_a_line(
    arguments: list[str], message: str, tmp_path: Path, pytestconfig: pytest.Config, capsys: pytest.CaptureFixture[str]
) -> None:
    mesh, target = str(pytestconfig.rootpath / "examples/meshes/bracket.vtu"), tmp_path / "out.png"
    assert main(["view", mesh, *arguments, "--screenshot", str(target)]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not target.exists()


def test_a_picture_replaces_no_mesh_and_shows_two_at_most(pytestconfig: pytest.Config) -> None:
    mesh = str(pytestconfig.rootpath / "examples/meshes/bracket.vtu")
    assert main(["view", mesh, "--screenshot", mesh]) == 2
    assert main(["view", str(pytestconfig.rootpath / "examples/meshes/*")]) == 2  # three


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--link", "types=banana"], "no cell type 'banana'; there are "),
        (["--link", "types=hexahedrn"], "no cell type 'hexahedrn'; did you mean 'hexahedron'?"),
        (["--link", "status=bad"], "no status 'bad'"),
        (["--link", "regions=inlet"], "no region 'inlet'; there are region 0, "),
        (["--screenshot", "a.jpg"], "a.jpg: pictures of a view are written as PNG"),
    ],
)
def test_names_that_are_none_show_no_empty_scene(
    arguments: list[str],
    message: str,
    tmp_path: Path,
    pytestconfig: pytest.Config,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    mesh = str(pytestconfig.rootpath / "examples/meshes/bracket.vtu")
    monkeypatch.chdir(tmp_path)
    if "--screenshot" not in arguments:
        arguments = [*arguments, "--screenshot", "a.png"]
    assert main(["view", mesh, *arguments]) == 2
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_cells_are_coloured_by_status_region_and_other_metrics() -> None:
    """By status first where the colour is of a value; the scene shows what the model says."""
    mesh = cubes(4, noise=0.2).mesh
    data = {"region": np.arange(mesh.n_cells) % 3}
    made = Model.of(meshgauge.measure(mesh.replace(cell_data=data), metrics=("shape", "edge_ratio")), "a")
    assert made.colourings == ("quality", "status", "region", "shape", "edge_ratio")
    cells, quality = np.arange(made.n_cells), made.quality
    invalid = meshgauge.status.is_invalid(quality.status)
    assert 0 < invalid.sum() < 40
    for by in ("quality", "status", "shape"):
        is_red = (made.colours(cells, by) == (255 * rgb(INVALID)).round()).all(axis=1)
        np.testing.assert_array_equal(is_red, invalid, by)
    is_orange = (made.colours(cells, "shape") == (255 * rgb(POOR)).round()).all(axis=1)
    low, _ = quality.rows["shape"].acceptable
    np.testing.assert_array_equal(is_orange, ~invalid & (quality.values_of("shape") < low))
    by_region = made.colours(cells, "region")
    assert len(np.unique(by_region, axis=0)) == 3
    assert all(len(np.unique(by_region[made.region_ids == one], axis=0)) == 1 for one in range(3))
    scene = Scene([made], size=SIZE)
    pictures = []
    for by in made.colourings:
        scene.show(view("" if by == "quality" else f"colour={by}"))
        pictures.append(scene.picture())
        assert made.legend(by) or by == "quality"
    assert len({picture.tobytes() for picture in pictures}) == len(pictures)
    with pytest.raises(ViewError, match="did you mean 'shape'"):
        scene.show(view("colour=shap"))
    assert scene.view.colour == "edge_ratio", "what cannot be changes nothing"
    # Neighbours share a face; the list of the worst is of what is shown.
    for cell in (0, 21):
        own = set(mesh.nodes(cell).tolist())
        expected = [other for other in range(made.n_cells) if len(own & set(mesh.nodes(other).tolist())) == 4]
        assert made.neighbours(cell) == expected
    among = np.zeros(made.n_cells, np.bool_)
    among[40:] = True
    rows = controls.worst(made, 5, among)
    assert [row["cell"] for row in rows] == [cell.cell for cell in made.quality.worst(made.n_cells) if cell.cell >= 40][
        :5
    ]
    with pytest.raises(meshgauge.OptionError):
        made.place_in("64")


@pytest.fixture(scope="module")
def sheared() -> Model:
    """3³ cubes, one point inside moved so far that faces there are beyond their limits."""
    model = cubes(3)
    points = np.array(model.mesh.points)
    points[np.flatnonzero((points == 1.0).all(axis=1))[0]] += (2.0, 2.0, 0.3)
    mesh = model.mesh.replace(points=points, purpose="fv")
    return Model.of(meshgauge.measure(mesh, metrics=["jens", "non_orthogonality", "boundary_skewness"]), "sheared")


def test_faces_are_coloured_by_their_own_value(sheared: Model) -> None:
    by = "non_orthogonality of faces"
    assert by in sheared.colourings
    faces = sheared.quality.faces
    assert faces is not None
    values = {}
    for face in range(faces.n_faces):
        if faces.neighbour[face] >= 0:
            values[frozenset((int(faces.owner[face]), int(faces.neighbour[face])))] = faces.non_orthogonality[face]
    shown = np.arange(27) < 9  # a layer, cut off: its inner faces are seen
    seen = sheared.surface(shown)
    colours = sheared.colours_of(seen, by)
    assert seen.slots is not None
    n_inner = n_beyond = 0
    for slot, colour in zip(seen.slots.tolist(), colours.tolist(), strict=True):
        value = values.get(frozenset(sheared.beside(slot)), np.nan) if len(sheared.beside(slot)) == 2 else np.nan
        n_inner += not np.isnan(value)
        is_grey = max(colour) - min(colour) < 20 and max(colour) < 180
        is_orange = colour[0] > 200 > colour[1] + 30 and colour[2] < 60
        assert is_grey == np.isnan(value)
        assert is_orange == (value > 70)
        n_beyond += value > 70
    assert (n_inner, n_beyond) == (9, 2)
    assert (
        sheared.colours_of(seen, "non_orthogonality").tolist()
        == sheared.colours(seen.cells, "non_orthogonality").tolist()
    )


def test_the_worst_faces_are_listed_and_one_can_be_gone_to(sheared: Model) -> None:
    rows = faces.rows(sheared.hard_faces, 20)
    assert rows[0]["measure"] == "non orthogonality"
    assert rows[0]["beyond"]
    assert {row["measure"] for row in rows} == {"non orthogonality", "boundary skewness"}
    first = sheared.hard_faces[0]
    assert sheared.beside(first.slot) == [first.face.owner, first.face.neighbour]
    details = faces.details(sheared.quality, sheared.face_at(first.slot))
    assert details["name"] == f"cells {first.face.owner}, {first.face.neighbour}"
    assert details["measures"][0]["beyond"]
    outside = next(one for one in sheared.hard_faces if one.face.neighbour is None)
    assert faces.details(sheared.quality, sheared.face_at(outside.slot))["name"].startswith(
        f"cell {outside.face.owner}, "
    )
    scene = Scene([sheared], size=SIZE)
    scene.show(View(edges=False, hollows=False))
    plain = scene.picture()
    scene.show(view(f"edges=0&hollows=0&cell={first.face.owner}&face={first.slot}"))
    drawn = np.abs(scene.picture().astype(int) - plain.astype(int)).max(axis=-1) > 40
    assert 50 < np.count_nonzero(drawn) < 20_000  # seen through all others
    with pytest.raises(ViewError, match="no face 99999"):
        scene.show(View(face=99_999))
    with pytest.raises(ViewError, match="--for fv"):
        Scene([cubes(2)], size=SIZE).show(View(face=0))
    # In the colouring of faces those that are listed as the worst are drawn over all the rest.
    scene.show(view("edges=0&hollows=0&colour=non_orthogonality%20of%20faces"))
    picture = scene.picture().astype(int)
    assert np.count_nonzero((picture[..., 0] > 180) & (picture[..., 2] < 60)) > 30


def test_a_camera_faces_a_plane_from_its_side() -> None:
    for normal in ((0.0, 0.0, 1.0), (0.0, 0.0, -3.0), (1.0, 1.0, 0.0)):
        turned = Camera().facing(np.array(normal))
        assert abs(turned.forward @ np.array(normal)) / np.linalg.norm(normal) > 0.8
        assert turned.forward @ Camera().forward > 0.3
    assert Camera().facing(np.zeros(3)) == Camera()
