"""
A gate for a pipeline
=====================

Rules that a mesh must keep, checked from Python as ``meshgauge check`` does: what fails, in which cells, at which
point.
"""

from pathlib import Path

import meshgauge
from meshgauge.check import check, rule

MESHES = Path("examples/meshes") if Path("examples").is_dir() else Path("../meshes")
rules = ["nothing invalid", "jens >= 0.2 @ 1%", rule("jens >= 0.3 @ 1%", level="warn")]

# %%
# One mesh that passes, and one that does not.
for name in ("bracket_good.vtu", "bracket.vtu"):
    found = check(meshgauge.measure(meshgauge.read(MESHES / name)), rules)
    print(name, "passes" if found.is_passed else "fails")
    for outcome in found.outcomes:
        print(f"  {outcome.state:5} {outcome.rule}: {outcome.text}")
        for cell in outcome.cells[:2] if outcome.state == "fail" else ():
            print(f"        {cell.text}")
