"""A plugin for ParaView: the filter *Meshgauge Quality*.

Load this file with Tools > Manage Plugins > Load New, or ``LoadPlugin`` in pvpython; ``meshgauge paraview-plugin``
prints where it is. Output *Measured*: the data set with cell arrays ``jens`` and ``status`` and point arrays
``jens_worst`` and ``jens_node``. Output *Low*: the cells that are invalid, without a value or below a threshold.

ParaView brings its own Python, VTK and NumPy. meshgauge and Numba are found beside this file, in the folder it is
installed in, which must be that of a Python of the same version as ParaView's.
"""

from __future__ import annotations

import sys
from pathlib import Path

SITE = str(Path(__file__).absolute().parents[2])
if SITE not in sys.path:
    # At the end: ParaView's own VTK and NumPy come first; another VTK beside them would end the program.
    sys.path.append(SITE)

from paraview.util.vtkAlgorithm import smdomain, smproperty, smproxy  # noqa: E402

try:
    from meshgauge.integrations.vtk import MeshQuality
    from meshgauge.look.bands import POOR
except ImportError as error:
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    raise ImportError(
        f"ParaView's Python {version} cannot load meshgauge from {SITE} ({error}); "
        f"install meshgauge for Python {version} and load the plugin from there (docs/integrations.md)"
    ) from error


@smproxy.filter(name="MeshgaugeQuality", label="Meshgauge Quality")
@smproperty.input(name="Input", port_index=0)
@smdomain.datatype(dataTypes=["vtkDataSet"], composite_data_supported=True)
@smproperty.xml('<OutputPort name="Measured" index="0"/><OutputPort name="Low" index="1"/>')
class MeshgaugeQuality(MeshQuality):
    """J_ENS of cells and points; the cells that are not ok apart."""

    @smproperty.doublevector(name="Threshold", default_values=POOR)
    @smdomain.doublerange(min=-1, max=1)
    def SetThreshold(self, value: float) -> None:
        """Cells of lower quality go to the second output."""
        super().SetThreshold(value)
