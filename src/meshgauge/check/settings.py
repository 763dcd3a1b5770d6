"""Settings from ``meshgauge.toml`` or ``[tool.meshgauge]`` of ``pyproject.toml``."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterable
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from ..errors import MeshgaugeError, OptionError
from ..files import sources
from ..look.bands import USUAL, PoorBelow
from ..look.names import meant_or_known
from ..quality.poor import checked

OWN, PROJECT = "meshgauge.toml", "pyproject.toml"
KEYS = ("meshes", "fail", "warn")
"""What ``check`` may hold, beside ``files``."""


LARGEST = 1 << 20
"""Bytes of a file of settings."""


class SettingsError(MeshgaugeError):
    """Settings that cannot be read or understood."""


@dataclass(frozen=True)
class FileRules:
    """Rules of the meshes whose names fit a pattern, in place of those of all."""

    pattern: str  #: of the path from the folder of the settings, ``fine/*.vtu``; without a slash, of its last part
    fail: tuple[str, ...] = ()
    warn: tuple[str, ...] = ()

    def fits(self, path: Path, folder: Path) -> bool:
        """Whether a mesh is meant."""
        if "/" not in self.pattern:
            return fnmatchcase(path.name, self.pattern)
        with contextlib.suppress(ValueError):  # on another drive
            return fnmatchcase(Path(os.path.relpath(path, folder)).as_posix(), self.pattern)
        return False


@dataclass(frozen=True)
class CheckSettings:
    """The settings of ``meshgauge check``; everything in them is relative to the folder of the file."""

    path: Path
    meshes: tuple[str, ...] = ()
    fail: tuple[str, ...] = ()
    warn: tuple[str, ...] = ()
    files: tuple[FileRules, ...] = ()  #: the first that fits a mesh has its rules
    poor_below: PoorBelow = USUAL  #: of every command that measures


def nearest(start: Path) -> Path | None:
    """The settings of a folder: in it, or in the nearest one above. A pyproject.toml without ours is passed over.

    Above the folder itself, only folders of the same repository are looked into, or of the home folder if there is no
    repository; and only files of this user, or of the owner of the folder, count: rules that somebody else has laid
    above a shared folder must not decide what passes.

    Raises
    ------
    SettingsError
        If a file on the way cannot be read, or belongs to somebody else.
    """
    start = start.absolute()
    for folder in (start, *_above(start)):
        own, project = folder / OWN, folder / PROJECT
        for path in (own, project):
            if path.is_file() and _table(path) is not None:
                if folder != start and not _is_trusted(path, start):
                    raise SettingsError(
                        f"{path}: belongs to another user and does not count here; name it with --config to use it"
                    )
                return path
    return None


def _above(start: Path) -> tuple[Path, ...]:
    """Folders above one in which its settings may be: up to the root of the repository, or else to the home folder."""
    folders = (start, *start.parents)
    for n, folder in enumerate(folders):
        if (folder / ".git").exists():
            return folders[1 : n + 1]
    try:
        home = Path.home()
    except RuntimeError:
        return ()
    return folders[1 : folders.index(home) + 1] if home in folders else ()


def _is_trusted(path: Path, start: Path) -> bool:
    """True if a file belongs to this user or to the owner of the folder; always where the system knows no owners."""
    if not hasattr(os, "geteuid"):
        return True
    return path.stat().st_uid in (os.geteuid(), start.stat().st_uid)


def load(path: Path) -> CheckSettings:
    """The settings in a file.

    Raises
    ------
    SettingsError
        If it cannot be read, or holds something unknown.
    """
    table = _table(path)
    if table is None:
        raise SettingsError(f"{path}: has no [tool.meshgauge]")
    prefix = "tool.meshgauge." if path.name == PROJECT else ""
    _check_keys(path, prefix, table, ("check", "quality"))
    check, own = table.get("check", {}), table.get("quality", {})
    for name, value in (("check", check), ("quality", own)):
        if not isinstance(value, dict):
            raise SettingsError(f"{path}: {prefix}{name} is {value!r}, expected a table")
    of_files = check.pop("files", {})
    if not isinstance(of_files, dict) or not all(isinstance(rules, dict) for rules in of_files.values()):
        raise SettingsError(f"{path}: {prefix}check.files is {of_files!r}, expected a table for each pattern of names")
    lists = _lists(path, f"{prefix}check.", check, KEYS)
    by_pattern = tuple(
        FileRules(pattern, **_lists(path, f"{prefix}check.files.{pattern!r}.", rules, KEYS[1:]))
        for pattern, rules in of_files.items()
    )
    return CheckSettings(path, **lists, files=by_pattern, poor_below=_poor_below(path, prefix, own))


def _lists(path: Path, prefix: str, table: dict[str, Any], keys: tuple[str, ...]) -> dict[str, tuple[str, ...]]:
    """A table of lists of strings."""
    _check_keys(path, prefix, table, keys)
    for key, value in table.items():
        if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
            raise SettingsError(f"{path}: {prefix}{key} is {value!r}, expected a list of strings")
    return {key: tuple(value) for key, value in table.items()}


def _poor_below(path: Path, prefix: str, own: dict[str, Any]) -> PoorBelow:
    """``quality.poor``: a number, or numbers by shape of cell."""
    _check_keys(path, f"{prefix}quality.", own, ("poor",))
    given = own.get("poor", USUAL.all)
    numbers = list(given.values()) if isinstance(given, dict) else [given]
    if not all(type(number) in (int, float) for number in numbers):
        raise SettingsError(f"{path}: {prefix}quality.poor is {given!r}, expected a number, or numbers by type of cell")
    try:
        return checked(given)
    except OptionError as error:
        raise SettingsError(f"{path}: {prefix}quality.poor: {error}") from error


def _table(path: Path) -> dict[str, Any] | None:
    import tomllib

    try:
        document = tomllib.loads(sources.contents(path, most=LARGEST).decode("utf-8"))
    except OSError as error:
        raise SettingsError(f"{path}: {error.strerror or error}") from error
    except ValueError as error:  # no TOML, or no UTF-8
        raise SettingsError(f"{path}: {error}") from error
    if path.name != PROJECT:
        return document
    tool = document.get("tool")
    table = tool.get("meshgauge") if isinstance(tool, dict) else None
    if table is not None and not isinstance(table, dict):
        raise SettingsError(f"{path}: tool.meshgauge is {table!r}, expected a table")
    return table


def _check_keys(path: Path, prefix: str, table: dict[str, Any], keys: tuple[str, ...]) -> None:
    for key in table:
        if key not in keys:
            hint = meant_or_known(prefix + key, [prefix + one for one in keys])
            raise SettingsError(f"{path}: no setting {prefix}{key}{hint}")


TEMPLATE = """\
# Settings of `meshgauge check`, see docs/check.md. Paths are relative to this folder.

