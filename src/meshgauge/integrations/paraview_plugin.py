"""A plugin for ParaView: the filters *Meshgauge Quality* and *Meshgauge Repair*, and the colours of the reports.

Load this file with Tools > Manage Plugins > Load New, or ``LoadPlugin`` in pvpython; ``meshgauge paraview-plugin``
prints where it is. *Quality* has two outputs: *Measured*, the data set with cell arrays by metric (``jens`` always) and
``status``, point arrays ``jens_worst`` and ``jens_node``; and *Low*, the cells of the statuses that are chosen, and
valid ones below a threshold. *Repair* moves points, and has the way of each as point array ``moved``.

ParaView brings its own Python, VTK and NumPy. meshgauge and Numba are found beside this file, in the folder it is
installed in, which must be that of a Python of the same version as ParaView's.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

SITE = str(Path(__file__).absolute().parents[2])
if SITE not in sys.path:
    # At the end: ParaView's own VTK and NumPy come first; another VTK beside them would end the program.
    sys.path.append(SITE)

from paraview.util.vtkAlgorithm import smdomain, smhint, smproperty, smproxy  # noqa: E402

try:
    from meshgauge.integrations.vtk import MeshQuality, MeshRepair
    from meshgauge.look.bands import POOR
    from meshgauge.plot.paraview_preset import QUALITY, STATUS, presets
except ImportError as error:
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    raise ImportError(
        f"ParaView's Python {version} cannot load meshgauge from {SITE} ({error}); "
        f"install meshgauge for Python {version} and load the plugin from there (docs/integrations.md)"
    ) from error


_MENU = '<ShowInMenu category="Meshgauge"/>'


def _switch(name: str) -> Any:
    """A property that is a box to tick."""
    return smproperty.xml(
        f'<IntVectorProperty name="{name}" command="Set{name}" number_of_elements="1" '
        'default_values="0"><BooleanDomain name="bool"/></IntVectorProperty>'
    )


def _number(name: str, value: float, low: float, high: float) -> Any:
    """A property that is a number in a range."""
    return smproperty.xml(
        f'<DoubleVectorProperty name="{name}" command="Set{name}" number_of_elements="1" '
        f'default_values="{value}"><DoubleRangeDomain name="range" min="{low}" max="{high}"/></DoubleVectorProperty>'
    )


@smhint.xml(_MENU)
@smproxy.filter(name="MeshgaugeQuality", label="Meshgauge Quality")
@smproperty.input(name="Input", port_index=0)
@smdomain.datatype(dataTypes=["vtkDataSet"], composite_data_supported=True)
@smproperty.xml('<OutputPort name="Measured" index="0"/><OutputPort name="Low" index="1"/>')
class MeshgaugeQuality(MeshQuality):
    """J_ENS of cells and points; the cells that are not ok apart."""

    @_number("Threshold", POOR, -1.0, 1.0)
    def SetThreshold(self, value: float) -> None:
        """Valid cells of lower quality go to the second output."""
        super().SetThreshold(value)

    @smproperty.dataarrayselection(name="Metrics")
    def GetMetrics(self) -> Any:
        """Metrics that are measured."""
        return super().GetMetrics()

    @smproperty.dataarrayselection(name="Statuses")
    def GetStatuses(self) -> Any:
        """Statuses whose cells go to the second output, whatever their value."""
        return super().GetStatuses()


@smhint.xml(_MENU)
@smproxy.filter(name="MeshgaugeRepair", label="Meshgauge Repair")
@smproperty.input(name="Input", port_index=0)
@smdomain.datatype(dataTypes=["vtkPointSet"], composite_data_supported=True)
class MeshgaugeRepair(MeshRepair):
    """Moves points so that no cell is inverted and the worst are better."""

    @_number("Target", POOR, 0.0, 1.0)
    def SetTarget(self, value: float) -> None:
        """Cells of lower quality are mended."""
        super().SetTarget(value)

    @_switch("Everywhere")
    def SetEverywhere(self, value: int) -> None:
        """All points move, not only those near bad cells."""
        super().SetEverywhere(value)

    @_switch("BoundarySlides")
    def SetBoundarySlides(self, value: int) -> None:
        """Points of the boundary move on it."""
        super().SetBoundarySlides(value)

    @_number("Seconds", 0.0, 0.0, 86400.0)
    def SetSeconds(self, value: float) -> None:
        """The best so far is then the result; 0: no limit."""
        super().SetSeconds(value)


def _set_colours() -> None:
    """The presets, and the maps of ``jens`` and ``status``, where there is a session to have them."""
    from paraview import servermanager, simple

    if servermanager.ActiveConnection is None:
        return  # a server: colours are its client's
    known = servermanager.vtkSMTransferFunctionPresets.GetInstance()
    for preset in presets():
        if not known.HasPreset(preset["Name"]):
            known.AddPreset(preset["Name"], json.dumps(preset))
    for array, name in (("jens", QUALITY), ("status", STATUS)):
        colours = simple.GetColorTransferFunction(array)
        colours.ApplyPreset(name, False)
        colours.AutomaticRescaleRangeMode = "Never"  # -1 to 1, not the range of the mesh
        colours.ScalarRangeInitialized = 1


_set_colours()
