"""``meshgauge check``: hold meshes against rules; made for pipelines and pre-commit."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..look import style
from ..look.bands import USUAL
from . import inputs, options, terminal
from .groups.check import PipelineOptions, RuleOptions

if TYPE_CHECKING:
    from ..check import Check
    from ..check.sources import RefusedRule
    from .batch import Batch


def check(
    meshes: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="MESH", help="Mesh files, folders of them, or patterns.", show_default="those of the settings"
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
    exit_zero: options.ExitZero = False,
    reading: options.Reading,
) -> int:
    """Read, measure and judge each mesh in turn; returns the exit code."""
    from ..check.settings import SettingsError
    from ..check.sources import RefusedRule, baselines_of, meshes_of, rules_of, settings_of

    if rule_options.init:
        return _init()
    settings = settings_of(rule_options.config)
    paths = inputs.expand(meshes or meshes_of(settings))
    if not paths:
        raise SettingsError("no mesh is given, and no settings name any (check.meshes)")
    try:  # None: those of the purpose of each mesh
        rules = rules_of(settings, rule_options.fail or (), rule_options.warn or ())
    except RefusedRule as refused:
        return _point_at(refused)
    # Before anything is measured: a stored report that is missing, or that an output would overwrite, is known at once.
    baseline = rule_options.write_baseline
    stored = baselines_of(rules or ()) if baseline is None else {}
    inputs.check_targets(paths, texts=(*pipelines.files.values(), baseline))

    from ..check import State, metrics_of
    from ..check import check as judge
    from ..check.outcome import overall
    from ..check.output.json import checks_json
    from ..check.output.text import CheckLine, ChecksText, CheckText
    from ..check.stream import check_slices, question
    from .batch import Batch
    from .batch import State as TimeState

    batch = Batch(
        reading=reading,
        wedge_order=wedge_order,
        purpose=purpose,
        threads=threads,
        keep_bricks=keep_bricks,
        memory=memory,
        scheduler=scheduler,
        poor_below=USUAL if settings is None else settings.poor_below,
        quiet=quiet,
    )
    paths = [inputs.Joined.of(paths)] if as_one else paths
    paths = batch.states(paths, every=True)  # a gate that lets an invalid step pass is none
    if baseline is not None:
        return _write_baseline(batch, paths, metrics_of(rules or ()), baseline)

    ask = question(
        rules,
        listed=worst,
        purpose=None if purpose is None else purpose.value,
        poor_below=batch.poor,
    )

    def examine(path: str) -> Check:
        done = batch.in_slices(path, ask)
        if done is not None:
            return check_slices(*done, path=path, baselines=stored)
        quality = batch.measure(path, metrics_of(rules or ()))
        if rules is None:
            quality = batch.with_faces(path, quality)
        return judge(quality, rules, path=path, listed=worst, baselines=stored)

    is_used = not meshes or not (rule_options.fail or rule_options.warn)
    used = str(settings.path) if settings is not None and is_used else None
    if used is not None and not (as_json or quiet):
        terminal.emit(f"settings: {style.printable(used)}")
    output, is_read = terminal.Output(), not as_json
    checks: list[Check] = []
    for path, one in batch.each(paths, examine):
        if isinstance(path, TimeState):
            one = replace(one, step=path.of_file)
        checks.append(one)
        if is_read:
            is_read = output.show(CheckLine(one) if quiet else CheckText(one), wrap=not quiet)
    if as_json:
        terminal.emit(checks_json(checks, batch.failures, settings=used))
    elif len(paths) > 1 and is_read and not quiet:
        output.show(ChecksText(checks, batch.failures))
    pipelines.write(checks, batch.failures)
    codes = {State.UNCHECKED: terminal.COULD_NOT, State.FAIL: terminal.DONE if exit_zero else terminal.FAILED}
    return codes.get(overall(checks, len(batch.failures)), terminal.DONE)


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
    for line in refused.error.pointed.split("\n"):
        print(f"  {line}", file=sys.stderr)
    return terminal.COULD_NOT


def _write_baseline(batch: Batch, paths: Sequence[str], metrics: Sequence[str], target: Path) -> int:
    """Store reports as a baseline, if every mesh can be measured; returns the exit code."""
    from ..check.baseline import write
    from ..report import FileReport
    from ..report.stream import file_report
    from ..slices import Ask

    def examine(path: str) -> FileReport:
        done = batch.in_slices(path, Ask(tuple(metrics), n_worst=0))
        if done is not None:
            return file_report(*done, path=path)
        return FileReport.of(batch.measure(path, metrics), path=path, worst=0, threads=batch.threads)

    reports = [report for _, report in batch.each(paths, examine)]
    if not batch.failures:
        write(target, reports)
        if not batch.quiet:
            terminal.emit(f"{target}: {len(reports)} mesh{'' if len(reports) == 1 else 'es'} stored")
    return batch.exit_code
