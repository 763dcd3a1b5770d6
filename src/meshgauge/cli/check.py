"""``meshgauge check``: hold meshes against rules; made for pipelines and pre-commit."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import FailedFile
from . import inputs, options, terminal
from .options import option

if TYPE_CHECKING:
    from ..check import Check
    from ..check.sources import RefusedRule
    from .batch import Batch

PIPELINES = "For pipelines"

FAILED = 1
"""Exit code: a rule is broken."""

SUMMARY = "GITHUB_STEP_SUMMARY"
"""Environment variable: a file of GitHub Actions to which a job adds Markdown."""


def check(
    meshes: Annotated[
        list[str] | None,
        typer.Argument(metavar="[MESH]", help="Mesh files, or patterns.", show_default="those of the settings"),
    ] = None,
    *,
    fail: Annotated[
        list[str] | None, option("--fail", "RULE", "Fail if this rule is broken; repeatable.", default=False)
    ] = None,
    warn: Annotated[
        list[str] | None, option("--warn", "RULE", "Warn if this rule is broken; repeatable.", default=False)
    ] = None,
    config: Annotated[
        Path | None, option("--config", "FILE", "Take the settings from this file.", default="the nearest one")
    ] = None,
    write_baseline: Annotated[
        Path | None, option("--write-baseline", "FILE", "Check nothing, store what is measured instead.")
    ] = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    junit: Annotated[Path | None, option("--junit", "FILE", "Write JUnit XML.", PIPELINES)] = None,
    sarif: Annotated[Path | None, option("--sarif", "FILE", "Write SARIF 2.1.0.", PIPELINES)] = None,
    gitlab: Annotated[Path | None, option("--gitlab", "FILE", "Write GitLab's code quality report.", PIPELINES)] = None,
    markdown: Annotated[Path | None, option("--markdown", "FILE", "Write a summary in Markdown.", PIPELINES)] = None,
    github: Annotated[
        bool | None,
        option(
            "--github/--no-github",
            None,
            "Annotate, and add to the summary of the job.",
            PIPELINES,
            default="if it runs in GitHub Actions",
        ),
    ] = None,
    worst: options.Worst = 5,
    purpose: options.Purpose = None,
    threads: options.Threads = None,
    wedge_order: options.WedgeOrder = options.WedgeOrders.auto,
    reading: options.Reading,
) -> int:
    """Read, measure and judge each mesh in turn; returns the exit code."""
    from ..check.settings import SettingsError
    from ..check.sources import RefusedRule, baselines_of, meshes_of, rules_of, settings_of

    settings = settings_of(config)
    paths = inputs.expanded(meshes or meshes_of(settings))
    if not paths:
        raise SettingsError("no mesh is given, and no settings name any (check.meshes)")
    files = {"junit": junit, "sarif": sarif, "gitlab": gitlab, "markdown": markdown}
    try:
        rules = rules_of(settings, fail or (), warn or ())  # None: those of the purpose of each mesh
    except RefusedRule as refused:
        return _point_at(refused)
    # Before anything is measured: a stored report that is missing, or that an output would overwrite, is known at once.
    baselines = baselines_of(rules or ()) if write_baseline is None else {}
    inputs.check_targets(paths, texts=(*files.values(), write_baseline))

    from ..check import State, metrics_of
    from ..check import check as judge
    from ..check.outcome import overall
    from ..check.output import text_for
    from ..check.output.json import checks_json
    from ..check.output.text import CheckLine, ChecksText, CheckText
    from .batch import Batch

    batch = Batch(reading=reading, wedge_order=wedge_order, purpose=purpose, threads=threads, quiet=quiet)
    paths = batch.states(paths, every=True)  # a gate that lets an invalid step pass is none
    if write_baseline is not None:
        return _store(batch, paths, metrics_of(rules or ()), write_baseline)

    def examine(path: str) -> Check:
        quality = batch.measure(path, metrics_of(rules or ()))
        return judge(quality, rules, path=path, listed=worst, baselines=baselines)

    output, is_read = terminal.Output(), not as_json
    checks: list[Check] = []
    for _, one in batch.each(paths, examine):
        checks.append(one)
        if is_read:
            is_read = output.show(CheckLine(one) if quiet else CheckText(one), wrap=not quiet)
    if as_json:
        terminal.emit(checks_json(checks, batch.failures))
    elif len(paths) > 1 and is_read and not quiet:
        output.show(ChecksText(checks, batch.failures))
    for kind, target in files.items():
        if target is not None:
            _write(target, text_for(kind, checks, batch.failures))
    if github if github is not None else os.environ.get("GITHUB_ACTIONS") == "true":
        _annotate(checks, batch.failures)
    codes = {State.UNCHECKED: terminal.COULD_NOT, State.FAIL: FAILED}
    return codes.get(overall(checks, len(batch.failures)), terminal.DONE)


def _point_at(refused: RefusedRule) -> int:
    """Print a rule that cannot be understood, with carets below the place; returns the exit code."""
    terminal.warn("error", f"{refused.where}: {refused.error.reason}")
    for line in refused.error.pointed.split("\n"):
        print(f"  {line}", file=sys.stderr)
    return terminal.COULD_NOT


def _store(batch: Batch, paths: Sequence[str], metrics: Sequence[str], target: Path) -> int:
    """Store reports as a baseline, if every mesh can be measured; returns the exit code."""
    from ..report import FileReport
    from ..report.json import dumps

    def examine(path: str) -> FileReport:
        return FileReport.of(batch.measure(path, metrics), path=path, worst=0, threads=batch.threads)

    reports = [report for _, report in batch.each(paths, examine)]
    if not batch.failures:
        _write(target, dumps(reports) + "\n")
        if not batch.quiet:
            terminal.emit(f"{target}: {len(reports)} mesh{'' if len(reports) == 1 else 'es'} stored")
    return batch.exit_code


def _annotate(checks: Sequence[Check], failures: Sequence[FailedFile]) -> None:
    """Annotations on standard error, where the runner looks as well and where they disturb no JSON."""
    from ..check.output.github import github
    from ..check.output.markdown import markdown

    for line in github(checks, failures):
        print(line, file=sys.stderr, flush=True)
    summary = os.environ.get(SUMMARY)
    if summary:
        try:
            with open(summary, "a", encoding="utf-8", errors="backslashreplace") as file:
                file.write(markdown(checks, failures))
        except OSError as error:
            terminal.warn("note", f"{summary}: the summary cannot be written: {error.strerror or error}")


def _write(path: Path, text: str) -> None:
    from ..files.output import replacing

    with replacing(path, text=True) as beside:
        beside.write_text(text, encoding="utf-8", errors="backslashreplace", newline="\n")
