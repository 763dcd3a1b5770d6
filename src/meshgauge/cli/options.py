"""The options that several commands share, each once: its names, its help, its place in the help.

An alias is an option with its type (``threads: Threads = None``). A group is a frozen dataclass of options: a command
with the parameter ``reading: Reading`` has all of them (`command.unfold`), so a new one is a new field here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from .completion import format_names, mesh_files, metric_names

READING, MEASURING, WRITING = "How to read", "What to measure", "Where to"
"""Panels of the help."""


def option(
    names: str,
    metavar: str | None,
    text: str,
    panel: str | None = None,
    *,
    least: float | None = None,
    most: float | None = None,
    default: bool | str = True,
    completes: Callable[[str], list[str]] | None = None,
) -> Any:
    """What `Annotated` needs to make a parameter an option.

    Parameters
    ----------
    names
        ``"--quiet -q"``.
    metavar
        What stands for the value in the help; None: the choices, or nothing.
    text
        The help.
    panel
        The panel of the help that lists it.
    least, most
        The range of a number.
    default
        What the help calls the default; False: nothing, True: the value itself.
    completes
        Gives the values that begin so, for shells that complete what is typed.
    """
    return typer.Option(
        *names.split(),
        metavar=metavar,
        help=text,
        rich_help_panel=panel,
        min=least,
        max=most,
        show_default=default,
        autocompletion=completes,
    )


class WedgeOrders(StrEnum):
    """How the wedges of a file may be numbered."""

    auto = "auto"
    gmsh = "gmsh"
    vtk_legacy = "vtk-legacy"


class Parts(StrEnum):
    """What a mesh can be reported by, beside the type of its cells."""

    region = "region"


class Dimensions(StrEnum):
    """Which cells are measured."""

    auto = "auto"
    surfaces = "2"
    solids = "3"

    @property
    def value_or_none(self) -> Literal[2, 3] | None:
        """As `meshgauge.measure` takes it."""
        return {"auto": None, "2": 2, "3": 3}[self.value]


class Purposes(StrEnum):
    """What a mesh may be for: finite elements, also with explicit time steps, or finite volumes."""

    fem = "fem"
    fv = "fv"
    explicit = "explicit"

    @property
    def of_mesh(self) -> Literal["fem", "fv"]:
        """As `Mesh.purpose` has it: explicit time steps ask for the same cells, by other rules."""
        return "fv" if self is Purposes.fv else "fem"


Meshes = Annotated[
    list[str],
    typer.Argument(
        metavar="MESH",
        help="Mesh files, folders of them, OpenFOAM or Elmer cases, or patterns such as 'runs/*.vtu'.",
        autocompletion=mesh_files,
    ),
]
OneMesh = Annotated[
    str,
    typer.Argument(metavar="MESH", help="A mesh file, or a folder of OpenFOAM or Elmer.", autocompletion=mesh_files),
]

FileFormat = Annotated[
    str | None,
    option("--format", "NAME", "Read as this format.", READING, default="by name and content", completes=format_names),
]
WedgeOrder = Annotated[
    WedgeOrders,
    option("--wedge-order", None, "Numbering of wedges in the file; auto decides by their volumes.", READING),
]
Step = Annotated[
    str | None,
    option("--step", "STEP", "Which time step: first, last, its number from 1, or all.", READING, default=False),
]
Displacement = Annotated[
    str | None,
    option("--displacement", "NAME", "Add this point data to the points: the deformed shape.", READING, default=False),
]
AsOne = Annotated[
    bool, option("--as-one", None, "The files are the parts of one mesh, in the order of their numbers.", READING)
]
ReadSeconds = Annotated[
    float | None,
    option(
        "--read-seconds",
        "S",
        "Stop a third-party reader after this time.",
        READING,
        least=0.1,
        most=1e6,
        default="60 and 1 a MB",
    ),
]
IncludeRoot = Annotated[
    list[Path] | None,
    option(
        "--include-root",
        "DIR",
        "Let mesh files name others of this folder too; may be repeated.",
        READING,
    ),
]
ReadMemory = Annotated[
    float | None,
    option(
        "--read-memory",
        "GB",
        "Memory that a third-party reader may use.",
        READING,
        least=0.1,
        most=1e6,
        default="4 and 60 times the file",
    ),
]

Dimension = Annotated[
    Dimensions,
    option(
        "--dimension",
        None,
        "Which cells are measured: surfaces (2) or solids (3). auto: solids if there are any.",
        READING,
    ),
]

Metrics = Annotated[
    list[str] | None,
    option(
        "--metric",
        "NAME",
        "Measure this; repeatable. 'meshgauge metrics' lists them.",
        MEASURING,
        default="jens",
        completes=metric_names,
    ),
]
Purpose = Annotated[
    Purposes | None,
    option(
        "--for",
        None,
        "What the mesh is for: finite elements (explicit: with explicit time steps) or finite volumes.",
        MEASURING,
        default="fv for formats of finite volumes, else fem",
    ),
]
By = Annotated[
    Parts | None,
    option("--by", None, "Show this as well: materials, zones, physical groups, blocks.", MEASURING),
]
KeepBricks = Annotated[
    bool,
    option("--keep-bricks", None, "Measure bricks with repeated nodes as they are.", MEASURING),
]
Cell = Annotated[
    str | None,
    option("--cell", "LABEL", "One cell: its number in the file, or its position if it has none.", default=False),
]
_WORST = option("--worst", "N", "List so many cells, the worst first.", MEASURING, least=0)
Worst = Annotated[int, _WORST]
WorstIfGiven = Annotated[int | None, _WORST]
Bins = Annotated[int, option("--bins", "N", "Bins of histograms.", MEASURING, least=1, most=10_000)]
Threads = Annotated[
    int | None, option("--threads", "N", "Threads to use.", MEASURING, least=1, default="all processors")
]

PartsOf = Annotated[
    int | None,
    option("--parts", "N", "Of how many parts the mesh is; fewer are an error.", READING, least=1, default=False),
]
Memory = Annotated[
    str | None,
    option(
        "--memory",
        "SIZE",
        "Memory for the points of a large mesh, such as 512MB or 4GB.",
        MEASURING,
        default="a quarter of what is free",
    ),
]
Scheduler = Annotated[
    str | None,
    option(
        "--scheduler",
        "N|ADDRESS",
        "Work on a large mesh in so many processes, or on a cluster of Dask.",
        MEASURING,
        default="$DASK_SCHEDULER_ADDRESS, else threads",
    ),
]

OutputMesh = Annotated[Path | None, option("--output -o", "MESH", "Write the mesh here.", WRITING)]
InPlace = Annotated[bool, option("--in-place", None, "Replace the input instead.", WRITING)]
Undo = Annotated[
    Path | None,
    option(
        "--undo",
        "FILE",
        "Keep the old bytes of what changes, for 'meshgauge undo' (.npz).",
        WRITING,
        default="with --in-place beside the file: NAME.undo.npz",
    ),
]
Convert = Annotated[
    bool,
    option("--convert", None, "Write the mesh anew, also where its file could be patched.", WRITING),
]
AllTimes = Annotated[
    bool,
    option("--all-times", None, "Copy the other times of an OpenFOAM case too, as they are.", WRITING),
]
Html = Annotated[
    Path | None, option("--html", "FILE", "Write a page with pictures: one file that opens offline.", WRITING)
]
Json = Annotated[bool, option("--json", None, "Print JSON, for programs.", WRITING)]
ExitZero = Annotated[
    bool, option("--exit-zero", None, "Exit with 0 also where something was found; not where a file failed.", WRITING)
]
Quiet = Annotated[bool, option("--quiet -q", None, "Print the verdict only, and no progress.", WRITING)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """How files are read: the options of every command that reads."""

    file_format: FileFormat = None
    step: Step = None
    displacement: Displacement = None
    dimension: Dimension = Dimensions.auto
    read_seconds: ReadSeconds = None
    read_memory: ReadMemory = None
    include_root: IncludeRoot = None
