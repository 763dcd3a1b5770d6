"""The gate as JUnit XML: a suite a mesh, a test case a rule. Read by Jenkins, GitLab, Azure and most others."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence

from ...errors import FailedFile
from .. import Check, Outcome, State
from .lines import messages, printable

TIME = "0"
"""Some readers insist on times; the same mesh must give the same file."""


def junit(checks: Sequence[Check], failures: Sequence[FailedFile] = ()) -> str:
    """The document as text. Broken rules are failures, warnings pass with a text, rules about no cell are skipped,
    what could not be checked is an error."""
    root = ET.Element("testsuites", name="meshgauge check", time=TIME)
    for check in checks:
        suite = _suite(root, check.path, len(check.outcomes))
        for outcome in check.outcomes:
            _case(suite, check.path, outcome)
    for failure in failures:
        suite = _suite(root, failure.path, 1)
        case = ET.SubElement(suite, "testcase", classname=printable(failure.path), name="is read", time=TIME)
        ET.SubElement(case, "error", message=printable(failure.reason), type="unreadable")
    for suite in (*root, root):
        for tag in ("failure", "error", "skipped"):
            plural = tag if tag == "skipped" else f"{tag}s"
            suite.set(plural, str(len(suite.findall(f".//{tag}"))))
    root.set("tests", str(len(root.findall(".//testcase"))))
    ET.indent(root)
    return ET.tostring(root, encoding="unicode", xml_declaration=False).join(
        ('<?xml version="1.0" encoding="UTF-8"?>\n', "\n")
    )


def _suite(root: ET.Element, path: str, n: int) -> ET.Element:
    return ET.SubElement(root, "testsuite", name=printable(path), tests=str(n), time=TIME)


def _case(suite: ET.Element, path: str, outcome: Outcome) -> None:
    case = ET.SubElement(suite, "testcase", classname=printable(path), name=printable(str(outcome.rule)), time=TIME)
    lines = printable("\n".join(messages(outcome)))
    text = printable(outcome.text)
    if outcome.state is State.FAIL:
        ET.SubElement(case, "failure", message=text, type="fail").text = lines
    elif outcome.state is State.UNCHECKED:
        ET.SubElement(case, "error", message=text, type="unchecked")
    elif outcome.state is State.EMPTY:
        ET.SubElement(case, "skipped", message=text)
    elif outcome.state is State.WARN:
        ET.SubElement(case, "system-out").text = f"warning: {lines}"
    else:
        ET.SubElement(case, "system-out").text = lines
