"""Giving a file back with other coordinates and nothing else touched: formats that are patched, not written anew."""

from __future__ import annotations

import contextlib
import os
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..errors import ReadError, WriteError
from ..files import private, undo
from ..files.output import new_folder, replacing
from ..mesh import Mesh
from . import registry
from .plumbing import files
from .plumbing.format import Format, IncludedNames
from .plumbing.isolate import Limits
from .plumbing.numerals import Ints, Reals
from .plumbing.patch import Edit, Places, is_same
from .plumbing.patch_faces import Faces
from .plumbing.patch_nodes import Nodes, edit_nodes
from .plumbing.steps import StepChoice
from .reading import StrPath, format_of

T = TypeVar("T")

Changes = Literal["points", "order", "nothing"]


@dataclass(frozen=True, eq=False)
class Patch:
    """What can be patched of a file, and where the result goes.

    Attributes
    ----------
    mesh
        As it was read from the file.
    target
        Where to.
    chosen
        The format.
    places
        Of the points of the mesh.
    limits, step
        As the mesh was read.
    nodes
        Of the cells of the mesh, if these are to be renumbered and points stay.
    all_times
        Whether a folder is copied with the times that were not read.
    """

    mesh: Mesh
    target: Path
    chosen: Format
    places: Places
    limits: Limits
    step: StepChoice = None
    nodes: tuple[Nodes | Faces, ...] | None = None
    all_times: bool = False

    @property
    def is_fixed(self) -> NDArray[np.bool_]:
        """``(n_points,)`` True for points that have no place of their own in a file that may change."""
        return ~self.places.has_place

    def rounded(self, ids: Ints, points: Reals) -> Reals:
        """``(n, 3)`` coordinates of some points as the file will hold them."""
        return self.places.rounded(ids, points)

    @property
    def roundings(self) -> tuple[Callable[[Ints, Reals], Reals], ...]:
        """`rounded`, and where fields can be made wider (Nastran's GRID becomes GRID*) the same in these."""
        wider = (partial(self.places.rounded, widens=True),) if self.places.can_widen else ()
        return (self.rounded, *wider)

    def write(self, mesh: Mesh, *, overwrite: bool = False, undo_file: Path | None = None) -> None:
        """Copy the files with the points of another mesh in their places.

        The copy is read back first: it takes its place only if the points are those of the mesh, to the last bit, and
        the cells are what they were. Undo data are on the disk before.

        Parameters
        ----------
        mesh
            The mesh of the file with other points, as `rounded` gives them.
        overwrite
            Allow to replace the file itself.
        undo_file
            Keeps the old bytes, see `meshgauge.files.undo`.

        Raises
        ------
        WriteError
            If the target is a file that was read (but for what ``overwrite`` allows), points moved that have no
            place, or the copy does not read back as it should.
        """
        if Path(self.mesh.path or "").is_dir():
            self._write_folder(mesh, overwrite=overwrite, undo_file=undo_file)
        else:
            self._write_file(mesh, overwrite=overwrite, undo_file=undo_file)

    def _moved(self, mesh: Mesh) -> tuple[Reals, Reals]:
        """Coordinates before and after. Raises `WriteError` if points moved that have no place."""
        before, after = (np.asarray(one.points, np.float64) for one in (self.mesh, mesh))
        is_moved = (before.view(np.int64) != after.view(np.int64)).any(axis=1)
        n = int(np.count_nonzero(is_moved & self.is_fixed))
        if n:
            raise WriteError(f"{self.target}: {n:,} points that moved have no place of their own in {self.mesh.path}")
        return before, after

    def _write_file(self, mesh: Mesh, *, overwrite: bool, undo_file: Path | None) -> None:
        source = Path(self.mesh.path or "")
        if not overwrite and os.path.realpath(self.target) in {os.path.realpath(source), *self.mesh.sources}:
            raise WriteError(f"{self.target}: is a file that the mesh was read from; it is not overwritten")
        before, after = self._moved(mesh)
        targets = _targets(self.chosen, source, self.target, _with_other_steps(self.chosen, self.mesh.sources))
        edits = {old: self._edit(old, mesh, before, after) for old in targets}
        is_beside = os.path.realpath(self.target.parent) == str(source.parent.resolve()) and not overwrite
        if is_beside and self.chosen.included is not None:
            targets, edits = self._with_new_names(self.chosen.included, targets, edits)
        changes = []
        with contextlib.ExitStack() as stack:
            staged: dict[Path, Path] = {}
            for old, new in targets.items():
                edit, stays = edits[old], old != source and is_same(old, new)
                if stays and edit.is_empty:
                    continue
                if stays and not overwrite:
                    raise WriteError(f"{self.target}: includes {old}, which changes: write into another folder")
                is_pair = _is_companion(self.chosen, os.path.realpath(old), os.path.realpath(source))
                if not (old == source or is_pair or stays or is_beside) and new.exists():
                    if edit.is_empty and new.read_bytes() == old.read_bytes():
                        continue
                    raise WriteError(f"{new}: exists; {self.target} would include it: write into another folder")
                new.parent.mkdir(parents=True, exist_ok=True) if old != source else None
                staged[old] = stack.enter_context(replacing(new, overwrite=overwrite))
                hunks = edit.copy(old, staged[old], packs=new.suffix.lower() == ".gz" or old != source)
                if old == source or not edit.is_empty:
                    name = "" if old == source else str(new.absolute().relative_to(self.target.absolute().parent))
                    changes.append(undo.Change(old, staged[old], hunks, name))
            names = {path: new.absolute().relative_to(self.target.absolute().parent) for path, new in targets.items()}
            with _as_one(source, self.mesh.sources, staged, names) as (path, roots):
                limits = replace(self.limits, include_roots=(*self.limits.include_roots, *roots))
                self._check(mesh, lambda: _read(self.chosen, path, limits, self.step))
            if undo_file is not None:
                undo.store(undo_file, changes)

    def _with_new_names(
        self, included: IncludedNames, targets: dict[Path, Path], edits: dict[Path, Edit]
    ) -> tuple[dict[Path, Path], dict[Path, Edit]]:
        """For a new file beside the old one: included files that change get names of their own, which it includes."""
        source = Path(self.mesh.path or "")
        folder, named = source.parent.resolve(), edits
        while True:
            new_names = {
                os.path.realpath(old): f"{self.target.stem}_{old.name}"
                for old, edit in named.items()
                if old != source and not edit.is_empty
            }
            renamed = {}
            for old, edit in edits.items():
                data, spans, texts = old.read_bytes(), [], []
                for start, end in included(data):
                    name = data[start:end].replace(b"\\", b"/")
                    at = old.parent if self.chosen.steps is not None else folder  # of a collection, or of a deck
                    other = new_names.get(os.path.realpath(at / os.fsdecode(name)))
                    if other is not None:
                        spans.append((start, end))
                        texts.append(data[start:end][: len(name) - len(name.split(b"/")[-1])] + os.fsencode(other))
                renamed[old] = edit.also(spans, texts)
            if all(renamed[old].is_empty == named[old].is_empty for old in edits):
                break
            named = renamed
        kept = {old: new for old, new in targets.items() if not renamed[old].is_empty or old == source}
        for old in kept:
            if os.path.realpath(old) in new_names:
                kept[old] = old.with_name(new_names[os.path.realpath(old)])
        return kept, renamed

    def _edit(self, path: Path, mesh: Mesh, before: Reals, after: Reals) -> Edit:
        if self.nodes is None:
            return self.places.edit(path, before, after)
        return edit_nodes(path, self.nodes, self.mesh, mesh)

    def _write_folder(self, mesh: Mesh, *, overwrite: bool, undo_file: Path | None) -> None:
        """Copy a folder, or put the files that change back into it."""
        folder, before, after = Path(self.mesh.path or ""), *self._moved(mesh)
        changes = []
        sources = [Path(path) for path in self.mesh.sources if Path(path).is_relative_to(folder.resolve())]
        with contextlib.ExitStack() as stack:
            staged: dict[Path, Path] = {}
            if not overwrite:
                new = stack.enter_context(new_folder(self.target))
                self._copy_folder(folder, new)
            for old in self.places.files:
                edit = self.places.edit(old, before, after)
                if edit.is_empty:
                    continue
                real = old.resolve()
                name = str(real.relative_to(folder.resolve()))
                if overwrite:
                    staged[real] = stack.enter_context(replacing(old, overwrite=True))
                else:
                    staged[real] = new / name
                    staged[real].unlink()
                changes.append(undo.Change(old, staged[real], edit.copy(old, staged[real]), name))
                shutil.copymode(old, staged[real])
            with private.folder() as one:
                for path in sources:
                    link = one / path.relative_to(folder.resolve())
                    link.parent.mkdir(parents=True, exist_ok=True)
                    link.symlink_to(staged.get(path, path).resolve())
                # Of the time steps the one that was read, and what it needs of those before, are there.
                self._check(mesh, lambda: registry.read_folder(one, self.chosen.name, "last"))
            if undo_file is not None:
                undo.store(undo_file, changes)

    @property
    def left_out(self) -> tuple[str, ...]:
        """What a copy of a folder goes without: results and the like, of the mesh as it was, unless they were read."""
        folder, is_stale = Path(self.mesh.path or ""), self.chosen.is_stale
        if is_stale is None or not folder.is_dir() or self.target == folder:
            return ()
        real = folder.resolve()
        used = {Path(path).relative_to(real).parts[0] for path in self.mesh.sources if Path(path).is_relative_to(real)}
        names = sorted(entry.name for entry in folder.iterdir() if is_stale(entry.name) and entry.name not in used)
        return tuple(name for name in names if not (self.all_times and name[:1].isdigit()))

    def _copy_folder(self, folder: Path, new: Path) -> None:
        left_out = self.left_out
        for entry in folder.iterdir():
            if entry.name in left_out:
                continue
            if entry.is_dir() and not entry.is_symlink():
                shutil.copytree(entry, new / entry.name, symlinks=True)
            else:
                shutil.copy2(entry, new / entry.name, follow_symlinks=False)

    def _check(self, mesh: Mesh, reader: Callable[[], Mesh]) -> None:
        """Raise `WriteError` unless what was written reads back as the mesh with its points where they are now."""
        try:
            back = reader()
        except ReadError as error:
            raise WriteError(f"{self.target}: what was written cannot be read back: {error}") from error
        same = all(np.array_equal(getattr(back, name), getattr(mesh, name)) for name in ("types", "offsets"))
        expected = np.asarray(mesh.points).astype(back.points.dtype)
        if self.nodes is not None:
            same &= np.array_equal(back.connectivity, mesh.connectivity)
        if not same or not np.array_equal(back.points, expected, equal_nan=True):
            raise WriteError(f"{self.target}: what was written does not read back as it was to be; nothing is changed")


