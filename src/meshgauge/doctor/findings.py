"""What may be wrong with a mesh beside the shapes of its cells, in one sentence each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from ..look.names import cell_name, listed
from ..look.records import brief
from ..mesh import Mesh
from ..mesh.labels import cell_labels, point_labels
from .hanging import Hanging
from .inward import InwardFaces
from .joined import Joined
from .orientation import EXAMPLES, Orientation
from .points import LAST_PLACES, PointScale

Level = Literal["defect", "notice"]


@dataclass(frozen=True, slots=True)
class Finding:
    """Something found, in one sentence.

    A *defect* makes a mesh unfit for most solvers; a *notice* may be meant so.
    """

    name: str
    level: Level
    count: int
    examples: tuple[int, ...]  #: the first few: cell ids, or point ids where it is points that were counted
    text: str
    labels: tuple[int | None, ...] = ()  #: the file's own numbers of the examples; empty if it numbers none

    __repr__ = brief

    def to_dict(self) -> dict[str, Any]:
        """Plain data, for JSON."""
        return {
            "name": self.name,
            "level": self.level,
            "count": self.count,
            "examples": list(self.examples),
            "labels": list(self.labels),
            "text": self.text,
        }


class Names(Protocol):
    """The file's own numbers; none where it numbers nothing."""

    def cell_labels(self, ids: Sequence[int]) -> tuple[int | None, ...]: ...

    def point_labels(self, ids: Sequence[int]) -> tuple[int | None, ...]: ...


@dataclass(frozen=True)
class NamesOf:
    """Those of a mesh in memory."""

    mesh: Mesh

    def cell_labels(self, ids: Sequence[int]) -> tuple[int | None, ...]:
        return cell_labels(self.mesh, ids)

    def point_labels(self, ids: Sequence[int]) -> tuple[int | None, ...]:
        return point_labels(self.mesh, ids)


def of_orientation(result: Orientation) -> list[Finding]:
    out = []
    for block in result.blocks:
        count = block.n_reversed + block.n_reversed_tangled + block.n_tangled + block.n_overlapping + block.n_undecided
        out.append(Finding("orientation", "defect", count, block.cells, _sentence(block.text), block.labels))
    return out


def misoriented_faces(names: Names, result: InwardFaces) -> Finding | None:
    n = result.n_faces
    firsts = [result.cells_of(at) for at in range(min(n, EXAMPLES))]
    named = "; ".join(
        f"face {face} of {_both(names, own)}" for face, own in zip(result.faces.tolist(), firsts, strict=False)
    )
    text = f"{_count(n, 'face')} {_verb(n, 'points', 'point')} the wrong way, inward"
    cells = [own[0] for own in firsts]
    more = "; ..." if n > EXAMPLES else ""
    return _of_cells(names, "misoriented_faces", n, cells, f"{text} ({named}{more}).")


def repeated_points(names: Names, ids: NDArray[np.int64]) -> Finding | None:
    n = len(ids)
    text = f"{_count(n, 'cell')} {_verb(n, 'has', 'have')} a point twice"
    return _of_cells(names, "repeated_points", n, ids.tolist(), f"{text} ({_ids(names, 'cell', ids)}).")


def duplicate_cells(names: Names, ids: NDArray[np.int64]) -> Finding | None:
    n = len(ids)
    text = f"{_count(n, 'cell')} {_verb(n, 'is', 'are')} there already, with the same points"
    return _of_cells(names, "duplicate_cells", n, ids.tolist(), f"{text} ({_ids(names, 'cell', ids)}).")


def covering_cells(names: Names, ids: NDArray[np.int64]) -> Finding | None:
    n = len(ids)
    text = (
        f"{_count(n, 'cell')} {_verb(n, 'lies', 'lie')} where another is, with points of {_verb(n, 'its', 'their')} own"
    )
    return _of_cells(names, "covering_cells", n, ids.tolist(), f"{text} ({_ids(names, 'cell', ids)}).")


def multiple_faces(names: Names, n: int, cells_of_one: list[int]) -> Finding | None:
    # A cell may have a face twice: then three half-faces are those of two cells.
    shared = "shared by three or more cells" if len(cells_of_one) != 2 else "there three times or more, in two cells"
    text = f"{_count(n, 'face')} {_verb(n, 'is', 'are')} {shared}"
    where = _ids(names, "cell", np.array(cells_of_one, np.int64)) if n else ""
    text = f"{text} ({'' if n == 1 else 'one by '}{where})."
    return _of_cells(names, "multiple_faces", n, cells_of_one, text)


