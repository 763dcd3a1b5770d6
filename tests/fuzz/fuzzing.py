"""Small whole files of every format, ways to break them, and what reading a broken one came to."""

from __future__ import annotations

import contextlib
import io as text_io
import os
import signal
import sys
import traceback
from collections.abc import Iterator
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "io"))
from cgns_files import mixed, polyhedral
from fluent_files import cff
from io_meshes import mesh_of
from ovm_files import ovmb
from plt_files import Zone, drawing, plt

from meshgauge import io
from meshgauge.errors import ReadError
from meshgauge.io import registry

HERE = Path(__file__).resolve().parent
SECONDS = 20
"""More than any reader may take for one of these files in the process of the caller."""
os.environ.setdefault("MESHGAUGE_READ_SECONDS", "12")  # and less than that for one in a process of its own

_WRITTEN = (
    ".vtu",
    ".vtk",
    ".vtkhdf",
    ".msh",
    ".mesh",
    ".meshb",
    ".su2",
    ".inp",
    ".avs",
    ".b8.ugrid",
    ".lr8.ugrid",
    ".ugrid",
    ".med",
    ".xdmf",
)
_FOAM = 'FoamFile\n{{ version 2.0; format ascii; class {}; note "nPoints:8 nCells:1 nFaces:6"; object {}; }}\n'
_CUBE = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n"
_FACES = ("0 3 2 1", "4 5 6 7", "0 1 5 4", "1 2 6 5", "2 3 7 6", "3 0 4 7")
_TETRA = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n"


_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))


def _half_edges(face: str) -> str:
    """The half-edges around a face of the cube, their number first."""
    ring = [int(v) for v in face.split()]
    sides = zip(ring, [*ring[1:], ring[0]], strict=True)
    ids = (2 * _EDGES.index((a, b)) if (a, b) in _EDGES else 2 * _EDGES.index((b, a)) + 1 for a, b in sides)
    return f"4 {' '.join(map(str, ids))}"


def _numbered(text: str, first: int = 1) -> str:
    return "".join(f"{i} {line}\n" for i, line in enumerate(text.splitlines(), first))


