"""Netgen's .vol by meshio, which is handed only the sections that it knows: those of today's Netgen end it."""

from __future__ import annotations

import io
import re
from pathlib import Path

from ...errors import ReadError
from ...mesh import Mesh
from ..plumbing import meshio
from ..plumbing.format import Format, Writer
from ..plumbing.text import Text
from . import rows_places

_MARK = re.compile(rb"^mesh3d\b", re.MULTILINE)
_WORD = re.compile(rb"[A-Za-z]\w*\Z")
_VALUES = (b"dimension", b"geomtype")
_KNOWN = frozenset((
    b"points", b"pointelements", b"edgesegments", b"edgesegmentsgi", b"edgesegmentsgi2", b"surfaceelements",
    b"surfaceelementsgi", b"surfaceelementsuv", b"volumeelements", b"materials", b"bcnames", b"cd2names", b"cd3names",
    b"identifications", b"identificationtypes",
))  # fmt: skip
_EDGES_OF_TODAY = b"edgesegmentsgi3"
_IN_ONE_ROW = b"identificationtypes"


def sniff(head: bytes, path: Path) -> bool:
    return _MARK.search(head) is not None


def read(path: Path) -> Mesh:
    """All cells; regions are ``netgen:index``.

    Raises
    ------
    ReadError
        If a section is not whole, or meshio fails.
    """
    source, notes = meshio.read(path, "netgen", io.StringIO(_known_sections(path)))
    mesh = meshio.mesh(source, path, notes)
    if not mesh.n_cells:
        raise ReadError(f"{path}: no cells were found in it")
    return mesh


def _known_sections(path: Path) -> str:
    """The file without comments and sections that meshio does not know; edges in the form that it knows."""
    text = Text(path, path.read_bytes())
    parts: list[bytes] = []
    rows_each = 1
    while line := text.line():
        if line.startswith(b"#"):
            continue
        if line.split()[:2] == [b"surf1", b"surf2"]:  # the edges that follow have two lines each
            rows_each = 2
            parts.append(line)
        elif line in (b"mesh3d", b"endmesh"):
            parts.append(line)
            if line == b"endmesh":  # the surfaces of the geometry may follow
                break
        elif line in _VALUES:
            parts += [line, text.line("a value")]
        elif _WORD.match(line):
            parts += _section(text, line, rows_each if line.startswith(b"edgesegments") else 1)
        else:
            raise text.fail(f"{line[:40].decode('utf-8', 'replace')!r} where a section is expected")
    return b"\n".join((*parts, b"")).decode("utf-8", "replace")


def _section(text: Text, name: bytes, rows_each: int) -> list[bytes]:
    n = text.integers(f"the number of {name.decode()}")[0]
    rows = text.lines(min(n, 1) if name == _IN_ONE_ROW else n * rows_each, name.decode())
    if name == _EDGES_OF_TODAY:  # two points, places on the surface, and the number of the edge
        edges = [row.split() for row in rows.splitlines()]
        if any(len(edge) < 7 for edge in edges):
            raise text.fail(f"{name.decode()} have fewer than 7 numbers")
        name, rows = b"edgesegments", b"".join(b"%b 0 %b %b\n" % (edge[6], edge[0], edge[1]) for edge in edges)
    return [name, str(n).encode(), rows] if name in _KNOWN else []


def netgen(write: Writer) -> Format:
    """The format, with a writer."""
    return Format("netgen", "Netgen", (".vol",), sniff, foreign=read, write=write, places=rows_places.netgen)
