"""
In PyVista, cut open
====================

Every data set of PyVista has ``.gauge``. Its arrays stand on a copy of the mesh, so cutting, thresholds and colours are
PyVista's own. Here the bracket is clipped, and then its worst cells are shown where they are.
"""

import pyvista as pv

grid = pv.read("../meshes/bracket.vtu")
measured = grid.gauge.quality()
print(f"{(measured['jens'] < 0.2).sum()} of {measured.n_cells} cells are below 0.2")

# %%
# All cells behind a plane, in the colours of the report: invalid ones red, poor ones yellow, good ones blue and lighter
# towards the ideal.
colours = ["#d1300f"] * 5 + ["#f0a202"] + ["#14456f", "#3f7fae", "#9cc3dc", "#eef4f8"]
plotter = pv.Plotter()
cut = measured.clip(normal="-y", crinkle=True)
plotter.add_mesh(cut, scalars="jens", cmap=colours, clim=(-1, 1), show_edges=True, scalar_bar_args={"title": "J_ENS\n"})
plotter.camera_position = "xz"
plotter.camera.azimuth, plotter.camera.elevation = 35, 25
plotter.show()

# %%
# The cells below 0.2, in the outline of the mesh. ``grid.gauge.plot_worst(10)`` adds a ball at each worst node.
plotter = pv.Plotter()
plotter.add_mesh(measured.extract_surface(algorithm="dataset_surface"), color="#8899aa", opacity=0.2)
plotter.add_mesh(measured.threshold(0.2, invert=True, scalars="jens"), color="#d1300f", show_edges=True)
plotter.camera_position = "xz"
plotter.camera.azimuth, plotter.camera.elevation = 35, 25
plotter.show()