TEXTS: dict[str, dict[str, str]] = {
    "mfem": {
        "a.mesh": "MFEM mesh v1.0\n\ndimension\n3\n\nelements\n1\n1 5 0 1 2 3 4 5 6 7\n\nboundary\n1\n2 3 0 1 2 3\n\n"
        f"vertices\n8\n3\n{_CUBE}"
    },
    "gmsh": {"a.msh": "$NOD\n4\n" + _numbered(_TETRA) + "$ENDNOD\n$ELM\n1\n1 4 1 1 4 1 2 3 4\n$ENDELM\n"},
    "gmsh 4.0": {
        "a.msh": "$MeshFormat\n4 0 8\n$EndMeshFormat\n$Entities\n0 0 0 1\n1 0 0 0 1 1 1 0 0\n$EndEntities\n"
        f"$Nodes\n1 4\n1 3 0 4\n{_numbered(_TETRA)}$EndNodes\n$Elements\n1 1\n1 3 4 1\n1 1 2 3 4\n$EndElements\n"
    },
    "mfem curved": {
        "a.mesh": "MFEM mesh v1.0\ndimension\n3\nelements\n1\n1 4 0 1 2 3\nboundary\n0\nvertices\n4\nnodes\n"
        f"FiniteElementSpace\nFiniteElementCollection: H1_3D_P1\nVDim: 3\nOrdering: 1\n{_TETRA}"
    },
    "mfem nc": {
        "a.mesh": "MFEM NC mesh v1.0\n\ndimension\n3\n\nelements\n3\n-1 1 4 7 1 2\n0 1 4 0 0 1 2 4\n0 1 4 0 4 1 2 3\n\n"
        f"boundary\n1\n2 2 0 1 2\n\nvertex_parents\n1\n4 0 3\n\nroot_state\n1\n0\n\ncoordinates\n4\n3\n{_TETRA}"
        "\nmfem_mesh_end\n"
    },
    "hedra": {
        "a.hedra": "8 6 1\n" + _CUBE + "".join(f"4 {' '.join(str(int(v) + 1) for v in f.split())}\n" for f in _FACES)
        + "6 1 2 3 4 5 6\n"
    },
    "ovm": {
        "a.ovm": f"OVM ASCII\nVertices\n8\n{_CUBE}Edges\n12\n" + "".join(f"{a} {b}\n" for a, b in _EDGES)
        + "Faces\n6\n" + "".join(f"{_half_edges(face)}\n" for face in _FACES)
        + "Polyhedra\n1\n6 0 2 4 6 8 10\nCell_Property int \"m\"\n1\n"
    },
    "rf": {
        "a.ele": "# RF\n1 0\n0 6\n" + "".join(f" {i} 4 {f}\n" for i, f in enumerate(_FACES)),
        "a.node": "8 3 0 0\n" + _numbered(_CUBE, 0),
    },
    "lsdyna": {
        "a.k": "*KEYWORD\n*NODE\n"
        + "".join("{:8d}{:>16}{:>16}{:>16}\n".format(i, *line.split()) for i, line in enumerate(_CUBE.splitlines(), 1))
        + "*ELEMENT_SOLID\n" + "".join(f"{i:8d}" for i in (1, 1, *range(1, 9))) + "\n*END\n"
    },
    "tetgen": {"a.ele": "1 4 1\n1 1 2 3 4 7\n# end\n", "a.node": "4 3 0 0\n" + _numbered(_TETRA)},
    "elmer": {
        "mesh.names": "! ----- names for bodies -----\n$ iron = 1\n! ----- names for boundaries -----\n$ wall = 2\n",
        "mesh.boundary": "1 2 1 0 303 1 2 3\n", "mesh.elements": "1 1 504 1 2 3 4\n",
        "mesh.nodes": "".join(f"{i} -1 {line}\n" for i, line in enumerate(_TETRA.splitlines(), 1)),
        "mesh.header": "4 1 1\n2\n303 1\n504 1\n",
    },
    "frontistr": {
        "a.msh": "!HEADER\n x\n!NODE\n" + _numbered(_TETRA).replace(" ", ", ")
        + "!ELEMENT, TYPE=341, EGRP=E\n1, 1, 2,\n3, 4\n!EGROUP, EGRP=F, GENERATE\n1, 1, 1\n"
        "!SECTION, TYPE=SOLID, EGRP=E, MATERIAL=M\n1.0\n!END\n"
    },
    "femap": {
        "a.neu": "   -1\n   100\n<NULL>\n8.2,\n   -1\n   -1\n   403\n" + "".join(
            f"{i},0,0,1,46,0,0,0,0,0,0,{line.replace(' ', ',')},\n" for i, line in enumerate(_TETRA.splitlines(), 1))
        + "   -1\n   -1\n   404\n1,1,1,25,6,1,0,0,\n1,2,3,0,4,0,0,0,0,0,\n" + "0," * 10 + "\n" + "0.,0.,0.,\n" * 3
        + "0," * 16 + "\n   -1\n   -1\n   402\n1,1,0,25,1,0,\niron\n0,0,0,0,\n   -1\n"
    },
    "plot3d": {"a.xyz": "2\n2 2 2\n2 2 2\n" + "0.5 1 2 3 4 5 6 7\n" * 6},
    "unv": {
        "a.unv": "    -1\n  2411\n"
        + "".join(f"{i} 1 1 11\n{line}\n" for i, line in enumerate(_TETRA.replace("1", "1.0D+00").splitlines(), 1))
        + "    -1\n    -1\n  2412\n1 111 1 2 7 4\n1 2 3 4\n    -1\n"
        + "    -1\n  2467\n1 0 0 0 0 0 0 1\nG\n8 1 0 0\n    -1\n"
    },
    "fluent": {
        "a.msh": '(0 "a")\n(2 3)\n(10 (0 1 8 0))\n(12 (0 1 1 0))\n(13 (0 1 6 0))\n(12 (2 1 1 1 4))\n(10 (1 1 8 1 3)(\n'
        + _CUBE + "))\n(13 (3 1 6 3 4)(\n"
        + "".join(" ".join(f"{int(v) + 1:x}" for v in reversed(f.split())) + " 1 0\n" for f in _FACES)
        + "))\n(45 (2 fluid air)())\n(45 (3 wall side)())\n"
    },
    "openfoam": {
        "constant/polyMesh/points": _FOAM.format("vectorField", "points")
        + "8\n(\n" + "".join(f"({line})\n" for line in _CUBE.splitlines()) + ")\n",
        "constant/polyMesh/faces": _FOAM.format("faceList", "faces")
        + "6\n(\n" + "".join(f"4({f})\n" for f in _FACES) + ")\n",
        "constant/polyMesh/owner": _FOAM.format("labelList", "owner") + "6\n(\n0\n0\n0\n0\n0\n0\n)\n",
        "constant/polyMesh/neighbour": _FOAM.format("labelList", "neighbour") + "0\n()\n",
        "constant/polyMesh/boundary": _FOAM.format("polyBoundaryMesh", "boundary")
        + "1\n(\nwall\n{\n type wall;\n nFaces 6;\n startFace 0;\n}\n)\n",
        "a.foam": " ",
    },
    "abaqus": {
        "b.inp": "*HEADING\n x\n*PART, NAME=P\n*NODE\n" + _numbered(_TETRA).replace(" ", ", ")
        + "*ELEMENT, TYPE=C3D4, ELSET=ALL\n1, 1, 2,\n3, 4\n*ELSET, ELSET=S, GENERATE\n1, 1, 1\n"
        "*SOLID SECTION, ELSET=ALL, MATERIAL=STEEL\n*END PART\n*ASSEMBLY, NAME=A\n*INSTANCE, NAME=I, PART=P\n1,0,0\n"
        "0,0,0,0,0,1,90.\n*END INSTANCE\n*END ASSEMBLY\n"
    },
    "ansys": {
        "a.cdb": "/COM,ANSYS RELEASE 19.4\n/PREP7\nET, 1,186\nET, 2,187\nKEYOP,1,2,1\n"
        "NBLOCK,6,SOLID,  8,  8\n(3i5,6e9.2)\n"
        + "".join(f"{i:5d}    0    0" + "".join(f"{float(v):9.2f}" for v in line.split()) + "\n"
                  for i, line in enumerate(_CUBE.splitlines(), 1))
        + "N,R5.3,LOC,       -1,\nEBLOCK,19,SOLID,  3,  3\n(19i5)\n"
        + "".join("".join(f"{v:5d}" for v in (1, kind, 1, 1, 0, 0, 0, 0, len(nodes), 0, number, *nodes[:8])) + "\n"
                  + ("".join(f"{v:5d}" for v in nodes[8:]) + "\n" if len(nodes) > 8 else "")
                  for number, (kind, nodes) in enumerate((
                      (1, (1, 2, 3, 4, 5, 6, 7, 8, *[0] * 12)), (1, (1, 2, 3, 3, 5, 6, 7, 7)), (2, (1, 2, 4, 5)))))
        + "   -1\nCMBLOCK,SOME,ELEM, 2  ! of elements\n(8i5)\n    1   -2\n"
    },
    "ansys one by one": {
        "a.cdb": "/PREP7\nET,1,285\n" + "".join(f"N,{i},{line.replace(' ', ',')}\n" for i, line in enumerate(
            _TETRA.splitlines(), 1))
        + "MAT,2\nE,1,2,3,4\nEN,R5.5,ATTR,4,1,1,1,1,0,9,0,0,0\nEN,R5.5,NODE,1,2,3,4\nEN,R5.5,ATTR,-1\n"
    },
    "gambit": {
        "a.neu": "        CONTROL INFO 1.2.1\n** GAMBIT NEUTRAL FILE\nx\nPROGRAM: Gambit\n1 Jan\n"
        " NUMNP NELEM NGRPS NBSETS NDFCD NDFVL\n"
        f"4 1 1 0 3 3\nENDOFSECTION\n   NODAL COORDINATES 1.2.1\n{_numbered(_TETRA)}ENDOFSECTION\n"
        "      ELEMENTS/CELLS 1.2.1\n1 6 4 1 2 3 4\nENDOFSECTION\n       ELEMENT GROUP 1.2.1\n"
        "GROUP: 1 ELEMENTS: 1 MATERIAL: 2 NFLAGS: 1\nfluid\n0\n1\nENDOFSECTION\n"
    },
    "tecplot": {
        "a.tec": 'TITLE = "a"\nVARIABLES = "X" "Y" "Z" "P"\nZONE N=4, E=1, F=FEBLOCK, ET=TETRAHEDRON, '
        "VARLOCATION=([4]=CELLCENTERED)\n0 1 0 0\n0 0 1 0\n3*0 1\n7\n1 2 3 4\nZONE I=2, J=2, K=2, F=POINT\n"
        + "".join(f"{line} 1\n" for line in _CUBE.splitlines())
    },
    "nastran": {
        "a.bdf": "SOL 101\nBEGIN BULK\nCORD2C,1,0,0.,0.,0.,0.,0.,1.,\n,1.,0.,0.\n" + "".join(
            f"GRID,{i},,{line.replace(' ', ',')}\n" for i, line in enumerate(
                _TETRA.replace("0", "0.").replace("1", "1.").splitlines(), 1))
        + "GRID*   5               1               1.0             9.0+1           \n*       1.5-3\nPSOLID,1,2\n"
        "CTETRA,1,1,1,2,3,4\nCTETRA  2       1       1       2       3       5\nENDDATA\n"
    },
}  # fmt: skip
"""Format → its files by name; the last of them is the one to read."""

