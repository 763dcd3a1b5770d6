"""Tecplot's ASCII files: own, since meshio and VTK read one zone of one form and mix up or refuse the others.

Zones of finite elements and ordered ones, by points or by blocks, with variables at cells, shared or passive; in the
keywords of today and of before. Zones of polygons and polyhedra are left to VTK.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...cells import BY_NAME
from ...errors import ReadError
from ...mesh import Mesh
from ..plumbing import budget
from ..plumbing.budget import Fail
from ..plumbing.merge import Part, merge_parts
from ..plumbing.steps import Step, number_steps
from ..plumbing.text import Text, numbers, write_out_repeated
from .structured import structured_part

_RECORD = re.compile(
    rb"(title|filetype|variables|zone|text|geometry|customlabels|datasetauxdata|varauxdata|functionlabels)\b",
    re.IGNORECASE,
)
_NUMBER = re.compile(rb"[-+.]?\d|[-+]?(nan|inf)", re.IGNORECASE)
_PAIR = re.compile(r'(?<!\w)(\w++)\s*=\s*("(?:[^"\\]|\\.)*"|\((?:[^()]|\([^()]*\))*\)|[^\s,()"]+)')
_QUOTED = re.compile(r'"([^"]*)"|([^\s,"=]+)')
_LISTED = re.compile(r"\(?\[([\d,\s-]+)\]\s*=\s*(\w+)|(?<=[(,])\s*(\w+)\s*(?=[,)])")
_SHAPES = {
    "LINESEG": "line",
    "TRIANGLE": "triangle",
    "QUADRILATERAL": "quad",
    "TETRAHEDRON": "tetra",
    "BRICK": "hexahedron",
}
_AXES = tuple(re.compile(rf"(coordinate\s*)?{axis}(\b|\d|c?$|[-_ ]?(coord|pos))", re.IGNORECASE) for axis in "xyz")


@dataclass(slots=True)
class _Zone:
    """The head of a zone and the lines of its numbers."""

    row: int
    options: dict[str, str]
    first: int = 0
    last: int = 0
    variables: list[str] = field(default_factory=list)

    def integer(self, *names: str, default: int = 0) -> int:
        value = next((self.options[name] for name in names if name in self.options), None)
        return default if value is None else int(value)

    def text(self, *names: str) -> str:
        value = next((self.options[name] for name in names if name in self.options), "")
        return value.strip('"').upper()

    @property
    def time(self) -> float | None:
        return float(self.options["SOLUTIONTIME"]) if "SOLUTIONTIME" in self.options else None

    def chosen(self, option: str, word: str | None = None) -> dict[int, str]:
        """What a list as ``([4,5-6]=CELLCENTERED)`` says of each variable, by position; ``word`` of a bare list."""
        table: dict[int, str] = {}
        text = self.options.get(option, "")
        bare = word is not None and "=" not in text
        groups = [(text.strip("()[]"), word)] if bare else [(m[1], m[2]) for m in _LISTED.finditer(text) if m[1]]
        for ids, value in groups:
            for piece in filter(None, re.split(r"[,\s]+", ids)):
                a, _, b = piece.partition("-")
                for n in range(int(a), min(int(b or a), len(self.variables)) + 1):
                    table[n - 1] = str(value).upper()
        return table


def sniff(head: bytes, path: Path) -> bool:
    return re.search(rb"^\s*(title\s*=|variables\s*=|zone\b)", head, re.IGNORECASE | re.MULTILINE) is not None


def _zones(path: Path) -> tuple[Text, list[_Zone]]:
    text = Text(path, path.read_bytes())
    zones: list[_Zone] = []
    variables: list[str] = []
    kind, record, row = b"", b"", 0

    def end() -> None:
        content = record.decode("utf-8", "replace")
        if kind == b"variables":
            variables[:] = [a or b for a, b in _QUOTED.findall(content.partition("=")[2])]
        elif kind == b"zone":
            options = {key.upper(): value for key, value in _PAIR.findall(content[4:])}
            zones.append(_Zone(row, options, variables=list(variables)))

    while line := text.peek():
        match = _RECORD.match(line)
        if line.startswith(b"#"):
            text.line()
        elif match is not None:
            end()
            kind, record, row = match[1].lower(), line, text.row
            text.line()
        elif kind == b"zone" and _NUMBER.match(line):
            end()
            kind = b""
            zones[-1].first = text.row
            while text.peek() and not _RECORD.match(text.peek()):
                text.line()
            zones[-1].last = text.row
        else:
            record += b" " + line
            text.line()
    end()
    return text, zones


def steps(path: Path) -> tuple[Step, ...]:
    """The solution times of the zones."""
    times = sorted({zone.time for zone in _zones(path)[1] if zone.time is not None})
    return number_steps(times)


def read(path: Path, at: int) -> Mesh | None:
    """The zones of a solution time, a block each, and those that have none; None if some are of polyhedra.

    Raises
    ------
    ReadError
        If a zone has not the numbers that its head states.
    """
    text, zones = _zones(path)
    if any(zone.text("ZONETYPE", "ET") in ("FEPOLYGON", "FEPOLYHEDRON") for zone in zones):
        return None
    times = sorted({zone.time for zone in zones if zone.time is not None})
    parts: list[Part] = []
    read_zones: list[Values] = []
    for zone in zones:
        try:
            values = _values(text, zone, read_zones)
            read_zones.append(values)
            if not times or zone.time in (None, times[at]):
                name = zone.options.get("T", "").strip('"').strip()
                parts.append(part(name, zone.variables, values, text.fail))
        except (ValueError, IndexError, OverflowError) as error:
            raise text.fail(f"zone {len(read_zones) + 1} is not whole: {error}", zone.row) from error
    if not any(len(part.types) for part in parts):
        raise ReadError(f"{path}: no cells were found in it")
    return merge_parts(parts, path=path)


@dataclass(slots=True)
class Values:
    """The arrays of a zone, whether each is of cells, and the nodes of its cells; ``shape`` of an ordered zone."""

    arrays: list[NDArray[Any]]
    is_of_cells: list[bool]
    nodes: NDArray[np.int64]
    shape: tuple[int, ...]
    cell: str


def _values(text: Text, zone: _Zone, before: list[Values]) -> Values:
    flat = _flat(text, zone)
    packing = zone.text("DATAPACKING") or zone.text("F") or "POINT"
    kind = zone.text("ZONETYPE", "ET").removeprefix("FE")
    is_elements = bool(kind and kind != "ORDERED") or zone.text("F").startswith("FE") or "E" in zone.options
    shape: tuple[int, ...] = ()
    n_points, n_cells = zone.integer("N", "NODES"), zone.integer("E", "ELEMENTS")
    if not is_elements:
        whole = [max(zone.integer(axis, default=1), 1) for axis in "IJK"]
        shape = tuple(n for n in whole if n > 1) or (1,)
        n_points, n_cells = int(np.prod(shape)), int(np.prod([n - 1 for n in shape]))
    if n_points < 1 or n_cells < 0 or n_points > len(flat) + sum(len(a) for v in before for a in v.arrays):
        raise ValueError(f"it states {n_points} points, and holds {len(flat)} numbers")
    if not zone.variables:  # they may be left out: so many as there are numbers for
        width = BY_NAME[_SHAPES[kind]].n_nodes or 0 if kind in _SHAPES else 0
        zone.variables = [f"V{k + 1}" for k in range(max(len(flat) - n_cells * width * is_elements, 0) // n_points)]
    n_variables = len(zone.variables)
    places, shared = zone.chosen("VARLOCATION"), zone.chosen("VARSHARELIST", str(len(before)))
    passive = zone.chosen("PASSIVEVARLIST", "yes")
    of_cells = [places.get(k, "NODAL").startswith("CELL") for k in range(n_variables)]
    arrays: list[NDArray[Any]] = []
    own = [k for k in range(n_variables) if k not in shared and k not in passive]
    if packing.endswith("BLOCK"):
        sizes = [n_cells if of_cells[k] else n_points for k in own]
        starts = np.concatenate([[0], np.cumsum(sizes)]).astype(int).tolist()
        columns = [flat[a:b] for a, b in itertools.pairwise(starts)]
        used = starts[-1]
    else:
        used = n_points * len(own)
        columns = list(flat[:used].reshape(n_points, len(own)).T)
    if used > len(flat):
        raise ValueError(f"{used} numbers are needed, {len(flat)} given")
    given = dict(zip(own, columns, strict=True))
    for k in range(n_variables):
        size = n_cells if of_cells[k] else n_points
        if k in shared:
            given[k] = before[int(shared[k]) - 1].arrays[k]
        elif k in passive:
            budget.draw("made", 8 * size, f"variable {zone.variables[k]!r}", text.fail)
            given[k] = np.zeros(size)
        if len(given[k]) != size:
            raise ValueError(f"variable {zone.variables[k]!r} has {len(given[k])} values, expected {size}")
        arrays.append(given[k])
    if not is_elements:
        return Values(arrays, of_cells, np.empty((0, 0), np.int64), shape, "")
    source = zone.integer("CONNECTIVITYSHAREZONE") or (before and "D" in zone.options and len(before)) or 0
    if source:
        return Values(arrays, of_cells, before[int(source) - 1].nodes, (), before[int(source) - 1].cell)
    rest = flat[used:]
    cell = _SHAPES.get(kind) or {3: "triangle", 8: "hexahedron"}.get(len(rest) // max(n_cells, 1), "quad")
    width = BY_NAME[cell].n_nodes or 0
    if len(rest) != n_cells * width:
        raise ValueError(f"{n_cells} elements of {width} nodes are stated, {len(rest)} numbers given")
    nodes = rest.reshape(n_cells, width).astype(np.int64) - 1
    if nodes.size and not 0 <= int(nodes.min()) <= int(nodes.max()) < n_points:
        raise ValueError(f"an element refers to a point outside of 1..{n_points}")
    return Values(arrays, of_cells, nodes, (), cell)


def _flat(text: Text, zone: _Zone) -> NDArray[np.float64]:
    """All numbers of a zone; ``3*0.5`` stands for three."""
    block = text.rows(zone.first, zone.last).replace(b",", b" ")
    block = re.sub(rb"^[ \t]*#[^\n]*", b"", block, flags=re.MULTILINE)
    return numbers(write_out_repeated(block, text.fail), np.float64)


def part(name: str, variables: Sequence[str], values: Values, fail: Fail) -> Part:
    """Cells of a zone, with the variables that are no coordinates as data; ``fail`` makes an error."""
    axes = list(coordinates(variables))
    n = len(values.arrays[axes[0]])
    budget.draw("made", sum(array.nbytes for array in values.arrays) + values.nodes.nbytes, "a zone", fail)
    points = np.zeros((n, 3))
    for column, at in enumerate(axes):
        points[:, column] = values.arrays[at]
    if values.shape:
        made = structured_part(name, values.shape, points)
    else:
        n_cells, width = values.nodes.shape
        types = np.full(n_cells, BY_NAME[values.cell].vtk_id if values.cell else 0, np.uint8)
        made = Part(name, points, types, np.arange(n_cells + 1) * width, values.nodes.ravel())
    data: tuple[dict[str, Any], dict[str, Any]] = (made.point_data, made.cell_data)
    for k, variable in enumerate(variables):
        if k not in axes:
            data[values.is_of_cells[k]][variable] = values.arrays[k]
    return made


def coordinates(variables: Sequence[str]) -> Iterator[int]:
    """Where x, y and z stand among the variables: by their names, else the first two or three."""
    found = [next((k for k, name in enumerate(variables) if axis.match(name.strip())), None) for axis in _AXES]
    if found[0] is None or found[1] is None:
        yield from range(min(3, len(variables)))
    else:
        yield from (k for k in found if k is not None)
