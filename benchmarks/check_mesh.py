"""Every number that OpenFOAM's checkMesh prints, beside what meshgauge has for the same mesh.

    python benchmarks/check_mesh.py [FOLDER] [--page docs/finite-volumes.md]

Meshes of blockMesh, snappyHexMesh, polyDualMesh and Gmsh are made by these tools (`foam_cases`; they stay in FOLDER if
one is given), and checked with -allGeometry and -allTopology. A line a number says whether ours is equal to twelve
digits; what of the geometry we have no number for is listed last, as checkMesh prints it. With ``--page`` the table of
that page is written again. Needs Debian's openfoam and Gmsh.
"""

from __future__ import annotations

import argparse
import re
import tempfile
from pathlib import Path
from typing import Any

import foam_cases
import numpy as np

import meshgauge
from meshgauge.kernels.finite_volume import driver
from meshgauge.quality.faces import FaceQuality, mean_angle
from meshgauge.surface_cells import IS_SURFACE

CLOSE = 1e-12
NUMBER = r"([-+\d.e]*\d)"
PLACE = rf"\({NUMBER} {NUMBER} {NUMBER}\)"
TYPES = {"hexahedra": "hexahedron", "prisms": "wedge", "pyramids": "pyramid", "tetrahedra": "tetra",
         "polyhedra": "polyhedron"}  # fmt: skip

PATTERNS = {
    "points": rf"^    points: +{NUMBER}",
    "faces": rf"^    faces: +{NUMBER}",
    "internal faces": rf"internal faces: +{NUMBER}",
    "cells": rf"^    cells: +{NUMBER}",
    "faces per cell": rf"faces per cell: +{NUMBER}",
    "boundary patches": rf"boundary patches: +{NUMBER}",
    **{f"cells: {name}": rf"^    {name}: +{NUMBER}" for name in TYPES},
    "regions": rf"Number of regions: {NUMBER}",
    "bounding box": rf"domain bounding box {PLACE} {PLACE}",
    "aspect ratio: max": rf"(?:Max aspect ratio =|high aspect ratio) {NUMBER}",
    "face area: min": rf"Minimum face area = {NUMBER}",
    "face area: max": rf"Maximum face area = {NUMBER}",
    "volume: min": rf"Min volume = {NUMBER}",
    "volume: max": rf"Max volume = {NUMBER}",
    "volume: total": rf"Total volume = {NUMBER}",
    "non-orthogonality: max": rf"non-orthogonality Max: {NUMBER}",
    "non-orthogonality: average": rf"non-orthogonality Max: \S+ average: {NUMBER}",
    "non-orthogonality: faces above 70": rf"Writing {NUMBER} non-orthogonal faces",
    "pyramids: faces with one of no volume": rf"Writing {NUMBER} faces with incorrect orientation",
    "skewness: max": rf"Max skewness = {NUMBER}",
    "skewness: faces above 4": rf"{NUMBER} highly skew faces",
    "edge length: min": rf"Min/max edge length = {NUMBER}",
    "edge length: max": rf"Min/max edge length = \S+ {NUMBER}",
    "flatness: min": rf"butterfly\) : min = {NUMBER}",
    "flatness: average": rf"butterfly\) : min = \S+ +average = {NUMBER}",
    "flatness: faces below 0.8": rf"There are {NUMBER} faces with ratio between projected and actual",
    "determinant: min": rf"wellposedness\) : minimum: {NUMBER}",
    "determinant: average": rf"wellposedness\) : minimum: \S+ average: {NUMBER}",
    "determinant: cells below 0.001": rf"small determinant .* number of cells: {NUMBER}",
    "weight: min": rf"interpolation weight : minimum: {NUMBER}",
    "weight: average": rf"interpolation weight : minimum: \S+ average: {NUMBER}",
    "weight: faces below 0.05": rf"small interpolation weight .* number of faces: {NUMBER}",
    "volume ratio: min": rf"volume ratio : minimum: {NUMBER}",
    "volume ratio: average": rf"volume ratio : minimum: \S+ average: {NUMBER}",
    "volume ratio: faces below 0.01": rf"small volume ratio .* number of faces: {NUMBER}",
}
"""What stands before each number, or the six of a box."""


