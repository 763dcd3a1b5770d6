"""``meshgauge doctor``: say what is wrong with meshes beside the shapes of their cells."""

from __future__ import annotations

from functools import partial
from typing import Annotated

import typer

from . import inputs
from .report import WRITING, FormatOption

AS_IN_THE_FILE = "gmsh"
"""Wedges are not turned while reading: which of them are numbered in reverse is told by their faces."""

HELP = """Say what is wrong with a mesh beside the shapes of its cells.

Finds cells that are numbered in reverse, told from cells that are really inverted; cells that have a point twice or are there twice; faces of three or more cells, and two triangles against a quadrilateral; parts that do not hang together; points that coincide, and points of no cell. Nothing is repaired: for cells numbered in reverse see [bold]meshgauge orient[/bold].

Exit codes: 0 done, 2 some file could not be read, 130 interrupted."""  # noqa: E501  Typer joins no lines of a paragraph


def register(app: typer.Typer) -> None:
    """Add the subcommand."""
    app.command(
        name="doctor",
        help=HELP,
        short_help="Say what is wrong with a mesh beside the shapes of its cells.",
        no_args_is_help=True,
    )(doctor)


def doctor(
    meshes: Annotated[list[str], typer.Argument(metavar="MESH", help="Mesh files, or patterns such as 'runs/*.vtu'.")],
    json: Annotated[
        bool, typer.Option("--json", help="Print JSON instead (docs/doctor.md).", rich_help_panel=WRITING)
    ] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress.", rich_help_panel=WRITING)] = False,
    tolerance: Annotated[
        float,
        typer.Option(
            "--tolerance",
            metavar="X",
            min=1e-13,
            max=1.0,
            help="Points within X times the size of the mesh coincide.",
        ),
    ] = 1e-9,
    format: FormatOption = None,
) -> int:
    """Read and diagnose each mesh in turn; returns the exit code."""
    paths = inputs.expanded(meshes)

    from ..doctor import Diagnosis, diagnosis
    from ..doctor.text import DiagnosisText, diagnosis_json
    from ..errors import FailedFile
    from ..io import read
    from .attempt import attempt
    from .terminal import Output, activity, emit, warn

    output = Output()
    done: list[tuple[str, Diagnosis]] = []
    failures: list[FailedFile] = []

    def diagnosed(path: str) -> Diagnosis:
        with activity(f"reading {path}", shown=not quiet):
            mesh = read(path, file_format=format, wedge_order=AS_IN_THE_FILE)
        with activity(f"diagnosing {path}", shown=not quiet):
            return diagnosis(mesh, tolerance=tolerance)

    for path in paths:
        found = attempt(path, partial(diagnosed, path))
        if isinstance(found, FailedFile):
            failures.append(found)
            warn("error", f"{path}: {found.reason}")
            continue
        done.append((path, found))
        if not json and not output.show(DiagnosisText(found, title=path)):
            break  # nobody reads any more
    if json:
        emit(diagnosis_json(done, failures))
    return 2 if failures else 0