def patch_of(
    mesh: Mesh,
    target: str | os.PathLike[str],
    *,
    file_format: str | None = None,
    limits: Limits | None = None,
    step: StepChoice = None,
    changes: Changes = "points",
) -> Patch | None:
    """How the file of a mesh is patched, if the output is of its format and the format is one that is patched.

    Parameters
    ----------
    mesh
        As `meshgauge.read` returned it.
    target
        The output.
    file_format, limits, step
        As the mesh was read; if cells change, without another order of wedges.
    changes
        What will: coordinates of points, the order of the nodes in cells, as by `meshgauge.doctor.orient`, or nothing.

    Returns
    -------
    Patch or None
        None: the output is a conversion.

    Raises
    ------
    ReadError
        If the places cannot be told; the message says why.
    WriteError
        If the output is a folder in the one that it is to be a copy of.
    """
    chosen = format_if_same(mesh, target, file_format=file_format)
    if chosen is None or not chosen.is_patched:
        return None
    source = Path(mesh.path or "")
    if changes != "points":
        if chosen.nodes is None:
            return None
        none = Places.joined([]).aligned(mesh)
        nodes = _plainly(
            source,
            lambda path: registry.nodes(chosen, path, limits) if changes == "order" else (),
            lambda found, plain: tuple(replace(one, path=source) if one.path == plain else one for one in found),
        )
        return Patch(mesh, Path(target), chosen, none, limits or Limits(), step, nodes)
    if source.is_dir():
        if source.resolve() in Path(target).resolve().parents:
            raise WriteError(f"{target}: is in the folder {source} that it is to be a copy of")
        places = registry.places(chosen, registry.case_of(source, file_format)[1], limits, step).aligned(mesh)
        inside = [path.resolve().is_relative_to(source.resolve()) for path, _ in places.pieces] or [True]
        places = places.without(~np.array(inside)[places.piece])
        return Patch(mesh, Path(target), chosen, places, limits or Limits(), step)
    given = _plainly(
        source,
        lambda path: registry.places(chosen, path, limits, step),
        lambda found, plain: found.renamed(plain, source),
    )
    if not given.pieces and chosen.write is not None:
        return None
    places = given.aligned(mesh)
    locked = _locked(chosen, source, Path(target), mesh.sources)
    piece_is_locked = np.array([os.path.realpath(path) in locked for path, _ in places.pieces] or [False])
    places = places.without(piece_is_locked[places.piece])
    return Patch(mesh, Path(target), chosen, places, limits or Limits(), step)


