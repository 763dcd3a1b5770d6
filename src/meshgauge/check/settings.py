"""Settings from ``meshgauge.toml`` or ``[tool.meshgauge]`` of ``pyproject.toml``."""

from __future__ import annotations

import difflib
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import MeshgaugeError
from ..files import sources

OWN, PROJECT = "meshgauge.toml", "pyproject.toml"
KEYS = ("meshes", "fail", "warn")
"""What ``check`` may hold."""


class SettingsError(MeshgaugeError):
    """Settings that cannot be read or understood."""


@dataclass(frozen=True)
class CheckSettings:
    """The settings of ``meshgauge check``; everything in them is relative to the folder of the file."""

    path: Path
    meshes: tuple[str, ...] = ()
    fail: tuple[str, ...] = ()
    warn: tuple[str, ...] = ()


def nearest(start: Path) -> Path | None:
    """The settings of a folder: in it, or in the nearest one above. A pyproject.toml without ours is passed over.

    Raises
    ------
    SettingsError
        If a file on the way cannot be read.
    """
    start = start.absolute()
    for folder in (start, *start.parents):
        own, project = folder / OWN, folder / PROJECT
        if own.is_file():
            return own
        if project.is_file() and _table(project) is not None:
            return project
    return None


def load(path: Path) -> CheckSettings:
    """The settings in a file.

    Raises
    ------
    SettingsError
        If it cannot be read, or holds something unknown.
    """
    sources.note(path)
    table = _table(path)
    if table is None:
        raise SettingsError(f"{path}: has no [tool.meshgauge]")
    prefix = "tool.meshgauge." if path.name == PROJECT else ""
    _known(path, prefix, table, ("check",))
    check = table.get("check", {})
    if not isinstance(check, dict):
        raise SettingsError(f"{path}: {prefix}check is {check!r}, expected a table")
    _known(path, f"{prefix}check.", check, KEYS)
    for key, value in check.items():
        if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
            raise SettingsError(f"{path}: {prefix}check.{key} is {value!r}, expected a list of strings")
    return CheckSettings(path, **{key: tuple(value) for key, value in check.items()})


def _table(path: Path) -> dict[str, Any] | None:
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
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


def _known(path: Path, prefix: str, table: dict[str, Any], keys: tuple[str, ...]) -> None:
    for key in table:
        if key not in keys:
            close = difflib.get_close_matches(key, keys, 1)
            hint = f"; did you mean {prefix}{close[0]}?" if close else f"; there are {', '.join(keys)}"
            raise SettingsError(f"{path}: no setting {prefix}{key}{hint}")
