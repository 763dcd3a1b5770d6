"""``grid.gauge``: quality of PyVista data sets, without importing meshgauge.

PyVista from 0.48 on finds this module by its entry point (group ``pyvista.accessors``). With an older one, use
``Gauge(grid)`` from here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pyvista
from numpy.typing import ArrayLike

from ..errors import MeshgaugeError
from ..io import from_pyvista
from ..look.bands import POOR, PoorBelow
from ..quality.measure import JENS, Quality, measure

if TYPE_CHECKING:
    from ..repair import Progress, RepairReport
    from ..repair.rounding import Rounding


@dataclass(frozen=True, repr=False)
class Report:
    """The report on a data set: text where it is printed, tables in a notebook."""

    text: str
    html: str

    def __repr__(self) -> str:
        return self.text

    def _repr_html_(self) -> str:
        return self.html


class Improved(NamedTuple):
    """What `Gauge.improve` returns."""

    grid: Any  #: a copy of the data set, its points moved
    report: RepairReport  #: what was reached, at what price, and what is left


class Gauge:
    """Measures a data set, and returns copies: the data set itself is never changed.

    Parameters
    ----------
    dataset
        Any `pyvista.DataSet` or `pyvista.MultiBlock`; its solid cells are measured, or the surface cells without any.
    """

    def __init__(self, dataset: Any) -> None:
        self._dataset = dataset

    def measure(self, metrics: Iterable[str] = (JENS,)) -> Quality:
        """What `meshgauge.measure` returns for the data set: values, status, worst cells.

        Raises
        ------
        MetricError
            If there is no such metric.
        """
        quality = measure(from_pyvista(self._dataset), metrics=metrics)
        n_cells = sum(leaf.n_cells for leaf in _leaves(self._dataset))
        if quality.n_cells != n_cells:
            raise MeshgaugeError(f"{quality.n_cells} of {n_cells} cells could be converted")
        return quality

    def quality(self, metrics: Iterable[str] = (JENS,)) -> Any:
        """A copy of the data set with the quality of its cells.

        Parameters
        ----------
        metrics
            Names of metrics beside ``"jens"``.

        Returns
        -------
        pyvista.DataSet
            Cell data by name of metric, NaN where it is undefined, and ``status`` (codes of `meshgauge.Status`); point
            data ``jens_worst`` and ``jens_node``. ``jens`` is the active scalar.

        Raises
        ------
        MetricError
            If there is no such metric.
        """
        metrics = list(metrics)
        copy = self._dataset.copy()
        if isinstance(copy, pyvista.MultiBlock):
            for n, block in enumerate(self._dataset):
                if block is not None:
                    copy.replace(n, Gauge(block).quality(metrics))  # keeps the name, as assignment does not
            return copy
        measured = self.measure(metrics)
        for name, values in measured.cell_data().items():
            copy.cell_data[name] = np.array(values)
        if measured.mesh.n_points == copy.n_points:  # points of grids with implicit points are the same, too
            for name, values in measured.point_data().items():
                copy.point_data[name] = np.array(values)
        copy.set_active_scalars(JENS, preference="cell")
        return copy

    def report(self, *, worst: int = 10) -> Report:
        """The report that ``meshgauge report`` prints, with this many worst cells."""
        from ..report import FileReport
        from ..report.methods import text

        measured = self.measure()
        one = FileReport.of(measured, path=type(self._dataset).__name__, worst=worst)
        return Report(text(one, width=120), measured._repr_html_())

    def plot_worst(self, n: int = 10, *, show: bool = True) -> Any:
        """The worst cells in their colours, with the worst node of each, in the data set seen through.

        Parameters
        ----------
        n
            How many cells.
        show
            Show the plotter, as PyVista is set; False leaves that to the caller.

        Returns
        -------
        pyvista.Plotter
        """
        from ..plot import plotter

        made = plotter(self.measure(), n)
        if show:
            made.show()
        return made

    def improve(
        self,
        *,
        everywhere: bool = False,
        boundary: str = "fixed",
        target: float = POOR,
        floor: float | None = None,
        size_change: float = 0.1,
        topology: bool = False,
        objective: str = "jens",
        split_hopeless: bool = False,
        strict: bool = False,
        seconds: float | None = None,
        fixed: ArrayLike | None = None,
        keep: Sequence[str] = (),
        surface: Any = None,
        feature_angle: float = 40.0,
        tolerance: float | None = None,
        progress: Callable[[Progress], object] | None = None,
        should_stop: Callable[[], bool] | None = None,
        threads: int | None = None,
        keep_bricks: bool = False,
        poor_below: float | Mapping[str, float] | PoorBelow | None = None,
        rounding: Rounding | Sequence[Rounding] | None = None,
    ) -> Improved:
        """A copy of the data set with its points moved so that its quality is better, and the report on that.

        The options are those of `meshgauge.improve`, which describes them.

        Returns
        -------
        Improved
            ``grid, report = grid.gauge.improve()``.

        Raises
        ------
        MeshgaugeError
            If the data set has no points of its own (an image, blocks), or what `meshgauge.improve` raises.
        """
        if isinstance(self._dataset, pyvista.ImageData | pyvista.RectilinearGrid | pyvista.MultiBlock):
            raise MeshgaugeError(f"the points of a {type(self._dataset).__name__} cannot be moved")
        from ..repair import improve

        improvement = improve(
            from_pyvista(self._dataset),
            everywhere=everywhere,
            boundary=boundary,
            target=target,
            floor=floor,
            size_change=size_change,
            topology=topology,
            objective=objective,
            split_hopeless=split_hopeless,
            strict=strict,
            seconds=seconds,
            fixed=fixed,
            keep=keep,
            surface=surface,
            feature_angle=feature_angle,
            tolerance=tolerance,
            progress=progress,
            should_stop=should_stop,
            threads=threads,
            keep_bricks=keep_bricks,
            poor_below=poor_below,
            rounding=rounding,
        )
        if topology or split_hopeless:
            return Improved(improvement.mesh.to_pyvista(), improvement.report)
        copy = self._dataset.copy()
        copy.points = np.array(improvement.mesh.points)
        return Improved(copy, improvement.report)


def _leaves(dataset: Any) -> Iterator[Any]:
    """The data sets of nested blocks; a data set itself."""
    if not isinstance(dataset, pyvista.MultiBlock):
        yield dataset
        return
    for block in dataset:
        if block is not None:
            yield from _leaves(block)


if hasattr(pyvista, "register_dataset_accessor"):
    for target in (pyvista.DataSet, pyvista.MultiBlock):
        pyvista.register_dataset_accessor("gauge", target)(Gauge)