def format_if_same(mesh: Mesh, target: str | os.PathLike[str], *, file_format: str | None = None) -> Format | None:
    """The format of the file of a mesh if an output has it too, by its extension; None if it is a conversion."""
    return None if mesh.path is None else same_format(Path(mesh.path), Path(target), file_format=file_format)


def same_format(source: Path, target: Path, *, file_format: str | None = None) -> Format | None:
    """The format of a file if an output has it too, by its extension; None if it is a conversion."""
    if source.is_dir():
        is_file = target.suffix.lower() in {e for f in registry.ALL if f.write is not None for e in f.extensions}
        return registry.case_of(source, file_format)[0] if not is_file or target == source else None
    chosen = format_of(source, file_format)
    here, there = (path.with_suffix("") if path.suffix.lower() == ".gz" else path for path in (source, target))
    if target.suffix.lower() == ".gz" != source.suffix.lower():
        return None
    known = () if chosen.has_kinds else chosen.extensions
    return chosen if there.suffix.lower() in (here.suffix.lower(), *known) else None


def format_of_copy(source: StrPath, target: StrPath, *, file_format: str | None = None) -> Format | None:
    """`same_format`, if the bytes of a file can be copied as they are: None of folders, and of files packed by gzip."""
    source = Path(source)
    is_plain = source.is_file() and not files.is_packed(source)
    return same_format(source, Path(target), file_format=file_format) if is_plain else None


