"""JSON Schema of the documents that commands print, made of the tables of json-schema.md.

python docs/refresh.py writes them to ``src/meshgauge/schemas``; a test holds them.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "json-schema.md"
FOLDER = ROOT / "src" / "meshgauge" / "schemas"

DOCUMENTS = {
    "report": "report",
    "cell": "one cell",
    "check": "check",
    "compare": "compare",
    "trend": "history",
    "doctor": "doctor",
    "improve": "improve",
    "improve-several": "improve several",
    "metrics": "metrics",
    "formats": "formats",
}
"""The object that each document is, by the name of its schema."""

_PLAIN = ("string", "integer", "number", "boolean")
_ROW = re.compile(r"^\| `(\w+)` \| ([\w ]+?) \|(?: (.*))? \|$", re.MULTILINE)
_ABSENT, _NULL = " or absent", " or null"

Fields = dict[str, tuple[str, str]]


def objects() -> dict[str, Fields]:
    """Type and meaning of each field, by object, as the page's tables say."""
    found: dict[str, Fields] = {}
    for section in re.split(r"^## ", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]:
        name = section.split("\n", 1)[0].strip()
        found[name] = {field: (kind, meaning) for field, kind, meaning in _ROW.findall(section)}
    return found


def _kind(kind: str) -> dict[str, Any]:
    """The schema of a type. ``list of X or null`` is a list of such as may be null."""
    if kind.startswith("list of "):
        return {"type": "array", "items": _kind(kind.removeprefix("list of "))}
    if kind.startswith("map of "):
        return {"type": "object", "additionalProperties": _kind(kind.removeprefix("map of "))}
    if kind.endswith(_NULL):
        return {"anyOf": [_kind(kind.removesuffix(_NULL)), {"type": "null"}]}
    if kind == "anything":
        return {}
    return {"type": kind} if kind in _PLAIN else {"$ref": f"#/$defs/{kind.replace(' ', '_')}"}


def _object(fields: Fields) -> dict[str, Any]:
    properties = {}
    for name, (kind, meaning) in fields.items():
        made = _kind(kind.removesuffix(_ABSENT))
        if name == "schema":
            made["const"] = meaning.strip("`")
        elif name == "version" and meaning.startswith("of this schema: "):
            made["const"] = int(meaning.rsplit(" ", 1)[1])
        properties[name] = {**made, "description": meaning} if meaning else made
    required = [name for name, (kind, _) in fields.items() if not kind.endswith(_ABSENT)]
    return {"type": "object", "properties": properties, "required": required}


def _uses(part: Any) -> set[str]:
    """Names of the objects that a schema refers to."""
    if isinstance(part, dict):
        own = {part["$ref"].rsplit("/", 1)[1]} if isinstance(part.get("$ref"), str) else set()
        return own.union(*map(_uses, part.values()))
    return set().union(*map(_uses, part)) if isinstance(part, list) else set()


def schema(name: str) -> dict[str, Any]:
    """The schema of a document, with the objects that it has."""
    known = {title.replace(" ", "_"): _object(fields) for title, fields in objects().items() if fields}
    root = known[DOCUMENTS[name].replace(" ", "_")]
    needed, missing = set(), _uses(root)
    while missing:
        needed |= missing
        missing = set().union(*(_uses(known[one]) for one in missing)) - needed
    version = root["properties"]["version"]["const"]
    head = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": f"urn:meshgauge:{name}:{version}",
        "title": root["properties"]["schema"]["const"],
    }
    return {**head, **root, "$defs": {one: known[one] for one in known if one in needed}}


def texts() -> dict[Path, str]:
    """What each file holds."""
    return {FOLDER / f"{name}.json": json.dumps(schema(name), indent=2) + "\n" for name in DOCUMENTS}


def write() -> None:
    for path, text in texts().items():
        path.write_text(text, encoding="utf-8")
