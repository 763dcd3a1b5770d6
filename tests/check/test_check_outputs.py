"""The outputs of the gate, each read back as what it claims to be."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from typing import Any

import pytest
from check_meshes import measured
from rich.console import Console

from meshgauge.check import Check, check, rule
from meshgauge.check.output import markdown as markdown_output
from meshgauge.check.output.github import github
from meshgauge.check.output.gitlab import gitlab
from meshgauge.check.output.json import checks_json
from meshgauge.check.output.junit import junit
from meshgauge.check.output.markdown import markdown
from meshgauge.check.output.sarif import sarif
from meshgauge.check.output.text import ChecksText, CheckText
from meshgauge.errors import FailedFile
from meshgauge.look.colours import INVALID

HOSTILE = 'runs/a "b",<i>%0A|`x`::error:\x1b[31m\x00.vtu'

FAILED = [FailedFile("gone.vtu", "no such file\n::warning::fooled")]


@pytest.fixture(scope="module")
def checks() -> list[Check]:
    """Every state: a failing mesh of a hostile name, one that passes, one that cannot be checked."""
    bad = measured("good", "inverted", "nan", "low", "inverted", regions=[1, 1, 2, 2, 2])
    rules = [
        rule("nothing invalid"),
        rule("jens >= 0.2 @ 1%", level="warn"),
        rule("jens >= 0.2 for pyramid"),
        rule("jens >= -1 @ 1 in 'region 2'"),
    ]
    return [
        check(bad, rules, path=HOSTILE, listed=1),
        check(measured("good"), ["nothing invalid"], path="good.vtu"),
        check(measured("good"), ["nothing invalid in inlet"], path="good.vtu"),
    ]


def strict(text: str) -> Any:
    """Parse, refusing NaN and infinities, which are no JSON."""

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is not JSON")

    assert text.isascii()
    return json.loads(text, parse_constant=refuse)


def test_json(checks: list[Check]) -> None:
    document = strict(checks_json(checks, FAILED))
    assert (document["schema"], document["version"], document["passed"]) == ("meshgauge-check", 3, False)
    assert [file["state"] for file in document["files"]] == ["fail", "pass", "unchecked"]
    states = [outcome["state"] for outcome in document["files"][0]["outcomes"]]
    assert states == ["fail", "warn", "empty", "pass"]
    assert document["files"][0]["outcomes"][1]["cells"][0]["value"] is None  # NaN
    assert document["errors"][0]["path"] == "gone.vtu"
    assert strict(checks_json(checks[1:2]))["passed"] is True
    assert strict(checks_json(checks[1:]))["passed"] is False


def test_junit(checks: list[Check]) -> None:
    root = ET.fromstring(junit(checks, FAILED))
    assert root.tag == "testsuites"
    assert [root.get(key) for key in ("tests", "failures", "errors", "skipped")] == ["7", "1", "2", "1"]
    first = root[0]
    assert {suite.tag for suite in root} == {"testsuite"}
    assert [first.get(key) for key in ("tests", "failures", "errors", "skipped")] == ["4", "1", "0", "1"]
    for suite in root:
        assert int(suite.get("tests", "")) == len(suite.findall("testcase"))
        for case in suite:
            assert case.get("name")
            assert case.get("classname")
    (failure,) = root.iter("failure")
    assert failure.get("message") == "2 of 5 cells are invalid; none is allowed"
    assert failure.text is not None
    assert "tetra cell 1 (inverted, jens -0.7071) in region 1 at node" in failure.text
    assert failure.text.endswith("and 1 more")
    (skipped,) = root.iter("skipped")
    assert skipped.get("message") == "the mesh has no such cells"


def require(item: dict[str, Any], keys: Sequence[str]) -> None:
    assert set(keys) <= set(item), f"{sorted(item)} lacks some of {keys}"


def test_sarif_has_what_its_schema_requires(checks: list[Check]) -> None:
    log = strict(sarif(checks, FAILED))
    require(log, ["version", "runs"])
    assert log["version"] == "2.1.0"
    assert log["$schema"].startswith("https://")
    (run,) = log["runs"]
    require(run, ["tool", "results"])
    driver = run["tool"]["driver"]
    require(driver, ["name"])
    assert re.fullmatch(r"\d+\.\d+\.\d+", driver["semanticVersion"])
    ids = [found["id"] for found in driver["rules"]]
    assert len(set(ids)) == len(ids)
    for found in driver["rules"]:
        require(found["shortDescription"], ["text"])
    for invocation in run["invocations"]:
        require(invocation, ["executionSuccessful"])
        for notification in invocation["toolExecutionNotifications"]:
            require(notification["message"], ["text"])
    assert [result["level"] for result in run["results"]] == ["error", "warning", "error", "error"]
    for result in run["results"]:
        require(result, ["message", "ruleId", "locations", "partialFingerprints"])
        require(result["message"], ["text"])
        assert ids[result["ruleIndex"]] == result["ruleId"]
        assert result["level"] in ("none", "note", "warning", "error")
        related = result.get("relatedLocations", [])
        assert [location["id"] for location in related] == list(range(len(related)))
        for location in (*result["locations"], *related):
            place = location["physicalLocation"]
            assert place["region"]["startLine"] >= 1
            # A URI reference of RFC 3986: no blank, quote, bracket or control character is left in it.
            assert re.fullmatch(r"[\w\-.~%!$&'()*+,;=:@/]+", place["artifactLocation"]["uri"])
        for location in related:
            assert location["logicalLocations"][0]["fullyQualifiedName"].startswith("tetra cell ")
            require(location["message"], ["text"])
    prints = [result["partialFingerprints"]["meshgauge/v1"] for result in run["results"]]
    assert len(set(prints)) == len(prints)


def test_sarif_is_accepted_by_a_model_made_of_its_schema(checks: list[Check]) -> None:
    model = pytest.importorskip("pydantic_sarif.model").StaticAnalysisResultsFormatSarifVersion210JsonSchema
    log = model.model_validate_json(sarif(checks, FAILED))
    assert len(log.runs[0].results) == 4
    broken = json.loads(sarif(checks))
    del broken["runs"][0]["results"][0]["message"]
    with pytest.raises(ValueError, match="message"):
        model.model_validate(broken)


def test_gitlab(checks: list[Check]) -> None:
    issues = strict(gitlab(checks, FAILED))
    assert [issue["severity"] for issue in issues] == ["major", "minor", "critical", "critical"]
    for issue in issues:
        require(issue, ["description", "check_name", "fingerprint", "severity", "location"])
        assert issue["location"]["lines"]["begin"] == 1
        assert issue["location"]["path"]
    assert len({issue["fingerprint"] for issue in issues}) == len(issues)
    assert "point" in issues[0]["description"]


def test_github_annotations_are_one_line_each_whatever_the_names_are(checks: list[Check]) -> None:
    lines = list(github(checks, FAILED))
    assert [line.split(" ", 1)[0] for line in lines] == ["::error", "::warning", "::error", "::error"]
    for line in lines:
        assert "\n" not in line
        assert "\x1b" not in line
        match = re.fullmatch(r"::(error|warning) file=([^:,]*),title=([^:,]*)::(.*)", line)
        assert match, line
    assert "%0Atetra cell 1 (inverted" in lines[0]
    assert "%250A" in lines[0]  # the %0A of the name stays text


def test_markdown_shows_names_as_they_are(checks: list[Check]) -> None:
    text = markdown(checks, FAILED)
    assert text.startswith("## ❌ Mesh quality: 1 of 4 passes\n")
    assert "<i>" not in text
    assert "\\`x\\`" in text
    assert "\x1b" not in text
    tables = [line for line in text.splitlines() if line.startswith("|")]
    assert all(line.endswith("|") for line in tables)
    overview = [re.split(r"(?<!\\)\|", line) for line in tables[:6]]
    assert {len(columns) for columns in overview} == {9}
    assert "| 1 | tetra | -0.7071 | inverted |" in text
    assert "and 1 more" in text
    assert markdown(checks[1:2]).startswith("## ✅ Mesh quality: 1 of 1 passes\n")


def test_markdown_has_pictures_that_pages_of_hosts_draw(checks: list[Check]) -> None:
    text = markdown(checks, FAILED)
    assert "| 5 | 2 | -0.707 | `" in text.replace(f"{checks[0].n_cells} |", "5 |")
    blocks = re.findall(r"^```mermaid\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)
    assert len(blocks) == 2  # the mesh that passes has none
    rows = [[float(n) for n in row.split(", ")] for row in re.findall(r"^  bar \[(.*)\]$", blocks[0], re.MULTILINE)]
    (palette,) = re.findall(r"plotColorPalette: '(.*)'", blocks[0])
    assert {len(row) for row in rows} == {20}
    assert len(palette.split(", ")) == len(rows)
    tally = checks[0].tally
    assert tally is not None
    inverted = rows[palette.split(", ").index(INVALID)]
    assert sum(round(10**n - 1) for n in inverted) == tally.n_invalid == 2
    assert f"{tally.n_invalid} invalid" in blocks[0]


def test_markdown_says_how_many_meshes_it_does_not_show(checks: list[Check], monkeypatch: pytest.MonkeyPatch) -> None:
    broken = [check for check in checks if not check.is_passed]
    monkeypatch.setattr(markdown_output, "MOST", len(broken))
    assert "not shown here" not in markdown(checks, FAILED)
    monkeypatch.setattr(markdown_output, "MOST", len(broken) - 1)
    assert markdown(checks, FAILED).endswith("Meshes with broken rules that are not shown here: 1\n")


@pytest.mark.parametrize("width", [60, 80, 160])
@pytest.mark.parametrize("encoding", ["utf-8", "ascii"])
def test_text_fits_its_width(checks: list[Check], width: int, encoding: str, tmp_path: Any) -> None:
    with (tmp_path / "out").open("w", encoding=encoding, errors="backslashreplace") as file:
        console = Console(file=file, width=width, highlight=False, markup=False)
        console.print(CheckText(checks[0]))
        console.print(ChecksText(checks, FAILED))
    text = (tmp_path / "out").read_text(encoding=encoding)
    assert max(map(len, text.splitlines())) <= width
    said = " ".join(text.split())
    assert "1 of 4 rules fails, 1 warns" in said
    assert "1 of 4 meshes passes" in said
    assert "nothing invalid: the worst 1 of 2 cells" in said
    assert "inverted" in said


@pytest.mark.parametrize(("width", "last"), [(160, "region"), (52, "z")])
def test_where_no_table_fits_the_one_without_regions_is_shown(width: int, last: str) -> None:
    one = check(measured("inverted", "good", regions=[1, 2]), ["nothing invalid"], path="a.vtu")
    console = Console(width=width, highlight=False, markup=False)
    with console.capture() as captured:
        console.print(CheckText(one))
    heads = [line.split() for line in captured.get().splitlines() if line.strip().startswith("cell ")]
    assert heads[0][:4] == ["cell", "type", "jens", "status"]
    assert heads[-1][-1] == last
    assert len(heads) == (2 if width < 60 else 1), "what does not fit goes on below"


def test_words_stand_on_the_left_of_their_column_and_numbers_on_the_right() -> None:
    one = check(measured("inverted", "flat", regions=[1, 200]), ["nothing invalid", "nothing degenerate"])
    console = Console(width=160, highlight=False, markup=False)
    with console.capture() as captured:
        console.print(CheckText(one))
    lines = captured.get().splitlines()
    heads = [line for line in lines if line.strip().startswith("cell ")]
    rows = [line for line in lines if " tetra " in line]
    assert len(heads) == len(rows) == 2
    for head, row, status, region in zip(
        heads, rows, ("inverted", "degenerate"), ("region 1", "region 200"), strict=True
    ):
        for title, entry in (("type", "tetra"), ("status", status), ("region", region)):
            assert head.index(title) == row.index(entry)
        assert head.index("jens") + len("jens") == row.index(status) - 2
