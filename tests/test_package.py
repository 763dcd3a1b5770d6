"""What is installed: version, entry points, type marker, documented public names."""

from __future__ import annotations

import inspect
import re
import subprocess
import sys
from importlib import import_module
from importlib.metadata import entry_points, metadata, version
from importlib.resources import files
from pathlib import Path

import pytest

import meshgauge

NAMES = [name for name in meshgauge.__all__ if name != "__version__"]
CALLABLES = [name for name in NAMES if callable(getattr(meshgauge, name))]


def test_one_version() -> None:
    assert meshgauge.__version__ == version("meshgauge")


@pytest.mark.parametrize("command", [[sys.executable, "-m", "meshgauge"], ["script"]], ids=["module", "script"])
def test_entry_points_say_the_version(command: list[str]) -> None:
    if command == ["script"]:
        (script,) = entry_points(group="console_scripts", name="meshgauge")
        module, function = script.value.split(":")
        command = [sys.executable, "-c", f"import sys; from {module} import {function}; sys.exit({function}())"]
    done = subprocess.run([*command, "--version"], capture_output=True, text=True, check=True)
    assert done.stdout == f"meshgauge {meshgauge.__version__}\n"


def test_types_are_shipped() -> None:
    assert files("meshgauge").joinpath("py.typed").is_file()


def test_requirements_and_licence_are_stated() -> None:
    stated = metadata("meshgauge")
    assert stated["License-Expression"] == "MIT"
    assert stated["Requires-Python"] == ">=3.11"
    needed = [r for r in stated.get_all("Requires-Dist") or () if "extra ==" not in r]
    assert not [r for r in needed if r.startswith(("pytest", "hypothesis", "gmsh"))]


def test_public_names_are_told_by_dir_and_typed() -> None:
    assert set(meshgauge.__all__) <= set(dir(meshgauge))
    source = inspect.getsource(meshgauge)
    assert [name for name in NAMES if f"import {name} as {name}\n" not in source] == []
    with pytest.raises(AttributeError, match="no_such_name"):
        meshgauge.no_such_name  # noqa: B018  the access is what is tested


MODULES = ("check", "compare", "doctor", "io", "plot", "repair", "view")


ALONE = """
import os, sys
import meshgauge, numpy
for name in sys.argv[1:]:
    child = os.fork() if hasattr(os, "fork") else 0
    if not child:
        module = getattr(meshgauge, name)
        print(module.__name__, *module.__all__, flush=True)
        if hasattr(os, "fork"):
            os._exit(0)
    else:
        assert os.waitpid(child, 0)[1] == 0
"""


def test_modules_are_there_without_an_import_of_their_own() -> None:
    """Each in a process of its own, where nothing else has imported them."""
    done = subprocess.run([sys.executable, "-c", ALONE, *MODULES], capture_output=True, text=True, check=True)
    for name, line in zip(MODULES, done.stdout.splitlines(), strict=True):
        assert line.split()[0] == f"meshgauge.{name}"
        assert len(line.split()) > 2
        assert name in dir(meshgauge)
        assert f"import {name} as {name}\n" in inspect.getsource(meshgauge), "seen by type checkers"


def test_no_folder_has_the_name_of_a_public_function() -> None:
    folder = Path(meshgauge.__file__).parent
    taken = {path.stem for path in folder.iterdir() if path.is_dir() or path.suffix == ".py"}
    assert taken.isdisjoint(NAMES)
    for package in MODULES:
        public = import_module(f"meshgauge.{package}").__all__
        assert {path.name for path in (folder / package).iterdir() if path.is_dir()}.isdisjoint(public), package


@pytest.mark.parametrize("name", CALLABLES)
def test_public_names_have_docstrings(name: str) -> None:
    public = getattr(meshgauge, name)
    written = inspect.getdoc(public) or ""
    assert len(written) > 20, name
    assert not written.startswith(f"{name}("), "a docstring, not the signature that dataclass makes of one"
    for own, member in vars(public).items() if inspect.isclass(public) and not issubclass(public, int) else ():
        if inspect.isfunction(member) and not own.startswith("_"):
            assert inspect.getdoc(member), f"{name}.{own}"


FUNCTIONS = [name for name in NAMES if inspect.isfunction(getattr(meshgauge, name))]


@pytest.mark.parametrize("name", [*FUNCTIONS, "Mesh.from_arrays", "Quality.to_html", "Quality.report"])
def test_docstrings_name_every_parameter_result_and_error(name: str) -> None:
    function: object = meshgauge
    for part in name.split("."):
        function = getattr(function, part)
    text = inspect.getdoc(function) or ""
    parameters = [p for p in inspect.signature(function).parameters if p != "self"]  # type: ignore[arg-type]
    sections = re.split(r"\n\n(\w+)\n-+\n", "\n\n" + text)
    by_title = {"Raises": "", **dict(zip(sections[1::2], sections[2::2], strict=True))}
    stated = {one.strip() for line in by_title["Parameters"].split("\n") if line[:1] != " " for one in line.split(",")}
    assert set(parameters) <= stated
    assert by_title["Returns"].strip()
    assert by_title["Raises"].strip() or name == "regions", "which takes any mesh"


ROOT = Path(__file__).resolve().parent.parent


def test_public_names_are_in_the_documentation_and_the_changelog() -> None:
    pages = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "docs").glob("*.md"))
    log = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    for text, where in ((pages, "docs/"), (log, "CHANGELOG.md")):
        assert [name for name in NAMES if not re.search(rf"\b{name}\b", text)] == [], where
