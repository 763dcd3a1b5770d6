"""Formats that only meshio++ reads (the optional extra ``meshgauge[meshioplusplus]``), in a process of its own.

Chosen by writing and reading back tetra, pyramids, wedges and hexahedra; formats that lost any are not among them.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import os
import re
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any, BinaryIO

from ...errors import ReadError
from ...mesh import Mesh
from ..plumbing import meshio, within
from ..plumbing.format import Format, Reader, Sniffer, anything
from ..plumbing.messages import is_out_of_memory

_INCLUDE = {
    "radioss": re.compile(rb"^[#/]include\b", re.IGNORECASE | re.MULTILINE),
    "febio": re.compile(rb"<Include\b|\b(?:from|include)\s*=\s*[\"']", re.IGNORECASE),
}
_MOST_NOTES = 5


def _by(module: str) -> Reader:
    def read(path: Path) -> Mesh:
        include = _INCLUDE.get(module)
        if include is not None and include.search(path.read_bytes()):
            raise ReadError(f"{path}: includes other files, which are not followed; join them first")
        if module == "febio":
            within.check_xml(path)
        source_, notes = source(_bytes(path, module) or str(path), module, path)
        mesh = meshio.mesh(source_, path, notes)
        if not mesh.n_cells:
            raise ReadError(f"{path}: no cells were found in it")
        return mesh

    return read


_EQUALS = re.compile(rb"^([ \t]*\w+)[ \t]+=[ \t]+(?=\w)", re.MULTILINE)


def _bytes(path: Path, module: str) -> BinaryIO | None:
    """What to read in place of a file; None if it is read as it is.

    Between the name of a cell and its points Code_Aster allows a "=", which meshio++ takes for a point.
    """
    if module != "code_aster":
        return None
    data = path.read_bytes()
    return io.BytesIO(_EQUALS.sub(rb"\1 ", data)) if _EQUALS.search(data) else None


def package(path: Path) -> Any:
    """The library; `ReadError` that names the extra if it is not installed."""
    try:
        return importlib.import_module("meshioplusplus")
    except ImportError as error:
        if is_out_of_memory(error):
            raise MemoryError from error
        raise ReadError(
            f"{path}: is read by meshio++, which is not installed: pip install 'meshgauge[meshioplusplus]'"
        ) from None


def source(file: str | BinaryIO, module: str, path: Path) -> tuple[Any, tuple[str, ...]]:
    """What one reader of meshio++ makes of a file or its bytes, and what it warned of; errors name ``path``."""
    library = package(path)
    with _captured_output() as log:
        try:
            mesh = library.read(file, file_format=module)
        except (Exception, SystemExit) as error:
            if is_out_of_memory(error):
                raise MemoryError from error
            reason = " ".join(str(error).split())
            reason = re.sub(rf"^Couldn't read file \S* as {module} \((.*)\)\Z", r"\1", reason).removeprefix(
                f"{module}: "
            )
            raise ReadError(f"{path}: meshio++ ({module}) says: {reason}") from error
        log.seek(0)
        warned = re.findall(r"warning[^\]\n]*\]?:?\s*([^\n]+)", log.read().decode("utf-8", "replace"))
    return mesh, tuple(f"meshio++ warns: {text.strip()}" for text in list(dict.fromkeys(warned))[:_MOST_NOTES])


def _log() -> IO[bytes]:
    """A file that is gone when it is closed; in memory where the system can: a reader may write nothing."""
    if hasattr(os, "memfd_create"):
        return os.fdopen(os.memfd_create("meshgauge-log"), "w+b")
    return tempfile.TemporaryFile()


@contextlib.contextmanager
def _captured_output() -> Iterator[IO[bytes]]:
    """What is written to standard output and error meanwhile, from C++ too: what meshio++ drops, it only prints."""
    with _log() as log:
        before = [os.dup(1), os.dup(2)]
        try:
            for fd in (1, 2):
                os.dup2(log.fileno(), fd)
            yield log
        finally:
            for fd, old in zip((1, 2), before, strict=True):
                os.dup2(old, fd)
                os.close(old)


def _mark(pattern: bytes) -> Sniffer:
    compiled = re.compile(pattern, re.IGNORECASE | re.MULTILINE)
    return lambda head, path: compiled.search(head) is not None


PLUSPLUS: tuple[Format, ...] = tuple(
    Format(name, title, extensions, sniff, foreign=_by(module), by_content=False)
    for name, module, title, extensions, sniff in (
        ("febio", "febio", "FEBio", (".feb",), _mark(rb"<febio_spec\b")),
        ("frd", "frd", "CalculiX results", (".frd",), _mark(rb"^\s*1C|^\s*2C|^ {4}1U")),
        ("comsol", "mphtxt", "COMSOL text", (".mphtxt",), anything),
        ("code_aster", "code_aster", "Code_Aster", (".mail",), anything),
        ("patran", "patran", "Patran neutral", (".pat",), _mark(rb"\A\s*2[56]\s")),
        ("libmesh", "libmesh", "libMesh", (".xda",), _mark(rb"libMesh")),
        ("radioss", "radioss", "RADIOSS", (".rad",), _mark(rb"^#RADIOSS|^/(NODE|BRICK|TETRA4|PART)\b")),
    )
)
"""A row a format."""
