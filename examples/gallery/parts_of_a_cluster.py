"""
Parts of a mesh, measured apart
===============================

On a cluster each rank has a part of the mesh. It measures that, and what it found is small; merged, in any order, the
parts give the report of the whole. Here the ranks are a loop.
"""

from pathlib import Path

import numpy as np

import meshgauge

MESHES = Path("examples/meshes") if Path("examples").is_dir() else Path("../meshes")
whole = meshgauge.read(MESHES / "bracket.vtu")

# %%
# Four parts, as a partitioner would hand them out.
shares = np.array_split(np.arange(whole.n_cells), 4)
partials = [meshgauge.partial(whole[cells], part=(rank, 4)) for rank, cells in enumerate(shares)]
for rank, partial in enumerate(partials):
    print(f"rank {rank}: {partial.n_cells:,} cells")

# %%
# On rank 0, with mpi4py: ``meshgauge.merge(comm.gather(partial))``.
report = meshgauge.merge(reversed(partials))
print(report.summary.all.in_words())
print(meshgauge.measure(whole).summary().all.in_words())