OWN = ("vtu", "vtkhdf", "gmsh", "su2", "mfem", "hedra", "rf", "tetgen", "unv", "fluent", "openfoam", "abaqus", "exodus",
       "ansys", "ovm", "gambit", "tecplot", "med", "nastran", "cgns", "ugrid", "medit",
       "lsdyna", "elmer", "frontistr", "femap", "tecplot-binary", "plot3d",
       "vtk")  # fmt: skip
"""Formats whose readers run in the process of the caller."""


def exodus_classic(path: Path) -> None:
    """A tetrahedron in a classic netCDF file, written byte by byte."""

    def number(*values: int) -> bytes:
        return b"".join(v.to_bytes(4, "big") for v in values)

    def name(text: str) -> bytes:
        return number(len(text)) + text.encode() + b"\0" * (-len(text) % 4)

    coords = np.array([line.split() for line in _TETRA.splitlines()], ">f8").T
    arrays = [(f"coord{axis}", (0,), 6, coords[i].tobytes(), b"") for i, axis in enumerate("xyz")]
    element = number(12, 1) + name("elem_type") + number(2, 4) + b"TET4"
    arrays.append(("connect1", (1, 2), 4, np.array([1, 2, 3, 4], ">i4").tobytes(), element))
    dimensions = number(10, 3) + name("num_nodes") + number(4) + name("n_el") + number(1) + name("n_per") + number(4)

    def header(begins: list[int]) -> bytes:
        text = b"CDF\x01" + number(0) + dimensions + number(0, 0) + number(11, len(arrays))
        for (key, ids, kind, raw, attributes), begin in zip(arrays, begins, strict=True):
            text += name(key) + number(len(ids), *ids) + (attributes or number(0, 0)) + number(kind, len(raw), begin)
        return text

    begins, at = [], len(header([0] * len(arrays)))
    for *_, raw, _ in arrays:
        begins.append(at)
        at += len(raw)
    path.write_bytes(header(begins) + b"".join(raw for *_, raw, _ in arrays))