def _plainly(source: Path, find: Callable[[Path], T], mend: Callable[[T, Path], T]) -> T:
    """What is found in a file, or in a copy of it that is not packed by gzip, whose name is then mended."""
    if not files.is_packed(source):
        return find(source)
    with files.open_input(source) as (plain, _):
        return mend(find(plain), plain)


def _read(chosen: Format, path: Path, limits: Limits, step: StepChoice) -> Mesh:
    with files.open_input(path) as (plain, _):
        return registry.read(chosen, plain, limits, step)


def _targets(chosen: Format, source: Path, target: Path, sources: tuple[str, ...]) -> dict[Path, Path]:
    """Where each file goes: what is included keeps its relative name in another folder."""
    own, folder = os.path.realpath(source), source.parent.resolve()
    parts = _parts(chosen, own, sources)
    if parts:
        named = chosen.parts(target.absolute()) if chosen.parts is not None else ()
        if len(named) != len(parts) or named.index(target.absolute()) != parts.index(Path(own)):
            ending = ".".join(source.name.rsplit(".", 2)[1:])
            raise WriteError(
                f"{target}: a mesh that is spread over files needs a name for each: one that ends in .{ending}"
            )
        return {source if str(old) == own else old: new for old, new in zip(parts, named, strict=True)}
    pair = [path for path in sources if _is_companion(chosen, path, own)]
    targets = {source: target.with_suffix(source.suffix) if pair else target}
    for path in sources:
        if path in pair:
            targets[Path(path)] = target.with_suffix(Path(path).suffix)
        elif path != own and Path(path).is_relative_to(folder):
            targets[Path(path)] = target.parent / Path(path).relative_to(folder)
    return targets


