"""Quality and repair in a pipeline of VTK: filters for VTK from 9.2 on, also those in ParaView."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase
from vtkmodules.vtkCommonCore import vtkDataArraySelection, vtkPoints, vtkStringArray
from vtkmodules.vtkCommonDataModel import vtkDataObject, vtkPointSet, vtkUnstructuredGrid
from vtkmodules.vtkFiltersCore import vtkThreshold

from ..errors import MeshgaugeError
from ..io import from_pyvista
from ..look.bands import POOR
from ..mesh import Mesh
from ..quality.measure import JENS, Quality
from ..quality.measure import measure as measure_mesh
from ..quality.metrics import METRICS
from ..status import STATUSES, Category, Status, is_solid

if TYPE_CHECKING:
    from ..repair import Progress, RepairReport

_MASK = "meshgauge:mask"
MOVED = "moved"
"""Point data of what `repaired` made: how far, and whither, each point went."""

OWN = tuple(name for name, row in METRICS.items() if row.source == "meshgauge")
"""Metrics that a filter offers: those of Verdict depend on the version of VTK, and ParaView has a filter for them."""

LOW = tuple(row.name for row in STATUSES.values() if row.category not in (Category.VALID, Category.APART))
"""Statuses of cells that are low whatever their value."""


def with_quality(data: Any, metrics: Iterable[str] = (JENS,)) -> Any:
    """A shallow copy of a vtkDataSet with cell data by metric and ``status``, point data ``jens_worst``, ``jens_node``.

    NaN where a metric is undefined. Raises what `meshgauge.measure` and `meshgauge.from_pyvista` do.
    """
    quality = _measure(data, metrics)
    copy = data.NewInstance()
    copy.ShallowCopy(data)
    for name, values in quality.cell_data().items():
        _add(copy.GetCellData(), name, values)
    if quality.mesh.n_points == copy.GetNumberOfPoints():
        for name, values in quality.point_data().items():
            _add(copy.GetPointData(), name, values)
    copy.GetCellData().SetActiveScalars(JENS)
    return copy


def low_cells(data: Any, threshold: float = POOR, statuses: Iterable[str] = LOW) -> Any:
    """The cells of what `with_quality` made that are not ok: a vtkUnstructuredGrid with their data.

    Parameters
    ----------
    data
        A vtkDataSet with cell data ``jens`` and ``status``.
    threshold
        Valid cells are low if their ``jens`` is less.
    statuses
        Names of statuses whose cells are low, whatever their value; unless given all but ok.
    """
    from vtkmodules.util.numpy_support import vtk_to_numpy

    values = vtk_to_numpy(data.GetCellData().GetArray(JENS))
    status = vtk_to_numpy(data.GetCellData().GetArray("status"))
    named = set(statuses)
    codes = [int(row.status) for row in STATUSES.values() if row.name in named]
    with np.errstate(invalid="ignore"):
        is_below = (status == Status.OK) & (values < threshold)
    chosen = is_solid(status) & (np.isin(status, codes) | is_below)
    masked = data.NewInstance()
    masked.ShallowCopy(data)
    _add(masked.GetCellData(), _MASK, chosen.astype(np.uint8))
    pick = vtkThreshold()
    pick.SetInputData(masked)
    pick.SetInputArrayToProcess(0, 0, 0, 1, _MASK)  # 1: of cells
    pick.SetThresholdFunction(vtkThreshold.THRESHOLD_UPPER)
    pick.SetUpperThreshold(0.5)
    pick.Update()
    chosen_cells = vtkUnstructuredGrid()
    chosen_cells.ShallowCopy(pick.GetOutput())
    chosen_cells.GetCellData().RemoveArray(_MASK)
    chosen_cells.GetCellData().SetActiveScalars(JENS)
    return chosen_cells


def repaired(
    data: Any,
    *,
    target: float = POOR,
    everywhere: bool = False,
    boundary: str = "fixed",
    seconds: float | None = None,
    progress: Callable[[Progress], object] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> tuple[Any, RepairReport]:
    """A copy of a vtkPointSet with its points moved, as `with_quality`, and the report; options as `meshgauge.improve`.

    Point data `MOVED` has the way of each point.

    Raises
    ------
    MeshgaugeError
        If the data set has no points of its own, or what `meshgauge.improve` raises.
    """
    from ..repair import improve

    if not isinstance(data, vtkPointSet):
        raise MeshgaugeError(f"a {data.GetClassName()} has no points of its own that could move")
    before = _mesh(data)
    made = improve(
        before,
        target=target,
        everywhere=everywhere,
        boundary=boundary,
        seconds=seconds,
        progress=progress,
        should_stop=should_stop,
    )
    copy = data.NewInstance()
    copy.ShallowCopy(data)
    points = vtkPoints()
    points.SetData(numpy_to_vtk(np.array(made.mesh.points, np.float64), deep=True))
    copy.SetPoints(points)
    _add(copy.GetPointData(), MOVED, np.asarray(made.mesh.points - before.points))
    return with_quality(copy), made.report


class _Filter(VTKPythonAlgorithmBase):  # type: ignore[misc]
    """One that reports what meshgauge refuses as VTK reports errors."""

    def work(self, data: Any) -> tuple[Any, ...]:
        """What the outputs are."""
        raise NotImplementedError

    def _selection(self, names: Iterable[str], chosen: Iterable[str]) -> Any:
        """Names of which some are chosen; a change has the filter work again."""
        made: Any = vtkDataArraySelection()
        chosen = set(chosen)
        for name in names:
            made.AddArray(name, name in chosen)
        made.AddObserver("ModifiedEvent", lambda *_: self.Modified())
        return made

    def RequestData(self, request: Any, inputs: Any, outputs: Any) -> int:
        """Work; what cannot be done is reported as VTK reports errors."""
        try:
            results = self.work(self.GetInputData(inputs, 0, 0))
        except MeshgaugeError as error:
            from vtkmodules.vtkCommonCore import vtkOutputWindow

            vtkOutputWindow.GetInstance().DisplayErrorText(f"meshgauge: {error}\n")
            return 0
        for port, result in enumerate(results):
            outputs.GetInformationObject(port).Get(vtkDataObject.DATA_OBJECT()).ShallowCopy(result)
        return 1


def _chosen(selection: Any) -> list[str]:
    names = map(selection.GetArrayName, range(selection.GetNumberOfArrays()))
    return [name for name in names if selection.ArrayIsEnabled(name)]


class MeshQuality(_Filter):
    """Measures a vtkDataSet. Output 0: `with_quality`; output 1: `low_cells`, by `SetThreshold` and `GetStatuses`."""

    def __init__(self) -> None:
        super().__init__(nInputPorts=1, inputType="vtkDataSet", nOutputPorts=2, outputType="vtkDataSet")
        self._threshold = POOR
        self._metrics = self._selection(OWN, [JENS])
        self._statuses = self._selection(LOW, LOW)

    def GetThreshold(self) -> float:
        """Valid cells of lower quality go to the second output."""
        return self._threshold

    def SetThreshold(self, value: float) -> None:
        """See `GetThreshold`; `look.bands.POOR` until it is set."""
        if value != self._threshold:
            self._threshold = value
            self.Modified()

    def GetMetrics(self) -> Any:
        """A vtkDataArraySelection: which metrics are measured; ``jens`` always is."""
        return self._metrics

    def GetStatuses(self) -> Any:
        """A vtkDataArraySelection: cells of which statuses go to the second output, whatever their value."""
        return self._statuses

    def work(self, data: Any) -> tuple[Any, ...]:
        """Measure."""
        result = with_quality(data, dict.fromkeys([JENS, *_chosen(self._metrics)]))
        return result, low_cells(result, self._threshold, _chosen(self._statuses))

    def FillOutputPortInformation(self, port: int, info: Any) -> int:
        """Output 1 is unstructured whatever comes in."""
        info.Set(vtkDataObject.DATA_TYPE_NAME(), "vtkUnstructuredGrid" if port else "vtkDataSet")
        return 1

    def RequestDataObject(self, request: Any, inputs: Any, outputs: Any) -> int:
        """Output 0 is of the type of the input."""
        data = self.GetInputData(inputs, 0, 0)
        if data is None:
            return 0
        kinds = (data.NewInstance, vtkUnstructuredGrid)
        for port, make in enumerate(kinds):
            info = outputs.GetInformationObject(port)
            key = vtkDataObject.DATA_OBJECT()
            old = info.Get(key)
            if old is None or old.GetClassName() != make().GetClassName():
                info.Set(key, make())
        return 1


class MeshRepair(_Filter):
    """Moves the points of a vtkPointSet: `repaired`; with what was reached in field data ``meshgauge``, as text."""

    def __init__(self) -> None:
        super().__init__(nInputPorts=1, inputType="vtkPointSet", nOutputPorts=1, outputType="vtkPointSet")
        self._options: dict[str, Any] = {"target": POOR, "everywhere": False, "boundary": "fixed", "seconds": None}

    def _set(self, name: str, value: Any) -> None:
        if self._options[name] != value:
            self._options[name] = value
            self.Modified()

    def SetTarget(self, value: float) -> None:
        """Cells below this ``jens`` are mended; `look.bands.POOR` until it is set."""
        self._set("target", value)

    def SetEverywhere(self, value: int) -> None:
        """1: all points move, and the mean is raised, too; 0: points near bad cells."""
        self._set("everywhere", bool(value))

    def SetBoundarySlides(self, value: int) -> None:
        """1: points of the boundary move on it; 0: they stay."""
        self._set("boundary", "slide" if value else "fixed")

    def SetSeconds(self, value: float) -> None:
        """Time after which the best so far is the result, that of compiling on the first run too; 0: no limit."""
        self._set("seconds", value or None)

    def FillInputPortInformation(self, port: int, info: Any) -> int:
        """Data sets that have points of their own."""
        info.Set(self.INPUT_REQUIRED_DATA_TYPE(), "vtkPointSet")
        return 1

    def RequestDataObject(self, request: Any, inputs: Any, outputs: Any) -> int:
        """The output is of the type of the input."""
        data, info, key = self.GetInputData(inputs, 0, 0), outputs.GetInformationObject(0), vtkDataObject.DATA_OBJECT()
        if data is None:
            return 0
        old = info.Get(key)
        if old is None or old.GetClassName() != data.GetClassName():
            info.Set(key, data.NewInstance())
        return 1

    def work(self, data: Any) -> tuple[Any, ...]:
        """Repair."""
        seconds = self._options["seconds"]

        def progress(now: Progress) -> None:
            self.UpdateProgress(min(now.seconds / seconds, 1.0) if seconds else 0.5)  # which lets a user abort

        def stop() -> bool:
            return bool(self.GetAbortExecute())

        result, report = repaired(data, progress=progress, should_stop=stop, **self._options)
        said = vtkStringArray()
        said.SetName("meshgauge")
        said.InsertNextValue(report.verdict)
        result.GetFieldData().AddArray(said)
        return (result,)


def _measure(data: Any, metrics: Iterable[str]) -> Quality:
    return measure_mesh(_mesh(data), metrics=metrics)


def _mesh(data: Any) -> Mesh:
    mesh = from_pyvista(data)
    if mesh.n_cells != data.GetNumberOfCells():
        raise MeshgaugeError(f"{mesh.n_cells} of {data.GetNumberOfCells()} cells could be converted")
    return mesh


def _add(attributes: Any, name: str, values: NDArray[Any]) -> None:
    array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
    array.SetName(name)
    attributes.AddArray(array)
