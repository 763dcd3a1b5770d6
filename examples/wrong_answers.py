"""Small meshes of which other tools say something wrong, what they say, and what meshgauge says.

    python examples/wrong_answers.py

Each row is one file of ``examples/wrong_answers`` (a cell or two, with coordinates one can check by hand), one question
put to the tool, its answer as it comes out here, and the truth; ``docs/wrong-answers.md`` tells how to see that. Tools
that are not installed are left out; VTK and PyVista always are there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from math import nan
from pathlib import Path
from typing import Any

import numpy as np

import meshgauge

FILES = Path(__file__).resolve().parent / "wrong_answers"

TESTED = {"vtk": "9.7.2", "pyvista": "0.49.1", "gmsh": "4.15.2", "meshioplusplus": "17.21.0"}
"""The versions that gave the answers below."""

DBL_MAX = float(np.finfo(np.float64).max)

Answer = float | str


@dataclass(frozen=True, slots=True)
class Case:
    """A question that a tool answers wrongly."""

    file: str
    tool: str
    asked: str
    says: Answer  #: the tool's answer with the version in `TESTED`
    truth: str
    status: str  #: meshgauge's
    quality: float  #: meshgauge's E_q
    cell: int = 0


MPP = "meshioplusplus"
GATE = "check scaled_jacobian >= 0.2"

CASES = (
    # VTK's pyramids: one score for the inverted and the flat, a good one for the tangled.
    Case("pyramid_inverted.vtk", "vtk", "scaled_jacobian", 0.0, "inside out: -1", "inverted", -1.0),
    Case("pyramid_flat.vtk", "vtk", "scaled_jacobian", 0.0, "flat: 0", "degenerate", 0.0),
    Case("pyramid_tangled.vtk", "vtk", "shape", 0.541966, "det -5/4 at node 2", "inverted", -0.348083),
    # VTK's 1e30, above any threshold.
    Case("hexahedron_flat.vtk", "vtk", "scaled_jacobian", 1e30, "volume 0", "degenerate", 0.0),
    Case(
        "hexahedron_crossed_middle.vtk", "vtk", "scaled_jacobian", 1e30, "det < 0 inside", "inverted_inside", 0.940721
    ),
    # VTK: coordinates that are not a number.
    Case("hexahedron_nan.vtk", "vtk", "jacobian", 1.0, "undefined", "non_finite", nan),
    Case("hexahedron_nan.vtk", "vtk", "shear", 1.0, "undefined", "non_finite", nan),
    Case("wedge_nan.vtk", "vtk", "scaled_jacobian", 1.0, "undefined", "non_finite", nan),
    # VTK looks at the corners, of a hexahedron also at the middle.
    Case("hexahedron_crossed.vtk", "vtk", "scaled_jacobian", 0.960031, "det -5 inside", "inverted_inside", 0.960031),
    Case("wedge_crossed.vtk", "vtk", "scaled_jacobian", 0.457779, "det < 0 inside", "inverted_inside", 0.457779),
    # PyVista: -1 is "undefined", and a value.
    Case("voxel_and_mirrored.vtk", "pyvista", "volume", -1.0, "a cube: 1", "ok", 1.0),
    Case("voxel_and_mirrored.vtk", "pyvista", "scaled_jacobian", -1.0, "a cube: 1", "ok", 1.0),
    Case("voxel_and_mirrored.vtk", "pyvista", "scaled_jacobian", -1.0, "mirrored: -1", "inverted", -1.0, cell=1),
    # meshio and meshio++ write wedges in the order that VTK used to document.
    Case("wedge_from_meshio.vtu", "vtk", "scaled_jacobian", -1.0, "perfect: 1", "ok", 1.0),
    # Gmsh.
    Case("pyramid_low.msh", "gmsh", "minSJ", 1.0, "nearly flat", "ok", 0.002),
    Case("pyramid13_apex_low.msh", "gmsh", "minDetJac", 2.4, "-4 at the apex", "inverted", -0.838052),
    Case("wedge_valid.msh", "gmsh", "minSJ", -0.5, "valid: det >= 7/32", "ok", 0.179787),
    Case("hexahedron_crossed.msh", "gmsh", "minSIGE", 0.960031, "det < 0 inside", "inverted_inside", 0.960031),
    Case("hexahedron_crossed.msh", "gmsh", "minSICN", 0.197173, "det < 0 inside", "inverted_inside", 0.960031),
    Case("hexahedron_flat.msh", "gmsh", "minSIGE", DBL_MAX, "volume 0", "degenerate", 0.0),
    Case("hexahedron_nan.msh", "gmsh", "minDetJac", DBL_MAX, "undefined", "non_finite", nan),
    Case("cube.msh", "gmsh", "gamma", 0.0, "perfect", "ok", 1.0),
    # meshio++.
    Case("hexahedron_corner_inverted.vtk", MPP, "check", "PASS (1 cells)", "det -5/4 at node 6", "inverted", -0.965961),
    Case("polyhedron_corner_inverted.vtu", MPP, GATE, "PASS (1 cells)", "det -5/4 at point 6", "concave", -0.965961),
    Case("hexahedron_crossed.vtk", MPP, GATE, "PASS (1 cells)", "det -5 inside", "inverted_inside", 0.960031),
    Case("tetra10_folded.vtk", MPP, GATE, "PASS (1 cells)", "det -32 at node 1", "inverted", -0.707107),
    Case("tetra_nan.vtk", MPP, GATE, "PASS (1 cells)", "undefined", "non_finite", nan),
    Case("voxel_inverted.vtu", MPP, GATE, "PASS (0 cells)", "volume -1", "inverted", -1.0),
    Case("cube_10_micrometres.vtk", MPP, "check", "FAIL (1 cells)", "perfect", "ok", 1.0),
)


def ask_vtk(path: Path, asked: str, cell: int) -> float:
    """A measure of ``vtkCellQuality``."""
    from vtkmodules.vtkFiltersVerdict import vtkCellQuality
    from vtkmodules.vtkIOLegacy import vtkUnstructuredGridReader
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

    reader: Any = vtkXMLUnstructuredGridReader() if path.suffix == ".vtu" else vtkUnstructuredGridReader()
    reader.SetFileName(str(path))
    quality = vtkCellQuality()
    quality.SetInputConnection(reader.GetOutputPort())
    getattr(quality, "SetQualityMeasureTo" + asked.title().replace("_", ""))()
    quality.Update()
    return float(quality.GetOutput().GetCellData().GetArray("CellQuality").GetValue(cell))


def ask_pyvista(path: Path, asked: str, cell: int) -> float:
    """A measure of PyVista's ``cell_quality``."""
    import pyvista

    grid: Any = pyvista.read(path)
    return float(grid.cell_quality(asked)[asked][cell])


