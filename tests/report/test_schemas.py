"""Every document that a command prints, against the JSON Schema that is shipped: no field is missing, none is more."""

from __future__ import annotations

import copy
import importlib.util
import json
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import command_line
import jsonschema
import numpy as np
import pytest

import meshgauge
from meshgauge import schemas
from meshgauge.cells import SHAPES

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"
BRACKET, GOOD = (EXAMPLES / "meshes" / name for name in ("bracket.vtu", "bracket_good.vtu"))


@cache
def strict(name: str) -> jsonschema.Draft202012Validator:
    """The schema, which here allows nothing that it does not name."""
    document = json.loads(schemas.schema(name))
    jsonschema.Draft202012Validator.check_schema(document)
    for part in (document, *document["$defs"].values()):
        part["additionalProperties"] = False
    return jsonschema.Draft202012Validator(document)


def printed(*arguments: object) -> Any:
    done = command_line.run(*arguments)
    assert done.stdout, done.stderr

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is not JSON")

    return json.loads(done.stdout, parse_constant=refuse)


def test_the_files_are_made_of_the_page() -> None:
    spec = importlib.util.spec_from_file_location("schemas", ROOT / "docs" / "schemas.py")
    assert spec is not None
    assert spec.loader is not None
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    assert tuple(made.DOCUMENTS) == schemas.NAMES
    for path, text in made.texts().items():
        assert path.read_text(encoding="utf-8") == text, "run python docs/refresh.py"
    assert {path.name for path in schemas.FOLDER.glob("*.json")} == {f"{name}.json" for name in schemas.NAMES}


@pytest.fixture(scope="module")
def odd(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Cubes: one numbered in reverse, one of a point that is no number, one flat; and a point of no cell."""
    cube = np.array(SHAPES["hexahedron"].points, float)
    points = np.vstack(
        [cube, cube + np.array((5, 0, 0)), cube + np.array((0, 5, 0)), cube * np.array((1, 1, 0)), [(9, 9, 9)]]
    )
    points[16] = np.nan
    nodes = [range(8), (12, 13, 14, 15, 8, 9, 10, 11), range(16, 24), range(24, 32)]
    mesh = meshgauge.Mesh.from_arrays(points, {"hexahedron": np.array([list(row) for row in nodes])})
    path = tmp_path_factory.mktemp("odd") / "odd.vtu"
    meshgauge.write(path, mesh)
    return path


def documents(odd: Path, folder: Path) -> Iterator[tuple[str, Any]]:
    missing, first = folder / "none.vtu", folder / "reports" / "1.json"
    first.parent.mkdir()
    report = printed("report", odd, GOOD, missing, "--by", "region", "--metric", "shape", "--json")
    first.write_text(json.dumps(report))
    yield "report", report
    yield "report", printed("report", BRACKET, "--no-diagnosis", "--json")
    yield "report", printed("report", BRACKET, "--for", "fv", "--json")
    yield "report", printed("report", EXAMPLES / "real" / "wedge_cylinder.cas", "--json")
    yield "cell", printed("report", odd, "--cell", "1", "--json")
    yield "cell", printed("report", odd, "--cell", "2", "--json")
    rules = ("--fail", "nothing invalid", "--warn", "jens >= 0.9", "--fail", "nothing unmeasured")
    yield "check", printed("check", odd, GOOD, missing, *rules, "--json", "--statistics")
    yield "check", printed("check", BRACKET, "--fail", f"no worse than {first}", "--json")
    yield "compare", printed("compare", BRACKET, GOOD, odd, "--by", "region", "--json")
    yield "compare", printed("compare", BRACKET, missing, "--json")
    yield "trend", printed("trend", first.parent, "--json")
    yield "doctor", printed("doctor", odd, BRACKET, missing, "--json")
    yield "improve", printed("improve", odd, "-o", folder / "a.vtu", "--json")
    yield "improve-several", printed("improve", odd, missing, "--output-dir", folder / "out", "--json")
    yield "metrics", printed("metrics", "--json")
    yield "metrics", printed("metrics", "skewness", "--json")
    yield "formats", printed("formats", "--json")


def test_documents_are_of_their_schemas(odd: Path, tmp_path: Path) -> None:
    seen = set()
    for name, document in documents(odd, tmp_path):
        errors = [f"{name}: {error.json_path}: {error.message[:200]}" for error in strict(name).iter_errors(document)]
        assert not errors, errors[:5]
        seen.add(name)
    assert seen == set(schemas.NAMES)


def test_a_field_that_is_missing_or_of_another_type_is_seen(odd: Path) -> None:
    document = printed("report", odd, "--json")
    assert strict("report").is_valid(document)
    for change in ("missing", "type", "more", "version"):
        wrong = copy.deepcopy(document)
        tally = wrong["files"][0]["all"]
        if change == "missing":
            del tally["n_poor"]
        elif change == "type":
            tally["n_poor"] = "0"
        elif change == "more":
            tally["n_rich"] = 0
        else:
            wrong["version"] += 1
        assert not strict("report").is_valid(wrong), change


def test_fields_may_be_added_within_a_version(odd: Path) -> None:
    document = printed("report", odd, "--json")
    document["files"][0]["new"] = 1
    jsonschema.validate(document, json.loads(schemas.schema("report")))


def test_the_command() -> None:
    assert command_line.run("schema").stdout.split() == list(schemas.NAMES)
    assert json.loads(command_line.run("schema", "check").stdout) == json.loads(schemas.schema("check"))
    wrong = command_line.run("schema", "reprot")
    assert (wrong.returncode, wrong.stdout) == (2, "")
    assert "no schema 'reprot'; did you mean 'report'?" in wrong.stderr
