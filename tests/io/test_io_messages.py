"""What errors of readers say: the file once, the line that is wrong, and too little memory by its name."""

from __future__ import annotations

import errno
import re
from pathlib import Path

import pytest
from patch_files import PATCHED

from meshgauge import io
from meshgauge.errors import ReadError
from meshgauge.io import registry
from meshgauge.io.plumbing.messages import is_out_of_memory, named_once

CUBE = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n"
FACES = "4 1 4 3 2\n4 5 6 7 8\n4 1 2 6 5\n4 2 3 7 6\n4 3 4 8 7\n4 4 1 5 8\n"


@pytest.mark.parametrize(
    ("message", "expected"),
    [
        ("is empty", "d/a.k: is empty"),
        ("d/a.k: is empty", "d/a.k: is empty"),
        ("d/a.k, line 3: is wrong", "d/a.k, line 3: is wrong"),
        ("d/a.k: d/a.k, line 3: is wrong", "d/a.k: the file, line 3: is wrong"),
        ("d/a.k: VTK says: d/a.k: a record", "d/a.k: VTK says: a record"),
        ("d/a.k: cannot read file 'd/a.k'", "d/a.k: cannot read the file"),
        ("d/a.k.inc: is missing", "d/a.k: d/a.k.inc: is missing"),
        ("d/a.k/b: is missing", "d/a.k: d/a.k/b: is missing"),
        ("d/a.k: refers to bd/a.k and d/a.k2", "d/a.k: refers to bd/a.k and d/a.k2"),
    ],
)
def test_a_file_is_named_once(message: str, expected: str) -> None:
    assert named_once(Path("d/a.k"), message) == expected


