"""No reader follows a path in a file out of its folder, and none fetches anything."""

from __future__ import annotations

import mmap
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from ...errors import ReadError
from ...files import sources

_ENTITY = re.compile(rb"<!(?:ENTITY|DOCTYPE[^>]*(?:PUBLIC|SYSTEM\s+[\"'](?!Xdmf\.dtd[\"'])))", re.IGNORECASE)
_HEAVY = re.compile(rb">\s*([^<>\s][^<>]{0,4000}?\.(?:h5|hdf5?|xmf|bin|raw|dat))(?=\s*[:<])", re.IGNORECASE)
_ATTRIBUTE = re.compile(rb"\b(?:href|file|source|reference)\s*=\s*[\"']([^\"']+)[\"']", re.IGNORECASE)
_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+:/")
_MOST_LINKS = 100_000


def check(path: Path, names: Iterable[str]) -> None:
    """Raise `ReadError` if a name, taken from the folder of the file, is of a file elsewhere; the others are noted as
    read."""
    folders = {path.parent.resolve(), path.resolve().parent}
    for name in names:
        if _SCHEME.match(name):
            raise ReadError(f"{path}: refers to {name}, which is not fetched")
        target = (path.parent / name).resolve()
        if not any(target.is_relative_to(folder) for folder in folders):
            raise ReadError(f"{path}: refers to {target}, which is outside its folder")
        # EnSight numbers the files of time steps in place of stars.
        for file in path.parent.glob(re.sub(r"\*+", "*", name)) if "*" in name else [target]:
            sources.note(file)


def check_present(path: Path, names: Sequence[str]) -> None:
    """As `check`, and raise if one of the files is missing: some readers would leave it out without a word."""
    check(path, names)
    missing = [name for name in names if not (path.parent / name).is_file()]
    if missing:
        more = f", and {len(missing) - 1} more" if len(missing) > 1 else ""
        raise ReadError(f"{path}: refers to {missing[0]}, which is missing{more}")


def check_xml(path: Path) -> None:
    """Raise for entities, and for names of files elsewhere in attributes or as the place of heavy data (XDMF, PVD).

    HDF5 files that are named are checked as well.
    """
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        if _ENTITY.search(data):
            raise ReadError(f"{path}: declares entities, which are not read")
        heavy = {n.decode("utf-8", "replace").strip() for n in _HEAVY.findall(data)}
        names = heavy | {n.decode("utf-8", "replace").strip() for n in _ATTRIBUTE.findall(data)}
    names = {n for n in names if not n.startswith(("/Xdmf", "XML", "#"))}
    check(path, names)
    check_present(path, sorted(heavy & names))
    for name in names:
        target = path.parent / name
        if target.is_file() and target.suffix.lower() in (".h5", ".hdf", ".hdf5"):
            check_hdf_file(target)


def check_ensight(path: Path) -> None:
    """Raise for names of files elsewhere in an EnSight case: the last word of the lines that name one."""
    text = path.read_bytes().decode("utf-8", "replace")
    words = re.findall(
        r"^\s*(?:model|measured|match|boundary|rigid_body|[^:\n]*\bper\b[^:\n]*):(.*)$", text, re.M | re.I
    )
    check(path, (word for line in words for word in line.split() if not re.fullmatch(r"[-\d.]+", word)))


def check_hdf_file(path: Path) -> None:
    """As `check_hdf`, for a file that is not open yet; one that is not HDF5 is left to its reader."""
    import h5py

    try:
        with h5py.File(path, "r") as file:
            check_hdf(path, file)
    except (OSError, RuntimeError, KeyError, ValueError):
        return


def check_hdf(path: Path, file: Any, *, follows: bool = False) -> None:
    """Raise if an HDF5 file keeps data in others: external links, virtual data sets, external storage.

    With ``follows`` links and virtual data sets may name other files of its folder, which must keep all of theirs.
    """
    import h5py

    stack, seen, count = [file], set(), 0
    others: set[str] = set()
    while stack:
        group = stack.pop()
        for name in group:
            count += 1
            if count > _MOST_LINKS:
                raise ReadError(f"{path}: has more than {_MOST_LINKS} objects")
            link = group.get(name, getlink=True)
            if isinstance(link, h5py.ExternalLink):
                if not follows:
                    raise ReadError(
                        f"{path}: {name!r} is kept in the file {link.filename!r}; such links are not followed"
                    )
                others.add(link.filename)
                continue
            if not isinstance(link, h5py.HardLink):
                continue
            item = group.get(name)
            if isinstance(item, h5py.Dataset) and (item.external or item.is_virtual):
                if item.external or not follows:
                    raise ReadError(f"{path}: array {item.name!r} is kept in other files, which are not read")
                others |= {source.file_name for source in item.virtual_sources()} - {"."}
            if isinstance(item, h5py.Group) and item.id.__hash__() not in seen:
                seen.add(item.id.__hash__())
                stack.append(item)
    check_present(path, sorted(others))  # HDF5 looks for a missing one elsewhere, or puts zeros in its place
    for name in sorted(others):
        with h5py.File(path.parent / name, "r") as opened:
            check_hdf(path.parent / name, opened)
