"""Options that several subcommands have are the same everywhere, and do the same."""

from __future__ import annotations

import inspect
import json
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, NoReturn, get_args

import numpy as np
import pytest
import typer
from typer.models import OptionInfo
from typer.testing import CliRunner

from meshgauge import Mesh, io
from meshgauge.cells import SHAPES
from meshgauge.cli import command, main, options
from meshgauge.cli.texts import TEXTS, Text
from meshgauge.errors import ReadError
from meshgauge.io.plumbing import isolate

Captured = pytest.CaptureFixture[str]

COMMANDS = {str(row.name): row.callback for row in main.program().registered_commands if row.callback is not None}

READING = {
    "report": [],
    "check": [],
    "compare": ["{mesh}"],
    "doctor": [],
    "orient": ["-o", "{out}.vtu"],
    "improve": ["-o", "{out}.vtu"],
    "plot": ["-o", "{out}.png"],
    "view": ["--screenshot", "{out}.png"],
}
"""Subcommands that read meshes, and what each needs beside one."""

DIFFERENT = {"--output", "--tolerance"}
"""Options that share a name, but not what they write (a mesh, or a picture), or what may be so far apart."""


def options_of(name: str) -> Iterator[tuple[str, str, type, OptionInfo]]:
    """Name of the parameter, longest name of the option, type and option, of each option of a subcommand."""
    for parameter in inspect.signature(COMMANDS[name]).parameters.values():
        kind, info = get_args(parameter.annotation)
        if isinstance(info, OptionInfo):
            yield parameter.name, max(declared(info), key=len), kind, info


def declared(info: OptionInfo) -> tuple[str, ...]:
    """The names of an option. In ``Annotated`` the first argument of `typer.Option` is a name, too."""
    return (info.default, *(info.param_decls or ()))


def look(kind: type, info: OptionInfo) -> tuple[object, ...]:
    """All that a user sees of an option, but its default."""
    choices = [c for c in get_args(kind) or (kind,) if c is not type(None)]
    return (str(choices), declared(info), info.help, info.metavar, info.rich_help_panel, info.min, info.max)


def test_an_option_of_several_subcommands_is_the_same_in_all() -> None:
    seen: dict[str, dict[tuple[object, ...], list[str]]] = defaultdict(lambda: defaultdict(list))
    for name in COMMANDS:
        for _, option, kind, info in options_of(name):
            seen[option][look(kind, info)].append(name)
    different = {option: dict(looks) for option, looks in seen.items() if len(looks) > 1}
    assert set(different) <= DIFFERENT, different
    shared = {option for option, looks in seen.items() if sum(map(len, looks.values())) > 1}
    assert shared >= {"--json", "--quiet", "--worst", "--threads", "--wedge-order", "--format", "--metric", "--html"}


def test_every_subcommand_that_reads_has_all_options_of_reading() -> None:
    wanted = {field.name for field in fields(options.Reading)}
    assert {name for name in COMMANDS if wanted <= {parameter for parameter, *_ in options_of(name)}} == set(READING)


def test_every_subcommand_and_option_has_a_help() -> None:
    assert set(TEXTS) == set(COMMANDS)
    for name in COMMANDS:
        for _, option, _, info in options_of(name):
            assert info.help, (name, option)
            assert info.help[-1] == ".", (name, option)
    for text in TEXTS.values():
        assert text.short.endswith(".")
        assert not any(line != line.strip() for line in text.examples)


