"""The worst cells of a mesh in a PyVista plotter, to be turned by hand."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..look.colours import FAINT, INK, SKIN
from ..quality.measure import Quality
from . import callouts
from .pyvista_cells import CELL, drawable, edges, surface
from .rendering import check_drawing


def plotter(quality: Quality, n: int = 10, *, off_screen: bool | None = None) -> Any:
    """A PyVista plotter with the worst cells in the colours of their quality, a ball at the worst node of each.

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
        made.add_point_labels(
            solids.place([cell.coordinates for cell in cells]),
            [f"    {': '.join(callouts.caption(cell)[:2])}" for cell in cells],
            point_color=INK,
            point_size=14,
            render_points_as_spheres=True,
            always_visible=True,
            text_color=INK,
            shape=None,
            font_size=12,
        )
    return made
