"""What was written is held against what was to be written: whatever differs is refused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from io_meshes import LINEAR, mesh_of
from test_io_round_trip import ONE_TYPE, WRITTEN

from meshgauge import io
from meshgauge.errors import WriteError
from meshgauge.io import registry, writing
from meshgauge.io.plumbing import verify
from meshgauge.mesh import CellBlock, Mesh

pytestmark = pytest.mark.usefixtures("readers_here")

KEEPS_NAMES = ("vtu", "vtk", "vtkhdf", "gmsh", "med", "avs", "xdmf", "tecplot")


def moved(mesh: Mesh) -> Mesh:
    points = mesh.points.copy()
    points[3, 1] += 1e-4
    return mesh.replace(points=points)


def turned(mesh: Mesh) -> Mesh:
    """Two nodes of a cell in the place of each other."""
    nodes = mesh.connectivity.copy()
    nodes[mesh.offsets[1] : mesh.offsets[1] + 2] = nodes[mesh.offsets[1] : mesh.offsets[1] + 2][::-1]
    return mesh.replace(connectivity=nodes)


def elsewhere(mesh: Mesh) -> Mesh:
    """A node of the last cell is one of the first: as many points and cells."""
    nodes = mesh.connectivity.copy()
    nodes[-1] = nodes[0]
    return mesh.replace(connectivity=nodes)


def renamed(mesh: Mesh) -> Mesh:
    return mesh.replace(point_data={"other": mesh.point_data["t"]})


DAMAGES: dict[str, Callable[[Mesh], Mesh] | None] = {
    "a point elsewhere": moved,
    "nodes in another order": turned,
    "a node of another cell": elsewhere,
    "a cell less": lambda mesh: mesh[: mesh.n_cells - 1],
    "a cell twice": lambda mesh: mesh.replace(
        connectivity=np.r_[mesh.connectivity[: mesh.offsets[-2]], mesh.connectivity[: mesh.offsets[1]]],
        types=np.r_[mesh.types[:-1], mesh.types[:1]],
        offsets=np.r_[mesh.offsets[:-1], mesh.offsets[-2] + mesh.offsets[1]],
    ),
    "another name": renamed,
    "other data": lambda mesh: mesh.replace(point_data={"t": mesh.point_data["t"] * 0.999}),
    "cut off": None,
}


def broken(monkeypatch: pytest.MonkeyPatch, damage: Callable[[Mesh], Mesh] | None) -> None:
    """Every writer writes another mesh than it is asked to or, if None, a file without its last quarter."""
    real = registry.for_writing

    def worse(path: Path, name: str | None) -> registry.Format:
        chosen = real(path, name)
        assert chosen.write is not None
        write = chosen.write

        def damaged(path: Path, mesh: Mesh) -> tuple[str, ...]:
            lost = write(path, damage(mesh) if damage is not None else mesh)
            if damage is None:
                path.write_bytes(path.read_bytes()[: path.stat().st_size * 3 // 4])
            return () if damage is renamed else lost

        return replace(chosen, write=damaged)

    monkeypatch.setattr(registry, "for_writing", worse)


CASES = [
    (name, extension, damage)
    for name, extensions in WRITTEN.items()
    for extension in extensions
    for damage in DAMAGES
    if damage not in ("another name", "other data") or name in KEEPS_NAMES
]


IN_PIECES = ("vtu", "vtkhdf")
"""Formats of which large files are compared in pieces."""


@pytest.fixture
def large(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> bool:
    """Whether every mesh counts as large, so that it is never read back as a whole."""
    is_large = bool(getattr(request, "param", True))
    if is_large:
        monkeypatch.setattr(writing, "_LARGE", -1)
    return is_large


@pytest.mark.parametrize(
    ("large", "name", "extension", "damage"),
    [(False, *case) for case in CASES] + [(True, *case) for case in CASES if case[0] in IN_PIECES],
    indirect=["large"],
)
def test_what_does_not_read_back_replaces_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, large: bool, name: str, extension: str, damage: str
) -> None:
    mesh = mesh_of(*([ONE_TYPE[name]] if name in ONE_TYPE else LINEAR))
    mesh = mesh.replace(
        points=mesh.points + np.random.default_rng(0).uniform(-0.05, 0.05, mesh.points.shape),
        point_data={"t": np.linspace(0.0, 1.0, mesh.n_points)} if name in KEEPS_NAMES else {},
        blocks=(CellBlock("a", 0, 1), CellBlock("b", 1, mesh.n_cells)),
    )
    path = tmp_path / f"a{extension}"
    io.write(path, mesh, file_format=name)
    before = path.read_bytes()
    broken(monkeypatch, DAMAGES[damage])
    with pytest.raises(WriteError, match=r"a\.[\w.]+: ") as caught:
        io.write(path, mesh, file_format=name)
    assert "meshgauge-" not in str(caught.value)  # the name of the temporary file
    assert path.read_bytes() == before
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize("extension", [".vtu", ".vtkhdf"])
def test_large_meshes_are_not_read_back_as_a_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, large: bool, loaded: Mesh, solid: Mesh, extension: str
) -> None:
    def read(*arguments: object) -> Mesh:
        raise AssertionError("is read as a whole")

    monkeypatch.setattr(registry, "read", read)
    for mesh in (loaded, solid, solid.replace(points=solid.points.astype(np.float32))):
        assert io.write(tmp_path / f"a{extension}", mesh) == ()


@pytest.mark.parametrize("large", [False, True], indirect=True)
@pytest.mark.parametrize("extension", [".vtu", ".vtk", ".vtkhdf"])
def test_faces_of_polyhedra_that_do_not_read_back_replace_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, large: bool, polyhedral: Mesh, extension: str
) -> None:
    path = tmp_path / f"a{extension}"
    io.write(path, polyhedral)
    before = path.read_bytes()
    poly = polyhedral.polyhedra
    assert poly is not None
    faces = poly.face_points.copy()
    faces[:4] = faces[[0, 1, 3, 2]]
    broken(monkeypatch, lambda mesh: mesh.replace(polyhedra=replace(poly, face_points=faces)))
    with pytest.raises(WriteError, match="read back"):
        io.write(path, polyhedral)
    assert path.read_bytes() == before


@pytest.mark.parametrize("name", [name for name in WRITTEN if name not in ("vtu", "vtk", "vtkhdf")])
def test_formats_without_polyhedra_refuse_them(tmp_path: Path, polyhedral: Mesh, name: str) -> None:
    with pytest.raises(WriteError, match="polyhedr"):
        io.write(tmp_path / f"a{WRITTEN[name][0]}", polyhedral, file_format=name)
    assert not list(tmp_path.iterdir())


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


@pytest.mark.parametrize(("labels", "missing"), [([0, 1, 2], []), ([1, 2, 3], []), ([5, 6, 7], ["label"])])
def test_labels_may_be_lost_only_if_they_count(labels: list[int], missing: list[str]) -> None:
    bare = mesh_of("tetra", n=3)
    labelled = bare.replace(cell_data={"label": np.array(labels)})
    assert verify._missing(labelled, bare, is_exact=True) == missing