def seeds(folder: Path) -> Iterator[tuple[str, Path, list[Path]]]:
    """Format, the file to read and all files, of one whole mesh of each format and encoding."""
    mesh = mesh_of("tetra", "pyramid", "wedge", "hexahedron", n=1)
    mesh = mesh.replace(cell_data={"material": np.arange(mesh.n_cells)}, point_data={"u": mesh.points[:, 0]})
    for extension in _WRITTEN:
        path = folder / f"written{extension}" / f"a{extension}"
        path.parent.mkdir(parents=True)
        io.write(path, mesh)
        head = path.read_bytes()[:4096]
        yield registry.detect(path, head).name, path, [path]
    for number, (name, files) in enumerate(TEXTS.items()):
        paths = []
        for file, text in files.items():
            path = folder / str(number) / file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
            paths.append(path)
        yield name.split()[0], (paths[0] if name in ("rf", "tetgen") else paths[-1]), paths
    classic = folder / "classic" / "a.e"
    classic.parent.mkdir()
    exodus_classic(classic)
    yield "exodus", classic, [classic]
    binary = ovmb(folder / "classic" / "a.ovmb", mesh_of("tetra", "penta_prism", n=1))
    yield "ovm", binary, [binary]
    fluent = cff(folder / "classic" / "a.cas.h5", mesh)
    yield "fluent", fluent, [fluent]
    for order in "<>":
        path = folder / "classic" / f"{'little' if order == '<' else 'big'}.x"
        head = np.array([4, 1, 4, 12, 2, 2, 2, 12, 192], f"{order}i4").tobytes()
        path.write_bytes(head + np.arange(24.0).astype(f"{order}f8").tobytes() + head[-4:])
        yield "plot3d", path, [path]
    for version in (102, 111, 112):
        points = [*np.array([line.split() for line in _TETRA.splitlines()], float).T]
        zones = [Zone(points, "tetra", np.arange(4)[None], n_points=4, strand=0),
                 Zone([np.arange(8.0)] * 3, shape=(2, 2, 2))]  # fmt: skip
        path = plt(folder / "classic" / f"{version}.plt", "XYZ", zones, version=version, extra=drawing())
        yield "tecplot-binary", path, [path]
    for path in (mixed(folder / "classic" / "a.cgns", mesh), polyhedral(folder / "classic" / "b.cgns", mesh)):
        yield "cgns", path, [path]
    for file in sorted((HERE / "seeds").glob("*")) if (HERE / "seeds").is_dir() else []:
        yield registry.detect(file, file.read_bytes()[:4096]).name, file, [file]


