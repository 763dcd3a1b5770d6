"""Where rules and meshes come from: the command line, else the settings, else the rules there always are."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterable, Sequence
from pathlib import Path

from ..errors import MeshgaugeError, RuleError
from .baseline import Baseline
from .grammar import rule
from .rules import Level, NoWorse, Rule
from .settings import CheckSettings, FileRules, SettingsError


class RefusedRule(MeshgaugeError):
    """A rule that cannot be understood, and where it is written.

    Attributes
    ----------
    where
        The option, or the file and key of the settings.
    error
        What is wrong with the rule.
    """

    def __init__(self, where: str, error: RuleError) -> None:
        super().__init__(f"{where}: {error}")
        self.where = where
        self.error = error


def meshes_of(settings: CheckSettings | None) -> list[str]:
    """The meshes, or patterns of their names, that the settings name: as paths from the working folder.

    Raises
    ------
    SettingsError
        If one lies outside of the folder of the settings.
    """
    if settings is None:
        return []
    folder = str(settings.path.parent)
    for mesh in settings.meshes:
        inner = os.path.normpath(mesh)
        if os.path.isabs(inner) or inner.split(os.sep)[0] == os.pardir:
            raise SettingsError(
                f"{settings.path}: check.meshes holds {mesh!r}, which is outside of the folder of the settings; "
                "give such a mesh on the command line"
            )
    with contextlib.suppress(ValueError):  # on another drive
        folder = os.path.relpath(folder)
    return [os.path.normpath(os.path.join(folder, mesh)) for mesh in settings.meshes]


def rules_of(
    settings: CheckSettings | None,
    fail: Sequence[str] = (),
    warn: Sequence[str] = (),
    of_files: FileRules | None = None,
) -> tuple[Rule, ...] | None:
    """The rules of ``--fail`` and ``--warn``, else those of the settings, all or ``of_files``; None if there are none.

    Raises
    ------
    RefusedRule
        If one cannot be understood.
    """
    written = [("--fail", Level.FAIL, text) for text in fail] + [("--warn", Level.WARN, text) for text in warn]
    folder = Path()
    if not written and settings is not None:
        folder = settings.path.parent
        own = settings if of_files is None else of_files
        key = "check" if of_files is None else f"check.files.{of_files.pattern!r}"
        for level, texts in ((Level.FAIL, own.fail), (Level.WARN, own.warn)):
            written += [(f"{settings.path}: {key}.{level}[{n}]", level, text) for n, text in enumerate(texts)]
    rules = []
    for where, level, text in written:
        try:
            rules.append(rule(text, level=level, folder=folder))
        except RuleError as error:
            raise RefusedRule(where, error) from error
    return tuple(rules) or None


class Rules:
    """The rules of every mesh.

    Raises
    ------
    RefusedRule
        If one cannot be understood, also of a pattern that no mesh fits.
    """

    def __init__(self, settings: CheckSettings | None, fail: Sequence[str] = (), warn: Sequence[str] = ()) -> None:
        self.of_all = rules_of(settings, fail, warn)
        self.folder = Path() if settings is None else settings.path.parent
        patterns = () if settings is None or fail or warn else settings.files
        self.of_files = [(one, rules_of(settings, (), (), one)) for one in patterns]

    def of(self, path: str) -> tuple[Rule, ...] | None:
        """Those of a mesh; None: the usual ones."""
        for pattern, rules in self.of_files:
            if pattern.fits(Path(path), self.folder):
                return rules
        return self.of_all

    @property
    def every(self) -> list[Rule]:
        """All that there are."""
        return [rule for rules in (self.of_all, *(own for _, own in self.of_files)) for rule in rules or ()]


def baselines_of(rules: Iterable[Rule]) -> dict[Path, Baseline]:
    """The stored reports that rules compare with, by path.

    Raises
    ------
    BaselineError
        If one cannot be read.
    """
    return {rule.path: Baseline.from_file(rule.path) for rule in rules if isinstance(rule, NoWorse)}
