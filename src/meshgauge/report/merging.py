"""The report on a mesh of which every part was measured apart."""

from __future__ import annotations

import json
import os
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from ..cells import CELL_TYPES
from ..errors import MeshgaugeError, OptionError
from ..files.plain_records import plain
from ..io.plumbing.ghosts import not_looked_at
from ..kernels.path import is_compiled
from ..look.names import natural
from ..look.style import enumeration, plural
from ..mesh.collapsed import note_on
from ..mesh.regions import MOST
from ..quality.measure import JENS
from ..quality.summary import Summary, summarise_nothing
from ..slices import Partial
from ..slices.labels import labelled
from ..slices.partial import MIXED, merged
from .part_diagnosis import merged_diagnosis
from .partial_report import PartialReport
from .record import FileReport

NOT_DIAGNOSED = "The parts were measured without what a diagnosis of the whole takes, and are not diagnosed."
FEW = "Last bits of values may differ from those of the mesh as a whole, which has few cells."
_MEASURED = {2: "surface", 3: "solid"}
_LIES = {1: "is seen from +z", -1: "is seen from -z", 0: "lies in space"}
NAMED = 4
"""Types or parts that are named; of more the first."""


def merge(
    partials: Iterable[PartialReport | str | os.PathLike[str]],
    *,
    parts: int | None = None,
    path: str | None = None,
    memory: int | None = None,
) -> FileReport:
    """The report on a mesh from those on its parts: that of the whole, to the last bit, where its types are many.

    Parameters
    ----------
    partials
        Made by `partial`, or the files that they were saved to. One that is there twice counts once.
    parts
        Of how many parts the mesh is, if they do not say so themselves; shares of a file may be counted each.
    path
        What to call the mesh; None: the file, or the first and the last part.
    memory
        Bytes that the diagnosis may take; None: half of what is free.

    Returns
    -------
    FileReport
        With the diagnosis, if the parts were measured with it: points that they have in common are joined as those of
        files that are measured as one. Parts follow one another by their numbers, else by the names of their files,
        numbers in them by value, else as they are given; so do cells and points, of which those on two parts count
        twice.

    Raises
    ------
    ReadError
        If a file is none of a partial report, or damaged.
    MeshgaugeError
        If a part is missing, or parts were asked for different things or decided differently; the message says what to
        do.
    OptionError
        If there are none.
    """
    found = together(partials, parts=parts)
    whole, result, names = found.whole, found.result, found.region_names
    summaries = dict(result.summaries)
    summary = summaries.pop(JENS)
    by_region = whole[0].by_region
    regions = [at for at in range(len(names)) if at in result.regions] if by_region else []
    nothing = tuple(map(summarise_nothing, result.companions))
    is_double = result.sample is not None and result.sample.n_common > 0
    diagnosis = merged_diagnosis(found.shares, memory=memory, is_double=is_double)
    return FileReport(
        path=path or found.name,
        n_points=found.n_points,
        n_cells=found.n_cells - result.n_ghosts,
        summary=summary,
        worst=tuple(cell for cell, _ in result.worst),
        others=tuple(summaries.values()),
        companions=result.companions,
        notes=found.notes if diagnosis is not None else (*found.notes, NOT_DIAGNOSED),
        findings=result.findings,
        diagnosis=diagnosis,
        regions=tuple((names[at], result.regions[at]) for at in regions),
        region_companions=tuple(result.region_companions.get(at, nothing) for at in regions),
        worst_regions=tuple(names[region] for _, region in result.worst) if by_region else (),
        dimension=next((one.dimension for one in whole if one.summary.all.n_measured), 3),
        mixed_processors=found.is_mixed,
    )


