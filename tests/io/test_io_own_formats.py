"""Formats of which the reader is our own: the same cells however they are written, and errors that say where."""

from __future__ import annotations

import gzip
import sys
from pathlib import Path

import gmsh_files
import numpy as np
import optional
import pytest
from io_meshes import LINEAR, mesh_of

import meshgauge
from meshgauge import io
from meshgauge.cells import CELL_TYPES, SHAPES
from meshgauge.errors import ReadError
from meshgauge.io.formats.abaqus.types import element_type
from meshgauge.io.plumbing import face_based
from meshgauge.kernels import path as kernels_path
from meshgauge.kernels.polyhedra import standard_driver
from meshgauge.mesh import Mesh
from meshgauge.mesh.regions import regions

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "fuzz"))
import fuzzing


def written(folder: Path, name: str) -> Path:
    """One of the small files of the fuzzer."""
    path = folder / "none"
    for file, text in fuzzing.TEXTS[name].items():
        path = folder / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return path


CUBE = ("mfem", "hedra", "rf", "fluent", "openfoam", "ovm")


@pytest.mark.parametrize("name", CUBE)
def test_a_cube_is_a_right_handed_hexahedron(tmp_path: Path, name: str) -> None:
    mesh = io.read(written(tmp_path, name))
    cell = int(np.flatnonzero(mesh.types == 12)[0])
    x = mesh.points[mesh.nodes(cell)]
    for a, i, j, k in SHAPES["hexahedron"].triples:
        assert np.linalg.det(x[[i, j, k]] - x[a]) == pytest.approx(1.0)


def test_patches_and_zones_are_blocks(tmp_path: Path) -> None:
    foam, fluent = (io.read(written(tmp_path / name, name)) for name in ("openfoam", "fluent"))
    assert [(b.name, b.stop - b.start) for b in foam.blocks] == [("cells", 1), ("wall", 6)]
    assert [(b.name, b.stop - b.start) for b in fluent.blocks] == [("air", 1), ("side", 6)]
    assert foam.type_counts() == fluent.type_counts() == {"quad": 6, "hexahedron": 1}


