"""Quality in a pipeline of VTK: a filter for VTK from 9.2 on, also the one in ParaView."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase
from vtkmodules.vtkCommonDataModel import vtkDataObject, vtkUnstructuredGrid
from vtkmodules.vtkFiltersCore import vtkThreshold

from ..errors import MeshgaugeError
from ..io import from_pyvista
from ..look.bands import POOR
from ..quality.measure import JENS, Quality
from ..quality.measure import measure as measure_mesh
from ..status import Status, is_solid

_MASK = "meshgauge:mask"


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


def low_cells(data: Any, threshold: float = POOR) -> Any:
    """The cells of what `with_quality` made that are not ok: a vtkUnstructuredGrid with their data.

    Solid cells whose ``jens`` is below the threshold, or whose status is another than ok whatever it is.
    """
    from vtkmodules.util.numpy_support import vtk_to_numpy

    values = vtk_to_numpy(data.GetCellData().GetArray(JENS))
    status = vtk_to_numpy(data.GetCellData().GetArray("status"))
    with np.errstate(invalid="ignore"):
        chosen = is_solid(status) & ((status != Status.OK) | (values < threshold))
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


class MeshQuality(VTKPythonAlgorithmBase):  # type: ignore[misc]
    """Measures a vtkDataSet. Output 0: `with_quality`; output 1: `low_cells`, by `SetThreshold`."""

    def __init__(self) -> None:
        super().__init__(nInputPorts=1, inputType="vtkDataSet", nOutputPorts=2, outputType="vtkDataSet")
        self._threshold = POOR

    def GetThreshold(self) -> float:
        """Cells of lower quality go to the second output."""
        return self._threshold

    def SetThreshold(self, value: float) -> None:
        """See `GetThreshold`; `look.bands.POOR` until it is set."""
        if value != self._threshold:
            self._threshold = value
            self.Modified()

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

    def RequestData(self, request: Any, inputs: Any, outputs: Any) -> int:
        """Measure; what cannot be is reported as VTK reports errors."""
        data = self.GetInputData(inputs, 0, 0)
        try:
            result = with_quality(data)
            cells = low_cells(result, self._threshold)
        except MeshgaugeError as error:
            from vtkmodules.vtkCommonCore import vtkOutputWindow

            vtkOutputWindow.GetInstance().DisplayErrorText(f"meshgauge: {error}\n")
            return 0
        key = vtkDataObject.DATA_OBJECT()
        outputs.GetInformationObject(0).Get(key).ShallowCopy(result)
        outputs.GetInformationObject(1).Get(key).ShallowCopy(cells)
        return 1


def _measure(data: Any, metrics: Iterable[str]) -> Quality:
    quality = measure_mesh(from_pyvista(data), metrics=metrics)
    if quality.n_cells != data.GetNumberOfCells():
        raise MeshgaugeError(f"{quality.n_cells} of {data.GetNumberOfCells()} cells could be converted")
    return quality


def _add(attributes: Any, name: str, values: NDArray[Any]) -> None:
    array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
    array.SetName(name)
    attributes.AddArray(array)