@dataclass(frozen=True, eq=False)
class Together:
    """Partial reports of all parts of a mesh, put together.

    Attributes
    ----------
    whole
        That of each part, in order, its shares as one.
    shares
        Those of each part, as they were given.
    result
        On all cells, with ids of the whole.
    region_names
        In an order that has those of each part in theirs; of a mesh that was not asked for regions one.
    n_cells, n_points
        Of all parts, ghosts too.
    is_mixed
        Processors that round differently measured them.
    """

    whole: tuple[PartialReport, ...]
    shares: tuple[tuple[PartialReport, ...], ...]
    result: Partial
    region_names: tuple[str, ...]
    n_cells: int
    n_points: int
    is_mixed: bool

    @property
    def name(self) -> str:
        """What the mesh is called."""
        return _name(self.whole)

    @property
    def notes(self) -> tuple[str, ...]:
        """What was noticed while reading and measuring."""
        return _notes(self.whole, self.result, is_mixed=self.is_mixed)


def together(partials: Iterable[PartialReport | str | os.PathLike[str]], *, parts: int | None = None) -> Together:
    """Put the results on all parts together; parameters and errors as of `merge`."""
    given = [one if isinstance(one, PartialReport) else PartialReport.load(one) for one in partials]
    if not given:
        raise OptionError("no partial report is given")
    _check_alike(given)
    groups = _groups(given)
    joined = [_joined(group) for group in groups]
    shares_of = {id(one): group for one, group in zip(joined, groups, strict=True)}
    if parts is not None and parts == sum(map(len, groups)):
        parts = len(groups)  # shares of a file count too
    whole = _in_order(joined, parts)
    names = _region_names(whole)
    _check_decisions(whole)
    cells = points = n_parts = 0
    results = []
    for one in whole:
        keeps_labels = one.cell_labels == "stored" or len(whole) == 1
        results.append(_moved(one, cells, points, n_parts, names, keeps_labels=keeps_labels))
        cells, points = cells + one.n_cells, points + one.n_points
        if one.result.sample is not None:
            n_parts += 1 + int(one.result.sample.parts.max(initial=0))
    result = merged([_without_labels(one) for one in results])
    result.check_covers(cells)
    return Together(
        whole=tuple(whole),
        shares=tuple(tuple(shares_of[id(one)]) for one in whole),
        result=_with_labels(result, results),
        region_names=names,
        n_cells=cells,
        n_points=points,
        is_mixed=len({bits for one in given for bits in one.last_bits.split()}) > 1,
    )


def _check_alike(given: Sequence[PartialReport]) -> None:
    """Raise `MeshgaugeError` unless all were asked for the same, by one version."""

    def question(one: PartialReport) -> dict[str, object]:
        result = one.result
        return {
            "another version of meshgauge": one.made_by,
            "other metrics": tuple(result.summaries),
            "another purpose (--for)": one.summary.purpose,
            "another number of worst cells (--worst)": result.n_worst,
            "other limits of what is poor": one.summary.poor_below,
            "other options (--by)": one.by_region,
            "other options (--keep-bricks)": one.keep_bricks,
            "parts of another number": one.part and one.part[1],
        }

    first = question(given[0])
    for one in given[1:]:
        for what, value in question(one).items():
            if value != first[what]:
                raise MeshgaugeError(
                    f"{one.path} was measured with {what} than {given[0].path} ({value} and {first[what]}); measure "
                    "all parts alike"
                )


def _groups(given: Sequence[PartialReport]) -> list[list[PartialReport]]:
    """Those of one file together, each cell once."""
    groups: dict[object, dict[object, PartialReport]] = {}
    for one in given:
        group = groups.setdefault(one.identity if one.part is None else one.part, {})
        known = next(iter(group.values()), one)
        if one.identity == known.identity and one.state != known.state:
            raise MeshgaugeError(f"{one.path} was changed between two of its partial reports; measure it again")
        if (one.n_cells, one.n_points) != (known.n_cells, known.n_points):
            raise MeshgaugeError(
                f"{one.path} has {one.n_cells:,} cells and {one.n_points:,} points in one partial report, and "
                f"{known.n_cells:,} and {known.n_points:,} in another"
            )
        if not _is_again(one, group.setdefault(one.result.spans, one)):
            place = one.path if one.part is None else f"number {one.part[0]} of {one.part[1]} (counted from 0)"
            raise MeshgaugeError(f"two parts that differ are both {place}")
    return [list(group.values()) for group in groups.values()]


