"""
A mesh over time
================

A bracket is crumpled along its length, further and further, as in a crash. The file of time steps is
measured step by step: when does the first cell turn inside out?
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import meshgauge

MESHES = Path("examples/meshes") if Path("examples").is_dir() else Path("../meshes")
start = meshgauge.read(MESHES / "bracket_good.vtu")

# %%
# Ten steps, written as a collection of ParaView (.pvd).
folder = Path(tempfile.mkdtemp())
rows = []
wave = 6 * np.pi / np.ptp(start.points[:, 0])
for n in range(10):
    points = start.points.copy()
    points[:, 0] -= 0.13 * n / wave * np.sin(wave * points[:, 0])
    meshgauge.write(folder / f"{n}.vtu", start.replace(points=points))
    rows.append(f'<DataSet timestep="{0.1 * n:.1f}" file="{n}.vtu"/>')
(folder / "run.pvd").write_text(f'<VTKFile type="Collection"><Collection>{"".join(rows)}</Collection></VTKFile>')

# %%
# Each step is read, measured and let go.
times, least, one_percent, invalid = [], [], [], []
for (step,), mesh in meshgauge.io.read_steps(folder / "run.pvd"):
    tally = meshgauge.measure(mesh).summary().all
    times.append(step.time)
    least.append(tally.min)
    one_percent.append(tally.quantiles([0.01])[0.01])
    invalid.append(tally.n_invalid)
    print(f"{step}: least {tally.min:.3f}, {tally.n_invalid} invalid")

# %%
# ``meshgauge report run.pvd --step all`` prints the same as sparklines.
figure, axes = plt.subplots(figsize=(8, 4), layout="constrained")
axes.plot(times, least, "o-", label="least")
axes.plot(times, one_percent, "s-", label="1 %")
axes.axhline(0, color="#d1300f", lw=1)
axes.set(xlabel="time", ylabel="J_ENS")
axes.legend()
plt.show()
