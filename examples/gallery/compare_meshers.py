"""
Which mesher is better?
=======================

The same block, meshed with tetrahedra in two ways: bricks cut into six each, and a Delaunay triangulation of the same
points moved a little. One number for both makes them comparable, and the comparison says in what each is better.
"""

import numpy as np
import pyvista

import meshgauge
from meshgauge.compare import comparison
from meshgauge.compare.plot import comparison_chart
from meshgauge.compare.sentences import sentences

# %%
# Points of a grid of 8 x 8 x 8, and two meshes of them.
axis = np.linspace(0, 1, 9)
grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
inner = ((grid > 0) & (grid < 1)).all(axis=1)
moved = grid.copy()
moved[inner] += np.random.default_rng(1).uniform(-0.02, 0.02, (inner.sum(), 3))

corner = np.arange(9**3).reshape(9, 9, 9)[:-1, :-1, :-1].ravel()
step = {"x": 81, "y": 9, "z": 1}
ways = [("x", "y", "z"), ("y", "z", "x"), ("z", "x", "y"), ("y", "x", "z"), ("x", "z", "y"), ("z", "y", "x")]
tetra = []
for way in ways:  # along three edges from one corner of a brick to the opposite one
    nodes = np.cumsum([np.zeros_like(corner), *(np.full_like(corner, step[edge]) for edge in way)], axis=0) + corner
    tetra.append(nodes.T if way in ways[:3] else nodes[[0, 2, 1, 3]].T)
cut = meshgauge.Mesh.from_arrays(grid, {"tetra": np.concatenate(tetra)})

delaunay = meshgauge.from_pyvista(pyvista.PolyData(moved).delaunay_3d())
print(cut, delaunay, sep="\n")

# %%
# In words, as ``meshgauge compare`` says it.
found = comparison({"cut bricks": meshgauge.measure(cut), "Delaunay": meshgauge.measure(delaunay)})
print("\n".join(sentences(found)))

# %%
# The distributions: cut bricks are all alike; Delaunay's differ, with flat ones (slivers) among them.
figure = comparison_chart(found)
