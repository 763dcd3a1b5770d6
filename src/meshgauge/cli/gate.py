"""One run of ``meshgauge check``: which meshes and rules, what came of them, what is written."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..check import Check, State, default_rules, metrics_of
from ..check import check as judge
from ..check.outcome import overall
from ..check.output.json import checks_json
from ..check.output.statistics import StatisticsText
from ..check.output.text import CheckLine, ChecksText, CheckText
from ..check.settings import CheckSettings, SettingsError, settings_of
from ..check.sources import Rules, baselines_of, meshes_of
from ..check.stream import asks_beside, check_slices, question
from ..errors import OptionError
from ..io.plumbing.pieces import ReadWhole
from ..look import style
from ..look.bands import USUAL
from ..report.over_time import trends_of
from ..report.over_time_text import TrendText
from . import inputs, terminal
from .batch import Batch
from .groups.check import PipelineOptions, RuleOptions
from .options import Purposes, Reading

if TYPE_CHECKING:
    from ..check.rules import Rule
    from ..check.states import CheckJob
    from ..report import FileReport
    from ..report.states import StateReader


@dataclass(kw_only=True)
class Gate:
    """What is checked, by what, and where the outcome goes."""

    paths: list[str]
    options: RuleOptions
    settings: CheckSettings | None
    rules: Rules
    batch: Batch
    pipelines: PipelineOptions
    used: str | None  #: the file of the settings, if rules or meshes are from it
    worst: int
    as_json: bool
    exit_zero: bool
    parts: int | None  #: of how many parts the mesh of partial reports is

    @classmethod
    def of(
        cls,
        meshes: Sequence[str],
        options: RuleOptions,
        *,
        as_json: bool,
        quiet: bool,
        pipelines: PipelineOptions,
        worst: int,
        as_one: bool,
        parts: int | None,
        exit_zero: bool,
        reading: Reading,
        **measuring: Any,
    ) -> Gate:
        """From the options of the command; ``measuring`` are fields of `Batch`.

        Raises
        ------
        MeshgaugeError
            If settings, rules or stored reports cannot be read, no mesh is given, or an output cannot be written.
        """
        settings = settings_of(options.config)
        paths = inputs.expand(meshes or meshes_of(settings))
        if not paths:
            raise SettingsError("no mesh is given, and no settings name any (check.meshes)")
        rules = Rules(settings, options.fail or (), options.warn or ())
        inputs.check_targets(paths, texts=(*pipelines.files.values(), options.write_baseline))
        batch = Batch(
            reading=reading,
            poor_below=USUAL if settings is None else settings.poor_below,
            quiet=quiet,
            **measuring,
        )
        is_used = not meshes or not (options.fail or options.warn)
        return cls(
            paths=_meshes(paths, as_one=as_one),
            options=options,
            settings=settings,
            rules=rules,
            batch=batch,
            pipelines=pipelines,
            used=str(settings.path) if settings is not None and is_used else None,
            worst=worst,
            as_json=as_json,
            exit_zero=exit_zero,
            parts=parts,
        )

    @property
    def watched(self) -> list[Path]:
        """Files of which a change calls for another run."""
        files = [Path(file) for path in self.paths for file in getattr(path, "files", (path,))]
        stored = [rule.path for rule in self.rules.every if hasattr(rule, "path")]
        return [*files, *stored, *([] if self.settings is None else [self.settings.path])]

    def run(self) -> int:
        """Read, measure and judge each mesh in turn; returns the exit code."""
        # Before anything is measured: a stored report that is missing is known at once.
        baseline = self.options.write_baseline
        stored = baselines_of(self.rules.every) if baseline is None else {}
        batch, is_quiet = self.batch, self.batch.quiet
        paths = batch.states(self.paths, every=True)  # a gate that lets an invalid step pass is none
        if baseline is not None:
            return _write_baseline(batch, paths, metrics_of(self.rules.every), baseline, self.parts)
        if self.options.fix is not None:
            from .fix import require_alone

            if any(isinstance(path, inputs.Partials) for path in paths):
                raise OptionError("--fix repairs a mesh, and partial reports are none")
            require_alone(paths, self.options.fix)

        def rules_of(path: str) -> tuple[Rule, ...] | None:
            rules = self.rules.of(path)
            if rules is None and batch.purpose is Purposes.explicit:
                rules = default_rules("explicit", batch.poor)
            return rules

        def examine(path: str, name: str | None = None) -> Check:
            rules = rules_of(getattr(path, "file", path) if name is None else name)
            purpose = None if batch.purpose is None else batch.purpose.of_mesh
            if isinstance(path, inputs.Partials):
                from ..check.partials import check_partials

                limits = None if self.settings is None else self.settings.poor_below
                return check_partials(
                    path.files,
                    rules,
                    path=path,
                    listed=self.worst,
                    baselines=stored,
                    purpose=purpose,
                    poor_below=limits,
                    parts=self.parts,
                )
            memory = batch.allowed_memory
            asked = question(
                rules,
                listed=self.worst,
                purpose=purpose,
                poor_below=batch.poor,
                pieces=batch.pieces(path) if any(map(asks_beside, rules or ())) else None,
                memory=memory,
            )
            done = batch.in_slices(path, asked)
            if done is not None:
                try:
                    with batch.progress(f"checking {path}"):
                        return check_slices(*done, path=path, baselines=stored, memory=memory)
                except ReadWhole as reason:
                    terminal.warn("note", f"{path}: is read whole: {reason}")
            quality = batch.measure(path, metrics_of(rules or ()))
            if rules is None:
                quality = batch.with_faces(path, quality)
            return judge(quality, rules, path=path, listed=self.worst, baselines=stored)

        def job_of(reader: StateReader, path: str) -> CheckJob:
            from ..check.states import CheckJob

            rules = rules_of(getattr(path, "file", path))
            return CheckJob(reader, rules, self.worst, stored)

        with_statistics = self.options.statistics
        if self.used is not None and not (self.as_json or is_quiet):
            terminal.emit(f"settings: {style.printable(self.used)}")
        output, is_read = terminal.Output(), not (self.as_json or with_statistics)
        checks: list[Check] = []
        with batch.in_processes(paths, job_of) as in_processes:
            for path, one in batch.each(paths, in_processes or examine):
                if isinstance(path, inputs.State):
                    one = replace(one, step=path.of_file)
                checks.append(one)
                if is_read:
                    is_read = output.show(CheckLine(one) if is_quiet else CheckText(one), wrap=not is_quiet)
        if self.as_json:
            terminal.emit(checks_json(checks, batch.failures, settings=self.used, with_statistics=with_statistics))
        elif with_statistics:
            output.show(StatisticsText(checks, batch.failures))
        elif len(paths) > 1 and is_read and not is_quiet:
            output.show(ChecksText(checks, batch.failures))
            for trend in trends_of((one.step, one.tally) for one in checks if one.step and one.tally):
                output.show(TrendText(trend))
        self.pipelines.write(checks, batch.failures)
        if self.options.fix is not None:
            from .fix import fix

            for check in checks:
                if check.of(State.FAIL):
                    fix(batch, check.path, self.options.fix, examine, is_silent=self.as_json)
        codes = {State.UNCHECKED: terminal.COULD_NOT, State.FAIL: terminal.DONE if self.exit_zero else terminal.FAILED}
        return codes.get(overall(checks, len(batch.failures)), terminal.DONE)


def _meshes(paths: list[str], *, as_one: bool) -> list[str]:
    """The files, those of partial reports as one mesh, and with ``as_one`` the others as another."""
    partials = [path for path in paths if path.endswith(inputs.PARTIAL)]
    others = [path for path in paths if not path.endswith(inputs.PARTIAL)]
    meshes = [inputs.Joined.of(others)] if as_one and others else others
    return [*meshes, *([inputs.Partials.of(partials)] if partials else [])]


def _write_baseline(batch: Batch, paths: Sequence[str], metrics: Sequence[str], target: Path, parts: int | None) -> int:
    """Store reports as a baseline, if every mesh can be measured; returns the exit code."""
    from ..check.baseline import write
    from ..report import FileReport
    from ..report.merging import merge
    from ..report.stream import file_report
    from ..slices import Ask

    def examine(path: str) -> FileReport:
        if isinstance(path, inputs.Partials):
            return merge(path.files, path=path, parts=parts)
        done = batch.in_slices(path, Ask(tuple(metrics), n_worst=0, companions=True))
        if done is not None:
            return file_report(*done, path=path)
        return FileReport.of(batch.measure(path, metrics), path=path, worst=0, threads=batch.threads)

    reports = [report for _, report in batch.each(paths, examine)]
    if not batch.failures:
        write(target, reports)
        if not batch.quiet:
            terminal.emit(f"{target}: {len(reports)} mesh{'' if len(reports) == 1 else 'es'} stored")
    return batch.exit_code
