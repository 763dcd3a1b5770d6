"""What a shell completes: the values that begin as what is typed does."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable


def metric_names(begin: str) -> list[str]:
    """Names of metrics."""
    from ..quality.metrics import METRICS

    return _beginning(begin, METRICS)


def format_names(begin: str) -> list[str]:
    """Names of formats that can be read."""
    from ..io.registry import FORMATS

    return _beginning(begin, (name for name, row in FORMATS.items() if row.is_readable))


def mesh_files(begin: str) -> list[str]:
    """Files with an extension that a known format has, and folders, which may hold some.

    Nothing where a single folder is meant: the shell then completes it by itself, and puts no blank behind it.
    """
    from ..io.formats.table import extensions

    folder, _, name = begin.rpartition("/")
    above = f"{folder}/" if "/" in begin else ""
    found, known = [], extensions()
    try:
        entries = sorted(os.scandir(os.path.expanduser(above) or "."), key=lambda entry: entry.name)
    except OSError:
        return []
    for entry in entries:
        if not entry.name.startswith(name) or (entry.name.startswith(".") and not name):
            continue
        stem = entry.name.lower().removesuffix(".gz")
        if entry.is_dir():
            found.append(f"{above}{entry.name}/")
        elif os.path.splitext(stem)[1] in known:
            found.append(above + entry.name)
    return [] if len(found) == 1 and found[0].endswith("/") else _for_shell(found)


def rules(begin: str) -> list[str]:
    """Rules after ``nothing``, those that are usual, and how those on a metric begin."""
    from ..check import default_rules
    from ..check.words import WORDS
    from ..quality.metrics import METRICS

    usual = [str(rule) for purpose in ("fem", "fv", "explicit") for rule in default_rules(purpose)]
    words = (f"nothing {word}" for word in WORDS)
    beginnings = (f"{name} {'>=' if row.better == 'higher' else '<='} " for name, row in METRICS.items())
    return _for_shell(_beginning(begin, [*words, *usual, "no worse than ", *beginnings]))


def schema_names(begin: str) -> list[str]:
    """Names of schemas."""
    from ..schemas import NAMES

    return _beginning(begin, NAMES)


def explained(begin: str) -> list[str]:
    """What ``meshgauge explain`` explains."""
    from ..check.words import WORDS
    from ..status import STATUSES

    names = [*(row.name for row in STATUSES.values()), *WORDS, "fem", "fv", "explicit"]
    return _for_shell(_beginning(begin, [*names, *metric_names(begin), *(f"nothing {word}" for word in WORDS)]))


def _beginning(begin: str, names: Iterable[str]) -> list[str]:
    return [name for name in dict.fromkeys(names) if name.startswith(begin)]


def _for_shell(values: list[str]) -> list[str]:
    """Bash alone puts in what it is given: blanks and their like need marks, unless a quotation is open already."""
    if not any(name.endswith("_COMPLETE") and value == "complete_bash" for name, value in os.environ.items()):
        return values
    words, at = os.environ.get("COMP_WORDS", "").split("\n"), os.environ.get("COMP_CWORD", "")
    typed = words[int(at)] if at.isdigit() and int(at) < len(words) else ""
    if typed.startswith(("'", '"')):
        return values
    return [re.sub(r"([^\w./:@%+=,-])", r"\\\1", value) for value in values]
