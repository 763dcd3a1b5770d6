"""Every output of every command: standard output, links, devices, folders that are not there or that are in the way."""

from __future__ import annotations

import os
import stat
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from inspect import signature
from pathlib import Path
from typing import Any, get_args, get_type_hints

import command_line
import pytest
import typer
from command_line import Process, processes

from meshgauge.cli.main import program

pytestmark = pytest.mark.skipif(os.name != "posix", reason="links and devices of POSIX")


@dataclass(frozen=True)
class Output:
    """An output of a command.

    ``before`` are the arguments before the option, MESH, OTHER, REPORT, PART and UNDO among them; ``suffixes`` what a
    name may end with; ``begins`` what the text begins with that is written, None for one that is no text.
    """

    command: str
    option: str
    before: Sequence[str]
    suffixes: Sequence[str]
    begins: str | None = None
    after: Sequence[str] = ()

    @property
    def is_text(self) -> bool:
        return self.begins is not None

    def __str__(self) -> str:
        return f"{self.command} {self.option}{self.suffixes[0]}"


QUIET = ("MESH", "-q", "--no-diagnosis")
OUTPUTS = (
    Output("report", "--csv", QUIET, [".csv"], "cell,cell_label"),
    Output("report", "--html", QUIET, [".html"], "<!doctype html>"),
    Output("report", "--output", QUIET, [".vtu", ".msh", ".mesh", ".inp"]),
    Output("report", "--bad", QUIET, [".vtu", ".txt", ".csv", ".inc", ".set", ".bdf", ".cellSet"]),
    Output("report", "--bad-set", QUIET, [".msh"]),
    Output("report", "--partial", ("MESH", "-q"), [".mgp"]),
    Output("merge", "--html", ("PART", "-q"), [".html"], "<!doctype html>"),
    Output("check", "--junit", ("MESH", "-q"), [".xml"], "<?xml"),
    Output("check", "--sarif", ("MESH", "-q"), [".sarif"], "{"),
    Output("check", "--gitlab", ("MESH", "-q"), [".json"], "["),
    Output("check", "--markdown", ("MESH", "-q"), [".md"], "#"),
    Output("check", "--write-baseline", ("MESH", "-q"), [".json"], "{"),
    Output("compare", "--html", ("MESH", "OTHER", "-q"), [".html"], "<!doctype html>"),
    Output("compare", "--plot", ("MESH", "OTHER", "-q"), [".svg"]),
    Output("trend", "--html", ("REPORT",), [".html"], "<!doctype html>"),
    Output("improve", "--output", ("MESH", "-q"), [".vtu"]),
    Output("improve", "--html", ("MESH", "-q"), [".html"], "<!doctype html>", after=("-o", "FREE.vtu")),
    Output("improve", "--undo", ("MESH", "-q"), [".npz"], after=("-o", "FREE.vtu")),
    Output("orient", "--output", ("OTHER", "-q"), [".mesh"]),
    Output("orient", "--undo", ("OTHER", "-q"), [".npz"], after=("-o", "FREE.mesh")),
    Output("undo", "--output", ("BETTER", "UNDO", "-q"), [".mesh"]),
    Output("plot", "--output", ("MESH", "-q"), [".svg"]),
    Output("paraview-plugin", "--preset", (), [".json"], "["),
    Output("view", "--screenshot", ("MESH", "-q"), [".png"]),
)
FOLDERS = {("improve", "--output-dir"), ("check", "--fix")}
"""Options that name a folder."""
INPUTS = {"--config", "--surface", "--include-root"}
"""Options that name what is read."""

each = pytest.mark.parametrize("output", OUTPUTS, ids=str)
drawn = pytest.mark.parametrize("output", [one for one in OUTPUTS if one.command != "view"], ids=str)


def test_every_output_is_among_these() -> None:
    found = set()
    for command in program().registered_commands:
        assert command.callback is not None
        hints = get_type_hints(command.callback, include_extras=True)
        for parameter in signature(command.callback).parameters.values():
            kind, info = get_args(hints[parameter.name])[:2]
            if isinstance(info, typer.models.OptionInfo) and Path in (kind, *get_args(kind)):
                names: tuple[Any, ...] = (info.default, *(info.param_decls or ()))
                found.add((command.name, next(name for name in names if str(name).startswith("--"))))
    outputs = {(one.command, one.option) for one in OUTPUTS} | FOLDERS
    assert {pair for pair in found if pair[1] not in INPUTS} == outputs


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """What is read, by its word: one mesh has bad cells, one is numbered in reverse."""
    folder = tmp_path_factory.mktemp("inputs")
    points = "0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n.3 .3 .02 0\n"
    names = {"MESH": "1 2 3 4 0\n1 2 3 5 0\n", "OTHER": "1 3 2 4 0\n"}
    words = {}
    for word, cells in names.items():
        path = folder / f"{word.lower()}.mesh"
        n = cells.count("\n")
        path.write_text(f"MeshVersionFormatted 2\nDimension 3\nVertices\n5\n{points}Tetrahedra\n{n}\n{cells}End\n")
        words[word] = str(path)
    words["REPORT"] = str(folder / "report.json")
    report = command_line.run("report", words["MESH"], "--json")
    Path(words["REPORT"]).write_text(report.stdout)
    words["PART"] = str(folder / "part.mgp")
    command_line.run("report", words["MESH"], "--partial", words["PART"], "-q")
    words["BETTER"], words["UNDO"] = str(folder / "better.mesh"), str(folder / "undo.npz")
    command_line.run("orient", words["OTHER"], "-o", words["BETTER"], "--undo", words["UNDO"], "-q")
    return words


