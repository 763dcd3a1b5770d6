"""What the public records print: never more than a screen, whatever mesh they are of."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meshgauge
from meshgauge import check, compare, doctor, repair, report
from meshgauge import io as meshio
from meshgauge.mesh.topology import topology
from meshgauge.report.json import dumps

sys.path.insert(0, str(Path(__file__).parent / "mesh"))
from mesh_examples import two_polyhedra

LINES, WIDTH = 24, 100
MODULES = ("check", "compare", "doctor", "io", "mesh", "plot", "quality.summary", "repair", "report")
EXAMPLES = Path(__file__).resolve().parent.parent / "examples" / "meshes"


def public_records() -> dict[str, type]:
    """Every dataclass that a public name is, by its name."""
    packages = [meshgauge, *(import_module(f"meshgauge.{name}") for name in MODULES)]
    named = ((name, getattr(package, name)) for package in packages for name in package.__all__)
    return {name: value for name, value in named if isinstance(value, type) and is_dataclass(value)}


def within(thing: Any, known: set[int]) -> Iterator[Any]:
    """Every record of ours in a record, however deep."""
    if id(thing) in known:
        return
    known.add(id(thing))
    if is_dataclass(thing) and not isinstance(thing, type) and type(thing).__module__.startswith("meshgauge"):
        yield thing
        for own in fields(thing):
            yield from within(getattr(thing, own.name), known)
    elif isinstance(thing, Mapping):
        for value in thing.values():
            yield from within(value, known)
    elif isinstance(thing, tuple | list):
        for value in thing:
            yield from within(value, known)


@pytest.fixture(scope="module")
def records(tmp_path_factory: pytest.TempPathFactory) -> list[Any]:
    """What meshgauge makes of a mesh of 6192 cells, some of them bad, in 400 regions, with 500 notes."""
    mesh = meshgauge.read(EXAMPLES / "bracket.vtu")
    mesh = mesh.replace(
        cell_data={**mesh.cell_data, "region": np.arange(mesh.n_cells) % 400},
        notes=tuple(f"note {n}" for n in range(500)),
        path="x" * 5000,
    )
    names = [name for name, row in meshgauge.METRICS.items() if row.source == "meshgauge"]
    quality = meshgauge.measure(mesh, metrics=names)
    better = meshgauge.measure(meshgauge.read(EXAMPLES / "bracket_good.vtu"), metrics=names)
    diagnosis = doctor.diagnosis(mesh, quality)
    file_report = report.FileReport(
        "x" * 5000,
        mesh.n_points,
        mesh.n_cells,
        quality.summary(),
        tuple(quality.worst(500)),
        others=tuple(quality.summary(name) for name in names),
        notes=mesh.notes,
        findings=tuple(quality.findings(500)),
        diagnosis=diagnosis,
    )
    stored = tmp_path_factory.mktemp("records") / "stored.json"
    stored.write_text(dumps([replace(file_report, path="it", summary=better.summary())], []))
    rules = ["nothing inverted", "jens >= 0.9 @ 1%", f"no worse than '{stored}'"]
    backwards = mesh.replace(connectivity=np.concatenate([mesh.nodes(c)[::-1] for c in range(mesh.n_cells)]))
    polyhedral = two_polyhedra()
    return [
        quality,
        quality.certificate,
        quality.worst(500),
        file_report,
        meshgauge.partial(mesh),
        report.FailedFile("x" * 500, "y" * 500),
        doctor.orient(backwards),
        doctor.hanging(quality),
        diagnosis,
        check.check(quality, rules, path="it"),
        check.Baseline.from_file(stored),
        compare.comparison({"a": quality, "b": better}, by_regions=True),
        compare.comparison({"a": quality, "b": meshgauge.measure(mesh.replace(points=mesh.points * 2))}),
        meshgauge.improve(mesh, seconds=1.0),
        meshgauge.measure(polyhedral.replace(cell_data={})),
        polyhedral.polyhedra,
        topology(mesh),
        repair.WorsenedCell(0, "tetra", 0.5, 0.4),
        repair.Progress("start", 0.0, 0.0, 0.0, 0, 0),
        meshgauge.CELL_TYPES,
        meshgauge.METRICS,
        meshgauge.STATUSES,
        meshio.FORMATS,
        meshio.Limits(),
        meshio.Step(1, 0.5),
    ]


def test_every_record_fits_a_screen(records: list[Any]) -> None:
    longest: dict[str, str] = {}
    for record in within(records, set()):
        text, name = repr(record), type(record).__name__
        longest[name] = max(longest.get(name, ""), text, key=len)
    too_long = {name: len(text) for name, text in longest.items() if len(text) > LINES * WIDTH / 2 or "\n\n" in text}
    assert too_long == {}
    assert set(public_records()) - set(longest) == set(), "records that no test has made"


@pytest.mark.parametrize("name", ["Summary", "Tally"])
def test_counts_are_seen(records: list[Any], name: str) -> None:
    one = next(record for record in within(records, set()) if type(record).__name__ == name)
    assert "invalid" in repr(one)
    assert "cells" in repr(one)


def test_a_list_is_shown_whole_or_counted() -> None:
    few, many = repair.Claim("x", True, "y"), check.Check("x", 1, 1, (), tuple(map(str, range(25))))
    assert repr(few) == "Claim(name='x', holds=True, text='y')"
    assert "notes=<25 items>" in repr(many)
    assert "notes=('0', '1')" in repr(replace(many, notes=("0", "1")))
    assert "notes=<1 items>" in repr(replace(many, notes=("0" * 500,)))
