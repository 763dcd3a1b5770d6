"""Options of ``meshgauge check``: the rules, and the outputs for what runs in a pipeline."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ...errors import FailedFile
from .. import terminal
from ..completion import rules
from ..options import option

if TYPE_CHECKING:
    from ...check import Check

PIPELINES = "For pipelines"

SUMMARY = "GITHUB_STEP_SUMMARY"
"""Environment variable: a file of GitHub Actions to which a job adds Markdown."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RuleOptions:
    """Which rules a mesh must keep."""

    fail: Annotated[
        list[str] | None,
        option("--fail", "RULE", "Fail if this rule is broken; repeatable.", default=False, completes=rules),
    ] = None
    warn: Annotated[
        list[str] | None,
        option("--warn", "RULE", "Warn if this rule is broken; repeatable.", default=False, completes=rules),
    ] = None
    config: Annotated[
        Path | None, option("--config", "FILE", "Take the settings from this file.", default="the nearest one")
    ] = None
    init: Annotated[
        bool, option("--init", None, "Write meshgauge.toml with comments and the usual rules, and check nothing.")
    ] = False
    write_baseline: Annotated[
        Path | None, option("--write-baseline", "FILE", "Check nothing, store what is measured instead.")
    ] = None
    fix: Annotated[
        Path | None,
        option("--fix", "DIR", "Orient and improve meshes that fail into new files there, and check these, too."),
    ] = None
    watch: Annotated[
        bool, option("--watch", None, "Check again whenever a mesh, or the settings, change; Ctrl-C ends it.")
    ] = False
    statistics: Annotated[
        bool, option("--statistics", None, "Print how many meshes break each rule, and nothing of each mesh.")
    ] = False


@dataclass(frozen=True, slots=True, kw_only=True)
class PipelineOptions:
    """Files for other programs, and annotations of GitHub Actions."""

    junit: Annotated[Path | None, option("--junit", "FILE", "Write JUnit XML.", PIPELINES)] = None
    sarif: Annotated[Path | None, option("--sarif", "FILE", "Write SARIF 2.1.0.", PIPELINES)] = None
    gitlab: Annotated[Path | None, option("--gitlab", "FILE", "Write GitLab's code quality report.", PIPELINES)] = None
    markdown: Annotated[Path | None, option("--markdown", "FILE", "Write a summary in Markdown.", PIPELINES)] = None
    github: Annotated[
        bool | None,
        option(
            "--github/--no-github",
            None,
            "Annotate, and add to the summary of the job.",
            PIPELINES,
            default="if it runs in GitHub Actions",
        ),
    ] = None

    @property
    def files(self) -> dict[str, Path]:
        """The files to write, by kind (`check.output.text_for`)."""
        kinds = {"junit": self.junit, "sarif": self.sarif, "gitlab": self.gitlab, "markdown": self.markdown}
        return {kind: target for kind, target in kinds.items() if target is not None}

    def write(self, checks: Sequence[Check], failures: Sequence[FailedFile]) -> None:
        """Write the files, and annotate if it is asked for or this is a job of GitHub. Raises `WriteError`."""
        from ...check.output import text_for
        from ...files.output import write_text

        for kind, target in self.files.items():
            write_text(target, text_for(kind, checks, failures))
        if self.github if self.github is not None else os.environ.get("GITHUB_ACTIONS") == "true":
            _annotate(checks, failures)


def _annotate(checks: Sequence[Check], failures: Sequence[FailedFile]) -> None:
    """Annotations on standard error, where the runner looks as well and where they disturb no JSON."""
    from ...check.output.github import github
    from ...check.output.markdown import markdown

    for line in github(checks, failures):
        print(line, file=sys.stderr, flush=True)
    summary = os.environ.get(SUMMARY)
    if summary:
        try:
            with open(summary, "a", encoding="utf-8", errors="backslashreplace") as file:
                file.write(markdown(checks, failures))
        except OSError as error:
            terminal.warn("note", f"{summary}: the summary cannot be written: {error.strerror or error}")