def split_faces(names: Names, cells: NDArray[np.int64]) -> Finding | None:
    """``cells`` ``(n, 3)``: that with the quadrilateral, and those with the triangles."""
    n, ids = len(cells), cells.tolist()
    where = f" ({_both(names, ids[0][:1])} against {_both(names, ids[0][1:])})" if n else ""
    text = f"{_count(n, 'quadrilateral face')} {_verb(n, 'stands', 'stand')} against two triangles{where}."
    return _of_cells(names, "split_faces", n, [cell for cell, *_ in ids], text)


def hanging_points(names: Names, result: Hanging) -> Finding | None:
    n, n_cells = len(result.points), len(result.cells)
    places = [_count(count, noun) for count, noun in ((result.n_edges, "edge"), (result.n_faces, "face")) if count]
    text = (
        f"{_count(n, 'point')} {_verb(n, 'hangs', 'hang')}, in {' and '.join(places)} of "
        f"{_count(n_cells, 'coarser cell')}, which {_verb(n_cells, 'does', 'do')} not have {_verb(n, 'it', 'them')}"
    )
    return _of_points(names, "hanging_points", result.points, text, level="defect")


def turned_cells(names: Names, ids: NDArray[np.int64], in_plane: bool) -> Finding | None:
    """Surface cells that run about the other way round than those beside them."""
    n = len(ids)
    beside = "" if in_plane else ", against most cells beside them"
    text = f"{_count(n, 'surface cell')} {_verb(n, 'runs', 'run')} the other way round{beside}"
    return _of_cells(names, "turned_cells", n, ids.tolist(), f"{text} ({_ids(names, 'cell', ids)}).")


def not_orientable(names: Names, cells: NDArray[np.int64]) -> Finding | None:
    """``cells`` ``(n, 2)``: those at each edge that contradicts the others."""
    n = len(cells)
    where = f", first where {_both(names, cells[0].tolist())} meet" if n else ""
    text = f"A surface has no two sides: {_count(n, 'edge')} {_verb(n, 'contradicts', 'contradict')} the others{where}."
    return _of_cells(names, "not_orientable", n, cells[:, 0].tolist(), text)


def edges_of_three(names: Names, cells: Sequence[NDArray[np.int64]], in_plane: bool) -> Finding | None:
    """``cells``: those of each edge that three or more have; where surfaces meet that is right, in a plane never."""
    n = len(cells)
    where = _ids(names, "cell", np.unique(cells[0])) if n else ""
    text = f"{_count(n, 'edge')} {_verb(n, 'is', 'are')} shared by three or more cells"
    text = f"{text} ({'' if n == 1 else 'one by '}{where})."
    ids = [int(some[0]) for some in cells]
    return _of_cells(names, "multiple_edges", n, ids, text, level="defect" if in_plane else "notice")


def points_on_edges(names: Names, ids: NDArray[np.int64]) -> Finding | None:
    n = len(ids)
    text = (
        f"{_count(n, 'point')} {_verb(n, 'hangs', 'hang')} on edges of cells that do not have {_verb(n, 'it', 'them')}"
    )
    return _of_points(names, "hanging_points", ids, text, level="defect")


def hinges(roots: NDArray[np.int64], n_parts: int) -> Finding | None:
    """Parts that touch at points or edges only: ``roots`` are the first cells of each that faces hold together."""
    n = len(roots) - n_parts
    if n <= 0:
        return None
    text = (
        f"The cells are {len(roots):,} parts by shared faces, but {n_parts:,} by shared points: "
        "some touch at an edge or a point only."
    )
    return Finding("hinges", "notice", n, tuple(roots[:EXAMPLES].tolist()), text)


def parts(sizes: Sequence[int]) -> Finding | None:
    n = len(sizes)
    if n < 2:
        return None
    largest = ", ".join(f"{size:,}" for size in sizes[:EXAMPLES])
    more = ", ..." if n > EXAMPLES else ""
    text = f"The mesh is {n:,} parts that share no point, of {largest}{more} cells."
    return Finding("parts", "notice", n, (), text)


def duplicate_points(names: Names, ids: NDArray[np.int64], n_exact: int, within: str) -> Finding | None:
    """``within`` is how far those may be apart that do not coincide exactly."""
    n = len(ids)
    how = "exactly" if n_exact == n else f"{n_exact:,} exactly, the others within {within}"
    text = f"{_count(n, 'point')} {_verb(n, 'coincides', 'coincide')} with an earlier one, {how}"
    return _of_points(names, "duplicate_points", ids, text)


