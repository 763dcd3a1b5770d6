"""
Polyhedra on the same scale
===========================

Every polyhedron has J_ENS, 1 for the one with regular faces. Here six solids are stretched along one axis; their scores
fall from 1 as their corners leave the ideal. (A box would not notice: J_S sees angles, not lengths.)
"""

import matplotlib.pyplot as plt
import numpy as np

from meshgauge.mesh.polyhedra import Polyhedra
from meshgauge.quality.polyhedra import measure_polyhedra
from meshgauge.quality.reference import solid


def score(points, faces):
    """J_ENS of one cell given by its faces."""
    cell = Polyhedra(
        cell_offsets=np.array([0, len(faces)]),
        cell_faces=np.arange(len(faces)),
        face_offsets=np.cumsum([0, *(len(face) for face in faces)]),
        face_points=np.concatenate(faces),
    )
    return float(measure_polyhedra(points, cell, slice(0, 1)).values[0])


# %%
# Scores over the stretch.
stretches = np.geomspace(0.2, 5, 41)
figure, axes = plt.subplots(figsize=(8, 4.5), layout="constrained")
for name in ("tetrahedron", "cube", "octahedron", "dodecahedron", "icosahedron", "truncated octahedron"):
    shape = solid(name)
    axes.plot(stretches, [score(shape.points * (1, 1, s), shape.faces) for s in stretches], label=name)
axes.set(xscale="log", xlabel="stretched along z by", ylabel="J_ENS", ylim=(0, 1.03))
axes.axhspan(0, 0.2, color="#f0a202", alpha=0.2)
axes.text(0.21, 0.09, "poor")
axes.legend()
plt.show()