def ours(mesh: meshgauge.Mesh) -> dict[str, list[float]]:
    """What meshgauge has for the names of `PATTERNS`."""
    faces = FaceQuality(mesh)
    solid = np.flatnonzero(~IS_SURFACE[mesh.types])
    kinds = mesh.type_counts()
    known = {name: getattr(faces, name) for name in (*driver.MEASURES, "flatness")}
    known = {name: values[~np.isnan(values)] for name, values in known.items()}
    angle, skewness = known["non_orthogonality"], np.concatenate([known["skewness"], known["boundary_skewness"]])
    flat, weight, ratio = known["flatness"], known["face_weight"], known["volume_ratio"]
    flat = flat if len(flat) else np.ones(1)  # triangles alone
    area, volume, determinant = np.linalg.norm(faces.areas, axis=1), faces.volumes[solid], faces.determinant[solid]
    following = np.arange(1, len(faces.points) + 1)
    following[faces.offsets[1:] - 1] = faces.offsets[:-1]
    length = np.linalg.norm(mesh.points[faces.points] - mesh.points[faces.points[following]], axis=1)
    n_inner = np.count_nonzero(faces.is_inner)
    found: dict[str, Any] = {
        "points": mesh.n_points,
        "faces": faces.n_faces,
        "internal faces": n_inner,
        "cells": len(solid),
        "faces per cell": (faces.n_faces + n_inner) / len(solid),
        "boundary patches": sum(bool(IS_SURFACE[mesh.types[block.start]]) for block in mesh.blocks),
        **{f"cells: {theirs}": kinds.get(own, 0) for theirs, own in TYPES.items()},
        "regions": meshgauge.doctor.diagnosis(mesh).n_parts,
        "bounding box": (*mesh.points.min(axis=0), *mesh.points.max(axis=0)),
        "aspect ratio: max": faces.aspect_ratio[solid].max(),
        "face area: min": area.min(),
        "face area: max": area.max(),
        "volume: min": volume.min(),
        "volume: max": volume.max(),
        "volume: total": volume.sum(),
        "non-orthogonality: max": angle.max(),
        "non-orthogonality: average": mean_angle(angle),
        "non-orthogonality: faces above 70": np.count_nonzero(angle > 70.0),
        "pyramids: faces with one of no volume": np.count_nonzero(known["pyramid_volume"] <= 0.0),
        "skewness: max": skewness.max(),
        "skewness: faces above 4": np.count_nonzero(skewness > 4.0),
        "edge length: min": length.min(),
        "edge length: max": length.max(),
        "flatness: min": flat.min(),
        "flatness: average": flat.mean(),
        "flatness: faces below 0.8": np.count_nonzero(flat < 0.8),
        "determinant: min": determinant.min(),
        "determinant: average": determinant.mean(),
        "determinant: cells below 0.001": np.count_nonzero(determinant < 0.001),
        "weight: min": weight.min(),
        "weight: average": weight.mean(),
        "weight: faces below 0.05": np.count_nonzero(weight < 0.05),
        "volume ratio: min": ratio.min(),
        "volume ratio: average": ratio.mean(),
        "volume ratio: faces below 0.01": np.count_nonzero(ratio < 0.01),
    }
    return {name: np.atleast_1d(np.asarray(value, float)).tolist() for name, value in found.items()}


def theirs(text: str) -> tuple[dict[str, list[float]], list[str]]:
    """The same of what checkMesh printed, and the lines on the geometry of which no number is among them.

    A count that is not printed is 0.
    """
    found, used = {}, set()
    for name, pattern in PATTERNS.items():
        match = re.search(pattern, text, re.MULTILINE)
        found[name] = [float(number) for number in match.groups()] if match else [0.0]
        if match:
            used.add(text.count("\n", 0, match.end(1)))
    lines = text.splitlines()
    geometry = lines.index("Checking geometry...")
    rest = [line.strip() for at, line in enumerate(lines) if at > geometry and at not in used]
    return found, [line for line in rest if re.search(r"\d", line) and "<<Writing" not in line]


def is_equal(what: str, one: list[float], other: list[float]) -> bool:
    """To twelve digits, and to that share of 1 where numbers are smaller; averages of angles by their cosines."""
    if what.startswith("non-orthogonality: average"):
        one, other = (np.cos(np.radians(angles)).tolist() for angles in (one, other))
    return bool(np.allclose(one, other, rtol=CLOSE, atol=CLOSE))


def compare(name: str, case: Path, file: Path) -> tuple[int, list[str]]:
    """Prints a case, line by line; how many numbers were compared, and the names of those that differ.

    ``file``: the mesh that we read.
    """
    text = foam_cases.run(case, "checkMesh", "-constant", "-allGeometry", "-allTopology")
    mesh = meshgauge.read(file)
    (said, rest), own = theirs(text), ours(mesh)
    print(f"\n{name}: {int(own['cells'][0]):,} cells")
    other = []
    for what, numbers in said.items():
        same = is_equal(what, numbers, own[what])
        other += [] if same else [what]
        columns = " ".join(f"{n:.13g}" for n in numbers), "" if same else " ".join(f"{n:.13g}" for n in own[what])
        print(f"  {'equal' if same else 'DIFFERS':8} {what:40} {columns[0]:>20} {columns[1]:>20}")
    for line in rest:
        print(f"  {'-':8} {line[:110]}")
    return len(said), other


def write_page(page: Path, rows: list[tuple[str, int, list[str]]]) -> None:
    """The table of a page: how many numbers were compared of each case, and which differ."""
    lines = ["| mesh | numbers | equal | differ |", "| --- | ---: | ---: | --- |"]
    lines += [f"| {name} | {n} | {n - len(other)} | {', '.join(other)} |" for name, n, other in rows]
    text = page.read_text(encoding="utf-8")
    head, _, rest = text.partition(lines[0])
    tail = re.sub(r"\A(?:\|.*\n|\n(?=\|))*", "", rest.lstrip("\n"))
    page.write_text(f"{head}{chr(10).join(lines)}\n\n{tail.lstrip()}", encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path)
    parser.add_argument("--page", type=Path)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = asked.folder or Path(scratch)
        rows = [(name, *compare(name, case, file)) for name, case, file in foam_cases.cases(folder)]
    if asked.page is not None:
        write_page(asked.page, rows)


if __name__ == "__main__":
    main()
