"""meshgauge on arrays and on a file.

python examples/quickstart.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import meshgauge

# On arrays: points, and the point ids of each cell.
points = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
print("a cube:", meshgauge.jens(points, [(0, 1, 2, 3, 4, 5, 6, 7)], "hexahedron"))

points[6] = 0.2, 0.2, 0.2  # push a corner deep into the cube
print("dented:", meshgauge.jens(points, [(0, 1, 2, 3, 4, 5, 6, 7)], "hexahedron"))
print("at its nodes:", meshgauge.jens(points, [(0, 1, 2, 3, 4, 5, 6, 7)], "hexahedron", nodes=True).round(2))

# On a file of any format and any mix of cell types.
mesh = meshgauge.read(Path(__file__).with_name("meshes") / "bracket.vtu")
quality = meshgauge.measure(mesh)
print(mesh)
print("inverted:", np.count_nonzero(quality.values < 0), "median:", np.median(quality.values).round(3))
for worst in quality.worst(3):
    print(f"cell {worst.cell}, a {worst.type}: {worst.quality:.3f} at point {worst.point}")
