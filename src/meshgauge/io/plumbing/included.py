"""Where files of text name those that they include."""

from __future__ import annotations

import re

_ABAQUS = re.compile(
    rb"^[ \t]*\*(?!\*)[^\n]*?\bINPUT[ \t]*=[ \t]*\"?([^,\"\r\n]*[^,\"\s])", re.MULTILINE | re.IGNORECASE
)
_NASTRAN = re.compile(rb"^INCLUDE[ \t]+['\"]?([^'\"\r\n]*[^'\"\s])", re.MULTILINE | re.IGNORECASE)
_LSDYNA = re.compile(rb"^\*INCLUDE[ \t]*\r?\n((?:(?!\*)[^\n]*(?:\n|\Z))+?)(?=\*|\Z)", re.MULTILINE | re.IGNORECASE)
_LINE = re.compile(rb"^(?!\$)[ \t]*(\S[^\r\n]*?)[ \t]*\r?$", re.MULTILINE)

_XML = re.compile(rb"\b(?:Source|file)\s*=\s*[\"']([^\"'<>]+)[\"']")
_HEAVY = re.compile(rb">\s*([^<>:\s][^<>:\r\n]*?)(?=:/|\s*<)")
_JSON = re.compile(rb'"name"\s*:\s*"([^"]+)"')

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


def xml(data: bytes) -> Spans:
    """Files of pieces and leaves of VTK's, in front of what is appended."""
    end = data.find(b"<AppendedData")
    return [match.span(1) for match in _XML.finditer(data, 0, end if end >= 0 else len(data))]


def collection(data: bytes) -> Spans:
    """Files of the steps of a ParaView collection, and of what they name."""
    return [match.span(1) for match in _JSON.finditer(data)] if data.lstrip().startswith(b"{") else xml(data)


def xdmf(data: bytes) -> Spans:
    """Files of heavy data: texts of elements that are no numbers, up to the name of an array in them."""
    if not data[:4096].lstrip().startswith(b"<"):
        return []
    return [match.span(1) for match in _HEAVY.finditer(data) if match[1][:1] not in b"0123456789+-."]
