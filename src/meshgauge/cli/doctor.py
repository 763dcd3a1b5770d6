"""``meshgauge doctor``: say what is wrong with meshes beside the shapes of their cells."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from ..errors import ReadError
from . import inputs, options
from .options import MEASURING, option

if TYPE_CHECKING:
    from ..doctor import Diagnosis


def doctor(
    meshes: options.Meshes,
    *,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    tolerance: Annotated[
        float,
        option(
            "--tolerance",
            "X",
            "Points within X times the size of the mesh coincide.",
            MEASURING,
            least=1e-13,
            most=1.0,
        ),
    ] = 1e-9,
    keep_bricks: options.KeepBricks = False,
    memory: options.Memory = None,
    exit_zero: options.ExitZero = False,
    reading: options.Reading,
) -> int:
    """Read and diagnose each mesh in turn; returns the exit code."""
    paths = inputs.expand(meshes)

    from ..doctor import diagnosis
    from ..doctor.text import DiagnosisLine, DiagnosisText, diagnosis_json
    from .batch import Batch
    from .terminal import DONE, FAILED, Output, emit

    batch = Batch(reading=reading, quiet=quiet, keep_bricks=keep_bricks, memory=memory, then="diagnose")
    paths = batch.states(paths)

    def in_slices(path: str) -> Diagnosis | None:
        """That of a large mesh; None if it is to be read whole."""
        from ..doctor.streamed import MarkCounter
        from ..report.diagnosis import streamed_diagnosis
        from ..slices import Ask
        from .slices import diagnosing

        done = batch.in_slices(path, Ask(counter=MarkCounter()))
        if done is None:
            return None
        with diagnosing(path, shown=not quiet) as tell:
            made = streamed_diagnosis(*done, batch.allowed_memory, tolerance=tolerance, tell=tell)
        if made.repeated_points is not None:
            return made
        if memory is not None:  # as a whole it takes more
            raise ReadError(f"{path}: {made.skipped[0].removeprefix('The mesh ').removesuffix('.')}")
        return None

    def examine(path: str) -> Diagnosis:
        made = None if batch.is_small(path) else in_slices(path)
        if made is not None:
            return made
        mesh = batch.read_to_measure(path)
        with batch.progress(f"diagnosing {path}"):
            return diagnosis(mesh, tolerance=tolerance, keep_bricks=keep_bricks)

    output = Output()
    done: list[tuple[str, Diagnosis]] = []
    for path, result in batch.each(paths, examine):
        done.append((path, result))
        text = DiagnosisLine(path, result) if quiet else DiagnosisText(result, title=path)
        if not as_json and not output.show(text, wrap=not quiet):
            break  # nobody reads any more
    if as_json:
        emit(diagnosis_json(done, batch.failures))
    has_defects = any(result.n_defects for _, result in done) and not exit_zero
    return batch.exit_code or (FAILED if has_defects else DONE)
