"""Names of other files in an XML file: as a parser decodes them, so that none hides behind an escape or an entity."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from ...errors import ReadError

ENCODINGS = ("utf-8", "us-ascii", "ascii", "iso-8859-1")
"""Those that all readers decode alike."""

ATTRIBUTES = ("href", "file", "source", "reference")
"""Attributes that name a file; compared without case."""

INLINE = ("", "xml")
"""Formats of an XDMF item whose text is its data; that of any other names where they are."""

_PLAIN = re.compile(r"\w[\w.+-]{0,254}")
_XDMF_PATH = re.compile(r"/Xdmf\b|XML$|#")
_CHUNK = 1 << 16


@dataclass(frozen=True, slots=True)
class Names:
    """What an XML file refers to."""

    heavy: set[str] = field(default_factory=set)  #: files of data of XDMF
    others: set[str] = field(default_factory=set)  #: files that attributes name
    included: set[str] = field(default_factory=set)  #: XML files that are to be put in the place of an element


class _Appended(Exception):
    """From here on the file is raw data."""


def names_in_xml(path: Path) -> Names:
    """The names in a file, up to data that are appended.

    A document type may be declared, and entities that stand for the plain name of a file, as PETSc's XDMF has them;
    nothing external is loaded.

    Raises
    ------
    ReadError
        If it is no XML, is neither in UTF-8, ASCII nor Latin-1, or declares other entities.
    """
    collector = _Collector(path)
    with path.open("rb") as file:
        head = file.read(4)
        if head[:2] in (b"\xff\xfe", b"\xfe\xff") or b"\0" in head:
            raise ReadError(f"{path}: is neither in UTF-8, ASCII nor Latin-1")
        file.seek(0)
        try:
            while chunk := file.read(_CHUNK):
                collector.parser.Parse(chunk, False)
            collector.parser.Parse(b"", True)
        except _Appended:
            pass
        except expat.ExpatError as error:
            raise ReadError(f"{path}: is no XML: {error}") from error
    return collector.names


class _Collector:
    """Takes what the parser meets."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.names = Names()
        self._texts: list[list[str] | None] = []  # of the elements that are open; None if of no interest
        self.parser = expat.ParserCreate()
        self.parser.buffer_text = True
        self.parser.XmlDeclHandler = self._declaration
        self.parser.EntityDeclHandler = self._entity
        self.parser.ExternalEntityRefHandler = self._external
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end

    def _declaration(self, version: str, encoding: str | None, standalone: int) -> None:
        if encoding is not None and encoding.lower() not in ENCODINGS:
            raise ReadError(f"{self.path}: is in {encoding}, expected UTF-8, ASCII or Latin-1")

    def _entity(self, name: str, is_parameter: int, value: str | None, *_: str | None) -> None:
        if is_parameter or value is None or not _PLAIN.fullmatch(value):
            raise ReadError(f"{self.path}: declares the entity {name!r}, which is not the name of a file beside it")

    def _external(self, *_: str | None) -> int:
        raise ReadError(f"{self.path}: refers to an external entity, which is not loaded")

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        tag = name.rsplit(":", 1)[-1].lower()
        if tag == "appendeddata":
            raise _Appended
        values = {key.lower(): value.strip() for key, value in attributes.items()}
        for key in ATTRIBUTES:
            value = values.get(key, "")
            if tag == "include" and key == "href" and value:
                self.names.included.add(value)
            elif value and not (key in ("reference", "href") and _XDMF_PATH.match(value)):
                self.names.others.add(value)
        is_heavy = tag in ("dataitem", "datastructure") and values.get("format", "").lower() not in INLINE
        self._texts.append([] if is_heavy else None)
        self.parser.CharacterDataHandler = self._texts[-1].append if self._texts[-1] is not None else None

    def _end(self, name: str) -> None:
        texts = self._texts.pop()
        text = "".join(texts or ()).strip()
        if text:
            self.names.heavy.add(text.rsplit(":", 1)[0])
        above = self._texts[-1] if self._texts else None
        self.parser.CharacterDataHandler = above.append if above is not None else None