def ask_gmsh(path: Path, asked: str, cell: int) -> float:
    """A measure of Gmsh's ``getElementQualities``."""
    import gmsh

    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(path))
        _, tags, _ = gmsh.model.mesh.getElements(3)
        return float(gmsh.model.mesh.getElementQualities(np.concatenate(tags), asked)[cell])
    finally:
        gmsh.finalize()


def ask_meshioplusplus(path: Path, asked: str, cell: int) -> str:
    """What ``meshioplusplus check FILE`` decides, with ``--require`` and the rest of the question if there is any."""
    import meshioplusplus

    require = asked.removeprefix("check").strip() or None
    result = meshioplusplus.check_quality(meshioplusplus.read(path), require)
    return f"{'PASS' if result['passed'] else 'FAIL'} ({result['num_cells']} cells)"


ASK: dict[str, Callable[[Path, str, int], Answer]] = {
    "vtk": ask_vtk,
    "pyvista": ask_pyvista,
    "gmsh": ask_gmsh,
    "meshioplusplus": ask_meshioplusplus,
}


def installed(tool: str) -> str | None:
    """The version of a tool, None if it is not installed or lacks a library of the system."""
    try:
        if tool == "gmsh":
            import gmsh  # noqa: F401  linked to libraries that may be missing
        return version(tool)
    except (PackageNotFoundError, ImportError, OSError):
        return None


def answer(case: Case) -> Answer:
    """What the tool says."""
    return ASK[case.tool](FILES / case.file, case.asked, case.cell)


def measured(case: Case) -> tuple[str, float]:
    """meshgauge's status and E_q of the cell."""
    quality = meshgauge.measure(meshgauge.read(FILES / case.file))
    return meshgauge.Status(int(quality.status[case.cell])).name.lower(), float(quality.values[case.cell])


def written(value: Answer) -> str:
    """A number as the table has it."""
    return value if isinstance(value, str) else f"{value:.6g}"


def agrees(says: Answer, expected: Answer) -> bool:
    """True if two answers are the same but for the rounding in the table."""
    if isinstance(says, str) or isinstance(expected, str):
        return says == expected
    return bool(np.isclose(says, expected, rtol=1e-5, atol=1e-6, equal_nan=True))


def main() -> None:
    """Print the table."""
    versions = {tool: installed(tool) for tool in ASK}
    print("  ".join(f"{tool} {found or 'is not installed'}" for tool, found in versions.items()))
    rows = [("file", "tool", "asked", "says", "true", "meshgauge")]
    for case in CASES:
        if versions[case.tool] is None:
            continue
        status, value = measured(case)
        name = case.file if case.cell == 0 else f"{case.file}, cell {case.cell}"
        rows.append((name, case.tool, case.asked, written(answer(case)), case.truth, f"{status} {written(value)}"))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        print("  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip())


if __name__ == "__main__":
    main()
