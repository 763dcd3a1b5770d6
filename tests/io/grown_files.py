"""Files of any size of every format that has a reader of ours: ``n`` tetrahedra apart from each other, ``n`` names."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from cgns_files import base, put, section, zone
from io_meshes import mesh_of
from ovm_files import ovm
from plt_files import Zone, plt

from meshgauge import io
from meshgauge.mesh import CellBlock, Mesh

CORNERS = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
FACES = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3))
"""Of a tetrahedron, with normals out of it."""


def points(n: int) -> list[tuple[int, int, int]]:
    return [(x + 2 * cell, y, z) for cell in range(n) for x, y, z in CORNERS]


def rows(lines: object, separator: str = " ", first: int | None = None) -> str:
    """A line for each tuple, with its number before it if counted from ``first``."""
    text = []
    for number, line in enumerate(lines):  # type: ignore[call-overload]
        words = line if first is None else (number + first, *line)
        text.append(separator.join(map(str, words)) + "\n")
    return "".join(text)


def tetra(n: int, first: int = 1) -> list[tuple[int, ...]]:
    return [tuple(4 * cell + k + first for k in range(4)) for cell in range(n)]


def named(n: int) -> Mesh:
    """Each cell a block of its own."""
    return mesh_of("tetra", n=n).replace(blocks=tuple(CellBlock(f"part {cell}", cell, cell + 1) for cell in range(n)))


def written(name: str) -> Callable[[Path, int], Path]:
    def make(folder: Path, n: int) -> Path:
        io.write(folder / name, named(n))
        return folder / name

    return make


def text(name: str, content: Callable[[int], str | dict[str, str]]) -> Callable[[Path, int], Path]:
    def make(folder: Path, n: int) -> Path:
        files = content(n)
        for file, body in ({name: files} if isinstance(files, str) else files).items():
            (folder / file).parent.mkdir(parents=True, exist_ok=True)
            (folder / file).write_text(body)
        return folder / name

    return make


def vtk(n: int) -> str:
    data = "".join(f"a{k} 1 {n} int\n{'1 ' * n}\n" for k in range(5))
    return (
        f"# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {4 * n} double\n{rows(points(n))}"
        f"CELLS {n} {5 * n}\n{rows([(4, *ids) for ids in tetra(n, 0)])}CELL_TYPES {n}\n{'10 ' * n}\n"
        f"CELL_DATA {n}\nFIELD f 5\n{data}"
    )


def gmsh(n: int) -> str:
    """Each volume is in two groups, so that every name becomes data of its own."""
    names = "".join(f'3 {k} "group {k}"\n' for k in range(1, n + 1))
    volumes = "".join(f"{k} 0 0 0 1 1 1 2 {k} {k % n + 1} 0\n" for k in range(1, n + 1))
    nodes = rows([(k,) for k in range(1, 4 * n + 1)]) + rows(points(n))
    elements = "".join(f"3 {k} 4 1\n{k} {' '.join(map(str, ids))}\n" for k, ids in enumerate(tetra(n), 1))
    return (
        f"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n{n}\n{names}$EndPhysicalNames\n"
        f"$Entities\n0 0 0 {n}\n{volumes}$EndEntities\n"
        f"$Nodes\n1 {4 * n} 1 {4 * n}\n3 1 0 {4 * n}\n{nodes}$EndNodes\n"
        f"$Elements\n{n} {n} 1 {n}\n{elements}$EndElements\n"
    )


def mfem(n: int) -> str:
    cells = rows([(1, 4, *ids) for ids in tetra(n, 0)])
    return f"MFEM mesh v1.0\ndimension\n3\nelements\n{n}\n{cells}boundary\n0\nvertices\n{4 * n}\n3\n{rows(points(n))}"


def hedra(n: int) -> str:
    faces = rows([(3, *(4 * cell + k + 1 for k in face)) for cell in range(n) for face in FACES])
    cells = rows([(4, *(4 * cell + k + 1 for k in range(4))) for cell in range(n)])
    return f"{4 * n} {4 * n} {n}\n{rows(points(n))}{faces}{cells}"


def rf(n: int) -> dict[str, str]:
    cells = "".join(
        f"{cell} 4\n" + rows([(k, 3, *(4 * cell + node for node in face)) for k, face in enumerate(FACES)])
        for cell in range(n)
    )
    return {"a.node": f"{4 * n} 3 0 0\n{rows(points(n), first=0)}", "a.ele": f"{n} 0\n{cells}"}


def tetgen(n: int) -> dict[str, str]:
    return {
        "a.node": f"{4 * n} 3 0 0\n{rows(points(n), first=1)}",
        "a.ele": f"{n} 4 1\n" + rows([(*ids, k) for k, ids in enumerate(tetra(n))], first=1),
    }


def unv(n: int) -> str:
    nodes = "".join(f"{k} 1 1 11\n{x} {y} {z}\n" for k, (x, y, z) in enumerate(points(n), 1))
    cells = "".join(f"{k} 111 1 1 7 4\n{' '.join(map(str, ids))}\n" for k, ids in enumerate(tetra(n), 1))
    groups = "".join(f"{k} 0 0 0 0 0 0 1\ngroup {k}\n8 {k} 0 0\n" for k in range(1, n + 1))
    return "".join(
        f"    -1\n  {number}\n{body}    -1\n" for number, body in ((2411, nodes), (2412, cells), (2467, groups))
    )


def fluent(n: int) -> str:
    faces = "".join(
        f"(13 ({cell + 2:x} {4 * cell + 1:x} {4 * cell + 4:x} 3 3)(\n"
        + "".join(" ".join(f"{4 * cell + k + 1:x}" for k in reversed(face)) + f" {cell + 1:x} 0\n" for face in FACES)
        + f"))\n(45 ({cell + 2} wall side-{cell})())\n"
        for cell in range(n)
    )
    return (
        f'(0 "a")\n(2 3)\n(10 (0 1 {4 * n:x} 0))\n(12 (0 1 {n:x} 0))\n(13 (0 1 {4 * n:x} 0))\n(12 (1 1 {n:x} 1 2))\n'
        f"(10 (1 1 {4 * n:x} 1 3)(\n{rows(points(n))}))\n{faces}(45 (1 fluid air)())\n"
    )


def openfoam(n: int) -> dict[str, str]:
    head = "FoamFile {{ version 2.0; format ascii; class x; object {}; }}\n"
    lists = {
        "points": rows([(f"({x} {y} {z})",) for x, y, z in points(n)]),
        "faces": rows([(f"3({' '.join(str(4 * cell + k) for k in face)})",) for cell in range(n) for face in FACES]),
        "owner": rows([(cell,) for cell in range(n) for _ in FACES]),
        "neighbour": "",
        "boundary": "".join(f"p{k} {{ type wall; nFaces 4; startFace {4 * k}; }}\n" for k in range(n)),
    }
    sizes = {"points": 4 * n, "faces": 4 * n, "owner": 4 * n, "neighbour": 0, "boundary": n}
    files = {
        f"constant/polyMesh/{name}": f"{head.format(name)}{sizes[name]}\n(\n{body})\n" for name, body in lists.items()
    }
    return {**files, "a.foam": " "}


def abaqus(n: int) -> str:
    sets = "".join(f"*ELSET, ELSET=S{k}\n{k}\n" for k in range(1, n + 1))
    return (
        f"*NODE\n{rows(points(n), ', ', 1)}*ELEMENT, TYPE=C3D4, ELSET=ALL\n{rows(tetra(n), ', ', 1)}{sets}"
        "*SOLID SECTION, ELSET=ALL, MATERIAL=STEEL\n"
    )


def ansys(n: int) -> str:
    nodes = "".join(f"{k:9d}{0:9d}{0:9d}{x:13.5E}{y:13.5E}{z:13.5E}\n" for k, (x, y, z) in enumerate(points(n), 1))
    cells = "".join(
        "".join(f"{v:9d}" for v in (1, 1, 1, 1, 0, 0, 0, 0, 4, 0, k, *ids)) + "\n" for k, ids in enumerate(tetra(n), 1)
    )
    sets = "".join(f"CMBLOCK,S{k},ELEM,1\n(8i10)\n{k:10d}\n" for k in range(1, n + 1))
    return (
        f"/PREP7\nET,1,285\nNBLOCK,6,SOLID,{4 * n},{4 * n}\n(3i9,6e13.5)\n{nodes}N,R5.3,LOC,-1,\n"
        f"EBLOCK,19,SOLID,{n},{n}\n(19i9)\n{cells}       -1\n{sets}"
    )


def gambit(n: int) -> str:
    cells = rows([(k, 6, 4, *ids) for k, ids in enumerate(tetra(n), 1)])
    groups = "".join(
        f"       ELEMENT GROUP 1.2.1\nGROUP: {k} ELEMENTS: 1 MATERIAL: 2 NFLAGS: 1\ngroup {k}\n0\n{k}\nENDOFSECTION\n"
        for k in range(1, n + 1)
    )
    return (
        "        CONTROL INFO 1.2.1\n** GAMBIT NEUTRAL FILE\nx\nPROGRAM: Gambit\n1 Jan\n"
        f" NUMNP NELEM NGRPS NBSETS NDFCD NDFVL\n{4 * n} {n} {n} 0 3 3\nENDOFSECTION\n"
        f"   NODAL COORDINATES 1.2.1\n{rows(points(n), first=1)}ENDOFSECTION\n"
        f"      ELEMENTS/CELLS 1.2.1\n{cells}ENDOFSECTION\n{groups}"
    )


def tecplot(n: int) -> str:
    zones = "".join(
        f'ZONE T="zone {cell}" N=4, E=1, F=FEPOINT, ET=TETRAHEDRON\n{rows(points(n)[4 * cell : 4 * cell + 4])}1 2 3 4\n'
        for cell in range(n)
    )
    return f'TITLE = "a"\nVARIABLES = "X" "Y" "Z"\n{zones}'


def nastran(n: int) -> str:
    grids = "".join(f"GRID,{k},,{x}.,{y}.,{z}.\n" for k, (x, y, z) in enumerate(points(n), 1))
    cells = "".join(f"CTETRA,{k},{k},{','.join(map(str, ids))}\nPSOLID,{k},{k}\n" for k, ids in enumerate(tetra(n), 1))
    return f"BEGIN BULK\n{grids}{cells}ENDDATA\n"


def lsdyna(n: int) -> str:
    """A part for each cell."""
    nodes = "".join(f"{k:8d}{x:16.1f}{y:16.1f}{z:16.1f}\n" for k, (x, y, z) in enumerate(points(n), 1))
    cells = "".join(
        "".join(f"{v:8d}" for v in (k, k, *ids, *(ids[3:] * 4))) + "\n" for k, ids in enumerate(tetra(n), 1)
    )
    parts = "".join(f"*PART\npart number {k}\n{k:10d}\n" for k in range(1, n + 1))
    return f"*KEYWORD\n*NODE\n{nodes}*ELEMENT_SOLID\n{cells}{parts}*END\n"


def elmer(n: int) -> dict[str, str]:
    """A body for each cell."""
    return {
        "mesh.header": f"{4 * n} {n} 0\n1\n504 {n}\n",
        "mesh.boundary": "",
        "mesh.nodes": rows([(-1, *x) for x in points(n)], first=1),
        "mesh.elements": rows([(k, 504, *ids) for k, ids in enumerate(tetra(n), 1)], first=1),
        "mesh.names": "! bodies\n" + "".join(f"$ body {k} = {k}\n" for k in range(1, n + 1)),
    }


def frontistr(n: int) -> str:
    groups = "".join(f"!EGROUP, EGRP=S{k}\n{k}\n" for k in range(1, n + 1))
    return (
        f"!HEADER\n x\n!NODE\n{rows(points(n), ', ', 1)}!ELEMENT, TYPE=341\n{rows(tetra(n), ', ', 1)}{groups}"
        "!SECTION, TYPE=SOLID, EGRP=ALL, MATERIAL=M1\n!END\n"
    )


def femap(n: int) -> str:
    """A property for each cell."""
    names = "".join(f"{k},1,0,25,1,0,\nproperty {k}\n0,0,0,0,\n" for k in range(1, n + 1))
    nodes = "".join(f"{k},0,0,1,46,0,0,0,0,0,0,{x},{y},{z},\n" for k, (x, y, z) in enumerate(points(n), 1))
    flags = "0.,0.,0.,\n" * 3 + "0," * 16 + "\n"
    cells = "".join(
        f"{k},1,{k},25,6,1,0,0,\n{a},{b},{c},0,{d},0,0,0,0,0,\n{'0,' * 10}\n{flags}"
        for k, (a, b, c, d) in enumerate(tetra(n), 1)
    )
    blocks = ((100, "<NULL>\n8.2,\n"), (402, names), (403, nodes), (404, cells))
    return "".join(f"   -1\n   {number}\n{body}   -1\n" for number, body in blocks)


def tecplot_binary(folder: Path, n: int) -> Path:
    """A zone for each cell."""
    zones = [Zone([*np.array(points(n)[4 * k : 4 * k + 4], float).T], "tetra", np.arange(4)[None], n_points=4,
                  name=f"zone {k}") for k in range(n)]  # fmt: skip
    return plt(folder / "a.plt", ("X", "Y", "Z"), zones)


def plot3d(n: int) -> str:
    """A hexahedron a block."""
    cubes = "".join(
        " ".join(str(float(c) + 2 * k * (axis == 0)) for c in values) + "\n"
        for k in range(n)
        for axis, values in enumerate(("01010101", "00110011", "00001111"))
    )
    return f"{n}\n{'2 2 2 ' * n}\n{cubes}"


def exodus(folder: Path, n: int) -> Path:
    """A block and two fields for each cell."""
    import h5py

    path = folder / "a.e"
    with h5py.File(path, "w") as file:
        for axis, values in zip("xyz", np.array(points(n), float).T, strict=True):
            file[f"coord{axis}"] = values
        names = [f"block {k}" for k in range(1, n + 1)]
        file["eb_names"] = np.array([list(name.ljust(20, "\0")) for name in names], "S1")
        file["eb_prop1"] = np.arange(1, n + 1)
        for k, ids in enumerate(tetra(n), 1):
            file[f"connect{k}"] = np.array([ids])
            file[f"connect{k}"].attrs["elem_type"] = np.bytes_("TET4")
    return path


def cgns(folder: Path, n: int) -> Path:
    """A boundary for each cell."""
    import h5py

    path = folder / "a.cgns"
    with h5py.File(path, "w") as file:
        one = zone(base(file), "Zone", np.array(points(n), float), n)
        section(one, "Cells", 10, 1, n, np.ravel(tetra(n)))
        boundaries = put(one, "ZoneBC", "ZoneBC_t")
        for k in range(1, n + 1):
            made = put(boundaries, f"side {k}", "BC_t", "BCWall")
            put(made, "ElementRange", "IndexRange_t", np.array([k, k]))
    return path


MAKERS: dict[str, Callable[[Path, int], Path]] = {
    "vtu": written("a.vtu"),
    "vtk": text("a.vtk", vtk),
    "vtkhdf": written("a.vtkhdf"),
    "gmsh": text("a.msh", gmsh),
    "medit": written("a.mesh"),
    "med": written("a.med"),
    "mfem": text("a.mesh", mfem),
    "nastran": text("a.bdf", nastran),
    "exodus": exodus,
    "cgns": cgns,
    "frontistr": text("a.msh", frontistr),
    "femap": text("a.neu", femap),
    "tecplot-binary": tecplot_binary,
    "plot3d": text("a.xyz", plot3d),
    "elmer": text("mesh.header", elmer),
    "su2": written("a.su2"),
    "abaqus": text("a.inp", abaqus),
    "ansys": text("a.cdb", ansys),
    "lsdyna": text("a.k", lsdyna),
    "rf": text("a.ele", rf),
    "tetgen": text("a.ele", tetgen),
    "unv": text("a.unv", unv),
    "ugrid": written("a.lb8.ugrid"),
    "fluent": text("a.cas", fluent),
    "openfoam": text("a.foam", openfoam),
    "hedra": text("a.hedra", hedra),
    "ovm": lambda folder, n: ovm(folder / "a.ovm", mesh_of("tetra", n=n)),
    "gambit": text("a.neu", gambit),
    "tecplot": text("a.dat", tecplot),
}