NUMBERS = (
    b"0",
    b"-1",
    b"1",
    b"4",
    b"255",
    b"65536",
    b"2147483647",
    b"-2147483648",
    b"99999999999",
    b"9" * 30,
    b"nan",
    b"1e308",
)


def broken(rng: np.random.Generator, data: bytes) -> bytes:
    """The bytes with one to three things done to them that happen to files, or that someone does on purpose."""
    for _ in range(int(rng.integers(1, 4))):
        if not data:
            return data
        at = int(rng.integers(len(data)))
        match int(rng.integers(8)):
            case 0:  # a bit or a byte changes
                data = data[:at] + bytes([int(rng.integers(256))]) + data[at + 1 :]
            case 1:  # cut off
                data = data[:at]
            case 2:  # a piece is missing
                data = data[:at] + data[at + int(rng.integers(1, 40)) :]
            case 3:  # a piece is there twice
                piece = data[at : at + int(rng.integers(1, 200))]
                data = data[:at] + piece * int(rng.integers(2, 4)) + data[at:]
            case 4:  # a number in a text becomes another
                end = at
                while end < len(data) and data[end : end + 1].isdigit():
                    end += 1
                data = data[:at] + NUMBERS[int(rng.integers(len(NUMBERS)))] + data[max(end, at + 1) :]
            case 5:  # a binary number becomes huge or negative
                width = int(rng.choice([4, 8]))
                value = int(rng.choice([-1, 2**31 - 1, -(2**31), 2**20, 0]))
                data = data[:at] + value.to_bytes(width, "little", signed=True) + data[at + width :]
            case 6:  # zeros, as after a crash of a disk
                n = int(rng.integers(1, 64))
                data = data[:at] + b"\0" * n + data[at + n :]
            case 7:  # two pieces change places
                other = int(rng.integers(len(data)))
                a, b, n = min(at, other), max(at, other), int(rng.integers(1, 20))
                data = data[:a] + data[b : b + n] + data[a + n : b] + data[a : a + n] + data[b + n :]
    return data


class Hang(BaseException):
    """Raised in a reader that takes too long."""


def attempt(path: Path) -> str:
    """Read a file: "read", "refused", or what went wrong, with its traceback."""

    def ring(*_: object) -> None:
        raise Hang

    before = signal.signal(signal.SIGALRM, ring)
    signal.alarm(SECONDS)
    out = text_io.StringIO()
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
            io.read(path)
        result = "read"
    except ReadError as error:
        result = "refused" if str(path.parent) in str(error) else f"no file name: {error}"
        if str(error).count(str(path)) > 1:
            result = f"names the file twice: {error}"
    except Hang:
        result = f"hang:\n{traceback.format_exc()}"
    except BaseException:
        result = f"traceback:\n{traceback.format_exc()}"
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
    return result if not out.getvalue() else f"printed {out.getvalue()[:200]!r}"