@pytest.mark.parametrize("name", READING)
def test_limits_of_third_party_readers_hold_in_every_subcommand(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    """They reach the reader, in whose tests they end it (`test_io_isolated.py`)."""

    def refuse(path: Path, name: str, limits: io.Limits | None = None, choice: object = None) -> NoReturn:
        raise ReadError(f"{path}: {limits}")

    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.avs").write_text("4 1 0 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n1 0 tet 1 2 3 4\n")
    io.write(tmp_path / "b.vtu", Mesh.from_arrays(SHAPES["tetra"].points, {"tetra": [(0, 1, 2, 3)]}))
    capsys.readouterr()
    monkeypatch.setattr(isolate, "read", refuse)
    monkeypatch.setattr(isolate, "steps", refuse)
    more = [word.format(mesh="b.vtu", out="out") for word in READING[name]]
    assert main.main([name, "a.avs", *more, "--read-seconds", "0.1", "--read-memory", "0.5"]) == 2
    assert capsys.readouterr().err == f"meshgauge: error: a.avs: {io.Limits(0.1, 1 << 29)}\n"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.avs", "b.vtu"]


def test_a_group_of_options_is_unfolded(monkeypatch: pytest.MonkeyPatch) -> None:
    """The fields of a dataclass become options; the command gets the dataclass, with defaults where none is given."""
    app = typer.Typer()
    got: list[object] = []

    def greet(name: str, *, greeting: Greeting, loud: bool = False) -> int:
        got.append((name, greeting, loud))
        return 0

    monkeypatch.setitem(TEXTS, "greet", Text("Greet.", "Greet."))
    greet.__annotations__ = {"name": str, "greeting": Greeting, "loud": bool, "return": int}
    command.add(app, greet)
    runner = CliRunner()
    assert runner.invoke(app, ["Ada", "--words", "Good day", "--times", "2", "--loud"]).exit_code == 0
    assert runner.invoke(app, ["Ada"]).exit_code == 0
    assert got == [("Ada", Greeting("Good day", 2), True), ("Ada", Greeting(), False)]
    assert "How to greet" in runner.invoke(app, ["--help"]).output


@dataclass(frozen=True)
class Greeting:
    """A group of options."""

    words: Annotated[str, options.option("--words", "TEXT", "What to say.", "How to greet")] = "Hello"
    times: Annotated[int, options.option("--times", "N", "How often.", "How to greet", least=1)] = 1


@pytest.fixture
def concave(tmp_path: Path) -> Path:
    """A prism over an L, as a polyhedron: star-shaped, with a negative corner."""
    pyvista = pytest.importorskip("pyvista")
    base = [(0, 0), (2, 0), (2, 1.2), (1.2, 1.2), (1.2, 2), (0, 2)]
    points = np.array([(x, y, z) for z in (0.0, 1.0) for x, y in base])
    sides = [[n, (n + 1) % 6, (n + 1) % 6 + 6, n + 6] for n in range(6)]
    faces = [[5, 4, 3, 2, 1, 0], [6, 7, 8, 9, 10, 11], *sides]
    stream = [len(faces), *(number for face in faces for number in (len(face), *face))]
    path = tmp_path / "concave.vtu"
    pyvista.UnstructuredGrid([len(stream), *stream], [42], points).save(path)
    return path


@pytest.mark.usefixtures("readers_here")
def test_a_concave_cell_is_of_use_to_finite_volumes_only(concave: Path, capsys: Captured) -> None:
    assert main.main(["check", str(concave), "--fail", "nothing invalid"]) == 1
    assert main.main(["check", str(concave), "--fail", "nothing invalid", "--for", "fem"]) == 1
    assert main.main(["check", str(concave), "--fail", "nothing invalid", "--for", "fv"]) == 0
    counts = {}
    for purpose in options.Purposes:
        capsys.readouterr()
        assert main.main(["report", str(concave), "--json", "--for", purpose]) == 0
        file = json.loads(capsys.readouterr().out)["files"][0]
        assert file["purpose"] == purpose.of_mesh
        counts[purpose.value] = file["all"]["n_invalid"]
        out = concave.with_name(f"{purpose}.vtu")
        assert main.main(["improve", str(concave), "-o", str(out), "-q", "--for", purpose]) == counts[purpose.value]
    assert counts == {"fem": 1, "fv": 0, "explicit": 1}


@pytest.fixture
def series(tmp_path: Path) -> Path:
    """A collection of two steps."""
    for n in range(2):
        io.write(tmp_path / f"{n}.vtu", Mesh.from_arrays(SHAPES["tetra"].points, {"tetra": [(0, 1, 2, 3)]}))
    sets = "".join(f'<DataSet timestep="{n}" file="{n}.vtu"/>' for n in range(2))
    path = tmp_path / "run.pvd"
    path.write_text(f'<VTKFile type="Collection"><Collection>{sets}</Collection></VTKFile>')
    return path


@pytest.mark.usefixtures("readers_here")
@pytest.mark.parametrize("name", READING)
@pytest.mark.parametrize(
    ("choice", "message"),
    [
        (["--step", "3"], "run.pvd: holds 2 time steps, step 3 is not among them"),
        (["--step", "next"], "--step is 'next', expected first, last, all or a number from 1"),
        (["--step", "1", "--displacement", "none"], "displacement"),
    ],
)
def test_steps_that_are_not_there(
    name: str, choice: list[str], message: str, series: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    monkeypatch.chdir(series.parent)
    before = sorted(series.parent.iterdir())
    more = [word.format(mesh="0.vtu", out="out") for word in READING[name]]
    assert main.main([name, "run.pvd", *more, *choice]) == 2
    assert message in capsys.readouterr().err
    assert sorted(series.parent.iterdir()) == before