@pytest.mark.parametrize("is_mirrored", [False, True])
@pytest.mark.parametrize("has_sides", [True, False])
def test_cells_are_recognised_by_their_faces(
    is_mirrored: bool, has_sides: bool, path: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(0)
    mesh = mesh_of(*LINEAR, "penta_prism", n=20)
    points = mesh.points * ([1, 1, -1] if is_mirrored else [1, 1, 1])
    rings, n_faces, inward = [], [], []
    for cell in range(mesh.n_cells):
        shape = CELL_TYPES[int(mesh.types[cell])].shape
        assert shape is not None
        n_faces.append(len(shape.faces))
        for at in rng.permutation(len(shape.faces)):
            ring = np.roll(mesh.nodes(cell)[list(shape.faces[at])], rng.integers(9))
            inward.append(bool(rng.integers(2)))
            rings.append(ring[::-1] if inward[-1] else ring)
    faces = face_based.Faces(
        face_based.offsets_of(np.array(n_faces)),
        np.arange(len(rings)),
        face_based.offsets_of(np.array([len(r) for r in rings])),
        np.concatenate(rings),
        np.array(inward) if has_sides else None,
    )
    found = face_based.solids(faces, points)
    expected = np.where(mesh.types == 15, 42, mesh.types)
    assert found.types.tolist() == expected.tolist()
    sign = -1 if is_mirrored and has_sides else 1  # a mirrored cell is seen only if the file says which side is outside
    for cell in np.flatnonzero(expected != 42):
        shape = CELL_TYPES[int(expected[cell])].shape
        assert shape is not None
        x = points[found.connectivity[found.offsets[cell] : found.offsets[cell + 1]]]
        assert all(np.linalg.det(x[[i, j, k]] - x[a]) * sign > 0 for a, i, j, k in shape.triples)
    assert found.polyhedra is not None
    assert found.polyhedra.n_faces == 7 * 20
    for module in (face_based, standard_driver):
        monkeypatch.setattr(module, "CHUNK", 7)  # of 100: some have prisms, some have none
    for most in (kernels_path.NUMPY_UP_TO, -1 if path == "numpy" else sys.maxsize):
        monkeypatch.setattr(kernels_path, "NUMPY_UP_TO", most)
        again = face_based.solids(faces, points)
        for name in ("types", "offsets", "connectivity"):
            np.testing.assert_array_equal(getattr(again, name), getattr(found, name))
        assert again.polyhedra is not None
        for name in ("cell_offsets", "cell_faces", "face_offsets", "face_points", "labels"):
            np.testing.assert_array_equal(getattr(again.polyhedra, name), getattr(found.polyhedra, name))


@pytest.mark.usefixtures("path")
def test_a_face_that_is_missing_makes_no_hexahedron() -> None:
    shape = SHAPES["hexahedron"]
    rings = [*shape.faces[:5], shape.faces[4]]
    faces = face_based.Faces(
        np.array([0, 6]), np.arange(6), np.arange(0, 25, 4), np.array(rings).ravel(), np.zeros(6, bool)
    )
    assert face_based.solids(faces, np.array(shape.points)).types.tolist() == [42]


def test_openfoam_binary_and_gzipped(tmp_path: Path) -> None:
    path = written(tmp_path, "openfoam")
    folder = tmp_path / "constant" / "polyMesh"
    plain = io.read(path)
    points = np.array([line.split() for line in fuzzing._CUBE.splitlines()], float)
    faces = np.array([face.split() for face in fuzzing._FACES], np.int32)

    def put(name: str, kind: str, *lists: np.ndarray) -> None:
        head = (
            f'FoamFile\n{{ format binary; class {kind}; arch "LSB;label=32;scalar=64"; object {name}; }}\n// * //\n\n'
        )
        sizes = [len(a) for a in lists]
        body = b"".join(b"%d\n(" % n + a.tobytes() + b")\n" for n, a in zip(sizes, lists, strict=True))
        (folder / name).unlink()
        (folder / f"{name}.gz").write_bytes(gzip.compress(head.encode() + body))

    put("points", "vectorField", points)
    put("faces", "faceCompactList", np.arange(0, 25, 4, dtype=np.int32), faces.ravel())
    put("owner", "labelList", np.zeros(6, np.int32))
    packed = io.read(path)
    np.testing.assert_array_equal(packed.points, plain.points)
    np.testing.assert_array_equal(packed.connectivity, plain.connectivity)


def test_fluent_binary(tmp_path: Path) -> None:
    plain = io.read(written(tmp_path, "fluent"))
    points = np.array([line.split() for line in fuzzing._CUBE.splitlines()], "<f8")
    faces = np.array([[int(v) + 1 for v in reversed(f.split())] + [1, 0] for f in fuzzing._FACES], "<i4")
    path = tmp_path / "b.cas"
    path.write_bytes(
        b'(0 "a (b")\n(2 3)\n(12 (0 1 1 0))\n(37 ((x "a\\") (") (y 2)))\n(2012 (2 1 1 1 4))\n(3010 (1 1 8 1 3)\n('
        + points.tobytes()
        + b")\nEnd of Binary Section   3010)\n(2013 (3 1 6 3 4)("
        + faces.tobytes()
        + b")\nEnd of Binary Section   2013)\n(45 (2 fluid air)())\n"
    )
    back = io.read(path)
    np.testing.assert_array_equal(back.points, plain.points)
    np.testing.assert_array_equal(back.connectivity, plain.connectivity)


def test_su2_zones_do_not_share_points(tmp_path: Path) -> None:
    tetra = "NELEM= 1\n10 0 1 2 3 0\nNPOIN= 4\n"
    markers = "NMARK= 1\nMARKER_TAG= wall\nMARKER_ELEMS= 1\n5 0 1 2\n"
    near, far = fuzzing._TETRA, "".join(f"9 {line[2:]} 0\n" for line in fuzzing._TETRA.splitlines())
    path = tmp_path / "a.su2"
    path.write_text(f"% two\nNZONE= 2\nIZONE= 1\nNDIME= 3\n{tetra}{near}{markers}IZONE= 2\nNDIME= 3\n{tetra}{far}")
    mesh = io.read(path)
    assert mesh.n_points == 8
    assert [b.name for b in mesh.blocks] == ["zone 1", "wall", "zone 2"]
    assert mesh.cell_data["su2:zone"].tolist() == [1, 1, 2]
    assert mesh.nodes(2).tolist() == [4, 5, 6, 7]
    path.write_text(path.read_text().replace("10 0 1 2 3 0", "10 0 1 2 4 0", 1))
    with pytest.raises(ReadError, match=r"zone 1 refers to point 4, which is outside 0\.\.3"):
        io.read(path)


def test_tetgen_and_rf_are_told_by_content_from_either_file(tmp_path: Path) -> None:
    for name, kind in (("tetgen", "tetra"), ("rf", "hexahedron")):
        path = written(tmp_path / name, name)
        for suffix in (".ele", ".node"):
            assert io.read(path.with_suffix(suffix)).type_counts() == {kind: 1}
    assert io.read(tmp_path / "tetgen" / "a.ele").cell_data["tetgen:attribute"].tolist() == [7]
    (tmp_path / "rf" / "a.node").unlink()
    with pytest.raises(ReadError, match=r"needs a\.node beside it"):
        io.read(tmp_path / "rf" / "a.ele")


def test_unv_groups_and_fortran_exponents(tmp_path: Path) -> None:
    mesh = io.read(written(tmp_path, "unv"))
    assert mesh.cell_data["G"].tolist() == [1]
    assert mesh.cell_data["unv:material"].tolist() == [2]
    np.testing.assert_array_equal(mesh.points[1], [1, 0, 0])


def test_abaqus_instances_are_moved_and_keep_sets_and_materials(tmp_path: Path) -> None:
    path = written(tmp_path, "abaqus")
    mesh = io.read(path)
    np.testing.assert_allclose(mesh.points[:3], [[0, 1, 0], [0, 2, 0], [-1, 1, 0]], atol=1e-15)
    assert mesh.cell_data["S"].tolist() == [1]
    assert mesh.cell_data["abaqus:material"].tolist() == [1]
    assert mesh.field_data["abaqus:material:names"].tolist() == ["STEEL"]
    (tmp_path / "nodes.inc").write_text("1, 0,0,0\n2, 1,0,0\n3, 0,1,0\n4, 0,0,1\n")
    path.write_text("*NODE\n*INCLUDE, INPUT=nodes.inc\n*ELEMENT, TYPE=C3D4\n1, 1,2,3,4\n")
    assert io.read(path).n_points == 4


@pytest.mark.parametrize(
    ("name", "expected"),
    [("C3D5", "pyramid"), ("C3D8RH", "hexahedron"), ("c3d10m", "tetra10"), ("DC3D15", "wedge15"),
     ("C3D20R", "hexahedron20"), ("S4R", "quad"), ("CPE6", "triangle6"), ("B31", "line"), ("B32", "line3"),
     ("T3D2", "line"), ("COH3D6", "wedge"), ("MASS", "vertex"), ("XYZ", None), ("C3D", None)],
)  # fmt: skip
def test_abaqus_element_types(name: str, expected: str | None) -> None:
    made = element_type(name)
    assert (made.kind.name if made is not None and made.kind is not None else None) == expected


def test_mfem_curved_nodes_give_the_corners(tmp_path: Path) -> None:
    mesh = io.read(written(tmp_path, "mfem curved"))
    assert mesh.type_counts() == {"tetra": 1}
    np.testing.assert_array_equal(mesh.points[3], [0, 0, 1])


MFEM_FOLD = """MFEM mesh v1.0

dimension
3

elements
1
1 4 0 1 2 3

boundary
0

vertices
4

nodes
FiniteElementSpace
FiniteElementCollection: {space}
VDim: 3
Ordering: {ordering}

{values}
"""


@pytest.mark.parametrize("ordering", [0, 1])
@pytest.mark.parametrize("space", ["H1_3D_P2", "Quadratic", "H1Pos_3D_P2"])
def test_mfem_of_order_2_is_measured_with_its_tangents(tmp_path: Path, space: str, ordering: int) -> None:
    """The node of edge 0-1 at 3.5 of 4: x'(1) = 3.5·4·(1 - 2) + 4·(4 - 1) = -2, so node 1 is turned inside out."""
    corners = np.array([(0, 0, 0), (4, 0, 0), (0, 4, 0), (0, 0, 4)], float)
    pairs = np.array([(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)])
    between = corners[pairs].mean(axis=1)
    between[0, 0] = 3.5
    stored = between.copy()
    if "Pos" in space:
        stored = 2 * between - corners[pairs].mean(axis=1)
    table = np.concatenate([corners, stored])
    values = " ".join(map(str, (table if ordering else table.T).ravel().tolist()))
    path = tmp_path / "fold.mesh"
    path.write_text(MFEM_FOLD.format(space=space, ordering=ordering, values=values))
    mesh = io.read(path)
    assert mesh.type_counts() == {"bezier_tetra" if "Pos" in space else "tetra10": 1}
    np.testing.assert_allclose(mesh.points[mesh.nodes(0)[4:]], stored[[0, 3, 1, 2, 4, 5]], atol=1e-15)
    quality = meshgauge.measure(mesh)
    assert quality.status.tolist() == [meshgauge.Status.INVERTED]
    assert quality.values[0] < 0


@pytest.mark.parametrize(("space", "n"), [("H1_3D_P3", 20), ("Cubic", 20)])
def test_mfem_above_order_2_is_undecided(tmp_path: Path, space: str, n: int) -> None:
    values = " ".join(map(str, np.concatenate([np.eye(4, 3, -1), np.full((n - 4, 3), 0.25)]).ravel().tolist()))
    path = tmp_path / "a.mesh"
    path.write_text(MFEM_FOLD.format(space=space, ordering=1, values=values))
    quality = meshgauge.measure(io.read(path))
    assert quality.status.tolist() == [meshgauge.Status.UNDECIDED]
    assert "nothing is known of their inside" in quality.mesh.notes[0]


@pytest.mark.parametrize("kind", ["classic", "hdf5"])
def test_exodus(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "a.e"
    if kind == "classic":
        fuzzing.exodus_classic(path)
    else:
        h5py = pytest.importorskip("h5py")
        with h5py.File(path, "w") as file:
            for axis, column in zip("xyz", [[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], strict=True):
                file[f"coord{axis}"] = np.array(column, float)
            file["connect1"] = np.array([[1, 2, 3, 4]], np.int32)
            file["connect1"].attrs["elem_type"] = b"TETRA"
            file["eb_prop1"] = [7]
            file["name_elem_var"] = np.array([list("stress\0")], "S1")
            file["vals_elem_var1eb1"] = [[0.5], [0.7]]
            file["time_whole"] = [0.0, 1.0]
    mesh = io.read(path)
    assert mesh.type_counts() == {"tetra": 1}
    assert mesh.nodes(0).tolist() == [0, 1, 2, 3]
    if kind == "hdf5":
        assert mesh.cell_data["exodus:block"].tolist() == [7]
        assert mesh.cell_data["stress"].tolist() == [0.5]
        assert "2 time steps" in mesh.notes[0]


ERRORS = {
    "a.su2": ("NDIME= 3\nNELEM= 1\n10 0 1 2\n", "line 3: 3 nodes of a tetra, expected 4"),
    "b.su2": ("NDIME= 3\nNELEM= 999999999\n10 0 1 2 3\n", "line 2: 999999999 elements are stated, but 1 lines follow"),
    "c.su2": ("NDIME= 3\nNPOIN= 1\n0 0\n", "line 3: 2 numbers where coordinates have 3"),
    "a.mesh": ("MFEM mesh v1.0\n\ndimension\n3\n\nelements\n1\n1 9 0 1\n", "line 8: element type 9 is not known"),
    "b.mesh": ("MFEM mesh v0.9\n", "only MFEM mesh v1.0 to v1.3"),
    "a.hedra": ("1 1 1\n0 0 0\n3 1 1\n", "line 3: states 3 points, but lists 2"),
    "a.unv": ("    -1\n  2411\n 1 1 1 11\n", "line 2: the file ends within a data set; it is truncated"),
    "b.unv": ("    -1\n  2412\n 1 999 1 1 7 1\n 1\n    -1\n", "no elements were found in it, but 1 of type 999"),
    "a.cas": ("(0 3)\n(10 (1 1 8 1 3)(\n0 0 0\n", "the file ends within a section"),
    "a.inp": ("*NODE\n1, 0,0,0\n*ELEMENT, TYPE=C3D99\n1, 1\n", "types that are not known: 1 of type 'C3D99'"),
    "b.inp": (
        "*NODE\n1, 0,0,0\n*ELEMENT, TYPE=C3D4\n1, 1\n",
        r"line 3: an element of type C3D4 with 1 nodes, expected 4",
    ),
    "c.inp": ("*NODE\n1, 0,0,0\n*ELEMENT, TYPE=C3D4\n1, 1,2,3,4\n", "refers to node 2, which does not exist"),
}


@pytest.mark.parametrize("name", ERRORS)
def test_errors_say_where_and_what(tmp_path: Path, name: str) -> None:
    text, message = ERRORS[name]
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(ReadError, match=message) as caught:
        io.read(path)
    assert str(path) in str(caught.value)


def test_blank_lines_and_carriage_returns_do_not_matter(tmp_path: Path) -> None:
    for name in ("mfem", "hedra", "unv", "fluent", "openfoam", "abaqus"):
        path = written(tmp_path / name, name)
        plain = io.read(path)
        for file in fuzzing.TEXTS[name]:
            text = (tmp_path / name / file).read_text()
            (tmp_path / name / file).write_bytes(text.replace("\n", "\r\n\r\n").encode())
        back = io.read(path)
        assert_equal(plain, back)


def assert_equal(a: Mesh, b: Mesh) -> None:
    np.testing.assert_array_equal(a.points, b.points)
    np.testing.assert_array_equal(a.connectivity, b.connectivity)
    np.testing.assert_array_equal(a.types, b.types)


@pytest.mark.parametrize("extension", [".unv", ".inp", ".msh"])
@pytest.mark.parametrize(("order", "is_incomplete"), [(1, False), (2, True)])
def test_what_gmsh_writes_in_other_formats_is_read_right(
    tmp_path: Path, extension: str, order: int, is_incomplete: bool
) -> None:
    gmsh = optional.gmsh()
    path = tmp_path / f"a{extension}"
    gmsh_files.three_bodies(gmsh, path, order, is_incomplete=is_incomplete)
    mesh = io.read(path)
    assert mesh.notes == ()
    assert gmsh_files.solids(mesh) == gmsh_files.CELLS
    gmsh_files.assert_straight(mesh)
    ids, names = regions(mesh)
    for name, n in gmsh_files.BODIES.items():
        if extension != ".msh":
            key = name if name in mesh.cell_data else name.upper()
            assert int(mesh.cell_data[key].sum()) == n
        else:
            assert int((ids == names.index(name)).sum()) == n


def test_fluent_faces_without_points_are_of_no_cell(tmp_path: Path) -> None:
    """Interfaces that do not conform list such, a zone of them or among others."""
    path = written(tmp_path, "fluent")
    whole = io.read(path)
    zone = "(13 (9 7 8 3f0 0)(\n0 1 0\n0 1 0\n))\n(45 (9 interface pcf)())\n"
    path.write_text(path.read_text().replace("(13 (0 1 6 0))", "(13 (0 1 8 0))") + zone)
    mesh = io.read(path)
    assert mesh.type_counts() == whole.type_counts()
    assert mesh.connectivity.tolist() == whole.connectivity.tolist()
    assert mesh.notes == ("2 faces without points were left out.",)


@pytest.mark.parametrize("head", ["OVM", "OVM \t", "OVM ASCII", "ovm ascii"])
def test_the_head_of_openvolumemesh_may_say_no_more(head: str, tmp_path: Path) -> None:
    path = written(tmp_path, "ovm")
    path.write_text(path.read_text().replace("OVM ASCII", head))
    assert io.read(path).type_counts() == {"hexahedron": 1}


@pytest.mark.parametrize(("code", "n"), [(171, 2), (172, 3), (300, 1), (204, 8), (221, 4)])
def test_universal_elements_that_can_be_no_solids_are_counted(code: int, n: int, tmp_path: Path) -> None:
    path = written(tmp_path, "unv")
    element = f"2 {code} 1 2 7 {n}\n{' '.join(str(i % 4 + 1) for i in range(n))}\n"
    path.write_text(path.read_text().replace("1 2 3 4\n", f"1 2 3 4\n{element}"))
    mesh = io.read(path)
    assert mesh.type_counts() == {"tetra": 1}
    assert mesh.notes == (
        "Elements that are no cells, or of fewer than four nodes and of types that are not known, were left out: "
        f"1 of type {code}.",
    )


def test_universal_elements_that_may_be_solids_are_an_error(tmp_path: Path) -> None:
    path = written(tmp_path, "unv")
    path.write_text(path.read_text().replace("1 2 3 4\n", "1 2 3 4\n2 300 1 2 7 4\n1 2 3 4\n"))
    with pytest.raises(ReadError, match="has elements of types that are not known: 1 of type 300"):
        io.read(path)
