"""Writes the parts of the documentation that are taken from the program: tables of rows, the output of the report.

python docs/refresh.py

A part stands between ``<!-- begin: NAME -->`` and ``<!-- end: NAME -->``. The tests hold every part against what
would be written.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterable
from enum import Enum
from inspect import Parameter, signature
from math import isinf
from pathlib import Path
from typing import Any, get_args, get_type_hints

import typer

from meshgauge import check
from meshgauge.cells import CELL_TYPES, SHAPES
from meshgauge.cli.main import program
from meshgauge.io.catalogue import rows as format_rows
from meshgauge.quality.metrics import METRICS, Metric, Standard
from meshgauge.status import STATUSES

ROOT = Path(__file__).resolve().parent.parent
PART = re.compile(r"(<!-- begin: (?P<name>[a-z-]+) -->\n).*?(<!-- end: (?P=name) -->)", re.DOTALL)

RULES = ("--fail", "nothing invalid", "--fail", "jens >= 0.2 @ 1%", "--warn", "jens >= 0.3 @ 1%")
BRACKET, GOOD = "examples/meshes/bracket.vtu", "examples/meshes/bracket_good.vtu"


def number(value: float) -> str:
    """At most four digits, a real minus sign."""
    text = "∞" if isinf(value) else f"{abs(value):.4g}"
    return f"−{text}" if value < 0 else text


def interval(ends: tuple[float, float]) -> str:
    return f"{number(ends[0])} to {number(ends[1])}"


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    columns = list(head)
    lines = [columns, ["---"] * len(columns), *(list(row) for row in rows)]
    return "".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |\n" for line in lines)


def printed(*arguments: str, code: int = 0) -> str:
    """What a command prints where there is no terminal."""
    environment = {k: v for k, v in os.environ.items() if k not in ("COLUMNS", "FORCE_COLOR", "CLICOLOR_FORCE")}
    done = subprocess.run(
        [sys.executable, "-m", "meshgauge", *arguments],
        cwd=ROOT,
        env={**environment, "PYTHONIOENCODING": "utf-8"},
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    if done.returncode != code:
        raise RuntimeError(f"{arguments} gave {done.returncode}, expected {code}: {done.stderr}")
    return "```text\n" + "".join(f"{line.rstrip()}\n" for line in done.stdout.strip("\n").splitlines()) + "```\n"


def shapes() -> str:
    rows = []
    for shape in SHAPES.values():
        others = [row.name for row in CELL_TYPES.values() if row.shape is shape and row.name != shape.name]
        rows.append((shape.name, f"{shape.k_formula} = {shape.k:.4f}" if shape.k != 1 else "1", ", ".join(others)))
    return table(("shape", "k", "types measured with it"), rows)


def statuses() -> str:
    rows = [(f"`{row.name}`", row.text, "yes" if row.is_measured else "no: NaN") for row in STATUSES.values()]
    return table(("status", "meaning", "has a value"), rows)


def default_rules() -> str:
    every = check.default_rules()
    rows = [
        (rule.level.value, f"`{rule}`", "every mesh" if rule in every else "finite volumes")
        for rule in check.default_rules("fv")
    ]
    return table(("level", "rule", "for"), rows)


def standards(row: Metric, text_of: Callable[[Standard], str]) -> str:
    """One text if it is the same for every shape, else one for each text."""
    names: dict[str, list[str]] = {}
    for shape in SHAPES if row.shapes is None else row.shapes:
        names.setdefault(text_of(row.standard(shape)), []).append(shape)
    if len(names) == 1:
        return next(iter(names))
    return "; ".join(f"{', '.join(of)}: {text}" for text, of in names.items())


def metrics() -> str:
    return table(
        ("name", "range", "acceptable", "ideal", "better", "unit", "cells"),
        (
            (
                f"`{row.name}`",
                interval(row.range),
                standards(row, lambda standard: interval(standard.acceptable)),
                standards(row, lambda standard: number(standard.ideal)),
                row.better,
                row.unit,
                row.cell_types,
            )
            for row in METRICS.values()
        ),
    )


def metric_texts() -> str:
    """A paragraph a metric: what it is, what is masked, the source."""
    references = list(dict.fromkeys(row.reference for row in METRICS.values()))
    parts = []
    for row in METRICS.values():
        masked = f" Masked (NaN): {'; '.join(row.masked)}." if row.masked else ""
        nodes = " Of cells and of nodes." if "node" in row.where else ""
        parts.append(
            f"- `{row.name}`: {row.title}. {row.text}{nodes}{masked} [{references.index(row.reference) + 1}]\n"
        )
    listed = "".join(f"{n}. {reference}\n" for n, reference in enumerate(references, 1))
    return "".join(parts).replace("|ARG|", "\\|ARG\\|") + "\n### References\n\n" + listed


def formats() -> str:
    """Which formats are read, patched, added to and written."""
    marks = {True: "yes", False: ""}
    return table(
        ("name", "format", "extensions", "read", "patched", "added to", "written"),
        (
            (
                f"`{row['name']}`",
                row["title"],
                " ".join(row["extensions"]),
                *(marks[row[key]] for key in ("read", "patched", "added_to", "written")),
            )
            for row in format_rows()
        ),
    )


def commands() -> str:
    """A heading, a sentence and a table of arguments and options for each subcommand."""
    parts = []
    for command in program().registered_commands:
        assert command.callback is not None
        parts.append(f"\n## meshgauge {command.name}\n\n{_plain(command.short_help or command.help or '')}\n")
        hints = get_type_hints(command.callback, include_extras=True)
        rows = [_parameter(p.name, hints[p.name], p.default) for p in signature(command.callback).parameters.values()]
        if rows:
            parts.append("\n" + table(("argument or option", "meaning", "unless given"), rows))
    return "".join(parts)


def _parameter(name: str, hint: Any, default: Any) -> tuple[str, str, str]:
    """A row: how it is written, what it means, what it is unless given."""
    kind, info = get_args(hint)[:2]
    kinds = [k for k in (get_args(kind) or (kind,)) if k is not type(None)]
    choices = [member.value for k in kinds if isinstance(k, type) and issubclass(k, Enum) for member in k]
    value = info.metavar or "|".join(choices)
    # Typer keeps the first name where its default stands without `Annotated`.
    written = [str(info.default or ""), *(getattr(info, "param_decls", None) or ())]
    names = [f"`{part}`" for decl in written if decl.startswith("-") for part in decl.split("/")]
    if isinstance(info, typer.models.ArgumentInfo):
        usage = f"`{info.metavar or name.upper()}`"
    else:
        usage = ", ".join(names or [f"`--{name.replace('_', '-')}`"]) + (f" {value}" if value else "")
    given = "yes" if default is True else getattr(default, "value", default)
    is_empty = given is None or given is False or given is Parameter.empty
    unless = info.show_default if isinstance(info.show_default, str) else "" if is_empty else str(given)
    return usage, _plain(info.help or ""), unless


def _plain(text: str) -> str:
    """Without the mark-up of the terminal."""
    return re.sub(r"(?<!\\)\[/?[a-z ]*\]", "", text).replace("\\[", "[").strip()


PARTS: dict[str, Callable[[], str]] = {
    "report": lambda: printed("report", BRACKET),
    "check": lambda: printed("check", BRACKET, *RULES, code=1),
    "compare": lambda: printed("compare", BRACKET, GOOD),
    "shapes": shapes,
    "statuses": statuses,
    "metrics": metrics,
    "metric-texts": metric_texts,
    "default-rules": default_rules,
    "commands": commands,
    "formats": formats,
}


def refreshed(text: str) -> str:
    """The text with every part as the program has it now."""
    return PART.sub(lambda found: f"{found[1]}{PARTS[found['name']]()}{found[3]}", text)


def pages() -> list[Path]:
    """The files that have parts."""
    return [
        path
        for path in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
        if "<!-- begin: " in path.read_text(encoding="utf-8")
    ]


def main() -> None:
    import schemas  # beside this file

    for path in pages():
        text = path.read_text(encoding="utf-8")
        path.write_text(refreshed(text), encoding="utf-8")
    schemas.write()


if __name__ == "__main__":
    main()