def _is_again(one: PartialReport, first: PartialReport) -> bool:
    """Whether a part has arrived twice: to the last bit, if processors that round alike measured it."""
    if (one.n_cells, one.n_points) != (first.n_cells, first.n_points):
        return False
    alike = one is not first and one.last_bits == first.last_bits and len(one.last_bits.split()) == 1
    return not alike or json.dumps(plain(one.result)) == json.dumps(plain(first.result))  # NaN as well


def _joined(group: Sequence[PartialReport]) -> PartialReport:
    """The shares of one file as one part. Raises `MeshgaugeError` if cells are missing, or there twice."""
    first = group[0]
    parts = [one.result for one in group]
    try:
        result = merged([_without_labels(part) for part in parts])
    except MeshgaugeError as error:
        raise MeshgaugeError(f"{first.path}: {error}") from error
    if result.spans != ((0, first.n_cells),):
        ends = [0, *(end for span in result.spans for end in span), first.n_cells]
        gaps = [f"{a} to {b - 1}" for a, b in zip(ends[::2], ends[1::2], strict=True) if a < b]
        some = enumeration(gaps[:NAMED]) + (", ..." if len(gaps) > NAMED else "")
        raise MeshgaugeError(f"{first.path}: cells {some} are in none of the partial reports; a share is missing")
    return replace(first, result=_with_labels(result, parts))


def _in_order(whole: list[PartialReport], parts: int | None) -> list[PartialReport]:
    """The parts as they follow one another. Raises `MeshgaugeError` if one is missing."""
    numbers = [one.part[0] for one in whole if one.part is not None]
    stated = whole[0].part[1] if whole[0].part is not None else parts
    if parts is not None and stated != parts:
        raise MeshgaugeError(f"the parts say that they are {stated}, not {parts}")
    if numbers:
        missing = sorted(set(range(stated or 0)) - set(numbers))
        if missing:
            some = ", ".join(map(str, missing[:NAMED])) + (", ..." if len(missing) > NAMED else "")
            raise MeshgaugeError(f"of {stated} parts {len(missing)} are missing: {some} (counted from 0)")
        return sorted(whole, key=lambda one: one.part or (0, 0))
    if stated is not None and len(whole) != stated:
        raise MeshgaugeError(f"{plural(len(whole), 'part')} given, of {stated}; shares of one file are one part")
    if all(os.path.isabs(one.identity) for one in whole):
        whole = sorted(whole, key=lambda one: natural(one.identity))
        if stated is None:
            _check_numbers([one.identity for one in whole])
    return whole


def _check_numbers(names: Sequence[str]) -> None:
    """Raise `MeshgaugeError` if names that differ in one number only leave one out."""
    split = [re.split(r"(\d+)", name) for name in names]
    if len({len(words) for words in split}) != 1:
        return
    differ = [at for at in range(len(split[0])) if len({words[at] for words in split}) > 1]
    if len(differ) != 1 or not split[0][differ[0]].isdecimal():
        return
    for (a, here), (b, there) in pairwise(zip((int(words[differ[0]]) for words in split), names, strict=True)):
        if b > a + 1:
            raise MeshgaugeError(
                f"between {os.path.basename(here)} and {os.path.basename(there)} a part is missing; if none is, "
                f"--parts {len(names)} says that these are all"
            )


def _check_decisions(whole: Sequence[PartialReport]) -> None:
    """Raise `MeshgaugeError` if something that holds for the whole was decided differently for two parts."""
    measured = [one for one in whole if one.summary.all.n_measured]
    for one in measured[1:]:
        first = measured[0]
        if one.dimension != first.dimension:
            raise MeshgaugeError(
                f"{_MEASURED[one.dimension]} cells of {one.path} were measured, and "
                f"{_MEASURED[first.dimension]} ones of {first.path}; measure all parts with --dimension 2 or 3"
            )
        if one.up != first.up:
            raise MeshgaugeError(
                f"the surface of {one.path} {_LIES[one.up]}, that of {first.path} {_LIES[first.up]}; measure the parts "
                "as one mesh (--as-one)"
            )
    with_wedges = [one for one in whole if one.wedges]
    for one in with_wedges[1:]:
        if one.wedges != with_wedges[0].wedges:
            raise MeshgaugeError(
                f"the wedges of {one.path} are {one.wedges}, those of {with_wedges[0].path} {with_wedges[0].wedges}; "
                "measure all parts with --wedge-order gmsh or vtk-legacy"
            )


