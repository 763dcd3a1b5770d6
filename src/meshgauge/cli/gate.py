"""The work of ``meshgauge check``: one mesh after another is read, measured, judged and dropped."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path

from rich.text import Text

from ..check import Baseline, Check, NoWorse, Rule, State, check, metrics_of
from ..check.output.github import github
from ..check.output.json import checks_json
from ..check.output.markdown import markdown
from ..check.output.text import ChecksText, CheckText, verdict
from ..errors import FailedFile
from ..files.output import check as check_output
from ..files.output import replacing
from ..io import read
from ..quality.measure import Quality, measure
from ..report import FileReport
from ..report.json import dumps
from .attempt import attempt
from .terminal import Output, activity, emit, warn

PASSED, FAILED, COULD_NOT = 0, 1, 2
"""Exit codes. What could not be checked outweighs what failed: the answer is not complete."""

SUMMARY = "GITHUB_STEP_SUMMARY"
"""Environment variable: a file of GitHub Actions to which a job adds Markdown."""


@dataclass(frozen=True)
class Gate:
    """What every mesh is held against, and how it is read."""

    rules: tuple[Rule, ...]
    listed: int
    threads: int | None
    wedge_order: str
    format: str | None
    shows_progress: bool

    def run(
        self, paths: Sequence[str], *, json: bool, quiet: bool, targets: Mapping[str, Path], annotates: bool
    ) -> int:
        """Check all, print, write the outputs by the name of their module; returns the exit code.

        Raises
        ------
        BaselineError, WriteError
            If a stored report cannot be read, or an output cannot be written.
        """
        # Before anything is measured: a file that is missing is known at once.
        baselines = {r.path: Baseline.from_file(r.path) for r in self.rules if isinstance(r, NoWorse)}
        for target in targets.values():
            check_output(target, text=True)
        output = Output()
        several, is_read = len(paths) > 1, True
        checks: list[Check] = []
        failures: list[FailedFile] = []
        for path in paths:
            outcome = attempt(path, partial(self._check, path, baselines))
            if isinstance(outcome, FailedFile):
                failures.append(outcome)
                warn("error", f"{path}: {outcome.reason}")
                continue
            checks.append(outcome)
            if is_read and quiet:
                is_read = output.show(_line(outcome), wrap=False)
            elif is_read and not json:
                is_read = output.show(CheckText(outcome))
        if json:
            emit(checks_json(checks, failures))
        elif several and is_read and not quiet:
            output.show(ChecksText(checks, failures))
        for make, target in targets.items():
            text: Callable[..., str] = getattr(import_module(f"..check.output.{make}", __package__), make)
            _write(target, text(checks, failures))
        if annotates:
            _annotate(checks, failures)
        if failures or any(one.state is State.UNCHECKED for one in checks):
            return COULD_NOT
        return PASSED if all(one.is_passed for one in checks) else FAILED

    def write_baseline(self, paths: Sequence[str], target: Path) -> int:
        """Store what is measured as the JSON of a report; nothing is written if some mesh cannot be measured."""
        reports: list[FileReport] = []
        failed = False
        for path in paths:
            quality = attempt(path, partial(self._quality, path))
            if isinstance(quality, FailedFile):
                failed = True
                warn("error", f"{path}: {quality.reason}")
                continue
            mesh = quality.mesh
            others = tuple(quality.summary(name) for name in quality.metrics if name != "jens")
            reports.append(FileReport(path, mesh.n_points, mesh.n_cells, quality.summary(), others=others))
        if failed:
            return COULD_NOT
        _write(target, dumps(reports) + "\n")
        if self.shows_progress:
            emit(f"{target}: {len(reports)} mesh{'' if len(reports) == 1 else 'es'} stored")
        return PASSED

    def _check(self, path: str, baselines: Mapping[Path, Baseline]) -> Check:
        quality = self._quality(path)
        return check(quality, self.rules, path=path, listed=self.listed, baselines=baselines)

    def _quality(self, path: str) -> Quality:
        with activity(f"reading {path}", shown=self.shows_progress):
            mesh = read(path, file_format=self.format, wedge_order=self.wedge_order)
        with activity(f"measuring {path}", shown=self.shows_progress):
            return measure(mesh, metrics=metrics_of(self.rules), threads=self.threads)


def _line(one: Check) -> Text:
    """A mesh in one line, with the rules that it breaks."""
    broken = "; ".join(str(outcome.rule) for outcome in one.of(State.FAIL, State.WARN, State.UNCHECKED))
    return Text(f"{one.path}: {verdict(one)}{f': {broken}' if broken else ''}")


def _annotate(checks: Sequence[Check], failures: Sequence[FailedFile]) -> None:
    """Annotations on standard error, where the runner looks as well and where they disturb no JSON."""
    _print(github(checks, failures))
    summary = os.environ.get(SUMMARY)
    if summary:
        try:
            with open(summary, "a", encoding="utf-8", errors="backslashreplace") as file:
                file.write(markdown(checks, failures))
        except OSError as error:
            warn("note", f"{summary}: the summary cannot be written: {error.strerror or error}")


def _print(lines: Iterable[str]) -> None:
    for line in lines:
        print(line, file=sys.stderr, flush=True)


def _write(path: Path, text: str) -> None:
    with replacing(path, text=True) as beside:
        beside.write_text(text, encoding="utf-8", errors="backslashreplace", newline="\n")
