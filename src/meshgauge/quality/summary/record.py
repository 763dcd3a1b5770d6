"""The summary of a mesh: a tally for each type of cell, and over all."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property, reduce
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...cells import CELL_TYPES, type_name
from ...errors import MeshError, OptionError
from ...kernels.cells.driver import certified_as
from ...kernels.threads import run
from ...look.bands import PoorBelow
from ...status import Purpose, Status
from ..frame import frame
from ..metrics import Metric
from ..metrics import metric as metric_row
from .builder import is_compiled, tallies
from .scale import JENS, Scale, Values
from .tally import BINS, QUANTILES, Tally

if TYPE_CHECKING:
    from ...look.notebook import Cell as HtmlCell


@dataclass(frozen=True)
class Summary:
    """What a metric says about the cells of a mesh, by cell type and over all solid cells.

    Attributes
    ----------
    scale
        Of the metric.
    tallies
        By VTK id, ascending: every type that occurs, solid or not.
    purpose
        What the mesh is for, which decides whether a concave cell is invalid.
    """

    scale: Scale
    tallies: Mapping[int, Tally]
    purpose: Purpose = "fem"

    __hash__ = None  # type: ignore[assignment]  # holds arrays

    @property
    def metric(self) -> str:
        """Name of the metric."""
        return self.scale.metric

    @property
    def poor_below(self) -> PoorBelow:
        """Below which J_ENS cells are poor; of another metric the usual limit."""
        return PoorBelow(self.scale.acceptable[0], self.scale.of_shapes) if self.metric == JENS else PoorBelow()

    @property
    def n_cells(self) -> int:
        """Cells of every type, solid or not."""
        return sum(tally.n_cells for tally in self.tallies.values())

    @cached_property
    def types(self) -> dict[str, Tally]:
        """Tallies of the solid types by name, in the order of the VTK ids. A type without a row counts as solid."""
        return {type_name(t): tally for t, tally in self.tallies.items() if _is_solid(tally)}

    @cached_property
    def all(self) -> Tally:
        """The tally of all solid cells."""
        return reduce(Tally.merge, self.types.values(), Tally.empty(self.scale, self.purpose))

    @property
    def not_measured(self) -> dict[str, dict[str, int]]:
        """Cells without a value, by type name and reason."""
        return {type_name(t): reasons for t, tally in self.tallies.items() if (reasons := tally.not_measured)}

    @property
    def corners_only(self) -> dict[str, int]:
        """Undecided cells by type name, of types of which not all can be told inside: cells above second order."""
        rows = (CELL_TYPES[t] for t in self.tallies if t in CELL_TYPES)
        unknown = (r for r in rows if r.shape is not None and r.is_curved and certified_as(r) is None)
        return {r.name: n for r in unknown if (n := self.tallies[r.vtk_id].n_undecided)}

    def merge(self, other: Summary) -> Summary:
        """The summary of the cells of both, also ``self + other``. Associative and commutative, to the last bit.

        Raises `OptionError` if they are of two metrics, or of meshes of two purposes.
        """
        if self.scale != other.scale:
            raise OptionError(f"cannot merge summaries of {self.metric} and {other.metric}")
        if self.purpose != other.purpose:
            raise OptionError(f"cannot merge summaries of meshes for {self.purpose} and for {other.purpose}")
        return Summary(self.scale, merge_tallies([self.tallies, other.tallies]), self.purpose)

    def __add__(self, other: object) -> Summary:
        """The same as `merge`: ``summary + summary``, ``sum(summaries)``."""
        return self.merge(other) if isinstance(other, Summary) else NotImplemented

    def __radd__(self, other: object) -> Summary:
        return self if other == 0 else NotImplemented  # where `sum` starts

    def frame(self) -> Any:
        """A `pandas.DataFrame` with a row for each solid type and one called "all", NaN where there is no value.

        Columns: ``n_cells, n_measured, n_invalid, n_degenerate, n_poor, n_good, min, quantile_0.01, ..., max, mean``.

        Raises
        ------
        MeshgaugeError
            If pandas is not installed.
        """
        counts = ("n_cells", "n_measured", "n_invalid", "n_degenerate", "n_poor", "n_good")
        columns = ("type", *counts, "min", *(f"quantile_{at:g}" for at in QUANTILES), "max", "mean")
        rows = [
            (name, *(getattr(one, count) for count in counts), one.min, *one.quantiles().values(), one.max, one.mean)
            for name, one in (*self.types.items(), ("all", self.all))
        ]
        return frame(rows, columns, index="type")

    def to_dict(self, bins: int = BINS) -> dict[str, Any]:
        """As plain numbers, lists and dicts, ready for JSON except that undefined numbers are NaN."""
        return {
            "metric": self.metric,
            "acceptable": list(self.scale.acceptable),
            **({"poor_below": self.poor_below.to_dict()} if self.metric == JENS else {}),
            "purpose": self.purpose,
            "cell_types": {name: tally.to_dict(bins) for name, tally in self.types.items()},
            "all": self.all.to_dict(bins),
            "not_measured": self.not_measured,
            "corners_only": self.corners_only,
        }

    def __repr__(self) -> str:
        types = ", ".join(f"{tally.n_cells:,} {name}" for name, tally in self.types.items())
        return f"<Summary of {self.metric}: {self.all.in_words()}; {types or 'no solid cells'}>"

    def _repr_html_(self) -> str:
        """The summary in a notebook: a row a type, and all."""
        from ...look import notebook  # with the colours of pages

        head = ("cells", "measured", "invalid", "degenerate", "poor", "good", "min", "1 %", "median", "mean", "")
        named = [*self.types.items(), *([("all", self.all)] if len(self.types) != 1 else [])]
        title = f"{self.metric} of {self.n_cells:,} cells"
        return notebook.block(title, notebook.table(head, [_html_row(name, tally) for name, tally in named]))


HTML_BINS = 40


def _html_row(name: str, tally: Tally) -> list[HtmlCell]:
    from ...look import notebook

    at = tally.quantiles((0.01, 0.5))
    row: list[HtmlCell] = [
        name,
        f"{tally.n_measured:,}" + (f" of {tally.n_cells:,}" if tally.n_cells > tally.n_measured else ""),
        notebook.count(tally.n_invalid, notebook.INVALID),
        notebook.count(tally.n_degenerate, notebook.INVALID),
        notebook.count(tally.n_poor, notebook.POOR),
        f"{tally.n_good:,}",
        *(notebook.quality(value) for value in (tally.min, at[0.01], at[0.5], tally.mean)),
    ]
    if tally.scale.is_bounded:
        edges, counts = tally.histogram(HTML_BINS)
        low, high = tally.scale.acceptable
        colours = [
            notebook.INVALID if start < 0 else notebook.GOOD if low <= start < high else notebook.POOR
            for start in edges[:-1]
        ]
        row.append(notebook.bars(counts.tolist(), colours))
    return row


def summarise(
    values: Values,
    status: NDArray[np.uint8],
    types: NDArray[np.uint8],
    metric: str | Metric = "jens",
    *,
    purpose: Purpose = "fem",
    chunk: int = 1 << 20,
    threads: int | None = None,
) -> Summary:
    """Summarise a metric over cells.

    Parameters
    ----------
    values
        ``(n_cells,)`` float64, NaN where the metric is undefined.
    status, types
        ``(n_cells,)`` uint8: codes of `Status`, VTK ids.
    metric
        Its name, or its row.
    purpose
        What the mesh is for: to "fv" a concave cell is valid, to "fem" it is not.
    chunk
        Cells of one partial result. It has no influence on the answer.
    threads
        How many work on it; None for all processors. It has no influence on the answer.

    Returns
    -------
    Summary
        The same to the last bit for any chunk and number of threads.

    Raises
    ------
    MetricError
        If there is no such metric.
    MeshError
        If the arrays differ in length.
    OptionError
        If there is less than one thread.
    """
    row = metric_row(metric)
    if not len(values) == len(status) == len(types):
        raise MeshError(
            f"{len(values)} values, {len(status)} statuses and {len(types)} types, expected as many of each"
        )

    compiled = is_compiled(min(len(values), chunk))

    def partial(start: int) -> dict[int, Tally]:
        part = slice(start, start + chunk)
        return tallies(values[part], status[part], types[part], row, purpose, compiled=compiled)

    return Summary(Scale.of(row), merge_tallies(run(partial, range(0, len(values), chunk), threads)), purpose)


def summarise_nothing(like: Summary) -> Summary:
    """The summary of no cells, by the metric and for the purpose of another one."""
    return Summary(like.scale, {}, like.purpose)


def merge_tallies(parts: Iterable[Mapping[int, Tally]]) -> dict[int, Tally]:
    """Those of some parts as one, by VTK id, ascending."""
    merged: dict[int, Tally] = {}
    for part in parts:
        for vtk_id, one in part.items():
            merged[vtk_id] = merged[vtk_id].merge(one) if vtk_id in merged else one
    return dict(sorted(merged.items()))


def _is_solid(tally: Tally) -> bool:
    return tally.by_status[Status.NOT_SOLID] + tally.by_status[Status.NOT_SURFACE] < tally.n_cells
