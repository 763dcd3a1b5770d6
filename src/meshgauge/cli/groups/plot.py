"""Options of ``meshgauge plot``: which picture, and of what."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from .. import options
from ..options import option

CHARTS, SCENES = "Charts", "Scenes"
JENS = "jens"
MOST = 12
"""Cells in a scene of the worst ones."""


class Kinds(StrEnum):
    """The charts."""

    histogram = "histogram"
    types = "types"
    cumulative = "cumulative"
    steps = "steps"


class Scenes(StrEnum):
    """The scenes."""

    worst = "worst"
    faces = "faces"
    cut = "cut"


@dataclass(frozen=True, slots=True, kw_only=True)
class Picture:
    """A chart of one or several meshes, or a scene of one."""

    kind: Annotated[Kinds | None, option("--kind", None, "The chart.", CHARTS)] = None
    scene: Annotated[Scenes | None, option("--scene", None, "Draw one mesh in space instead.", SCENES)] = None
    metric: options.Metrics = None
    bins: options.Bins = 80
    log: Annotated[
        bool | None, option("--log/--linear", None, "Scale of the counts.", CHARTS, default="log if cumulative")
    ] = None
    worst: options.Worst = 6
    cell: options.Cell = None
    normal: Annotated[
        tuple[float, float, float] | None,
        option("--normal", "X Y Z", "From the cut to the eye.", SCENES, default="what shows most"),
    ] = None
    at: Annotated[
        float | None,
        option(
            "--at",
            "S",
            "Where to cut, a share of the size along the normal.",
            SCENES,
            least=0.0,
            most=1.0,
            default="at the worst cell",
        ),
    ] = None

    @property
    def is_scene(self) -> bool:
        """Whether one mesh is drawn in space."""
        return self.scene is not None or self.cell is not None

    @property
    def metrics(self) -> tuple[str, ...]:
        """The metrics to draw, each once."""
        usual = "non_orthogonality" if self.scene is Scenes.faces else JENS
        return tuple(dict.fromkeys(self.metric or (usual,)))

    def targets(self, output: Path) -> dict[str, Path]:
        """The file of each metric: the output, or one each beside it (``out-jens.png``) if there are several."""
        if len(self.metrics) == 1:
            return {self.metrics[0]: output}
        return {name: output.with_name(f"{output.stem}-{name}{output.suffix}") for name in self.metrics}

    def check(self, paths: Sequence[str]) -> None:
        """Refuse options that do not go together, rather than ignore them. Raises `typer.BadParameter`."""
        if self.cell is not None and self.scene is Scenes.cut:
            raise typer.BadParameter("--cell draws one cell, --scene cut the whole mesh: give one of them")
        if self.is_scene:
            if self.kind is not None:
                raise typer.BadParameter("--kind draws a chart and --scene a scene: give one of them")
            if len(paths) > 1:
                raise typer.BadParameter(f"a scene takes one mesh, {len(paths)} are given")
            if self.log is not None or (self.metrics != (JENS,) and self.scene is not Scenes.faces):
                raise typer.BadParameter("--metric and --log are of charts; a scene is coloured by jens")
            if self.cell is not None and self.scene is Scenes.faces:
                raise typer.BadParameter("--cell draws one cell, --scene faces the worst faces: give one of them")
        if self.kind is Kinds.steps and (len(paths) > 1 or self.metrics != (JENS,)):
            raise typer.BadParameter("--kind steps draws jens over the time steps of one file")
        if self.scene in (Scenes.worst, Scenes.faces) and not 1 <= self.worst <= MOST:
            raise typer.BadParameter(f"--worst is {self.worst}; a scene shows 1 to {MOST}")
        if self.scene is not Scenes.cut and (self.normal, self.at) != (None, None):
            raise typer.BadParameter("--normal and --at are of --scene cut")
        if self.kind in (Kinds.types, Kinds.steps) and self.log is not None:
            raise typer.BadParameter("--log is of histogram and cumulative")