def within(scale: PointScale, tolerance: float, stored: str) -> str:
    """How far points may be apart that coincide, in words."""
    is_last = LAST_PLACES * scale.last_place > tolerance * scale.size
    return f"the last place of {stored} precision" if is_last else f"{tolerance:g} of the mesh's size"


def interfaces(names: Names, ids: NDArray[np.int64], n_sides: int) -> Finding | None:
    """Cohesive and gasket cells, apart from the others, and how many coinciding points they account for."""
    n = len(ids)
    sides = (
        f"; {_count(n_sides, 'coinciding point')} {_verb(n_sides, 'is', 'are')} of their two sides" if n_sides else ""
    )
    text = f"{_count(n, 'cohesive or gasket cell')} {_verb(n, 'is', 'are')} flat by design, and not measured{sides}"
    listed_ids = _ids(names, "cell", ids) if n else ""
    return _of_cells(names, "interface_cells", n, ids.tolist(), f"{text} ({listed_ids}).", level="notice")


def joined_points(names: Names, joined: Joined | None) -> Finding | None:
    """Points that several parts of a mesh have."""
    if joined is None or not joined.is_said:
        return None
    n, how = len(joined.ids), "numbers" if joined.by_numbers else "equal coordinates"
    of_others = f"{_count(n, 'point')} {_verb(n, 'was', 'were')} joined with those of another"
    what = of_others if n else "none has a point of another"
    ids = joined.ids[:EXAMPLES].tolist()
    text = f"Of {joined.n_parts:,} parts {what}, by their {how}."
    return Finding("joined_points", "notice", n, tuple(ids), text, names.point_labels(ids))


def unused_points(names: Names, ids: NDArray[np.int64]) -> Finding | None:
    n = len(ids)
    text = f"{_count(n, 'point')} {_verb(n, 'belongs', 'belong')} to no cell"
    return _of_points(names, "unused_points", ids, text)


def surface_cells(names: Names, ids: NDArray[np.int64], n_surface: int) -> Finding | None:
    n = len(ids)
    text = f"{n:,} of {_count(n_surface, 'surface cell')} {_verb(n, 'is', 'are')} no face of a solid cell"
    return _of_cells(names, "surface_cells", n, ids.tolist(), f"{text} ({_ids(names, 'cell', ids)}).", level="notice")


def points_of_no_solid(names: Names, ids: NDArray[np.int64]) -> Finding | None:
    n = len(ids)
    text = f"{_count(n, 'point')} {_verb(n, 'belongs', 'belong')} to no solid cell"
    return _of_points(names, "points_of_no_solid", ids, text)


def _of_cells(names: Names, name: str, n: int, cells: list[int], text: str, level: Level = "defect") -> Finding | None:
    """A finding about cells, of which the first few are examples; None if ``n`` is 0."""
    first = tuple(cells[:EXAMPLES])
    return Finding(name, level, n, first, text, names.cell_labels(first)) if n else None


def _of_points(names: Names, name: str, ids: NDArray[np.int64], text: str, level: Level = "notice") -> Finding | None:
    """A finding about points, which are named behind the text; None if there are none."""
    n, first = len(ids), tuple(ids[:EXAMPLES].tolist())
    text = f"{text} ({_ids(names, 'point', ids)})."
    return Finding(name, level, n, first, text, names.point_labels(first)) if n else None


def _count(n: int, noun: str) -> str:
    return f"{n:,} {noun}{'' if n == 1 else 's'}"


def _verb(n: int, one: str, several: str) -> str:
    return one if n == 1 else several


def _ids(names: Names, noun: Literal["cell", "point"], ids: NDArray[np.int64]) -> str:
    """``cell 3``, ``cells 3, 5, 9, ...``, with the file's own numbers in front, if it has any."""
    first = ids[:EXAMPLES].tolist()
    labels = names.cell_labels(first) if noun == "cell" else names.point_labels(first)
    return listed(noun, first, labels, more=len(ids) > EXAMPLES)


def _both(names: Names, cells: Sequence[int]) -> str:
    """``cell 3``, ``cells 3 and 5``, ``element 70 (cell 3) and element 71 (cell 5)``."""
    labels = names.cell_labels(cells)
    if labels:
        return " and ".join(cell_name(cell, label) for cell, label in zip(cells, labels, strict=True))
    return f"cell{'' if len(cells) == 1 else 's'} {' and '.join(map(str, cells))}"


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}."
