"""What is known of one part of a mesh that is measured apart, and the file that keeps it."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..doctor.streamed.open_cells import OpenCells
from ..errors import ReadError
from ..files.output import replacing
from ..files.plain_records import NotPlain, plain, record
from ..look.records import brief
from ..quality.companions import NAMES
from ..quality.measure import JENS
from ..quality.summary import EXACT, Summary
from ..quality.summary.scale import HALF
from ..quality.summary.unlike import NOT_VALID, Unlike
from ..slices import Partial
from ..slices.facts import Labels
from ..status import STATUSES, Status

FORMAT, VERSION = "meshgauge-partial", 4
LARGEST = 1 << 31
"""Bytes of a file beyond which it holds no partial report."""


@dataclass(frozen=True, eq=False)
class PartialReport:
    """What is known of one part of a mesh, made by `partial`; `merge` makes the report of all parts.

    Attributes
    ----------
    path
        What the part is called.
    identity
        By which a part that arrives twice is known: the file, or what stands for it.
    state
        Size of the file and time of its last change in nanoseconds; 0 where there is none.
    part
        ``(k, n)``: the k-th of n, from 0 on, if that was given.
    n_cells, n_points
        Of the file or mesh, ghosts too; `result` may cover a share of them only.
    cell_labels
        How the file numbers its cells.
    wedges
        What became of the wedges; empty if there are none.
    region_source, region_names
        What tells the regions, and their names in order.
    dimension, up
        What was measured, see `Mesh`.
    by_region, keep_bricks
        As asked.
    notes
        Of the reader.
    last_bits
        Of the processor, see `meshgauge.kernels.probe`; of several that differ all, with blanks between them.
    made_by
        Version of meshgauge.
    result
        What was measured, with ids as the part has them.
    counts
        What rules come to on these cells, as `meshgauge.check` writes it, by the text of each.
    open_cells
        What the diagnosis of the whole needs to know of these cells; None: why not, see ``not_diagnosed``.
    not_diagnosed
        Why nothing is kept for the diagnosis, a clause; empty if it is.
    """

    path: str
    identity: str
    state: tuple[int, int]
    part: tuple[int, int] | None
    n_cells: int
    n_points: int
    cell_labels: Labels
    wedges: str
    region_source: str
    region_names: tuple[str, ...]
    dimension: int
    up: int
    by_region: bool
    keep_bricks: bool
    notes: tuple[str, ...]
    last_bits: str
    made_by: str
    result: Partial
    counts: Mapping[str, str]
    open_cells: OpenCells | None
    not_diagnosed: str

    __repr__ = brief

    @property
    def summary(self) -> Summary:
        """Of J_ENS, of the cells of this part."""
        return self.result.summaries[JENS]

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a file for `merge` (``.mgp``): text, JSON behind a line with its checksum. Raises `WriteError`."""
        body = json.dumps(plain(self), separators=(",", ":"))
        with replacing(path) as temporary:
            temporary.write_text(f"{FORMAT} {VERSION} {_checksum(body)}\n{body}\n", encoding="ascii")

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> PartialReport:
        """Read what `save` wrote. Nothing of the file is run. Raises `ReadError` if it is another file, or damaged."""
        name = os.fspath(path)
        try:
            if os.stat(path).st_size > LARGEST:
                raise ReadError(f"{name}: is too large for a partial report")
            head, _, body = Path(path).read_bytes().partition(b"\n")
        except OSError as error:
            raise ReadError(f"{name}: {error.strerror or error}") from error
        words = head.decode("ascii", "replace").split(" ")
        if words[0] != FORMAT or len(words) != 3:
            raise ReadError(f"{name}: is no partial report, as 'meshgauge report MESH --partial FILE' writes it")
        if words[1] != str(VERSION):
            raise ReadError(f"{name}: is of another version of partial reports ({words[1][:9]}, not {VERSION})")
        try:
            text = body.decode("ascii").removesuffix("\n")
            if _checksum(text) != words[2]:
                raise NotPlain("its checksum is wrong")
            made = record(json.loads(text), cls)
            _check(made)
        except (ValueError, RecursionError) as error:
            raise ReadError(f"{name}: is damaged: {error}") from error
        return made


def _checksum(text: str) -> str:
    return hashlib.sha256(text.encode("ascii")).hexdigest()


def _are_right(unlike: tuple[Unlike, ...], n_measured: int) -> bool:
    """Whether counts of the values of cells that are not valid can be those of a tally."""
    bins = np.concatenate([np.empty(0, np.int64), *(one.bins for one in unlike)])
    counts = [one.counts for one in unlike]
    return (
        len(unlike) == len(NOT_VALID)
        and all(len(one.bins) == len(one.counts) and bool((np.diff(one.bins) > 0).all()) for one in unlike)
        and bool(((bins >= 0) & (bins < 2 * HALF)).all())
        and all(bool((n > 0).all()) for n in counts)
        and sum(int(n.sum()) for n in counts) <= n_measured
    )


def _belongs(kept: OpenCells, made: PartialReport) -> bool:
    """Whether what is kept for the diagnosis is of the cells that were measured, and of points that are there."""
    return (
        ((kept.first_cell, kept.first_cell + kept.n_cells),) == made.result.spans
        and kept.dimension == made.dimension
        and min(kept.first_point, kept.n_points) >= 0
        and kept.first_point + kept.n_points <= made.n_points
    )


def _check(made: PartialReport) -> None:
    """Raise `NotPlain` if numbers do not belong together, so that none is looked up where there is nothing."""
    result = made.result
    ends = [end for span in result.spans for end in span]
    names = {row.name for row in STATUSES.values()}
    beside = [result.companions, *result.region_companions.values()]
    summaries = [*result.summaries.values(), *(one for some in beside for one in some), *result.regions.values()]
    named = {*result.regions, *result.region_companions, *(region for _, region in result.worst)}
    tallies = [tally for summary in summaries for tally in summary.tallies.values()]
    right = (
        JENS in result.summaries
        and ends == sorted(ends)
        and (not ends or (ends[0] >= 0 and ends[-1] <= made.n_cells))
        and all(summary.scale.metric == name for name, summary in result.summaries.items())
        and all(tuple(summary.scale.metric for summary in some) == NAMES for some in beside)
        and all(0 <= region < len(made.region_names) for region in named)
        and {one.status for one in result.findings} <= names
        and all(one.cells and len(one.labels) in (0, len(one.cells)) for one in result.findings)
        and all(len(one.by_status) == len(one.missing) == len(Status) for one in tallies)
        and all((one.values is None) != (one.counts is None) for one in tallies)
        and all(one.values is None or len(one.values) == one.n_measured <= EXACT for one in tallies)
        and all(one.counts is None or len(one.counts) == 2 * HALF for one in tallies)
        and (result.sample is None or result.sample.is_right)
        and all(_are_right(tally.unlike, tally.n_measured) for tally in tallies)
        and min(made.n_cells, made.n_points) >= 0
        and (made.open_cells is None or _belongs(made.open_cells, made))
    )
    if not right:
        raise NotPlain("its numbers do not belong together")
