"""
Repair a boundary layer
=======================

Twelve layers of hexahedra that get thinner towards a wall, on a wavy floor. Some points were pushed through their
neighbours. Repair moves points near the bad cells only, keeps the wall, and holds the heights of the layers.
"""

import numpy as np

import meshgauge
from meshgauge import plot

# %%
# The mesh: 16 x 16 columns; the first layer is 1/40 of the last.
n, layers = 16, 12
height = np.cumsum([0, *1.4 ** np.arange(layers)])
x, y, z = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0), 6 * height / height[-1], indexing="ij")
floor = 0.4 * np.sin(0.7 * x) * np.cos(0.5 * y)
points = np.stack([x, y, z + floor * (1 - z / z.max())], axis=-1)

rng = np.random.default_rng(3)
for i, j, k in zip(rng.integers(2, n - 1, 4), rng.integers(2, n - 1, 4), rng.integers(2, 5, 4), strict=True):
    points[i, j, k, 2] += 1.4 * (points[i, j, k + 1, 2] - points[i, j, k, 2])  # through the layer above

ids = np.arange(points[..., 0].size).reshape(points.shape[:3])
corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
cells = np.stack([ids[a : a + n, b : b + n, c : c + layers].ravel() for a, b, c in corners], axis=1)
mesh = meshgauge.Mesh.from_arrays(points.reshape(-1, 3), {"hexahedron": cells})
quality = meshgauge.measure(mesh)
print(quality)

# %%
# Cut open at the worst cell: the layers, and what is inverted in them.
figure = plot.cut(quality, normal=(0.3, -1, 0.4))

# %%
# Repair, and what it promises.
result = meshgauge.improve(mesh)
print(result)
for claim in result.report.claims:
    print("holds" if claim.holds else "BROKEN", "-", claim.text)

# %%
# Only points near them moved, and the cells that were good keep their volumes and the heights of their layers.
report = result.report
print(f"{report.displacement.share:.1%} of the points moved")
print(f"volumes of good cells changed by a factor of at most {report.sizes.volume:.2f}")
repaired = plot.cut(result.after, normal=(0.3, -1, 0.4))