def _with_other_steps(chosen: Format, sources: tuple[str, ...]) -> tuple[str, ...]:
    """Files that were read, and those that they name beside, of other time steps, if the format has any."""
    if chosen.included is None or chosen.steps is None:
        return sources
    every, waiting = dict.fromkeys(sources), list(sources)
    while waiting:
        path = Path(waiting.pop())
        data = path.read_bytes()
        names = [os.fsdecode(data[start:end]) for start, end in chosen.included(data)]
        new = [os.path.realpath(path.parent / name) for name in names]
        new = [one for one in dict.fromkeys(new) if one not in every and os.path.isfile(one)]
        every |= dict.fromkeys(new)
        waiting += new
    return tuple(every)


def _parts(chosen: Format, own: str, sources: tuple[str, ...]) -> list[Path]:
    """The files of a mesh that is spread over several, if they were read."""
    parts = chosen.parts(Path(own)) if chosen.parts is not None else ()
    return list(parts) if len(parts) > 1 and {str(part) for part in parts} <= set(sources) else []


def _is_companion(chosen: Format, path: str, own: str) -> bool:
    """Whether a file is one of a pair with the main one: of its name, with another extension, and not named in it."""
    return chosen.included is None and path != own and Path(path).with_suffix("") == Path(own).with_suffix("")


def _locked(chosen: Format, source: Path, target: Path, sources: tuple[str, ...]) -> set[str]:
    """Files that were read and must stay: outside of the folder, or beside a new file that must include them still."""
    own, folder = os.path.realpath(source), source.parent.resolve()
    others = {path for path in sources if path != own and not _is_companion(chosen, path, own)}
    others -= {str(part) for part in _parts(chosen, own, sources)}
    is_beside = os.path.realpath(target.parent) == str(folder) and os.path.realpath(target) != own
    if is_beside and chosen.included is None:
        return others
    return {path for path in others if not Path(path).is_relative_to(folder)}


@contextlib.contextmanager
def _as_one(
    source: Path, sources: tuple[str, ...], staged: dict[Path, Path], names: dict[Path, Path]
) -> Iterator[tuple[Path, tuple[Path, ...]]]:
    """The main file with what it includes around it, as it will be; and the folders where all of that stands."""
    own, folder = os.path.realpath(source), source.parent.resolve()
    others = [Path(path) for path in sources if path != own]
    if not others:
        yield staged[source], ()
        return
    with private.folder() as one:
        main = one / names[source]
        main.symlink_to(staged[source].resolve())
        for path in others:
            if path.is_relative_to(folder):
                link = one / (names[path] if path in staged else path.relative_to(folder))
                link.parent.mkdir(parents=True, exist_ok=True)
                link.symlink_to(staged.get(path, path).resolve())
        yield main, (folder, *(path.parent.resolve() for path in staged.values()))
