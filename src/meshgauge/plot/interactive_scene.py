"""The worst cells of a mesh in a PyVista plotter, to be turned by hand."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..look.colours import DEGENERATE, FAINT, HALO, INK, INVALID, POOR, RAMP, SKIN, rgb
from ..quality.measure import Quality
from ..status import Category, category
from . import callouts
from .pyvista_cells import CELL, drawable, edges, surface
from .rendering import check_drawing


def plotter(quality: Quality, n: int = 10, *, off_screen: bool | None = None) -> Any:
    """A PyVista plotter with the worst cells in the colours of their quality, numbered balls at their worst nodes.

    All of them are named in a list, with their values, and a legend says what the colours mean.

    Parameters
    ----------
    quality
        Of a mesh.
    n
        How many cells; fewer if fewer have a value.
    off_screen
        As PyVista's `Plotter` takes it; None: as PyVista is set.

    Returns
    -------
    pyvista.Plotter
        Not shown yet: call its ``show`` or ``screenshot``.

    Raises
    ------
    MeshgaugeError
        If there is nothing to draw.
    """
    import pyvista

    solids = drawable(quality, moved=False)  # other things may be added to the plotter
    grid = solids.grid
    if off_screen or pyvista.OFF_SCREEN:
        check_drawing()
    made = pyvista.Plotter(off_screen=off_screen)
    made.set_background("white")
    skin = surface(grid)
    made.add_mesh(skin, color=SKIN, opacity=0.14, pickable=False)
    sharp = edges(skin)
    if sharp.n_cells:
        made.add_mesh(sharp, color=FAINT, pickable=False)
    cells = quality.worst(n)
    if cells:
        drawn = np.isin(np.asarray(grid.cell_data[CELL]), [cell.cell for cell in cells])
        made.add_mesh(
            surface(grid.extract_cells(np.flatnonzero(drawn))),
            scalars="colour",
            rgb=True,
            show_edges=True,
            edge_color=INK,
        )
        at = pyvista.PolyData(solids.place([cell.coordinates for cell in cells]))
        made.add_mesh(at, color=INK, point_size=14, render_points_as_spheres=True, pickable=False)
        made.add_actor(_numbers(at), name="numbers", pickable=False, reset_camera=False)
        rows = [f"{n}  {'  '.join(callouts.caption(cell)[:2])}" for n, cell in enumerate(cells, 1)]
        made.add_text("\n".join(rows), position="upper_left", font_size=9, color=INK, name="worst cells")
        entries = _legend(quality, [cell.cell for cell in cells])
        made.add_actor(_square(0.015, 0.02, 0.3, 0.02 + 0.04 * len(entries), HALO, 0.8), name="legend")
        for n, (text, colour) in enumerate(entries[::-1]):
            low = 0.03 + 0.04 * n
            made.add_actor(_square(0.025, low, 0.045, low + 0.024, colour), name=text)
            made.add_text(text, position=(0.055, low), viewport=True, font_size=9, color=INK, name=f"{text} in words")
    return made


def _legend(quality: Quality, cells: list[int]) -> list[tuple[str, str]]:
    """What the colours of some cells mean."""
    of_cells = category(quality.status[cells], quality.mesh.purpose)
    is_poor = quality.values[cells] < quality.poor_limits(np.array(cells, np.int64))
    valid = of_cells == Category.VALID
    entries = [
        ("invalid", INVALID, of_cells == Category.INVALID),
        ("degenerate", DEGENERATE, of_cells == Category.DEGENERATE),
        (f"poor, below {quality.poor_below.text}", POOR, valid & is_poor),
        ("good, light is ideal", RAMP[1], valid & ~is_poor),
    ]
    return [(text, colour) for text, colour, which in entries if which.any()]


def _square(left: float, low: float, right: float, high: float, colour: str, opacity: float = 1.0) -> Any:
    """A rectangle on the picture, in shares of its width and height."""
    import pyvista
    from vtkmodules.vtkRenderingCore import vtkActor2D, vtkCoordinate, vtkPolyDataMapper2D

    place = vtkCoordinate()
    place.SetCoordinateSystemToNormalizedViewport()
    mapper = vtkPolyDataMapper2D()
    mapper.SetInputData(pyvista.Rectangle([(left, low, 0.0), (right, low, 0.0), (right, high, 0.0)]))
    mapper.SetTransformCoordinate(place)
    actor = vtkActor2D()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(*rgb(colour))
    actor.GetProperty().SetOpacity(opacity)
    return actor


def _numbers(at: Any) -> Any:
    """An actor of 1, 2, 3 ... beside some points; none is left out where they are near each other."""
    from vtkmodules.vtkRenderingCore import vtkActor2D
    from vtkmodules.vtkRenderingLabel import vtkLabeledDataMapper

    at["number"] = np.array([f"  {n}" for n in range(1, at.n_points + 1)])
    labels = vtkLabeledDataMapper()
    labels.SetInputData(at)
    labels.SetLabelModeToLabelFieldData()
    labels.SetFieldDataName("number")
    look = labels.GetLabelTextProperty()
    look.SetColor(*rgb(INK))
    look.SetFontSize(16)
    look.BoldOn()
    look.ItalicOff()
    look.ShadowOff()
    actor = vtkActor2D()
    actor.SetMapper(labels)
    return actor
