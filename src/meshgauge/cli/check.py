"""``meshgauge check``: hold meshes against rules; made for pipelines and pre-commit."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..files.standard import drop
from . import options, terminal
from .completion import mesh_files
from .groups.check import PipelineOptions, RuleOptions

if TYPE_CHECKING:
    from ..check.sources import RefusedRule


def check(
    meshes: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="MESH",
            help="Mesh files, folders of them, or patterns.",
            show_default="those of the settings",
            autocompletion=mesh_files,
        ),
    ] = None,
    *,
    rule_options: RuleOptions,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    pipelines: PipelineOptions,
    worst: options.Worst = 5,
    purpose: options.Purpose = None,
    keep_bricks: options.KeepBricks = False,
    threads: options.Threads = None,
    memory: options.Memory = None,
    scheduler: options.Scheduler = None,
    wedge_order: options.WedgeOrder = options.WedgeOrders.auto,
    as_one: options.AsOne = False,
    parts: options.PartsOf = None,
    exit_zero: options.ExitZero = False,
    reading: options.Reading,
) -> int:
    """Read, measure and judge each mesh in turn; returns the exit code."""
    from ..check.sources import RefusedRule

    if rule_options.init:
        return _init()
    from .gate import Gate
    from .watch import watched

    def once() -> tuple[int, Gate | None]:

        try:
            gate = Gate.of(
                meshes or (),
                rule_options,
                as_json=as_json,
                quiet=quiet,
                pipelines=pipelines,
                worst=worst,
                purpose=purpose,
                keep_bricks=keep_bricks,
                threads=threads,
                memory=memory,
                scheduler=scheduler,
                wedge_order=wedge_order,
                as_one=as_one,
                parts=parts,
                exit_zero=exit_zero,
                reading=reading,
            )
        except RefusedRule as refused:
            return _point_at(refused), None
        return gate.run(), gate

    if rule_options.watch:
        return watched(once, as_json=as_json)
    return once()[0]


def _init() -> int:
    """Write settings into this folder; returns the exit code."""
    from ..check.judge import default_rules
    from ..check.rules import Level
    from ..check.settings import create

    rules = default_rules()
    path = create(Path(), *([str(one) for one in rules if one.level is level] for level in (Level.FAIL, Level.WARN)))
    terminal.emit(f"{path}: name your meshes there, then run 'meshgauge check'")
    return terminal.DONE


def _point_at(refused: RefusedRule) -> int:
    """Print a rule that cannot be understood, with carets below the place; returns the exit code."""
    terminal.warn("error", f"{refused.where}: {refused.error.reason}")
    try:
        for line in refused.error.pointed.split("\n"):
            print(f"  {line}", file=sys.stderr, flush=True)
    except (OSError, ValueError):  # nobody reads it: the exit code still tells
        drop(sys.stderr)
    return terminal.COULD_NOT