[check]
# Meshes to check where none are given on the command line.
meshes = []

# Rules that fail the check if they are broken: exit code 1.
fail = [
{fail}
]

# Rules that are a warning.
warn = [
{warn}
]

# Further rules:
#   "no worse than base.json within 0.01"   `meshgauge check MESH --write-baseline base.json` stores the report
#   "jens >= 0.3 for tetra in inlet"        cells of some types, in some regions

# Rules of the meshes whose names fit a pattern, in place of those above:
# [check.files."coarse_*.vtu"]
# fail = ["nothing invalid"]

# [quality]
# Below which valid cells are poor, in reports and pictures, and what improve aims at; also by shape, as
# {{ tetra = 0.25, all = 0.3 }}.
# poor = 0.2
"""


def create(folder: Path, fail: Iterable[str], warn: Iterable[str]) -> Path:
    """Write settings with comments and some rules; returns the file.

    Raises
    ------
    SettingsError
        If the folder has settings of ours.
    WriteError
        If the file cannot be written.
    """
    path = folder / OWN
    for one in (path, folder / PROJECT):
        if one.is_file() and _table(one) is not None:
            raise SettingsError(f"{one}: holds settings already")
    lines = ["\n".join(f'    "{rule}",' for rule in rules) for rules in (fail, warn)]
    from ..files import output

    output.write_text(path, TEMPLATE.format(fail=lines[0], warn=lines[1]))
    return path


def settings_of(config: Path | None) -> CheckSettings | None:
    """The settings in a file; those nearest to the working folder if None, and None if there are none.

    Raises
    ------
    SettingsError
        If they cannot be read or understood.
    """
    path = config if config is not None else nearest(Path.cwd())
    return load(path) if path is not None else None


def poor_below() -> PoorBelow:
    """Below which cells are poor, as the settings nearest to the working folder say. Raises `SettingsError`."""
    settings = settings_of(None)
    return USUAL if settings is None else settings.poor_below