@pytest.mark.parametrize(
    ("error", "message"),
    [
        ("No module named 'h5py'", "needs a package that is not installed: No module named 'h5py'"),
        ("h5.so: failed to map segment from shared object", "a.x: does not fit into memory"),
    ],
)
def test_too_little_memory_is_no_missing_package(
    error: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A library that cannot be loaded for want of memory raises ImportError."""

    def missing(path: Path) -> None:
        raise ImportError(error)

    monkeypatch.setitem(registry.FORMATS, "x", registry.Format("x", "X", (".x",), lambda *_: True, read=missing))
    (tmp_path / "a.x").write_text("x")
    with pytest.raises(ReadError, match=message):
        io.read(tmp_path / "a.x", file_format="x")


@pytest.mark.parametrize(
    ("error", "expected"),
    [
        (MemoryError(), True),
        (OSError(errno.ENOMEM, "Cannot allocate memory"), True),
        (ImportError("x.so: cannot map: Cannot allocate memory"), True),
        (RuntimeError("std::bad_alloc"), True),
        (ImportError("No module named 'x'"), False),
        (OSError(errno.ENOENT, "no such file"), False),
    ],
)
def test_what_is_for_want_of_memory(error: BaseException, expected: bool) -> None:
    assert is_out_of_memory(error) is expected
    outer = ReadError("why")
    outer.__cause__ = error
    assert is_out_of_memory(outer) is expected


# Points of a cube, its faces, and files that are wrong in one line: the files, the one that is wrong, the line.
NODES = "4 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n"
ONE = "1 4 0\n1 1 2 3 4\n"
EDGES = "OVM ASCII\nVertices\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\nEdges\n3\n0 1\n0 2 3\n1 2\nFaces\n0\nPolyhedra\n0\n"
WRONG = {
    "hedra face": ({"a.hedra": f"8 6 1\n{CUBE}{FACES.replace('3 7 6', '3 99 6')}6 1 2 3 4 5 6\n"}, "a.hedra", 13),
    "hedra cell": ({"a.hedra": f"8 6 1\n{CUBE}{FACES}6 1 2 3 4 5 7\n"}, "a.hedra", 16),
    "hedra with blanks": ({"a.hedra": f"8 6 1\n\n{CUBE}\n{FACES}6 1 2 3 4 -9 6\n"}, "a.hedra", 18),
    "tetgen twice": ({"a.node": NODES.replace("\n3", "\n2"), "a.ele": ONE}, "a.node", 4),
    "tetgen number": ({"a.node": NODES.replace("\n3", "\n2.5"), "a.ele": ONE}, "a.node", 4),
    "tetgen point": ({"a.node": NODES, "a.ele": "3 4 0\n1 1 2 3 4\n2 1 2 3 9\n3 1 2 3 4\n"}, "a.ele", 3),
    "tetgen node": ({"a.node": NODES, "a.ele": "3 4 0\n1 1 2 3 4\n2 1 2.5 3 4\n3 1 2 3 4\n"}, "a.ele", 3),
    "rf point": (
        {"a.node": NODES, "a.ele": "# RF\n1 0\n0 4\n 0 3 1 3 2\n 1 3 1 2 4\n 2 3 2 3 9\n 3 3 1 4 3\n"}, "a.ele", 6),
    "rf face": (
        {"a.node": NODES, "a.ele": "# RF\n1 0\n0 4\n 0 3 1 3 2\n 1 2 1 2\n 2 3 2 3 4\n 3 3 1 4 3\n"}, "a.ele", 5),
    "ovm edge": ({"a.ovm": EDGES}, "a.ovm", 11),
    "unv label": ({"a.unv": "    -1\n  2411\n1 1 1 11\n0 0 0\n1e20 1 1 11\n1 0 0\n    -1\n"}, "a.unv", 5),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_the_line_is_the_one_that_is_wrong(name: str, tmp_path: Path) -> None:
    files, wrong, line = WRONG[name]
    for file, text in files.items():
        (tmp_path / file).write_text(text)
    opened = next(file for file in files if not file.endswith(".node"))
    with pytest.raises(ReadError, match=rf"{wrong}, line {line}: "):
        io.read(tmp_path / opened)


REAL = re.compile(rb"(?<![\w.])-?\d*\.\d+(?:[eEdD+-][-+]?\d+)?(?![\w.])")
INTEGER = re.compile(rb"(?<![\w.])\d+(?![\w.])")
TEXTS = [
    *(
        "abaqus",
        "su2",
        "nastran",
        "gmsh 2.2",
        "gmsh 4.0",
        "gmsh 4.1",
        "ansys",
        "lsdyna",
        "unv",
        "tetgen",
        "rf",
        "mfem",
        "ugrid",
    ),
    *("netgen", "avs", "flac3d", "hedra", "elmer", "fluent", "ovm", "medit", "vtk", "vtk single"),
]


@pytest.mark.usefixtures("readers_here")
@pytest.mark.parametrize("name", TEXTS)
def test_the_line_of_a_word_that_is_no_number_is_named(name: str, tmp_path: Path) -> None:
    """In the midst of blocks of numbers that are read at once."""
    path = PATCHED[name][1](tmp_path)
    for file in [one for one in tmp_path.iterdir() if one.is_file()]:
        data = file.read_bytes()
        for words, share in ((list(REAL.finditer(data)), 0.5), (list(INTEGER.finditer(data)), 0.75)):
            if len(words) < 20:
                continue
            word = words[int(share * len(words))]
            file.write_bytes(data[: word.start()] + b"x" * len(word[0]) + data[word.end() :])
            line = data.count(b"\n", 0, word.start()) + 1
            with pytest.raises(ReadError, match=rf"line {line}\b"):
                io.read(path)
            file.write_bytes(data)


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.szplt", "#!SZPLT", "subzone files .* are read by Tecplot's own library only; save it as .plt"),
        ("a.plt", "#!SZPLT", "subzone files"),
        ("a.mesh", "MFEM NURBS mesh v1.0\n\ndimension\n3\n", "NURBS meshes of MFEM are not read"),
    ],
)
def test_what_no_reader_knows_is_refused_by_name(name: str, text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(ReadError, match=message):
        io.read(tmp_path / name)