def arguments(output: Output, inputs: dict[str, str], target: str, folder: Path) -> list[str]:
    rest = [
        str(folder / f"free{word.removeprefix('FREE')}") if word.startswith("FREE") else word for word in output.after
    ]
    before = [inputs.get(word, word) for word in output.before]
    return [output.command, *before, output.option, target, *rest]


def run(output: Output, inputs: dict[str, str], target: object, folder: Path) -> tuple[int, str, str]:
    done = command_line.run(*arguments(output, inputs, str(target), folder), cwd=folder)
    for path in folder.glob("free.*"):
        path.unlink()
    return done.returncode, done.stdout, done.stderr


@each
def test_standard_output_takes_what_is_text(output: Output, inputs: dict[str, str], tmp_path: Path) -> None:
    code, out, err = run(output, inputs, "-", tmp_path)
    assert list(tmp_path.iterdir()) == []
    if output.is_text:
        assert (code in (0, 1), err) == (True, "")
        assert any(line.startswith(output.begins or "") for line in out.splitlines()), out[:200]
    elif (output.command, output.option) == ("report", "--bad"):
        assert (code, err) == (0, "")
        assert out.splitlines()[0] == "1"  # a number a line
    else:
        assert (code, out, err.count("\n")) == (2, "", 1), (out, err)


@each
def test_no_folder_and_a_folder_in_the_way(output: Output, inputs: dict[str, str], tmp_path: Path) -> None:
    before = {name: Path(path).read_bytes() for name, path in inputs.items()}
    for suffix in output.suffixes:
        code, out, err = run(output, inputs, tmp_path / "none" / f"a{suffix}", tmp_path)
        assert (code, out, err.count("\n")) == (2, "", 1), (out, err)
        assert "there is no folder" in err
        (tmp_path / f"folder{suffix}").mkdir()
        code, out, err = run(output, inputs, tmp_path / f"folder{suffix}", tmp_path)
        assert (code, out, err.count("\n")) == (2, "", 1), (out, err)
        assert list((tmp_path / f"folder{suffix}").iterdir()) == []
        (tmp_path / f"folder{suffix}").rmdir()
    assert list(tmp_path.iterdir()) == []
    assert {name: Path(path).read_bytes() for name, path in inputs.items()} == before


@each
def test_what_is_read_is_not_written_over(output: Output, inputs: dict[str, str], tmp_path: Path) -> None:
    """Nor through a link of another name."""
    word = next((word for word in output.before if word in inputs), None)
    if word is None:
        return
    before = Path(inputs[word]).read_bytes()
    link = tmp_path / f"link{output.suffixes[0]}"
    link.symlink_to(inputs[word])
    for target in (inputs[word], link):
        code, out, err = run(output, inputs, target, tmp_path)
        assert (code, out, err.count("\n")) == (2, "", 1), (out, err)
    assert Path(inputs[word]).read_bytes() == before
    assert list(tmp_path.iterdir()) == [link]


@drawn
def test_links_are_followed_and_devices_written_into(output: Output, inputs: dict[str, str], tmp_path: Path) -> None:
    for suffix in output.suffixes:
        behind, link = tmp_path / f"behind{suffix}", tmp_path / f"link{suffix}"
        link.symlink_to(behind)
        code, _, err = run(output, inputs, link, tmp_path)
        assert code in (0, 1), err
        assert link.is_symlink()
        assert behind.stat().st_size > 0
        assert sorted(tmp_path.iterdir()) == [behind, link]
        behind.write_text("old")
        code, _, err = run(output, inputs, link, tmp_path)
        assert code in (0, 1), err
        assert behind.read_bytes() != b"old"
        link.unlink()
        link.symlink_to("/dev/null")
        code, _, err = run(output, inputs, link, tmp_path)
        assert code in (0, 1), err
        assert link.is_symlink()
        assert stat.S_ISCHR(os.stat("/dev/null").st_mode)
        assert sorted(tmp_path.iterdir()) == [behind, link]
        behind.unlink()
        link.unlink()


@pytest.mark.skipif(sys.platform != "linux", reason="/dev/stdout of Linux")
def test_the_device_of_standard_output(inputs: dict[str, str], tmp_path: Path) -> None:
    """Text comes out as it does for ``-``, beside what is printed; a device without a known name takes no mesh."""
    chosen = {("report", "--csv"), ("check", "--markdown"), ("trend", "--html")}
    texts = [one for one in OUTPUTS if (one.command, one.option) in chosen]
    wanted = [Process(arguments(one, inputs, "/dev/stdout", tmp_path)) for one in texts]
    for one, done in zip(texts, processes(*wanted), strict=True):
        assert done.returncode in (0, 1), (str(one), done.stderr)
        assert any(line.startswith(one.begins or "") for line in done.stdout.splitlines()), str(one)
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)
    code, out, err = run(OUTPUTS[2], inputs, "/dev/null", tmp_path)
    assert (code, out, err.count("\n")) == (2, "", 1), err


def test_folders(inputs: dict[str, str], tmp_path: Path) -> None:
    """Where a file or nothing is where the folder of an option should be."""
    (tmp_path / "file").write_text("x")
    (tmp_path / "to_null").symlink_to("/dev/null")
    for command, option in sorted(FOLDERS):
        for name in ("file", "to_null", "file/below"):
            done = command_line.run(command, inputs["OTHER"], option, tmp_path / name, cwd=tmp_path)
            assert done.returncode == 2, done.args
            assert done.stderr.count("\n") == 1, done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "to_null"]
    assert (tmp_path / "file").read_text() == "x"
