"""``meshgauge orient``: renumber cells that are numbered in reverse."""

from __future__ import annotations

from pathlib import Path

from . import inputs, options


def orient(
    mesh: options.OneMesh,
    *,
    output: options.OutputMesh = None,
    in_place: options.InPlace = False,
    undo: options.Undo = None,
    convert: options.Convert = False,
    quiet: options.Quiet = False,
    reading: options.Reading,
) -> int:
    """Read, renumber, write, say what was done; returns the exit code."""
    target = inputs.mesh_target([mesh], output, in_place=in_place, what="renumbered") or Path(mesh)
    inputs.check_targets([mesh], files=[output, undo])

    from .. import doctor
    from ..doctor.text import ChangesLine, ChangesText
    from .batch import Batch
    from .changed import ChangedMesh
    from .terminal import Output

    batch = Batch(reading=reading, quiet=quiet)
    batch.require_one_state(mesh)
    before = batch.read(mesh)
    with batch.progress(f"renumbering {mesh}"):
        after, changes = doctor.orient(before)
    changed = ChangedMesh.of(
        batch,
        before,
        target,
        in_place=in_place,
        undo=undo,
        convert=convert,
        changes="nothing" if after is before else "order",
    )
    changed.write(after)
    if quiet:
        Output().show(ChangesLine(mesh, changes), wrap=False)
    else:
        Output().show(ChangesText(mesh, changes, notes=before.notes))
    return batch.exit_code
