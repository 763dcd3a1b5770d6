"""Where files of text name those that they include."""

from __future__ import annotations

import re

_ABAQUS = re.compile(
    rb"^[ \t]*\*(?!\*)[^\n]*?\bINPUT[ \t]*=[ \t]*\"?([^,\"\r\n]*[^,\"\s])", re.MULTILINE | re.IGNORECASE
)
_NASTRAN = re.compile(rb"^INCLUDE[ \t]+['\"]?([^'\"\r\n]*[^'\"\s])", re.MULTILINE | re.IGNORECASE)
_LSDYNA = re.compile(rb"^\*INCLUDE[ \t]*\r?\n((?:(?!\*)[^\n]*(?:\n|\Z))+?)(?=\*|\Z)", re.MULTILINE | re.IGNORECASE)
_LINE = re.compile(rb"^(?!\$)[ \t]*(\S[^\r\n]*?)[ \t]*\r?$", re.MULTILINE)

Spans = list[tuple[int, int]]


def abaqus(data: bytes) -> Spans:
    """Behind INPUT= of *INCLUDE, *NODE and *ELEMENT."""
    return [match.span(1) for match in _ABAQUS.finditer(data)]


def nastran(data: bytes) -> Spans:
    """Behind INCLUDE."""
    return [match.span(1) for match in _NASTRAN.finditer(data)]


def lsdyna(data: bytes) -> Spans:
    """On the lines below *INCLUDE."""
    return [
        line.span(1) for block in _LSDYNA.finditer(data) for line in _LINE.finditer(data, block.start(1), block.end(1))
    ]