def _region_names(whole: Sequence[PartialReport]) -> tuple[str, ...]:
    """Names of the regions of all parts, in an order that has those of each part in theirs."""
    first = whole[0]
    names: list[str] = []
    for one in whole if first.by_region else ():
        if one.region_source != first.region_source:
            raise MeshgaugeError(
                f"the regions of {one.path} are told by {one.region_source or 'nothing'}, those of {first.path} by "
                f"{first.region_source or 'nothing'}; measure the parts as one mesh (--as-one)"
            )
        at = 0
        for name in one.region_names:
            if name not in names:
                names.insert(at, name)
            at = names.index(name) + 1
    if len(names) > MOST:
        raise MeshgaugeError(f"{first.region_source} has more than {MOST} values in all parts, too many for regions")
    return tuple(names) or ("all",)


def _moved(
    one: PartialReport, cells: int, points: int, n_parts: int, names: Sequence[str], *, keeps_labels: bool
) -> Partial:
    """The result on a part with ids of the whole, behind so many cells, points and parts."""
    result = one.result if keeps_labels else labelled(one.result, None, None)
    region = [names.index(name) if one.by_region else 0 for name in one.region_names]
    return replace(
        result,
        spans=tuple((start + cells, stop + cells) for start, stop in result.spans),
        worst=tuple(
            (replace(cell, cell=cell.cell + cells, point=cell.point + points), region[at]) for cell, at in result.worst
        ),
        findings=tuple(
            replace(finding, cells=tuple(cell + cells for cell in finding.cells)) for finding in result.findings
        ),
        regions={region[at]: summary for at, summary in result.regions.items()},
        region_companions={region[at]: summaries for at, summaries in result.region_companions.items()},
        sample=None if result.sample is None else result.sample.of_part(n_parts),
    )


def _without_labels(part: Partial) -> Partial:
    """The same without the file's numbers of the cells of findings, which do not merge."""
    return replace(part, findings=tuple(replace(one, labels=()) for one in part.findings))


def _with_labels(result: Partial, parts: Sequence[Partial]) -> Partial:
    """A merged result with the file's numbers of the cells of findings, which the parts know."""
    known = {
        cell: label
        for part in parts
        for one in part.findings
        for cell, label in zip(one.cells, one.labels, strict=bool(one.labels))
    }
    if not known:
        return result
    return replace(
        result, findings=tuple(replace(one, labels=tuple(map(known.get, one.cells))) for one in result.findings)
    )


def _name(whole: Sequence[PartialReport]) -> str:
    if len(whole) == 1:
        return whole[0].path
    if len({one.path for one in whole}) == 1:
        return f"{whole[0].path} ({len(whole)} parts)"
    return f"{whole[0].path} to {whole[-1].path} ({len(whole)} parts)"


def _notes(whole: Sequence[PartialReport], result: Partial, *, is_mixed: bool) -> tuple[str, ...]:
    of_ghosts = {not_looked_at(one.result.n_ghosts) for one in whole}
    notes = dict.fromkeys(note for one in whole for note in one.notes if note not in of_ghosts)
    if result.n_ghosts:
        notes[not_looked_at(result.n_ghosts)] = None
    if result.collapsed:
        notes[note_on(Counter(result.collapsed))] = None
    if result.sample is not None and result.sample.note:
        notes[result.sample.note] = None
    if _differs(result.summaries[JENS]):
        notes[FEW] = None
    if is_mixed:
        notes[MIXED] = None
    return tuple(notes)


def _differs(summary: Summary) -> bool:
    """Whether the whole mesh is measured without compiled kernels, and parts were not."""
    if is_compiled(sum(tally.n_cells for tally in summary.tallies.values())):
        return False
    rows = (CELL_TYPES.get(vtk_id) for vtk_id, tally in summary.tallies.items() if tally.n_measured)
    return any(row.shape is not None and not row.is_curved for row in rows if row is not None)  # others have one path
