"""No reader follows a path in a file out of its folder, and none fetches anything."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from ...errors import ReadError
from ...files import sources
from . import budget
from .xml_names import names_in_xml

_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+:/")
_MOST_LINKS = 100_000
_DEEPEST = 8


def check(path: Path, names: Iterable[str]) -> None:
    """Raise `ReadError` if a name, taken from the folder of the file, is of a file elsewhere; the others are noted as
    read."""
    folders = {path.parent.resolve(), path.resolve().parent, *budget.roots()}
    for name in names:
        if _SCHEME.match(name):
            raise ReadError(f"{path}: refers to {name}, which is not fetched")
        target = (path.parent / name).resolve()
        if not any(target.is_relative_to(folder) for folder in folders):
            raise ReadError(f"{path}: refers to {target}, which is outside its folder (--include-root allows more)")
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


def check_xml(path: Path, *, depth: int = 0) -> None:
    """Raise for names of files elsewhere, in attributes, as the place of heavy data (XDMF), or of XML to be included.

    HDF5 files that are named are checked as well, and so is what is included.
    """
    names = names_in_xml(path)
    check(path, names.others)
    check_present(path, sorted(names.heavy | names.included))
    for name in names.heavy | names.others:
        target = path.parent / name
        if target.is_file() and target.suffix.lower() in (".h5", ".hdf", ".hdf5"):
            check_hdf_file(target)
    if names.included and depth == _DEEPEST:
        raise ReadError(f"{path}: includes a file, the {depth}th one in another")
    for name in sorted(names.included):
        check_xml(path.parent / name, depth=depth + 1)


def check_ensight(path: Path) -> None:
    """Raise for names of files elsewhere in an EnSight case: words and quoted texts of the lines that name one."""
    text = path.read_bytes().decode("utf-8", "replace")
    lines = re.findall(
        r"^\s*(?:model|measured|match|boundary|rigid_body|[^:\n]*\bper\b[^:\n]*):(.*)$", text, re.M | re.I
    )
    words = [word.strip("\"'") for line in lines for word in re.findall(r"\"[^\"]*\"|'[^']*'|\S+", line)]
    check(path, (word for word in words if not re.fullmatch(r"[-\d.]*", word)))


def check_hdf_file(path: Path) -> None:
    """As `check_hdf`, for a file that is not open yet; one that is not HDF5 is left to its reader."""
    import h5py

    try:
        with h5py.File(path, "r") as file:
            check_hdf(path, file)
    except (OSError, RuntimeError, KeyError, ValueError):
        return


def check_hdf(path: Path, file: Any, *, follows: bool = False, held: bool = True) -> None:
    """Raise if an HDF5 file keeps data in others: external links, virtual data sets, external storage.

    With ``follows`` links and virtual data sets may name other files of its folder, which must keep all of theirs.
    Not ``held``: the arrays are never in memory as a whole. Nor may they be more than such a file can hold, each
    counted as often as it can be reached.
    """
    import h5py

    stack, count = [file], 0
    ways, sizes = {hash(file.id): 1}, {hash(file.id): 0}  # of each group: links to it, bytes of the arrays in it
    others: set[str] = set()
    while stack:
        group = stack.pop()
        here = hash(group.id)
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
            if isinstance(item, h5py.Dataset):
                sizes[here] += item.size * item.dtype.itemsize if item.size else 0
            elif isinstance(item, h5py.Group):
                ways[hash(item.id)] = ways.get(hash(item.id), 0) + 1
                if hash(item.id) not in sizes:
                    sizes[hash(item.id)] = 0
                    stack.append(item)
    check_present(path, sorted(others))  # HDF5 looks for a missing one elsewhere, or puts zeros in its place
    budget.draw("unpacked", sum(ways[key] * sizes[key] for key in sizes), str(file.name), held=held)
    for name in sorted(others):
        with h5py.File(path.parent / name, "r") as opened:
            check_hdf(path.parent / name, opened, held=held)
