"""``meshgauge check``: hold meshes against rules; made for pipelines and pre-commit."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import RuleError
from . import inputs, terminal
from .report import MEASURING, READING, WRITING, FormatOption, WedgeOrder

if TYPE_CHECKING:
    from ..check import Rule
    from ..check.settings import CheckSettings

COULD_NOT = 2

HELP = """Hold meshes against rules: exit code 0 if they keep them, 1 if not.

Rules come from --fail and --warn, else from [bold]meshgauge.toml[/bold] or [bold]\\[tool.meshgauge.check][/bold] of pyproject.toml in this folder or above. Without any, every cell must be valid and measured, and more than 1 % below 0.2 are a warning.

  METRIC >= NUMBER       [dim]or >, <=, <; a cell without a value never passes[/dim]

  nothing invalid        [dim]or invalid inside, degenerate, unmeasured, undecided, ...[/dim]

  no worse than FILE     [dim]a report stored by --write-baseline or report --json[/dim]

The first two may go on: [bold]@ 1%[/bold] or [bold]@ 5 cells[/bold] may break them; [bold]for tetra, wedge[/bold]; [bold]in inlet, 'layer*'[/bold]. The last: [bold]within 0.01[/bold].

Exit codes: 0 passed, also with warnings, 1 a rule is broken, 2 some mesh or rule could not be checked, 130 interrupted."""  # noqa: E501  Typer joins no lines of a paragraph

EPILOG = """[bold]Examples[/bold]

  meshgauge check wing.vtu --fail 'jens >= 0.2 @ 1%' --fail 'nothing invalid'

  meshgauge check 'meshes/*.vtu' --junit junit.xml --sarif mesh.sarif

  meshgauge check wing.vtu --write-baseline wing.json

  meshgauge check wing.vtu --fail 'no worse than wing.json within 0.01'"""

PIPELINES = "For pipelines"


def register(app: typer.Typer) -> None:
    """Add the subcommand."""
    app.command(name="check", help=HELP, short_help="Hold meshes against rules, in CI or pre-commit.", epilog=EPILOG)(
        check
    )


def check(
    meshes: Annotated[
        list[str] | None,
        typer.Argument(metavar="[MESH]", help="Mesh files, or patterns.", show_default="those of the settings"),
    ] = None,
    fail: Annotated[
        list[str] | None,
        typer.Option("--fail", metavar="RULE", help="Fail if this rule is broken; repeatable.", show_default=False),
    ] = None,
    warn: Annotated[
        list[str] | None,
        typer.Option("--warn", metavar="RULE", help="Warn if this rule is broken; repeatable.", show_default=False),
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option(
            "--config", metavar="FILE", help="Take the settings from this file.", show_default="the nearest one"
        ),
    ] = None,
    cells: Annotated[int, typer.Option("--cells", metavar="N", min=0, help="Name N cells of each broken rule.")] = 5,
    write_baseline: Annotated[
        Path | None,
        typer.Option("--write-baseline", metavar="FILE", help="Check nothing, store what is measured instead."),
    ] = None,
    json: Annotated[
        bool, typer.Option("--json", help="Print JSON instead (docs/check.md).", rich_help_panel=WRITING)
    ] = False,
    quiet: Annotated[
        bool, typer.Option("--quiet", "-q", help="One line a mesh, no progress.", rich_help_panel=WRITING)
    ] = False,
    junit: Annotated[
        Path | None, typer.Option("--junit", metavar="FILE", help="Write JUnit XML.", rich_help_panel=PIPELINES)
    ] = None,
    sarif: Annotated[
        Path | None, typer.Option("--sarif", metavar="FILE", help="Write SARIF 2.1.0.", rich_help_panel=PIPELINES)
    ] = None,
    gitlab: Annotated[
        Path | None,
        typer.Option(
            "--gitlab", metavar="FILE", help="Write a code quality report of GitLab.", rich_help_panel=PIPELINES
        ),
    ] = None,
    markdown: Annotated[
        Path | None,
        typer.Option("--markdown", metavar="FILE", help="Write a summary in Markdown.", rich_help_panel=PIPELINES),
    ] = None,
    github: Annotated[
        bool | None,
        typer.Option(
            "--github/--no-github",
            help="Annotate, and add to the summary of the job.",
            show_default="if it runs in GitHub Actions",
            rich_help_panel=PIPELINES,
        ),
    ] = None,
    threads: Annotated[
        int | None,
        typer.Option(
            "--threads",
            metavar="N",
            min=1,
            help="Threads to use.",
            show_default="all processors",
            rich_help_panel=MEASURING,
        ),
    ] = None,
    wedge_order: Annotated[
        WedgeOrder,
        typer.Option("--wedge-order", help="Numbering of wedges in the file.", rich_help_panel=READING),
    ] = WedgeOrder.auto,
    format: FormatOption = None,
) -> int:
    """Read, measure and judge each mesh in turn; returns the exit code."""
    found = _settings(config)
    paths = inputs.expanded(meshes) if meshes else _meshes(found)
    if not paths:
        from ..check.settings import SettingsError

        raise SettingsError("no mesh is given, and no settings name any (check.meshes)")
    targets = {"junit": junit, "sarif": sarif, "gitlab": gitlab, "markdown": markdown}
    inputs.check_targets(paths, (*targets.values(), write_baseline))
    try:
        rules = _rules(found, fail or (), warn or ())
    except _RefusedRule as refused:
        return refused.said()

    from .gate import Gate

    gate = Gate(rules, cells, threads, wedge_order.value, format, shows_progress=not quiet)
    if write_baseline is not None:
        return gate.write_baseline(paths, write_baseline)
    return gate.run(
        paths,
        json=json,
        quiet=quiet,
        targets={make: path for make, path in targets.items() if path is not None},
        annotates=github if github is not None else os.environ.get("GITHUB_ACTIONS") == "true",
    )


class _RefusedRule(Exception):
    """A rule that cannot be understood, and where it is written."""

    def __init__(self, where: str, error: RuleError) -> None:
        super().__init__(str(error))
        self.where = where
        self.error = error

    def said(self) -> int:
        """Point at the place on standard error; returns the exit code."""
        terminal.warn("error", f"{self.where}: {self.error.reason}")
        for line in self.error.pointed.split("\n"):
            print(f"  {line}", file=sys.stderr)
        return COULD_NOT


def _settings(config: Path | None) -> CheckSettings | None:
    """The settings asked for, or the nearest, if there are any."""
    from ..check.settings import load, nearest

    path = config if config is not None else nearest(Path.cwd())
    return load(path) if path is not None else None


def _meshes(found: CheckSettings | None) -> list[str]:
    """The meshes that the settings name, as paths from the working folder."""
    if found is None:
        return []
    folder = str(found.path.parent)
    with contextlib.suppress(ValueError):  # on another drive
        folder = os.path.relpath(folder)
    return inputs.expanded(os.path.normpath(os.path.join(folder, mesh)) for mesh in found.meshes)


def _rules(found: CheckSettings | None, fail: Sequence[str], warn: Sequence[str]) -> tuple[Rule, ...]:
    """The rules of the command line, else those of the settings, else those there always are."""
    from ..check import Level, default_rules, rule

    written = [("--fail", Level.FAIL, text) for text in fail] + [("--warn", Level.WARN, text) for text in warn]
    folder = Path()
    if not written and found is not None:
        folder = found.path.parent
        for level, texts in ((Level.FAIL, found.fail), (Level.WARN, found.warn)):
            written += [(f"{found.path}: check.{level}[{n}]", level, text) for n, text in enumerate(texts)]
    rules = []
    for where, level, text in written:
        try:
            rules.append(rule(text, level=level, folder=folder))
        except RuleError as error:
            raise _RefusedRule(where, error) from error
    return tuple(rules) or default_rules()
